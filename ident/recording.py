"""What the identification reads: uniformly sampled reference, position and control signal."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ident.errors import IdentificationError
from ident.ordered import median
from robots.arrays import FloatArray
from robots.carried import Load

JITTER_ALLOWED = 0.01
"""Largest departure of a sampling interval from the median that counts as uniform."""


LARGEST = {
    "position": 1e6,
    "reference": 1e6,
    "control signal": 1e12,
    "torque from outside": 1e9,
    "added signal": 1e12,
    "second position": 1e6,
    "temperature": 1e4,
}
"""rad (or m), control-signal units: no arm is there; squares of much more overflow."""


@dataclass(frozen=True)
class Recording:
    """One uninterrupted record of an arm, from our own capture or an imported log.

    Attributes:
        name: where it came from, for messages.
        time: (samples,) s, uniform.
        reference: samples × joints position reference q_r in rad (or m); None where it was not recorded.
        position: samples × joints measured position q_mes in rad (or m).
        control_signal: samples × drives v_τ in control-signal units.
        load: the known body that was screwed to the arm; None where none was.
        outside: samples × joints torque on the joints by measured forces from outside, N·m (or N).
        added: samples × drives, known part of v_τ that no controller asked for: feed-forward or injected.
        second: samples × joints position by second encoders at the links, rad (or m).
        temperature: samples × drives, °C.
        lent: samples at its beginning and its end that are other recordings' too: filters run over them, and
            they are no rows of this one.

    Raises:
        IdentificationError: shapes differ, values are not finite or beyond ``LARGEST``, or the sampling is
            not uniform.
    """

    name: str
    time: FloatArray
    reference: FloatArray | None
    position: FloatArray
    control_signal: FloatArray
    load: Load | None = None
    outside: FloatArray | None = None
    added: FloatArray | None = None
    second: FloatArray | None = None
    temperature: FloatArray | None = None
    lent: tuple[int, int] = (0, 0)

    def __post_init__(self) -> None:
        samples = self.time.shape[0]
        for label, values in self._signals():
            if values.ndim != 2 or values.shape[0] != samples:
                raise IdentificationError(
                    f"{self.name}: {label} has shape {values.shape}; allowed: {samples} samples × joints"
                )
            if values.shape[1] != self.position.shape[1]:
                raise IdentificationError(
                    f"{self.name}: {label} has {values.shape[1]} joints, position {self.position.shape[1]}"
                )
            bad = np.isfinite(values)
            if not bad.all():
                bad = ~bad
                sample, joint = np.argwhere(bad)[0]
                raise IdentificationError(
                    f"{self.name}: {label} of joint {joint + 1} is not a number at sample {sample}"
                    f" ({int(bad.sum())} such values); allowed: finite values without gaps"
                )
            if values.size and max(values.max(), -values.min()) > LARGEST[label]:
                sample, joint = np.argwhere(np.abs(values) > LARGEST[label])[0]
                raise IdentificationError(
                    f"{self.name}: {label} of joint {joint + 1} is {values[sample, joint]:g} at sample"
                    f" {sample}; allowed: up to {LARGEST[label]:g}"
                )
        self._check_sampling()

    def _signals(self) -> list[tuple[str, FloatArray]]:
        more = {
            "reference": self.reference,
            "torque from outside": self.outside,
            "added signal": self.added,
            "second position": self.second,
            "temperature": self.temperature,
        }
        signals = [("position", self.position), ("control signal", self.control_signal)]
        return [*signals, *((label, values) for label, values in more.items() if values is not None)]

    def piece(self, rows: slice, name: str | None = None, lent: tuple[int, int] = (0, 0)) -> Recording:
        """Some of its samples, with every channel; of which some are ``lent``."""
        reference, outside, added, second, temperature = (
            None if values is None else values[rows]
            for values in (self.reference, self.outside, self.added, self.second, self.temperature)
        )
        return replace(
            self,
            name=self.name if name is None else name,
            time=self.time[rows],
            reference=reference,
            position=self.position[rows],
            control_signal=self.control_signal[rows],
            outside=outside,
            added=added,
            second=second,
            temperature=temperature,
            lent=lent,
        )

    def _check_sampling(self) -> None:
        if self.time.shape[0] < 3:
            raise IdentificationError(f"{self.name}: {self.time.shape[0]} samples are too few to identify")
        steps = np.diff(self.time)
        usual = median(steps)
        worst = int(np.argmax(np.abs(steps - usual)))
        if usual <= 0 or abs(steps[worst] - usual) > JITTER_ALLOWED * usual:
            raise IdentificationError(
                f"{self.name}: sampling is not uniform: {steps[worst]:.6g} s at {self.time[worst]:.6g} s,"
                f" median {usual:.6g} s; allowed: within {JITTER_ALLOWED:.0%} of the median"
            )

    @property
    def sample_time(self) -> float:
        """Sampling period in s."""
        return float((self.time[-1] - self.time[0]) / (self.time.shape[0] - 1))

    @property
    def joints(self) -> int:
        return int(self.position.shape[1])
