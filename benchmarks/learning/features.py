"""Features of a window that an engineer would look at, per drive: for learners that want a table.

Of the residual of each drive: how loud, where and when; its correlation with a dictionary of what nature
makes of speed, position, load, acceleration and time; how much groups of these explain together; its
spectrum over time and over the drive's angle.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from benchmarks.learning.rows import RATE, RESIDUAL
from robots.arrays import FloatArray

_BANDS = (0.0, 1.0, 3.0, 8.0, 15.0, 25.0)
"""Hz, edges."""
_ORDERS = np.concatenate([np.arange(1.0, 8.0), np.geomspace(8.0, 130.0, 40)])
"""Periods a turn."""
_WIDTHS = (0.01, 0.03, 0.1)
"""Shares of the speed limit over which a friction falls."""
GROUPS = {
    "dry": ("one", "sign"),
    "friction": ("one", "sign", "speed"),
    "load": ("one", "sign", "speed", "load", "load sign"),
    "inertia": ("acceleration", "jerk"),
    "late": ("torque rate", "jerk"),
    "warming": ("sign", "speed", "time sign", "time speed"),
    "spring": ("one", "position", "position²", "position³"),
    "turning friction": ("sign", "sin1 sign", "cos1 sign", "sin2 sign", "cos2 sign"),
    "gain": ("torque", "torque²", "torque³", "torque sign"),
}


def features(window: FloatArray, context: FloatArray) -> FloatArray:
    """Features of every drive, n × features.

    Args:
        window: rows × n × channels.
        context: n × context of the accepted model.
    """
    left = np.asarray(window[..., RESIDUAL], dtype=np.float64)
    loud = np.sqrt(np.mean(np.square(window[..., RESIDUAL:].astype(np.float64)), axis=0))
    others = np.stack([np.delete(loud[:, 0], j).max() for j in range(len(loud))])
    found = []
    for j in range(window.shape[1]):
        one = window[:, j].astype(np.float64)
        neighbours = [window[:, k].astype(np.float64) for k in (j - 1, j + 1) if 0 <= k < window.shape[1]]
        found.append(np.concatenate([_of_drive(one, left[:, j]), _of_neighbours(neighbours, left[:, j])]))
    level = np.column_stack([np.log1p(loud), np.log1p(others), np.log((loud[:, 0] + 1) / (others + 1))])
    return np.column_stack([level, np.stack(found), context]).astype(np.float32)


def dictionary(one: FloatArray) -> dict[str, FloatArray]:
    """What could be proportional to a torque, (rows,) each, of one drive's rows × channels."""
    position, speed, height, torque, load = one[:, :RESIDUAL].T
    time = np.linspace(0.0, 1.0, len(one))
    middle = position - position.mean()
    sign = np.tanh(speed / 0.002)
    found = {
        "one": np.ones(len(one)),
        "sign": sign,
        "speed": speed,
        "speed|speed|": speed * np.abs(speed),
        "speed³": speed**3,
        "√speed": sign * np.sqrt(np.abs(speed)),
        "|speed|": np.abs(speed),
        "acceleration": height,
        "jerk": np.gradient(height),
        "torque": torque,
        "torque²": torque * np.abs(torque),
        "torque³": torque**3,
        "torque sign": np.tanh(torque / 0.02),
        "peak torque": np.sign(torque) * np.maximum(np.abs(torque) - 0.8 * np.abs(torque).max(), 0.0),
        "torque rate": np.gradient(torque),
        "load": load,
        "load sign": np.abs(load) * sign,
        "load² sign": load**2 * sign,
        "driven load": np.abs(load) * sign * (load * speed < 0),
        "position": middle,
        "position²": middle**2,
        "position³": middle**3,
        "beyond": np.maximum(middle - np.quantile(middle, 0.85), 0.0),
        "below": np.minimum(middle - np.quantile(middle, 0.15), 0.0),
        "time": time,
        "time sign": time * sign,
        "time speed": time * speed,
        "since reversal": _since_reversal(position, speed),
        "lost way": sign * np.exp(-np.abs(_way(position, speed)) / 0.02),
    }
    for width in _WIDTHS:
        found[f"falling {width}"] = sign * np.exp(-np.abs(speed) / width)
    for order in (1, 2, 3):
        for name, wave in (("sin", np.sin(order * position)), ("cos", np.cos(order * position))):
            found[f"{name}{order}"] = wave
            found[f"{name}{order} sign"] = wave * sign
    return found


