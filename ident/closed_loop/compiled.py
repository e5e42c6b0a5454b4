"""From the model and the recording to the arrays of the compiled closed loop, and back."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ident.closed_loop.coordinates import Coordinates, coordinates_of
from ident.closed_loop.direct_dynamics import check_mass_matrix
from ident.closed_loop.extras import extras_of, gain_errors, lifted_terms, only_plain_friction
from ident.closed_loop.foot import foot_of
from ident.closed_loop.friction_rows import friction_rows, shares_at_new_velocity, together
from ident.closed_loop.leading import RUNAWAY, Leading, SimulatedRun, check_stable
from ident.closed_loop.torque_parts import TorqueParts
from ident.effects.simulated import DriveChange
from ident.errors import IdentificationError
from ident.kernels.compilation import is_kept
from ident.kernels.extended import closed_loop_with_extras
from ident.kernels.loop import closed_loop
from ident.kernels.rigid_bodies import mass_and_bias
from ident.kernels.values import RUNS, TERM_HEAD, Drives, Dynamics, Run
from robots import rigid_body_model
from robots.arrays import FloatArray, IntArray
from robots.description import Robot


def run_compiled(frames: FloatArray, leading: Leading, parts: TorqueParts) -> SimulatedRun:
    """One run of a serial chain (``frames`` as of ``chain_frames``) without effects of unknown shape.

    Raises:
        IdentificationError: the mass matrix is not positive definite, or the loop is unstable.
    """
    robot, recording = leading.robot, leading.recording
    h = robot.controller.sample_time / leading.substeps
    axes = tuple(range(robot.n))
    coordinates = coordinates_of(robot, parts.inertia, parts.extra.springs, h)
    drives = _drives(coordinates, gain_errors(parts.extra.drives, robot.n))
    run = _run(coordinates, leading)
    if parts.usual or only_plain_friction(parts.extra):
        rows = parts.friction
        if parts.extra.friction:
            rows = together(rows, friction_rows(parts.extra.friction, robot.velocity_limits, h), ())
        terms = lifted_terms(rows, coordinates)
        dynamics = _dynamics(frames, parts, coordinates, terms, rows.strength)
        dynamics = _centred(dynamics, recording.position[0], h)
        ending, sample = closed_loop(axes, dynamics, drives, run, leading.substeps)
    else:
        extras, terms, strength = extras_of(
            parts.extra, coordinates, parts.friction, recording.time, h, leading.substeps, leading.speeds
        )
        dynamics = _dynamics(frames, parts, coordinates, terms, strength)
        dynamics = _centred(dynamics, recording.position[0], h)
        start = recording.position[0], leading.velocity
        run = run._replace(start=coordinates.start(*start, _load(dynamics, *start)))
        model = rigid_body_model(robot)
        foot = foot_of(parts.extra.feet, model, parts.links, parts.gravity, recording.position[0])
        ending, sample = closed_loop_with_extras(
            axes, np.arange(coordinates.count), dynamics, drives, run, leading.substeps, extras, foot
        )
    if ending != RUNS:
        q, v = run.start
        check_stable(v, run.speed_limit, float(recording.time[sample]))
        check_mass_matrix(mass_matrix(dynamics, q), q[: robot.n])
        raise IdentificationError(f"the simulation fails at {recording.time[sample]:.3f} s")
    whole = SimulatedRun(recording.time, run.position, run.velocity, run.control_signal)
    return as_the_bus_shows(leading.as_drives_show(whole), robot, parts.extra.drives)


def is_compiled(robot: Robot) -> bool:
    """Whether the loop of the usual model of such an arm is on disk as machine code."""
    return is_kept(closed_loop, tuple(range(robot.n)))


def as_the_bus_shows(run: SimulatedRun, robot: Robot, changes: Sequence[DriveChange]) -> SimulatedRun:
    """The run with channels of the bus that show the past, linearly between samples."""
    position_age, signal_age = np.zeros(robot.n), np.zeros(robot.n)
    for change in changes:
        position_age[change.drive] += change.position_age
        signal_age[change.drive] += change.signal_age
    there, back = robot.transmission_matrix.T, np.linalg.inv(robot.transmission_matrix).T
    if position_age.any():
        position, velocity = (
            _past(run.time, joints @ there, position_age) @ back for joints in (run.position, run.velocity)
        )
        run = replace(run, position=position, velocity=velocity)
    if signal_age.any():
        run = replace(run, control_signal=_past(run.time, run.control_signal, signal_age))
    return run


def _past(time: FloatArray, values: FloatArray, age: FloatArray) -> FloatArray:
    """Samples × drives as they were an age (n,) ago; what they begin with, before that."""
    return np.stack(
        [np.interp(time - late, time, column) for late, column in zip(age, values.T, strict=True)], axis=1
    )


def mass_matrix(dynamics: Dynamics, q: FloatArray) -> FloatArray:
    """M(q) with the drives' inertia, (m, m)."""
    n = dynamics.links.shape[0]
    whole = dynamics.inertia.copy()
    whole[:n, :n] += _mass_and_bias(dynamics, q[:n], np.zeros(n))[0]
    return whole


