"""The present model as a closed loop is simulated with it: exact friction signs, which bristles stand for."""

from __future__ import annotations

from dataclasses import fields, is_dataclass, replace
from typing import Any

from ident.base import BaseParameters
from ident.closed_loop.torque_parts import ModelStructure, TorqueParts
from ident.discrepancy.loop import Loop, added, bristled, with_bristles
from ident.discrepancy.present import Present
from ident.effects import Effect, FrictionSign
from ident.effects.family import PlacedEffect
from ident.effects.placed import Placed
from ident.effects.vocabulary import form_of
from ident.regressor import RegressorModel
from robots.arrays import FloatArray
from robots.description import Robot


def sharp_robot(robot: Robot) -> Robot:
    """The arm with exact friction signs."""
    settings = robot.identification.model_copy(update={"friction_sign": "sign"})
    return robot.model_copy(update={"identification": settings})


def sharpened(model: RegressorModel) -> RegressorModel:
    """The model with exact friction signs."""
    robot = sharp_robot(model.robot)
    return RegressorModel(robot, tuple(_sharp(effect, robot) for effect in model.effects))


def _sharp(effect: Effect, robot: Robot) -> Effect:
    if isinstance(effect, Placed):
        raise TypeError("a placed effect needs its present model")
    changed: Any = effect
    if is_dataclass(effect):
        for item in fields(changed):
            if isinstance(getattr(effect, item.name), FrictionSign):
                changed = replace(changed, **{item.name: FrictionSign("sign", 0.0)})
    sharp: Effect = changed
    return sharp


def sharp_twin(robot: Robot, effect: PlacedEffect, present: Present) -> Placed:
    """The effect on an arm whose friction has an exact sign."""
    form = form_of(robot, effect.name, effect.shape_names)
    return form.effect(sharp_robot(robot), effect.place, effect.shape, present)


def simulated_parts(
    loop: Loop, base: BaseParameters, standard: FloatArray, lengths: FloatArray
) -> TorqueParts:
    """A model with its standard parameters (p,) as the simulation takes it."""
    model = base.model
    usual = [effect for effect in model.effects if not isinstance(effect, Placed)]
    plain = sum(len(effect.parameter_names) for effect in usual)
    structure = _structure(loop, model, tuple(usual))
    parts = with_bristles(structure.parts(standard[:plain]), lengths, loop.robot)
    start = plain
    for effect in model.effects[len(usual) :]:
        end = start + len(effect.parameter_names)
        assert isinstance(effect, Placed)
        twin = sharp_twin(loop.robot, effect, Present(model, standard))
        parts = added(parts, bristled(twin.simulated(standard[start:end]), lengths, loop.robot))
        start = end
    return parts


_STRUCTURES: dict[int, tuple[Loop, ModelStructure]] = {}


def _structure(loop: Loop, model: RegressorModel, usual: tuple[Effect, ...]) -> ModelStructure:
    kept = _STRUCTURES.get(id(loop))
    if kept is None or kept[0] is not loop:
        _STRUCTURES.clear()
        kept = (loop, ModelStructure(sharpened(RegressorModel(model.robot, usual))))
        _STRUCTURES[id(loop)] = kept
    return kept[1]
