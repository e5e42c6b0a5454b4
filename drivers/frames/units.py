"""Counts of the drives and joint coordinates: both directions from the same numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drivers.errors import DriveError
from robots.arrays import FloatArray, IntArray
from robots.description import Robot

INT32 = np.iinfo(np.int32)


@dataclass(frozen=True)
class Units:
    """The one relation between joint positions and drive counts: counts = c ∘ (T · q).

    Args:
        transmission: T, n × n: drive output position = T · joint position.
        counts_per_output_unit: c, (n,), signed: counts per rad (or m) of drive output.
        control_signal_per_count: (n,), signed: control-signal units per count of the drive's object.
        joints: names, for messages.
        counts_per_second: (n,), encoder counts per second in one unit of the drive's velocity object; NaN for
            drives whose velocity is not recorded. None where none is.
    """

    transmission: FloatArray
    counts_per_output_unit: FloatArray
    control_signal_per_count: FloatArray
    joints: tuple[str, ...]
    counts_per_second: FloatArray | None = None

    @classmethod
    def of(cls, robot: Robot) -> Self:
        return cls(
            transmission=robot.transmission_matrix,
            counts_per_output_unit=robot.counts_per_output_unit,
            control_signal_per_count=robot.control_signal_per_count,
            joints=tuple(joint.name for joint in robot.joint),
            counts_per_second=np.array(
                [np.nan if d.velocity is None else d.velocity.counts_per_second for d in robot.drive]
            ),
        )

    def counts(self, position: ArrayLike) -> NDArray[np.int32]:
        """Joint positions (… × n, rad or m) to the nearest counts of the drives.

        Raises:
            DriveError: a position is not finite or does not fit the 32 bits of 607Ah.
        """
        exact = np.asarray(position, dtype=np.float64) @ self.transmission.T * self.counts_per_output_unit
        rounded = np.rint(exact)
        fits = (rounded >= INT32.min) & (rounded <= INT32.max)
        if not fits.all():
            axis = int(np.argwhere(~fits)[0][-1])
            raise DriveError(
                f"a position of drive {axis + 1} ({self.joints[axis]}) does not fit into 32-bit counts; "
                f"allowed: {INT32.min} to {INT32.max}"
            )
        return rounded.astype(np.int32)

    def position(self, counts: ArrayLike) -> FloatArray:
        """Counts (… × n) to joint positions, rad or m."""
        output = np.asarray(counts, dtype=np.float64) / self.counts_per_output_unit
        return np.asarray(
            np.linalg.solve(self.transmission, output.reshape(-1, output.shape[-1]).T).T
        ).reshape(output.shape)

    def control_signal(self, raw: IntArray | NDArray[np.int32]) -> FloatArray:
        """Raw values of the control-signal object (… × n) to v_τ."""
        return np.asarray(raw * self.control_signal_per_count)

    def velocity(self, raw: IntArray | NDArray[np.int32]) -> FloatArray:
        """Raw values of the velocity object (… × n) to joint velocities, rad/s or m/s.

        NaN for a joint that a drive moves whose velocity is not recorded.
        """
        if self.counts_per_second is None or np.isnan(self.counts_per_second).all():
            return np.full(np.shape(raw), np.nan)
        unknown = np.isnan(self.counts_per_second)
        found = self.position(raw * np.where(unknown, 0.0, self.counts_per_second))
        depends = np.abs(np.linalg.inv(self.transmission)) > 1e-12
        found[..., (depends & unknown).any(axis=1)] = np.nan
        return found

    def output_span(self, joint_span: FloatArray) -> FloatArray:
        """The largest drive-output motion that joint motions within ±joint_span make, (n,)."""
        return np.asarray(np.abs(self.transmission) @ joint_span)