def _of_drive(one: FloatArray, left: FloatArray) -> FloatArray:
    words = dictionary(one)
    columns = np.column_stack(list(words.values()))
    correlation = _correlation(columns, left)
    base = np.column_stack([words[name] for name in ("one", "sign", "speed")])
    rest = left - base @ np.linalg.lstsq(base, left, rcond=None)[0]
    columns_rest = columns - base @ np.linalg.lstsq(base, columns, rcond=None)[0]
    partial = _correlation(columns_rest, rest)
    explained = [_explained(np.column_stack([words[n] for n in names]), left) for names in GROUPS.values()]
    return np.concatenate(
        [correlation, partial, explained, _course(left), _spectra(left, one[:, 0]), _at(one)]
    )


def _of_neighbours(neighbours: list[FloatArray], left: FloatArray) -> FloatArray:
    """The largest correlation with what the drives on either side do and leave, and both together."""
    found = np.zeros(8)
    for one in neighbours:
        columns = [one[:, 2], one[:, 1], np.tanh(one[:, 1] / 0.002), one[:, RESIDUAL]]
        correlation = np.abs(_correlation(np.column_stack(columns), left))
        found[:4] = np.maximum(found[:4], correlation)
        found[4:] += correlation
    return found


def _correlation(columns: FloatArray, left: FloatArray) -> FloatArray:
    size = np.sqrt(np.sum(columns**2, axis=0) * max(float(left @ left), 1e-9))
    return np.where(size > 1e-6, columns.T @ left / np.maximum(size, 1e-6), 0.0)


def _explained(columns: FloatArray, left: FloatArray) -> float:
    """Share of the residual's power that columns explain together."""
    rest = left - columns @ np.linalg.lstsq(columns, left, rcond=None)[0]
    return 1.0 - float(rest @ rest) / max(float(left @ left), 1e-9)


def _course(left: FloatArray) -> FloatArray:
    """How the residual is spread over time: thirds, peak, tails, memory of one and five rows."""
    power = max(float(np.mean(left**2)), 1e-9)
    thirds = [float(np.mean(part**2)) / power for part in np.array_split(left, 3)]
    memory = [float(np.mean(left[k:] * left[:-k])) / power for k in (1, 5)]
    peak = float(np.abs(left).max()) / np.sqrt(power)
    return np.array([*thirds, *memory, peak, float(np.mean(left**4)) / power**2])


def _spectra(left: FloatArray, position: FloatArray) -> FloatArray:
    """Shares of bands, the loudest line in time, and the loudest two orders of the drive's angle."""
    power = np.abs(np.fft.rfft(left * np.hanning(len(left)))) ** 2
    hz = np.fft.rfftfreq(len(left), 1.0 / RATE)
    whole = max(float(power.sum()), 1e-9)
    bands = [power[(hz >= a) & (hz < b)].sum() / whole for a, b in pairwise(_BANDS)]
    waves = np.exp(1j * np.outer(_ORDERS, position))
    orders = np.abs(waves @ left) ** 2 / (len(left) * max(float(left @ left), 1e-9))
    best = int(np.argmax(orders))
    line = int(np.argmax(power))
    return np.array(
        [*bands, power[line] / whole, hz[line], orders[best], np.log(_ORDERS[best]), np.sort(orders)[-2]]
    )


def _at(one: FloatArray) -> FloatArray:
    """Where it is loud: fast, slow, under high torque, while accelerating, at reversals, within rows."""
    left, still, fast = one[:, RESIDUAL:].T
    moving = left != 0
    power = max(float(np.mean(left**2)), 1e-9)
    conditions = (np.abs(one[:, 1]) > 0.25, np.abs(one[:, 1]) < 0.05, *_upper(one[:, 3]), *_upper(one[:, 2]))
    shares = [
        float(np.mean(left[c & moving] ** 2)) / power if (c & moving).any() else 0.0 for c in conditions
    ]
    loud = [
        float(np.sqrt(np.mean(still**2))),
        float(np.abs(still).max()),
        float(fast.max()),
        float(fast.mean()),
    ]
    signed = [float(np.mean(still)), float(np.mean(still * np.sign(np.gradient(one[:, 1]))))]
    swing = [float(np.ptp(one[:, k])) for k in (0, 1, 2, 3, 4)]
    return np.array([*shares, *np.log1p(loud), *signed, *swing, float(np.mean(~moving))])


def _upper(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    size = np.abs(values)
    return size > np.quantile(size, 0.8), size < np.quantile(size, 0.2)


def _way(position: FloatArray, speed: FloatArray) -> FloatArray:
    """rad (or m) since the last reversal."""
    turned = np.flatnonzero(np.diff(np.sign(speed)) != 0) + 1
    last = np.zeros(len(position), dtype=np.int64)
    last[turned] = turned
    return np.asarray(position - position[np.maximum.accumulate(last)])


def _since_reversal(position: FloatArray, speed: FloatArray) -> FloatArray:
    """Like a bristle that takes 50 mrad to slip."""
    return np.tanh(_way(position, speed) / 0.05)
