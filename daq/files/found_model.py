"""A model with found effects out of its file, for whatever goes on with it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from daq.files.model_file import ModelFile, ModelFileError, read_model
from daq.files.model_found import added_entries
from ident.effects.entry import EffectEntry
from ident.identification.found_effects import FoundModel
from robots import Robot


def read_found_model(path: Path, robot: Robot) -> FoundModel:
    """The model of a file.

    Args:
        path: of the file.
        robot: the arm that it has to be of.

    Raises:
        ModelFileError: it cannot be read, or is of another arm.
    """
    model = read_model(path)
    if model.robot.name != robot.name:
        raise ModelFileError(f"{path}: robot.name: {model.robot.name}; allowed: a model of {robot.name}")
    values = {parameter.name: parameter.value for parameter in model.parameter}
    known = FoundModel.of(str(path), model.effects, entries_of(model), values)
    return replace(known, covariance=_covariance_of(model) if known.found else {})


def _covariance_of(model: ModelFile) -> dict[tuple[str, str], float]:
    """Of the parameters that stand for themselves alone, as those of what was found do."""
    own = [k for k, one in enumerate(model.parameter) if one.expression == one.name]
    whole = model.covariance
    if whole is None:
        whole = np.diag([one.sigma**2 for one in model.parameter])
    names = [one.name for one in model.parameter]
    return {(names[a], names[b]): float(whole[a, b]) for a in own for b in own}


def entries_of(model: ModelFile) -> tuple[EffectEntry, ...]:
    """The effects of a file that were found, terms among them."""
    return added_entries(model.effects, model.found, model.term)


def found_json(model: FoundModel) -> dict[str, Any]:
    """A model with found effects as the catalogue keeps it among the settings of an identification."""
    return {
        "source": model.source,
        "usual": list(model.usual),
        "found": [entry.as_json() for entry in model.found],
        "values": dict(model.values),
        "covariance": [[a, b, value] for (a, b), value in model.covariance.items()],
    }


def found_of_json(values: Mapping[str, Any] | None) -> FoundModel | None:
    """The same back; None where nothing was found."""
    if values is None:
        return None
    entries = tuple(EffectEntry.of_json(entry) for entry in values["found"])
    covariance = {(a, b): value for a, b, value in values.get("covariance", [])}
    return FoundModel(values["source"], tuple(values["usual"]), entries, dict(values["values"]), covariance)
