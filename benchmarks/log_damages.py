"""Ways in which logs are damaged, each by a seed: what loggers, exports and people do to them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.interpolate import CubicSpline

from robots.arrays import FloatArray

Columns = dict[str, FloatArray]
Damage = Callable[["Log", np.random.Generator], "Log"]


@dataclass(frozen=True)
class Log:
    """A log before it is written as text.

    Attributes:
        columns: by name.
        time: name of the time column.
        position, torque: names, one per joint.
        said: what was done.
        delimiter, units, header, encoding, cut: of the text; ``cut`` bytes are missing at its end.
    """

    columns: Columns
    time: str
    position: tuple[str, ...]
    torque: tuple[str, ...]
    said: str = ""
    delimiter: str = ","
    units: str = ""
    header: bool = True
    encoding: str = "utf-8"
    cut: int = 0
    numbers: str = "%.10g"
    also: tuple[str, ...] = field(default=())

    def text(self) -> bytes:
        """As a file has it."""
        lines = [self.delimiter.join(self.columns)] if self.header else []
        lines += [self.units] if self.units else []
        table = np.column_stack(list(self.columns.values()))
        rows = (self.delimiter.join(self.numbers % x for x in row) for row in table)
        body = "\n".join([*lines, *rows]) + "\n"
        if self.delimiter == ";" and self.also == ("comma",):
            body = body.replace(".", ",")
        content = body.encode(self.encoding)
        return content[: len(content) - self.cut] if self.cut else content

    def changed(self, said: str, **changes: FloatArray) -> Log:
        return replace(self, columns={**self.columns, **changes}, said=said)

    def rows(self, kept: FloatArray, said: str) -> Log:
        return replace(self, columns={n: v[kept] for n, v in self.columns.items()}, said=said)


def _one(names: tuple[str, ...], lot: np.random.Generator) -> str:
    return names[int(lot.integers(len(names)))]


def _even(log: Log) -> tuple[FloatArray, float]:
    time = log.columns[log.time]
    return time, float(np.median(np.diff(time)))


def jitter(log: Log, lot: np.random.Generator) -> Log:
    """Samples taken at other times, as their stamps say."""
    time, period = _even(log)
    share = lot.uniform(0.02, 0.5)
    taken = time + share * period * lot.uniform(-1, 1, len(time))
    taken = np.clip(taken, time[0], time[-1])
    moved = {name: CubicSpline(time, v)(taken) for name, v in log.columns.items() if name != log.time}
    return replace(log, columns={log.time: taken, **moved}, said=f"jitter of {share:.0%} of a period")


def late(log: Log, lot: np.random.Generator) -> Log:
    """Samples taken evenly, stamped late."""
    time, period = _even(log)
    share = lot.uniform(0.02, 0.5)
    stamps = time + share * period * lot.uniform(-1, 1, len(time))
    return log.changed(f"stamps off by {share:.0%} of a period", **{log.time: stamps})


def missing(log: Log, lot: np.random.Generator) -> Log:
    share = lot.uniform(0.0005, 0.05)
    kept = lot.random(len(log.columns[log.time])) > share
    return log.rows(np.flatnonzero(kept), f"{share:.2%} of the samples missing")


def gap(log: Log, lot: np.random.Generator) -> Log:
    count = len(log.columns[log.time])
    length = int(lot.uniform(0.002, 0.05) * count)
    begin = int(lot.uniform(0.1, 0.8) * count)
    return log.rows(
        np.delete(np.arange(count), np.s_[begin : begin + length]), f"{length} samples in a row missing"
    )


def twice(log: Log, lot: np.random.Generator) -> Log:
    count = len(log.columns[log.time])
    again = np.sort(np.concatenate([np.arange(count), lot.integers(count, size=int(0.01 * count))]))
    return log.rows(again, "1 % of the rows written twice")


def position_unit(log: Log, lot: np.random.Generator) -> Log:
    factor, said = (180 / np.pi, "as from rad to deg") if lot.random() < 0.5 else (1e3, "by 1000")
    return log.changed(f"positions multiplied {said}", **{n: factor * log.columns[n] for n in log.position})


def torque_unit(log: Log, lot: np.random.Generator) -> Log:
    factor = float(lot.choice([1e-3, 1e3, 0.01, 8.85]))
    return log.changed(
        f"torques multiplied by {factor:g}", **{n: factor * log.columns[n] for n in log.torque}
    )


def one_torque_unit(log: Log, lot: np.random.Generator) -> Log:
    factor, name = float(lot.choice([1e3, 10.0, 0.1, 1e-3])), _one(log.torque, lot)
    return log.changed(f"{name} multiplied by {factor:g}", **{name: factor * log.columns[name]})


def time_unit(log: Log, lot: np.random.Generator) -> Log:
    factor = float(lot.choice([1e3, 1e6, 1e9]))
    return log.changed(
        f"time multiplied by {factor:g}", **{log.time: np.round(factor * log.columns[log.time])}
    )


def torque_sign(log: Log, lot: np.random.Generator) -> Log:
    name = _one(log.torque, lot)
    return log.changed(f"sign of {name} turned", **{name: -log.columns[name]})


def position_sign(log: Log, lot: np.random.Generator) -> Log:
    name = _one(log.position, lot)
    return log.changed(f"sign of {name} turned", **{name: -log.columns[name]})


def swapped_joints(log: Log, lot: np.random.Generator) -> Log:
    """Two columns of one kind under each other's names; of a single axis, position and torque."""
    names = log.torque if lot.random() < 0.5 else log.position
    if len(names) == 1:
        return swapped_kinds(log, lot)
    first, second = (names[int(k)] for k in lot.choice(len(names), 2, replace=False))
    values = {first: log.columns[second], second: log.columns[first]}
    return log.changed(f"{first} and {second} exchanged", **values)


