"""The present model as a closed loop is simulated with it: exact friction signs, which bristles stand for."""

from __future__ import annotations

from dataclasses import fields, is_dataclass, replace
from typing import Any

from ident.closed_loop.compiled import run_compiled
from ident.closed_loop.leading import SimulatedRun, leading_of
from ident.closed_loop.torque_parts import ModelStructure, TorqueParts
from ident.discrepancy.loop import Loop, Standstill, added, with_standstill, with_standstill_of
from ident.effects import Effect, FrictionSign, RigidBody
from ident.effects.chain import chain_frames
from ident.effects.family import PlacedEffect
from ident.effects.placed import Placed
from ident.effects.vocabulary import form_of
from ident.errors import IdentificationError
from ident.parameters.base import BaseParameters
from ident.parameters.present import Present
from ident.parameters.regressor import RegressorModel
from ident.recording import Recording
from robots.arrays import FloatArray
from robots.description import Robot


def exact_sign_robot(robot: Robot) -> Robot:
    """The arm with exact friction signs."""
    settings = robot.identification.model_copy(update={"friction_sign": "sign"})
    return robot.model_copy(update={"identification": settings})


def with_exact_signs(model: RegressorModel) -> RegressorModel:
    """The model with exact friction signs."""
    robot = exact_sign_robot(model.robot)
    return RegressorModel(robot, tuple(_with_exact_sign(effect, robot) for effect in model.effects))


def _with_exact_sign(effect: Effect, robot: Robot) -> Effect:
    if isinstance(effect, Placed):
        raise TypeError("a placed effect needs its present model")
    changed: Any = effect
    if is_dataclass(effect):
        for item in fields(changed):
            if isinstance(getattr(effect, item.name), FrictionSign):
                changed = replace(changed, **{item.name: FrictionSign("sign", 0.0)})
    exact: Effect = changed
    return exact


def exact_sign_variant(robot: Robot, effect: PlacedEffect, present: Present) -> Placed:
    """The effect on an arm whose friction has an exact sign."""
    form = form_of(robot, effect.name, effect.shape_names)
    return form.effect(exact_sign_robot(robot), effect.place, effect.shape, present)


def simulated_parts(
    loop: Loop, base: BaseParameters, standard: FloatArray, standstill: Standstill
) -> TorqueParts:
    """A model with its standard parameters (p,) as the simulation takes it."""
    return _parts(loop.structures, base.model, standard, standstill)


def simulated_with(
    base: BaseParameters, standard: FloatArray, standstill: Standstill, recording: Recording
) -> SimulatedRun:
    """One run of a model whose drives hold at standstill as recordings have shown it.

    Args:
        base: the model.
        standard: (p,) its parameters.
        standstill: of each drive.
        recording: as of :func:`ident.closed_loop.simulate`.

    Raises:
        IdentificationError: as there, and of a model that has no compiled simulation.
    """
    model = base.model
    parts = _parts({}, model, standard, standstill)
    links = next(effect for effect in model.effects if isinstance(effect, RigidBody))
    frames = chain_frames(links.model)
    if frames is None or parts.others:
        raise IdentificationError("the model has no compiled simulation")
    return run_compiled(frames, leading_of(model.robot, recording, None), parts.carrying(recording.load))


def _parts(
    structures: dict[tuple[str, ...], ModelStructure],
    model: RegressorModel,
    standard: FloatArray,
    standstill: Standstill,
) -> TorqueParts:
    robot = model.robot
    usual = tuple(effect for effect in model.effects if not isinstance(effect, Placed))
    structure = _structure(structures, model, usual)
    plain = sum(len(effect.parameters) for effect in usual)
    parts = with_standstill(structure.parts(standard[:plain]), standstill, robot)
    for effect, own in model.columns_of_effects:
        if isinstance(effect, Placed):
            variant = exact_sign_variant(robot, effect, Present(model, standard))
            parts = added(parts, with_standstill_of(variant.simulated(standard[own]), standstill, robot))
    return parts


def _structure(
    structures: dict[tuple[str, ...], ModelStructure], model: RegressorModel, usual: tuple[Effect, ...]
) -> ModelStructure:
    """Of the usual effects, which stay the same as effects are found: kept with the recordings."""
    names = tuple(effect.name for effect in usual)
    if names not in structures:
        structures[names] = ModelStructure(with_exact_signs(RegressorModel(model.robot, usual)))
    return structures[names]
