"""From an arm's description, its drawn figures and a scenario to the arrays of the compiled plant."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from drivers.simulated.effects.entry import DriveEntry, JointEntry
from drivers.simulated.physics import base, compliance
from drivers.simulated.physics.chain import Chain, chain_of
from drivers.simulated.physics.records import DRIVE, JOINT, Arm, Harmonics, Plane, Records
from drivers.simulated.scenario import EMPTY, Scenario
from drivers.simulated.truth import PlantTruth
from robots import Robot, rigid_body_model
from robots.arrays import FloatArray

BRAKE_RATIO = 3.0
"""Holding torque of a brake over the torque limit of its axis."""
_UNLIMITED = np.inf


def true_model(robot: Robot, truth: PlantTruth, scenario: Scenario = EMPTY) -> pin.Model:
    """The rigid-body model with the links of ``truth``, the scenario's payload and its tilt of the base."""
    model = rigid_body_model(robot)
    for j in range(1, robot.n + 1):
        link = truth.link(j)
        inertia = pin.Inertia.FromDynamicParameters(link) if link[0] > 0 else pin.Inertia.Zero()
        model.inertias[j] = inertia
    if scenario.payload is not None:
        body = scenario.payload
        model.inertias[robot.n] += pin.Inertia(body.mass, np.array(body.centre), np.diag(body.inertia))
    if scenario.base_tilt is not None:
        tilt = pin.rpy.rpyToMatrix(scenario.base_tilt.roll, scenario.base_tilt.pitch, 0.0)
        model.gravity.linear = tilt.T @ model.gravity.linear
    return model


def true_transmission(robot: Robot, scenario: Scenario) -> FloatArray:
    """Gear outputs per joint position, (d, n): as described, other ratios, and the passive shafts' rows."""
    matrix = robot.transmission_matrix
    for entry in scenario.transmission:
        matrix[entry.drive - 1, entry.joint - 1] = entry.ratio
    shafts = np.zeros((len(scenario.wrist_coupling), robot.n))
    for row, shaft in zip(shafts, scenario.wrist_coupling, strict=True):
        for joint, ratio in zip(shaft.joints, shaft.ratios, strict=True):
            row[joint - 1] += ratio
    return np.ascontiguousarray(np.vstack([matrix, shafts]))


def assemble(robot: Robot, truth: PlantTruth, scenario: Scenario, model: pin.Model, step: float) -> Arm:
    """The plant as arrays.

    Args:
        robot: description.
        truth: drawn figures.
        scenario: effects besides; checked against the robot.
        model: of :func:`true_model`.
        step: plant step, s.

    Raises:
        DriveError: a gear is so stiff that the step would have to be cut too often.
    """
    transmission = true_transmission(robot, scenario)
    drives = np.zeros(len(transmission), DRIVE)
    _fill_drawn_figures(drives, robot, truth)
    _fill_shafts(drives, robot.n, truth, scenario)
    for _, _, entry in scenario.entries():
        if isinstance(entry, DriveEntry):
            entry.fill(drives[entry.drive - 1])
    _match_bristle_damping(drives)
    chain = chain_of(model, model.gravity.linear)
    resonance = compliance.Resonance(robot, chain, transmission, drives)
    compliance.fill_gears(drives, scenario, resonance)
    return Arm(
        chain=chain,
        drives=drives,
        joints=_joints(robot, truth, scenario),
        transmission=transmission,
        ripple=_ripple(robot, scenario),
        kinematic=_kinematic(robot, scenario),
        plane=_plane(scenario),
        base=_base(robot, scenario, chain),
        crosstalk=_crosstalk(robot.n, scenario),
        step_time=step,
        substeps=compliance.substeps(drives, resonance, step),
    )


def _fill_drawn_figures(drives: Records, robot: Robot, truth: PlantTruth) -> None:
    n = robot.n
    for field, figures in (
        ("inertia", truth.per_drive("Ia")),
        ("viscous", truth.per_drive("Fv")),
        ("coulomb", truth.per_drive("Fc")),
        ("bristle_width", np.array(truth.bristle_width)),
        ("gain", np.array(truth.gain)),
        ("brake", BRAKE_RATIO * np.abs(np.linalg.inv(robot.transmission_matrix).T) @ robot.torque_limits),
    ):
        drives[field][:n] = figures
    drives["current_limit"] = _UNLIMITED
    # Values that no division fails on, where the effect is absent.
    for field in (
        "stribeck_speed",
        "static_speed",
        "spot_width",
        "power_speed",
        "load_time",
        "stribeck_exponent",
    ):
        drives[field] = 1.0


