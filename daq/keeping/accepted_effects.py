"""The effects that a model of the catalogue has found, for whatever identifies the arm again."""

from __future__ import annotations

from dataclasses import replace

from daq.catalogue.values import Model
from daq.files.found_model import found_of_json
from ident import RegressorModel
from ident.identification.found_effects import FoundModel, extended_model
from robots import Robot


def effects_of(model: Model) -> FoundModel | None:
    """The model with its found effects, out of the catalogue alone; None where nothing was found."""
    if not model.found:
        return None
    values = {parameter.name: parameter.value for parameter in model.parameters}
    source = f"model {model.id} of run {model.run_id}"
    return FoundModel.of(source, model.effects, model.found, values)


def regressor_of(model: Model, robot: Robot) -> RegressorModel:
    """What the parameters of a model are of: the usual effects, and those found that were identified with it.

    Args:
        model: of the catalogue.
        robot: its arm, with the settings of the identification.

    Raises:
        IdentificationError: the arm is described otherwise now.
    """
    own = effects_of(model)
    if own is None:
        return RegressorModel.of(robot)
    known = found_of_json(model.settings.get("model"))
    if known is not None:  # of which it kept what its recordings told
        values = {name: value for name, value in known.values.items() if name in own.values}
        own = replace(known, found=own.found, values=values)
    return extended_model(robot, own)
