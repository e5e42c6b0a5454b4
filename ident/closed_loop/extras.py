"""What only some models have, as the arrays of the compiled closed loop."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from ident.closed_loop.coordinates import Coordinates, Gear
from ident.closed_loop.friction_rows import FASTEST, FrictionRows, friction_rows, together
from ident.effects import FrictionSign
from ident.effects.simulated import DriveChange, FrictionTorque, SimulatedParts, Table
from ident.errors import IdentificationError
from ident.kernels.values import CHANGING_HEAD, LAW_CELLS, LINEAR, LOAD_SIDES, TERM_HEAD, Extras
from robots.arrays import FloatArray
from robots.description import Robot

_GAP_CELLS = 256


@dataclass
class _Tables:
    """All tables in one array."""

    values: list[FloatArray] = field(default_factory=list)
    rows: list[tuple[float, ...]] = field(default_factory=list)

    def add(self, table: Table | None) -> int:
        if table is None:
            return -1
        first = sum(values.size for values in self.values)
        self.values.append(np.asarray(table.values, dtype=np.float64))
        self.rows.append((first, table.values.size, table.lower, 1.0 / table.spacing))
        return len(self.rows) - 1


def only_plain_friction(extra: SimulatedParts) -> bool:
    """Whether there is nothing but friction that the usual model's code can take along."""
    return not (extra.position or extra.springs or extra.errors or extra.drives or extra.feet) and all(
        (torque.law is None or isinstance(torque.law, FrictionSign)) and not _changes(torque)
        for torque in extra.friction
    )


def lifted_terms(rows: FrictionRows, coordinates: Coordinates) -> FloatArray:
    """(K, 4 + 2m) of rows over the joints; friction over the speed of a gear's drive moves to the drive."""
    terms = []
    for head, speed, torque in zip(rows.heads, rows.speed, rows.torque, strict=True):
        moved = coordinates.at_drive(speed, torque)
        pair = moved or (coordinates.lift(speed), coordinates.lift(torque))
        terms.append(np.concatenate([head, *pair]))
    return np.array(terms).reshape(-1, TERM_HEAD + 2 * coordinates.count)


def extras_of(
    extra: SimulatedParts,
    coordinates: Coordinates,
    usual: FrictionRows,
    time: FloatArray,
    h: float,
    substeps: int,
    speeds: FloatArray,
) -> tuple[Extras, FloatArray, FloatArray]:
    """Extras, all speed terms (K, 4 + 2m) and their strengths (K,).

    Args:
        extra: of the model.
        coordinates: of the arm.
        usual: friction of the usual effects.
        time: (samples,) s.
        h, substeps: integration step, s, and how many make a controller sample.
        speeds: (controller samples, n) of the set-points at the drive outputs.

    Raises:
        IdentificationError: a delay or lag is negative.
    """
    robot, tables = coordinates.robot, _Tables()
    changes = {k for k, torque in enumerate(extra.friction) if _changes(torque)}
    rows = together(usual, friction_rows(extra.friction, robot.velocity_limits, h), changes)
    loose = [(index, gear) for index, gear in enumerate(coordinates.gears) if gear.gap]
    contact = [_contact(index, gear, coordinates) for index, gear in loose]
    terms = np.concatenate([lifted_terms(rows, coordinates), *contact])
    strength = np.concatenate([rows.strength, np.ones(len(contact))])
    changing = [
        _changing(k, rows.strength[k], extra.friction[source], coordinates, tables, h)
        for k, source in enumerate(rows.sources)
        if source in changes
    ]
    joint_speeds = speeds @ np.linalg.inv(robot.transmission_matrix).T
    warming = [
        _warming(k, extra.friction[source], joint_speeds, float(time[0]), h)
        for k, source in enumerate(rows.sources)
        if source in changes and extra.friction[source].warming is not None
    ]
    first = rows.strength.size
    for k, (index, gear) in enumerate(loose, start=first):
        touching = tables.add(_gap_table(gear, lambda x, gap=gear.gap: 1.0 * (np.abs(x) > 0.5 * gap)))
        row = coordinates.across(index)
        changing.append(
            np.concatenate([[k, 1.0, touching, -1, -1, 0, -1, 0, 1, 0], np.zeros(robot.n), row, 0.0 * row])
        )
    controller_step = h * substeps
    extras = Extras(
        tables=np.empty(0),
        curves=_curves(extra, coordinates, tables),
        errors=_errors(extra, robot, tables),
        changing=np.array(changing).reshape(-1, CHANGING_HEAD + robot.n + 2 * coordinates.count),
        warming=np.array(warming).reshape(-1, 5),
        laws=np.array(rows.laws).reshape(-1, 2 * LAW_CELLS + 1),
        chain=_chain(extra.drives, robot.n, h, controller_step),
        gains=_gains(extra.drives, coordinates, tables),
        reading=_reading(extra.drives, robot.n, h),
        misread=_misread(extra.drives, tables),
        back=np.asarray(np.linalg.inv(robot.transmission_matrix), dtype=np.float64),
        time=np.ascontiguousarray(time),
        values=np.empty(0),
    )
    return (
        extras._replace(
            values=np.concatenate([np.empty(0), *tables.values]),
            tables=np.array(tables.rows, dtype=np.float64).reshape(-1, 4),
        ),
        terms,
        strength,
    )


