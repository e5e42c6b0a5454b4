"""Pages from templates: how every page of HTML is filled and written."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined

from robots.errors import UserError


class ReportError(UserError):
    """A report that cannot be written, in one line."""


@cache
def templates() -> Environment:
    """The templates that ship: what a page shows is escaped, and what it lacks is an error.

    One for the process, because it keeps the templates that it has compiled: that takes longer than filling
    them. Whoever adds to it takes an overlay.
    """
    return Environment(
        loader=PackageLoader("daq", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def write_page(path: Path, text: str, what: str = "page") -> None:
    """Write one HTML file, with the same line ends everywhere.

    Args:
        path: of the file.
        text: of the page.
        what: it is called in the error.

    Raises:
        ReportError: the file cannot be written.
    """
    try:
        path.write_text(text, encoding="utf-8", newline="\n")
    except OSError as error:
        raise ReportError(f"cannot write {what} {path}: {error.strerror}") from error
