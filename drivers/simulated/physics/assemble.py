"""From an arm's description, its drawn figures and a scenario to the arrays of the compiled plant."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from drivers.simulated.physics import compliance
from drivers.simulated.physics.chain import chain_of
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
    _fill_friction(drives, scenario)
    _fill_motors(drives, scenario)
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


def _fill_friction(drives: Records, scenario: Scenario) -> None:
    for viscous in scenario.viscous_friction:
        drives[viscous.drive - 1]["viscous"] *= 1.0 + viscous.change
    for coulomb in scenario.coulomb_friction:
        drives[coulomb.drive - 1]["coulomb"] *= 1.0 + coulomb.change
    for sides in scenario.asymmetric_friction:
        _set(drives, sides.drive, coulomb_asymmetry=sides.coulomb, viscous_asymmetry=sides.viscous)
    for slow in scenario.stribeck_friction:
        _set(drives, slow.drive, stribeck_rise=slow.rise)
        _set(drives, slow.drive, stribeck_speed=slow.speed, stribeck_exponent=slow.exponent)
    for still in scenario.static_friction:
        _set(drives, still.drive, static_rise=still.rise, static_speed=still.speed)
        if still.displacement is not None:
            _set(drives, still.drive, bristle_width=still.displacement)
    for power in scenario.nonlinear_viscous_friction:
        _set(drives, power.drive, power_share=power.share, power_exponent=power.exponent)
        _set(drives, power.drive, power_speed=power.reference, cubic_viscous=power.cubic)
    _fill_surroundings(drives, scenario)


def _fill_surroundings(drives: Records, scenario: Scenario) -> None:
    """Friction that follows load, place, temperature and time."""
    for load in scenario.load_dependent_friction:
        _add_of_load(drives, load.drive, load.coefficient, load.coefficient, load.time_constant)
    for gear in scenario.directional_efficiency:
        _add_of_load(drives, gear.drive, gear.driving, gear.driven, gear.time_constant)
    for place in scenario.position_dependent_friction:
        _set(drives, place.drive, wave_height=place.wave, wave_order=place.order, wave_phase=place.phase)
        _set(drives, place.drive, spot_height=place.spot, spot_centre=place.spot_centre)
        _set(drives, place.drive, spot_width=place.spot_width)
    for drift in scenario.drifting_friction:
        _set(drives, drift.drive, start_warmth=drift.start, ambient_warmth=drift.ambient)
        _set(drives, drift.drive, ambient_rate=drift.ambient_rate, heating=drift.heating)
        _set(drives, drift.drive, warming_time=drift.time_constant)
        _set(drives, drift.drive, coulomb_per_kelvin=drift.coulomb_per_kelvin)
        _set(drives, drift.drive, viscous_per_kelvin=drift.viscous_per_kelvin)
    for rub in scenario.brake_drag:
        _set(drives, rub.drive, drag_rise=rub.rise, drag_period=rub.period, drag_share=rub.share)


def _add_of_load(drives: Records, number: int, driving: float, driven: float, time: float) -> None:
    """Friction in N·m per N·m of load, which the level counts in units of the Coulomb torque."""
    drive = drives[number - 1]
    unit = drive["coulomb"] if drive["coulomb"] > 0 else np.inf
    _set(drives, number, load_time=time, load_rise=drive["load_rise"] + driving / unit)
    _set(drives, number, driven_rise=drive["driven_rise"] + driven / unit)


def _fill_motors(drives: Records, scenario: Scenario) -> None:
    for gain in scenario.drive_gain_error:
        drives[gain.drive - 1]["gain"] *= 1.0 + gain.change
    for rotor in scenario.rotor_inertia:
        drives[rotor.drive - 1]["inertia"] += rotor.change
    for offset in scenario.current_offset:
        _set(drives, offset.drive, torque_offset=offset.torque)
    for limit in scenario.saturation:
        _set(drives, limit.drive, current_limit=limit.limit)
    for lag in scenario.current_loop_lag:
        _set(drives, lag.drive, current_lag=lag.time_constant)
    for delay in scenario.time_delay:
        _set(drives, delay.drive, position_delay=delay.position, torque_delay=delay.torque)
    for drift in scenario.thermal_gain_drift:
        _set(drives, drift.drive, gain_per_kelvin=drift.per_kelvin, winding_heating=drift.heating)
        _set(drives, drift.drive, winding_time=drift.time_constant)


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
    for spring in scenario.gravity_spring:
        _set(joints, spring.joint, torsion_stiffness=spring.torsion, torsion_centre=spring.centre)
        _set(joints, spring.joint, spring_stiffness=spring.stiffness, spring_length=spring.length)
        _set(joints, spring.joint, spring_fixed_radius=spring.fixed_radius, spring_angle=spring.angle)
        _set(joints, spring.joint, spring_moving_radius=spring.moving_radius)
    for cable in scenario.cable_spring:
        _set(joints, cable.joint, cable_stiffness=cable.stiffness, cable_cubic=cable.cubic)
        _set(joints, cable.joint, cable_centre=cable.centre)
    for wall in scenario.contact:
        _set(joints, wall.joint, wall_stiffness=wall.stiffness, wall_damping=wall.damping)
        if wall.upper is not None:
            _set(joints, wall.joint, wall_upper=wall.upper)
        if wall.lower is not None:
            _set(joints, wall.joint, wall_lower=wall.lower)
    for swing in scenario.slosh:
        rate = 2.0 * np.pi * swing.frequency
        _set(joints, swing.joint, slosh_inertia=swing.inertia, slosh_stiffness=swing.inertia * rate**2)
        _set(joints, swing.joint, slosh_damping=2.0 * swing.damping * swing.inertia * rate)
    return joints


def _set(records: Records, axis: int, **values: float) -> None:
    """Fields of the record of an axis (from 1)."""
    for field, value in values.items():
        records[field][axis - 1] = value


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


def _crosstalk(n: int, scenario: Scenario) -> FloatArray:
    shares = np.zeros((n, n))
    for entry in scenario.torque_crosstalk:
        shares[entry.drive - 1, entry.source - 1] += entry.share
    return shares
