"""Compiled control law of all drives, as ``ident.closed_loop.control_law``."""

from __future__ import annotations

from ident.kernels.compilation import compiled, inlined
from ident.kernels.values import Axes, Drives, Loop, Run
from robots.arrays import FloatArray


@compiled
def start_controller(
    axes: Axes, drives: Drives, run: Run, loop: Loop, measured: FloatArray, rate: FloatArray
) -> None:
    """Fill the memory as if the drives had moved at constant speed so far.

    Args:
        axes: of the drives.
        drives, run, loop: as in ``values``.
        measured, rate: (n,) drive positions and velocities at the start.
    """
    reach = drives.reach
    for i in range(len(axes)):
        loop.filtered[i] = rate[i]
        for k in range(reach):
            loop.past[k, i] = measured[i] - (reach - k) * drives.sample_time * rate[i]
        for k in range(drives.delay + 1):
            loop.coming[k, i] = run.control_signal[0, i]


@inlined
def control(
    axes: Axes,
    drives: Drives,
    run: Run,
    loop: Loop,
    measured: FloatArray,
    step: int,
    output: FloatArray,
) -> None:
    """One controller sample: what the drives put out from now on goes into ``output`` (n,).

    Args:
        axes: of the drives.
        drives, run, loop: as in ``values``.
        measured: (n,) drive positions.
        step: number of the sample.
        output: written.
    """
    # Names for the arrays: reaching into a tuple in a loop costs a count of references each time.
    past, filtered, integral, coming = loop.past, loop.filtered, loop.integral, loop.coming
    position_gain, velocity_gain, integral_gain = (
        drives.position_gain,
        drives.velocity_gain,
        drives.integral_gain,
    )
    reference, speed, added, limit = run.reference, run.speed, run.added, drives.limit
    oldest, latest, next_out = step % drives.reach, step % (drives.delay + 1), (step + 1) % (drives.delay + 1)
    span = drives.reach * drives.sample_time
    fed_forward = added.shape[0] > 0
    for i in range(len(axes)):
        position = measured[i]
        raw = (position - past[oldest, i]) / span
        past[oldest, i] = position
        filtered[i] += drives.smoothing * (raw - filtered[i])
        error = reference[step, i] - position
        speed_error = speed[step, i] - filtered[i]
        if drives.cascade:
            wanted = velocity_gain[i] * (position_gain[i] * error + speed_error)
            growth = integral_gain[i] * wanted
        else:
            wanted = position_gain[i] * error + velocity_gain[i] * speed_error
            growth = integral_gain[i] * error
        if fed_forward:
            wanted += added[step, i]
        if step == 0 and integral_gain[i] > 0.0:
            integral[i] = run.control_signal[0, i] - wanted
        wanted += integral[i]
        limited = min(max(wanted, -limit[i]), limit[i])
        if limited == wanted or growth * wanted <= 0.0:
            integral[i] += growth * drives.sample_time
        coming[latest, i] = limited
    for i in range(len(axes)):
        output[i] = coming[next_out, i]