def _fill_shafts(drives: Records, n: int, truth: PlantTruth, scenario: Scenario) -> None:
    for drive, shaft in zip(drives[n:], scenario.wrist_coupling, strict=True):
        drive["inertia"], drive["viscous"], drive["coulomb"] = shaft.inertia, shaft.viscous, shaft.coulomb
        drive["bristle_width"] = truth.bristle_width[shaft.joints[0] - 1]


def _match_bristle_damping(drives: Records) -> None:
    """c = √(stiffness · inertia) is critical damping of half the ratio; torque c·d·ds/dt."""
    inertia = np.maximum(drives["inertia"], 1e-9)
    width = np.where(drives["bristle_width"] > 0, drives["bristle_width"], 1.0)
    drives["bristle_width"] = width
    drives["bristle_damping"] = np.sqrt(drives["coulomb"] / width * inertia) * width


def _joints(robot: Robot, truth: PlantTruth, scenario: Scenario) -> Records:
    joints = np.zeros(robot.n, JOINT)
    joints["offset"] = truth.per_drive("off")
    joints["wall_upper"], joints["wall_lower"] = _UNLIMITED, -_UNLIMITED
    for _, _, entry in scenario.entries():
        if isinstance(entry, JointEntry):
            entry.fill(joints[entry.joint - 1])
    return joints


def _ripple(robot: Robot, scenario: Scenario) -> Harmonics:
    return Harmonics(
        drive=np.array([entry.drive - 1 for entry in scenario.torque_ripple], dtype=np.int64),
        order=np.array(
            [_per_output(robot, e.drive, e.order) for e in scenario.torque_ripple], dtype=np.float64
        ),
        phase=np.array([entry.phase for entry in scenario.torque_ripple], dtype=np.float64),
        amplitude=np.array([entry.amplitude for entry in scenario.torque_ripple], dtype=np.float64),
        per_current=np.array([entry.per_current for entry in scenario.torque_ripple], dtype=np.float64),
    )


def _kinematic(robot: Robot, scenario: Scenario) -> Harmonics:
    return Harmonics(
        drive=np.array([entry.drive - 1 for entry in scenario.gear_ripple], dtype=np.int64),
        order=np.array(
            [_per_output(robot, e.drive, e.order) for e in scenario.gear_ripple], dtype=np.float64
        ),
        phase=np.array([entry.phase for entry in scenario.gear_ripple], dtype=np.float64),
        amplitude=np.array([entry.amplitude for entry in scenario.gear_ripple], dtype=np.float64),
        per_current=np.zeros(len(scenario.gear_ripple)),
    )


def _per_output(robot: Robot, drive: int, order: float) -> float:
    """Waves per motor revolution as rad of phase per rad (or m) of the drive output."""
    turns = robot.drive[drive - 1].gear
    return order * turns * (2.0 * np.pi if robot.joint[drive - 1].kind == "prismatic" else 1.0)


def _plane(scenario: Scenario) -> Plane:
    contact = scenario.tool_contact
    if contact is None:
        return Plane(np.array([0.0, 0.0, 1.0]), 0.0, 0.0, 0.0, np.zeros(3))
    normal = np.array(contact.normal)
    length = float(np.linalg.norm(normal))
    return Plane(
        normal / length, contact.distance, contact.stiffness, contact.damping, np.array(contact.point)
    )


def _base(robot: Robot, scenario: Scenario, chain: Chain) -> base.Base:
    if scenario.base_compliance is None:
        return base.firm(chain)
    return base.soft(chain, scenario.base_compliance, inertia_on_foot(robot, chain))


def inertia_on_foot(robot: Robot, chain: Chain) -> FloatArray:
    """(2,) of the arm's links about x and y of its foot, in the home posture, kg·m²."""
    rocking = base.rocking_chain(chain, (0, 1), 0.0)
    mass = compliance.links_at(rocking, np.array([0.0, 0.0, *robot.home]))
    return np.diag(mass)[:2].copy()


def _crosstalk(n: int, scenario: Scenario) -> FloatArray:
    shares = np.zeros((n, n))
    for entry in scenario.torque_crosstalk:
        shares[entry.drive - 1, entry.source - 1] += entry.share
    return shares