def _contact(index: int, gear: Gear, coordinates: Coordinates) -> FloatArray:
    """A speed term: damping of the teeth of a gear with play, which acts while they touch."""
    row = coordinates.across(index)
    return np.concatenate([[1.0, LINEAR, 0, -1], row, gear.damping * row])[np.newaxis]


def _changes(torque: FrictionTorque) -> bool:
    factors = (
        torque.curve,
        torque.course,
        torque.speed_factor,
        torque.load_row,
        torque.warming,
        torque.other_factor,
    )
    return any(factor is not None for factor in factors)


def _changing(
    term: int, strength: float, torque: FrictionTorque, coordinates: Coordinates, tables: _Tables, h: float
) -> FloatArray:
    n = coordinates.robot.n
    load = np.zeros(n) if torque.load_row is None else np.asarray(torque.load_row)
    position = np.zeros(coordinates.count)
    if torque.position_row is not None:
        moved = coordinates.at_drive(torque.position_row)
        position = moved[0] if moved else coordinates.lift(torque.position_row)
    other = np.zeros(coordinates.count)
    if torque.other_row is not None:
        other = coordinates.lift(torque.other_row)
    head = [
        term,
        strength,
        tables.add(torque.curve),
        tables.add(torque.course),
        tables.add(_over_speed(torque, coordinates.robot)),
        0 if torque.load_row is None else LOAD_SIDES[torque.load_side],
        tables.add(torque.other_factor),
        torque.load_offset,
        1.0 if torque.load_memory <= 0.0 else -math.expm1(-h / torque.load_memory),
        torque.load_share,
    ]
    return np.concatenate([head, load, position, other])


def _over_speed(torque: FrictionTorque, robot: Robot) -> Table | None:
    if torque.speed_factor is None:
        return None
    fastest = FASTEST * float(np.abs(torque.speed_row) @ robot.velocity_limits)
    return Table.of(torque.speed_factor, -fastest, fastest)


def _warming(
    term: int, torque: FrictionTorque, speeds: FloatArray, start: float, h: float
) -> tuple[float, ...]:
    """A row of ``Extras.warming``; before the start, s, the gear was moved as by these speeds (steps, n)."""
    gear = torque.warming
    assert gear is not None
    before = gear.at_start(speeds @ torque.speed_row, start)
    return (term, gear.kept(h), gear.dry, gear.viscous, before)


def _gap_table(gear: Gear, function: object) -> Table:
    assert callable(function)
    points = np.linspace(-gear.gap, gear.gap, _GAP_CELLS + 1)
    return Table.at(-gear.gap, 2 * gear.gap / _GAP_CELLS, np.asarray(function(points), dtype=np.float64))


