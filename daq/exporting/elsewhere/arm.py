"""An identified arm in the terms that simulators share: bodies, armature, damping, dry friction, offsets.

A model file holds base parameters. Of the arms that have them, the one nearest to the description is taken:
any split of a regrouped parameter gives the same torque.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from daq.exporting.elsewhere.found import (
    Added,
    Coupling,
    FoundEffect,
    added,
    found_effects,
    merged,
    not_held,
)
from daq.files.model_file import ModelFile, ModelFileError
from ident import BaseParameters, RegressorModel, base_parameters
from ident.effects.wrist_coupling import coupled_drives
from ident.estimators import LinearFit
from ident.estimators.consistent import consistent_fit, consistent_standard, require_solver
from robots import Robot
from robots.arrays import FloatArray
from robots.pseudo_inertia import LINK_SIZE, impossible_links


@dataclass(frozen=True)
class IdentifiedArm:
    """An identified arm; arrays have one entry per joint, SI.

    Attributes:
        robot: its description.
        model: the file that it is from.
        links: (n, 10) standard parameters of the moving links, each of a body that can exist.
        armature: inertia of rotors and gears at the joint, coupled drives included.
        damping: viscous friction, coupled drives included.
        friction: Coulomb friction, without that of coupled drives.
        offset: torque at rest without a load.
        couplings: drives, and shafts that were found, that move with more than one joint.
        said: what was changed or left out to get these terms, one sentence each.
        found: effects that were found. Those that are bodies, shafts, friction, offsets or a tilt are in the
            terms above, and gravity in that of ``robot``.
    """

    robot: Robot
    model: ModelFile
    links: FloatArray
    armature: FloatArray
    damping: FloatArray
    friction: FloatArray
    offset: FloatArray
    couplings: tuple[Coupling, ...]
    said: tuple[str, ...]
    found: tuple[FoundEffect, ...] = ()

    def lost(self, held: Collection[str]) -> tuple[str, ...]:
        """What a format lacks that holds these found effects, one sentence each."""
        return (*self.said, *not_held(self.found, held))

    @property
    def heading(self) -> str:
        """Where the figures are from, one sentence for the top of a file."""
        sources = ", ".join(one.name for one in self.model.capture)
        estimate = self.model.estimate
        return (
            f"{self.robot.name} as identified by armhil {self.model.armhil} from {sources}"
            f" ({estimate.estimator}; verdict {estimate.verdict}; relative torque error"
            f" {estimate.relative_error_percent:.3g} %). SI units."
        )


def identified_arm(robot: Robot, model: ModelFile) -> IdentifiedArm:
    """The arm of a model file.

    Args:
        robot: the arm that the model is of.
        model: the file's content.

    Raises:
        ModelFileError: the model is of another arm, or of another description of it.
        IdentificationError: it takes the solver of the consistent fit, and that is not installed.
    """
    if model.robot.name != robot.name:
        raise ModelFileError(f"robot.name: {model.robot.name}; allowed: a model of {robot.name}")
    robot = robot.model_copy(update={"identification": model.identification})
    base = base_parameters(RegressorModel.of(robot))
    values = {parameter.name: parameter for parameter in model.parameter}
    missing = [name for name in base.names if name not in values]
    if missing:
        raise ModelFileError(
            f"has no parameter {missing[0]}; allowed: a model of {robot.name} as it is described now;"
            f" armhil identify CAPTURE --robot {robot.name} --out FOLDER makes one"
        )
    found = found_effects(robot, model)
    more = added(robot, found)
    standard, remark = _standard(base, model, more)
    return _in_common_terms(base, model, standard, [remark] if remark else [], found, more)


def _standard(base: BaseParameters, model: ModelFile, more: Added) -> tuple[FloatArray, str]:
    """Standard parameters (p,) of an arm that can exist, and what was changed for that.

    A payload and rotors that were found are part of it: the last link with its load has to be a body.
    """
    names = [parameter.name for parameter in model.parameter]
    order = [names.index(name) for name in base.names]
    n = base.model.robot.n
    change = np.zeros(len(base.model.names))
    change[LINK_SIZE * (n - 1) : LINK_SIZE * n] = more.payload
    for place, parameter in enumerate(base.model.parameters):
        if parameter.symbol == "Ia" and parameter.joint is not None:
            change[place] = more.armature[parameter.joint]
    beta = model.values[order] + base.regroup(change)
    nearest = base.standard_from(beta, base.model.prior())
    if not impossible_links(_links(base, nearest)) and (_links(base, nearest)[:, 0] > 0).all():
        return nearest, ""
    require_solver()
    exact = consistent_standard(base, beta)
    if exact is not None:
        return exact, ""
    covariance = model.covariance
    if covariance is None:
        covariance = np.diag([parameter.sigma**2 for parameter in model.parameter])
    covariance = covariance[np.ix_(order, order)]
    fit = LinearFit(beta, covariance, np.ones(base.model.robot.n), 1.0)
    found = consistent_fit(base, fit)
    return found.standard, (
        "No arm made of bodies has exactly these base parameters: written is the nearest one that can exist"
        f" ({found.sentence()})."
    )


def _links(base: BaseParameters, standard: FloatArray) -> FloatArray:
    return standard[: LINK_SIZE * base.model.robot.n].reshape(-1, LINK_SIZE)


def _in_common_terms(
    base: BaseParameters,
    model: ModelFile,
    standard: FloatArray,
    remarks: Sequence[str],
    found: tuple[FoundEffect, ...],
    more: Added,
) -> IdentifiedArm:
    robot, said = base.model.robot, list(remarks)
    by_symbol: dict[str, FloatArray] = {}
    for parameter, value in zip(base.model.parameters, standard.tolist(), strict=True):
        if parameter.joint is not None:
            by_symbol.setdefault(parameter.symbol, np.zeros(robot.n))[parameter.joint] = value
    damping = by_symbol.get("Fv", np.zeros(robot.n))
    friction = by_symbol.get("Fc", np.zeros(robot.n))
    if "Fvp" in by_symbol:
        damping = (by_symbol["Fvp"] + by_symbol["Fvn"]) / 2
        friction = (by_symbol["Fcp"] + by_symbol["Fcn"]) / 2
        said += _asymmetric(robot, by_symbol)
    couplings = tuple(
        Coupling(
            f"drive_{drive + 1}",
            robot.transmission_matrix[drive],
            *(float(by_symbol[symbol][drive]) for symbol in ("Iam", "Fvm", "Fcm")),
        )
        for drive in coupled_drives(robot)
    )
    return IdentifiedArm(
        robot.model_copy(update={"gravity": tuple((np.array(robot.gravity) + more.gravity).tolist())}),
        model,
        _links(base, standard),
        _not_negative("rotor inertia", by_symbol["Ia"], robot, said),
        _not_negative("viscous friction", damping + more.damping, robot, said),
        _not_negative("Coulomb friction", friction + more.friction, robot, said),
        by_symbol.get("off", np.zeros(robot.n)) + more.offset,
        merged((*couplings, *more.couplings)),
        tuple(said),
        found,
    )


def _asymmetric(robot: Robot, by_symbol: dict[str, FloatArray]) -> list[str]:
    """Friction that differs by direction: simulators have one for both."""
    sentences = []
    for axis, joint in enumerate(robot.joint):
        more, less = by_symbol["Fcp"][axis], by_symbol["Fcn"][axis]
        sentences.append(
            f"{joint.name}: Coulomb friction is {more:.4g} forwards and {less:.4g} backwards; written is the"
            " mean."
        )
    return sentences


def _not_negative(what: str, values: FloatArray, robot: Robot, said: list[str]) -> FloatArray:
    """Estimates may come out a little below zero; no engine takes that."""
    for axis, joint in enumerate(robot.joint):
        if values[axis] < 0.0:
            said.append(f"{joint.name}: {what} was identified as {values[axis]:.3g}; written is 0.")
    return np.maximum(values, 0.0)
