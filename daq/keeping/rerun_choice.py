"""Which analysis of a run's recording is meant where nobody says."""

from __future__ import annotations

from daq.catalogue import models, runs
from daq.catalogue.database import Catalogue
from daq.keeping.again import IDENTIFY
from daq.keeping.diagnosed_again import DIAGNOSE


def chosen_analysis(catalogue: Catalogue, run_id: int) -> str:
    """``identification``, or ``diagnosis`` where the recording was diagnosed and never identified.

    Raises:
        CatalogueError: there is no such run.
    """
    run = runs.get(catalogue, run_id)
    made = {model.settings.get("command") for model in models.of_run(catalogue, run.id)}
    return "diagnosis" if DIAGNOSE in made and IDENTIFY not in made else "identification"