def _load(dynamics: Dynamics, position: FloatArray, velocity: FloatArray) -> FloatArray:
    """Torque (n,) of links and of what is constant on their side, without acceleration."""
    bias = _mass_and_bias(dynamics, position, velocity)[1]
    return np.asarray(bias + dynamics.constant[: position.shape[0]])


def _mass_and_bias(
    dynamics: Dynamics, position: FloatArray, velocity: FloatArray
) -> tuple[FloatArray, FloatArray]:
    n = position.shape[0]
    mass, bias, work = np.empty((n, n)), np.empty(n), np.empty((n, 22))
    turn = np.column_stack([np.cos(position), np.sin(position)])
    mass_and_bias(
        tuple(range(n)),
        dynamics.frames,
        dynamics.links,
        dynamics.gravity,
        position,
        turn,
        velocity,
        mass,
        bias,
        work,
    )
    return mass, bias


def _dynamics(
    frames: FloatArray,
    parts: TorqueParts,
    coordinates: Coordinates,
    terms: FloatArray,
    strength: FloatArray,
) -> Dynamics:
    damping = coordinates.split(parts.damping)
    for index, gear in enumerate(coordinates.gears):
        if not gear.gap:
            row = coordinates.across(index)
            damping += gear.damping * np.outer(row, row)
    return Dynamics(
        frames=frames,
        links=parts.links,
        gravity=parts.gravity,
        inertia=coordinates.split(parts.inertia),
        damping=damping,
        constant=coordinates.split_torque(parts.constant),
        terms=terms,
        spans=_spans(terms, coordinates.count),
        strength=strength,
        shares=np.ones(strength.size),
    )


def _centred(dynamics: Dynamics, position: FloatArray, h: float) -> Dynamics:
    """With friction shared out between old and new velocity, by the mass at a posture (n,)."""
    m = dynamics.inertia.shape[0]
    rows = dynamics.terms[:, TERM_HEAD:]
    mass = mass_matrix(dynamics, position)
    shares = shares_at_new_velocity(
        dynamics.terms[:, :TERM_HEAD], rows[:, :m], rows[:, m:], dynamics.strength, mass, h
    )
    return dynamics._replace(shares=shares)


def _run(coordinates: Coordinates, leading: Leading) -> Run:
    robot, recording = leading.robot, leading.recording
    position, velocity, signal = (np.empty(recording.position.shape) for _ in range(3))
    signal[0] = leading.signal
    limits = robot.velocity_limits
    at_drives = np.abs(robot.transmission_matrix) @ limits
    fastest = np.concatenate([limits, at_drives[[gear.drive for gear in coordinates.gears]]])
    return Run(
        # One that cannot be written is another type, for which all would be compiled once more.
        reference=np.require(leading.points, requirements=("C", "W")),
        speed=leading.speeds * np.array(robot.controller.velocity_feed_forward),
        added=leading.added,
        start=np.array([recording.position[0], leading.velocity]),
        position=position,
        velocity=velocity,
        control_signal=signal,
        speed_limit=RUNAWAY * fastest,
    )


def _spans(terms: FloatArray, m: int) -> IntArray:
    """Begin and end of what is not zero in the speed row and the torque row of each term, (K, 4)."""
    spans = np.zeros((terms.shape[0], 4), dtype=np.int64)
    for span, term in zip(spans, terms, strict=True):
        for column, row in ((0, term[TERM_HEAD : TERM_HEAD + m]), (2, term[TERM_HEAD + m :])):
            filled = np.flatnonzero(row)
            if filled.size:
                span[column : column + 2] = filled[0], filled[-1] + 1
    return spans


def _drives(coordinates: Coordinates, gain: FloatArray) -> Drives:
    robot = coordinates.robot
    controller = robot.controller
    cutoff = controller.velocity_cutoff_hz
    transmission = coordinates.transmission
    return Drives(
        cascade=controller.type == "cascade_p_pi",
        sample_time=controller.sample_time,
        position_gain=np.array(controller.position_gain),
        velocity_gain=np.array(controller.velocity_gain),
        integral_gain=np.array(controller.integral_gain),
        limit=np.array(controller.saturation),
        reach=controller.velocity_difference_samples,
        smoothing=1.0 if cutoff is None else 1.0 - math.exp(-2 * math.pi * cutoff * controller.sample_time),
        delay=controller.delay_samples,
        transmission=transmission,
        torque=np.ascontiguousarray(transmission.T * (robot.gains * gain)),
    )