def swapped_kinds(log: Log, lot: np.random.Generator) -> Log:
    values = {q: log.columns[t] for q, t in zip(log.position, log.torque, strict=True)}
    values |= {t: log.columns[q] for q, t in zip(log.position, log.torque, strict=True)}
    return log.changed("positions and torques exchanged", **values)


def spikes(log: Log, lot: np.random.Generator) -> Log:
    names = log.position if lot.random() < 0.6 else log.torque
    name = _one(names, lot)
    values = log.columns[name].copy()
    count, size = int(lot.integers(1, 6)), float(np.exp(lot.uniform(np.log(0.02), np.log(20.0))))
    at = lot.integers(20, len(values) - 20, size=count)
    values[at] += size * np.ptp(values) * lot.choice([-1.0, 1.0], size=count)
    return log.changed(f"{count} samples of {name} off by {size:.2g} of its range", **{name: values})


def stuck(log: Log, lot: np.random.Generator) -> Log:
    name = _one(log.position + log.torque, lot)
    values = log.columns[name].copy()
    length = int(np.exp(lot.uniform(np.log(0.002), np.log(0.2))) * len(values))
    begin = int(lot.uniform(0.1, 0.7) * len(values))
    values[begin : begin + length] = values[begin]
    return log.changed(f"{name} stuck for {length} samples", **{name: values})


def clipped(log: Log, lot: np.random.Generator) -> Log:
    name, share = _one(log.position + log.torque, lot), lot.uniform(0.4, 0.9)
    values = log.columns[name]
    middle, half = (values.max() + values.min()) / 2, share * np.ptp(values) / 2
    kept = np.clip(values, middle - half, middle + half)
    return log.changed(f"{name} clipped at {share:.0%} of its range", **{name: kept})


def coarse(log: Log, lot: np.random.Generator) -> Log:
    digits = int(lot.integers(2, 5))
    return replace(log, numbers=f"%.{digits}f", said=f"written with {digits} digits behind the point")


def delimiter(log: Log, lot: np.random.Generator) -> Log:
    mark, comma = [(";", True), (";", False), ("\t", False), (" ", False)][int(lot.integers(4))]
    return replace(log, delimiter=mark, also=("comma",) if comma else (), said=f"columns divided by {mark!r}")


def no_header(log: Log, lot: np.random.Generator) -> Log:
    return replace(log, header=False, said="without a header")


def row_of_units(log: Log, lot: np.random.Generator) -> Log:
    units = log.delimiter.join("[s]" if n == log.time else "[-]" for n in log.columns)
    return replace(log, units=units, said="a row of units")


def odd_names(log: Log, lot: np.random.Generator) -> Log:
    """Names that say nothing."""
    names = {n: f"signal{k}" for k, n in enumerate(log.columns)}
    return replace(log, columns={names[n]: v for n, v in log.columns.items()}, said="names that say nothing")


def encoding(log: Log, lot: np.random.Generator) -> Log:
    name = str(lot.choice(["utf-16", "cp1252", "utf-8-sig"]))
    renamed = {(f"{n}_°" if name == "cp1252" else n): v for n, v in log.columns.items()}
    return replace(log, columns=renamed, encoding=name, said=f"written as {name}")


def truncated(log: Log, lot: np.random.Generator) -> Log:
    size = len(log.text())
    return replace(log, cut=int(lot.uniform(0.0001, 0.95) * size), said="cut off in the middle of a line")


def not_numbers(log: Log, lot: np.random.Generator) -> Log:
    name = _one(log.position + log.torque, lot)
    values = log.columns[name].copy()
    values[lot.integers(len(values), size=int(lot.integers(1, 20)))] = np.nan
    return log.changed(f"{name} has values that are no numbers", **{name: values})


def velocity_as_reference(log: Log, lot: np.random.Generator) -> Log:
    time = log.columns[log.time]
    speeds = {f"{n}_ref": np.gradient(log.columns[n], time) for n in log.position}
    return log.changed("velocities under the names of references", **speeds)


def shifted(log: Log, lot: np.random.Generator) -> Log:
    """Torques logged some samples late: two loggers."""
    count = int(lot.integers(1, 30))
    late = {
        n: np.concatenate([np.repeat(log.columns[n][:1], count), log.columns[n][:-count]]) for n in log.torque
    }
    return log.changed(f"torques {count} samples late", **late)


DAMAGES: tuple[Damage, ...] = (
    jitter, late, missing, gap, twice, position_unit, torque_unit, one_torque_unit, time_unit, torque_sign,
    position_sign, swapped_joints, swapped_kinds, spikes, stuck, clipped, coarse, delimiter, no_header,
    row_of_units, odd_names, encoding, truncated, not_numbers, velocity_as_reference,
)  # fmt: skip