def _curves(extra: SimulatedParts, coordinates: Coordinates, tables: _Tables) -> FloatArray:
    rows = []
    for torque in extra.position:
        own = (np.asarray(torque.position_row, float), np.asarray(torque.torque_row, float))
        moved = coordinates.at_drive(*own) if torque.side == "drive" else None
        pair = moved or tuple(coordinates.lift(row) for row in own)
        rows.append(np.concatenate([[tables.add(torque.curve), tables.add(torque.course)], *pair]))
    for index, gear in enumerate(coordinates.gears):
        if gear.gap:
            table = _gap_table(
                gear, lambda x, g=gear: g.stiffness * np.sign(x) * np.maximum(np.abs(x) - 0.5 * g.gap, 0.0)
            )
        else:
            bent = np.linspace(-1.0, 1.0, 5)
            table = Table.at(-1.0, 0.5, gear.stiffness * bent + gear.cubic * bent**3)
        row = coordinates.across(index)
        rows.append(np.concatenate([[tables.add(table), -1], row, row]))
    return np.array(rows).reshape(-1, 2 + 2 * coordinates.count)


def _errors(extra: SimulatedParts, robot: Robot, tables: _Tables) -> FloatArray:
    matrix = robot.transmission_matrix
    inverse = np.linalg.inv(matrix)
    rows = [
        np.concatenate([[tables.add(error.error)], matrix[error.drive], inverse[:, error.drive]])
        for error in extra.errors
    ]
    return np.array(rows).reshape(-1, 1 + 2 * robot.n)


def _chain(changes: tuple[DriveChange, ...], n: int, h: float, controller_step: float) -> FloatArray:
    chain = np.zeros((n, 8))
    chain[:, 4] = np.inf
    for row, drive in zip(chain, range(n), strict=True):
        own = [change for change in changes if change.drive == drive]
        lag, delay = sum(change.lag for change in own), sum(change.delay for change in own)
        if lag < 0.0 or delay < 0.0:
            raise IdentificationError(
                f"drive {drive + 1} has a lag of {lag:.4g} s and a delay of {delay:.4g} s;"
                " allowed: not negative"
            )
        if lag > 0.0:
            row[0] = math.exp(-h / lag)
            row[1] = lag / h * (1.0 - row[0])
        row[2] = math.floor(delay / controller_step + 1e-9)
        row[3] = max(0.0, delay - row[2] * controller_step)
        row[4] = min((change.limit for change in own), default=math.inf)
        row[5] = sum(change.dead_zone for change in own)
        row[6], row[7] = max(((change.droop, change.droop_power) for change in own), default=(0.0, 2.0))
        if row[5] < 0.0 or row[6] < 0.0:
            raise IdentificationError(
                f"drive {drive + 1} has a dead zone of {row[5]:.4g} and a droop of {row[6]:.4g};"
                " allowed: not negative"
            )
    return chain


def _gains(changes: tuple[DriveChange, ...], coordinates: Coordinates, tables: _Tables) -> FloatArray:
    matrix = coordinates.transmission
    rows = [
        np.concatenate([[change.drive, tables.add(change.gain_curve)], matrix[change.drive]])
        for change in changes
        if change.gain_curve is not None
    ]
    return np.array(rows, dtype=np.float64).reshape(-1, 2 + coordinates.count)


def _misread(changes: tuple[DriveChange, ...], tables: _Tables) -> FloatArray:
    rows = [
        (change.drive, tables.add(change.reading_error))
        for change in changes
        if change.reading_error is not None
    ]
    return np.array(rows, dtype=np.float64).reshape(-1, 2)


def _reading(changes: tuple[DriveChange, ...], n: int, h: float) -> FloatArray:
    delays = np.array([sum(c.reading_delay for c in changes if c.drive == drive) for drive in range(n)])
    if delays.min() < 0.0:
        raise IdentificationError(
            f"the position reading of drive {int(np.argmin(delays)) + 1} is delayed by {delays.min():.4g} s;"
            " allowed: not negative"
        )
    return delays / h if delays.any() else np.empty(0)


def gain_errors(changes: tuple[DriveChange, ...], n: int) -> FloatArray:
    """(n,) factors of the drive gains."""
    factors = np.ones(n)
    for change in changes:
        factors[change.drive] *= 1.0 + change.gain
    return factors
