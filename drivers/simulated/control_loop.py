"""The position loop inside the drives (eq. 4 of the paper), all axes at once.

The law stands in :mod:`drivers.simulated.physics.loop`, compiled; this is what it starts from and remembers.
"""

from __future__ import annotations

import numpy as np

from drivers.simulated.physics.entry_points import compiled
from drivers.simulated.physics.loop import Law, Memory
from robots.arrays import BoolArray, FloatArray
from robots.description import Controller


class ControlLoop:
    """State and law of the position loops of n drives.

    Args:
        controller: type, gains and timing from the arm's description.
        counts: signed encoder counts per rad (or m) at each drive output, (n,); 1 where None.
        steps: plant steps per sample.
        past_steps: plant steps that a delayed position channel looks back.
        past_samples: samples that a delayed torque channel looks back.
    """

    def __init__(
        self,
        controller: Controller,
        counts: FloatArray | None = None,
        steps: int = 1,
        past_steps: int = 0,
        past_samples: int = 0,
    ) -> None:
        n = len(controller.position_gain)
        self._viscous = np.array(controller.friction_feed_forward or (0.0,) * n)
        self._inertia = np.array(controller.acceleration_feed_forward or (0.0,) * n)
        cutoff = controller.velocity_cutoff_hz
        rate = 2.0 * np.pi * cutoff * controller.sample_time if cutoff is not None else np.inf
        cascade = controller.type == "cascade_p_pi"
        per_integral = np.array(controller.integral_gain)
        if cascade:
            per_integral *= np.array(controller.velocity_gain)
        self.law = Law(
            cascade=cascade,
            sample_time=controller.sample_time,
            position_gain=np.array(controller.position_gain),
            velocity_gain=np.array(controller.velocity_gain),
            output_per_integral=per_integral,
            feed_forward=np.array(controller.velocity_feed_forward),
            limit=np.array(controller.saturation),
            per_difference=1.0 / (controller.velocity_difference_samples * controller.sample_time),
            filter_gain=float(-np.expm1(-rate)),
            counts=np.ones(n) if counts is None else np.array(counts, dtype=np.float64),
            steps=steps,
        )
        self.memory = Memory(
            readings=np.zeros((controller.velocity_difference_samples, n)),
            velocity=np.zeros(n),
            integral=np.zeros(n),
            outputs=np.zeros((controller.delay_samples + 1, n)),
            places=np.zeros(4, dtype=np.int64),
            output=np.zeros(n),
            off=np.ones(n, dtype=np.bool_),
            counts=np.zeros(n),
            frozen=np.zeros(n, dtype=np.bool_),
            path=np.zeros((past_steps + 2 if past_steps else 1, n)),
            signals=np.zeros((past_samples + 2, n)),
            reported_counts=np.zeros(n),
            reported_signal=np.zeros(n),
        )

    def reset(self, axes: BoolArray, position: FloatArray, holding: FloatArray) -> None:
        """Puts axes into equilibrium: no velocity, and an integral that holds the arm by itself.

        A loop without integral action starts at zero output instead.

        Args:
            axes: which axes, (n,).
            position: present position readings at the drive outputs, (n,).
            holding: control signals that hold the arm still, (n,).
        """
        law, memory = self.law, self.memory
        limited = np.clip(holding, -law.limit, law.limit)
        integrating = law.output_per_integral > 0
        integral = np.zeros_like(limited)
        np.divide(limited, law.output_per_integral, out=integral, where=integrating)
        memory.readings[:, axes] = position[axes]
        memory.velocity[axes] = 0.0
        memory.integral[axes] = integral[axes]
        memory.outputs[:, axes] = np.where(integrating, limited, 0.0)[axes]
        memory.signals[:, axes] = np.where(integrating, limited, 0.0)[axes]

    def fed_forward(self, velocity: FloatArray, acceleration: FloatArray) -> FloatArray:
        """Control signal that the set-points' velocity and acceleration, (…, n), add to the loop's own."""
        return np.asarray(self._viscous * velocity + self._inertia * acceleration)

    def step(
        self,
        set_point: FloatArray,
        set_point_velocity: FloatArray,
        position: FloatArray,
        set_point_acceleration: FloatArray | None = None,
    ) -> FloatArray:
        """One sample of the loop.

        Args:
            set_point: internal set-points at the drive outputs, (n,), rad or m.
            set_point_velocity: their slopes, (n,).
            position: position readings, (n,).
            set_point_acceleration: (n,); zero where None.

        Returns:
            The control signals that the motors get from now on, (n,).
        """
        acceleration = np.zeros_like(position) if set_point_acceleration is None else set_point_acceleration
        added = self.fed_forward(set_point_velocity, acceleration)
        compiled.control(self.law, self.memory, set_point, set_point_velocity, added, position)
        return self.memory.output.copy()
