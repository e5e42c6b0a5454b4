"""Which verdicts somebody was told: in the catalogue, and in a file each as long as that does not answer."""

from __future__ import annotations

import os
from pathlib import Path

from daq.catalogue import checks
from daq.catalogue.database import Catalogue
from daq.catalogue.location import catalogue_url
from daq.catalogue.values import CatalogueError


def note_told(check: int, settings: Path) -> None:
    """Everybody was told of a check: the catalogue says so, or a file beside the settings until the next one.

    Args:
        check: its number in the catalogue.
        settings: notify.toml.
    """
    try:
        with Catalogue() as catalogue:
            checks.mark_told(catalogue, check)
    except CatalogueError:  # the database has died since; nobody is to be told twice for that
        noted = settings.with_suffix(f".told-{check}")
        with os.fdopen(os.open(noted, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "w") as file:
            file.write(catalogue_url().render_as_string())


def settle_told(catalogue: Catalogue, settings: Path) -> None:
    """Take what the files say into the catalogue that they are of.

    Raises:
        CatalogueError: it does not answer either.
    """
    for noted in settings.parent.glob(f"{settings.stem}.told-*"):
        if noted.read_text(encoding="utf-8") == catalogue.url.render_as_string():
            checks.mark_told(catalogue, int(noted.suffix.removeprefix(".told-")))
            noted.unlink()
