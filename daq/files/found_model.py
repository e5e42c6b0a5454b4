"""A model with found effects out of its file, for whatever goes on with it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

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
    return FoundModel.of(str(path), model.effects, entries_of(model), values)


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
    }


def found_of_json(values: Mapping[str, Any] | None) -> FoundModel | None:
    """The same back; None where nothing was found."""
    if values is None:
        return None
    entries = tuple(EffectEntry.of_json(entry) for entry in values["found"])
    return FoundModel(values["source"], tuple(values["usual"]), entries, dict(values["values"]))
