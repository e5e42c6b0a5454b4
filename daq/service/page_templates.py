"""The templates of the service's pages, with what they write in their own way."""

from __future__ import annotations

import re
from functools import cache

from jinja2 import Environment

from daq.catalogue import runs
from daq.catalogue.values import Run
from daq.report.templates import templates


@cache
def page_templates() -> Environment:
    """One for the process, as those of the reports are."""
    environment = templates().overlay()
    environment.filters = {**environment.filters, "whole": _whole, "ending": _ending}
    return environment


def _whole(text: str) -> str:
    """A number and its unit are not torn apart at the end of a line."""
    return re.sub(r"(?<=\d) (?=%|N·m\b|N\b|kg|°C|rad\b)", "\u00a0", text)


def _ending(run: Run) -> str:
    """How a run ended, in a word or two."""
    return "no verdict" if run.reason == runs.UNJUDGED else run.outcome or run.state
