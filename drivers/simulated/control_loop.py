"""The position loop inside the drives (eq. 4 of the paper), all axes at once.

One step is taken every ``sample_time``. With e = set-point − position, both at the drive output:

- q̇[k] = (q[k] − q[k−N]) / (N·T), then, where a cut-off f is given, the first-order low-pass
  y[k] = y[k−1] + (1 − exp(−2π f T))·(q̇[k] − y[k−1]);
- ``cascade_p_pi``: u = Kp·e + ff·q̇_r − q̇ and v = Kv·(u + Ki·I), I[k] = I[k−1] + T·u[k−1];
- ``pd``: v = Kp·e + Kv·(ff·q̇_r − q̇);  ``pid``: the same + Ki·I with I[k] = I[k−1] + T·e[k−1];
- v is limited to ±saturation; the integral does not grow further into the limit (conditional integration);
- the output of step k reaches the motor at step k + delay_samples.

q̇_r is the slope of the set-point over the present SYNC period.
"""

from __future__ import annotations

import numpy as np

from robots.arrays import BoolArray, FloatArray
from robots.description import Controller


class ControlLoop:
    """State and law of the position loops of n drives.

    Args:
        controller: type, gains and timing from the arm's description.
    """

    def __init__(self, controller: Controller) -> None:
        n = len(controller.position_gain)
        self._type = controller.type
        self._sample_time = controller.sample_time
        self._position_gain = np.array(controller.position_gain)
        self._velocity_gain = np.array(controller.velocity_gain)
        self._integral_gain = np.array(controller.integral_gain)
        self._feed_forward = np.array(controller.velocity_feed_forward)
        self._limit = np.array(controller.saturation)
        samples = controller.velocity_difference_samples
        self._per_difference = 1.0 / (samples * controller.sample_time)
        self._positions = np.zeros((samples, n))
        self._oldest = 0
        cutoff = controller.velocity_cutoff_hz
        rate = 2.0 * np.pi * cutoff * controller.sample_time if cutoff is not None else np.inf
        self._filter_gain = float(-np.expm1(-rate))
        self._velocity = np.zeros(n)
        self._integral = np.zeros(n)
        self._outputs = np.zeros((controller.delay_samples + 1, n))
        self._next_output = 0
        per_integral = self._integral_gain.copy()
        if self._type == "cascade_p_pi":
            per_integral *= self._velocity_gain
        self._output_per_integral = per_integral

    def reset(self, axes: BoolArray, position: FloatArray, holding: FloatArray) -> None:
        """Puts axes into equilibrium: no velocity, and an integral that holds the arm by itself.

        A loop without integral action starts at zero output instead.

        Args:
            axes: which axes, (n,).
            position: present position readings at the drive outputs, (n,).
            holding: control signals that hold the arm still, (n,).
        """
        limited = np.clip(holding, -self._limit, self._limit)
        integrating = self._output_per_integral > 0
        integral = np.zeros_like(limited)
        np.divide(limited, self._output_per_integral, out=integral, where=integrating)
        self._positions[:, axes] = position[axes]
        self._velocity[axes] = 0.0
        self._integral[axes] = integral[axes]
        self._outputs[:, axes] = np.where(integrating, limited, 0.0)[axes]

    def step(self, set_point: FloatArray, set_point_velocity: FloatArray, position: FloatArray) -> FloatArray:
        """One sample of the loop.

        Args:
            set_point: internal set-points at the drive outputs, (n,), rad or m.
            set_point_velocity: their slopes, (n,).
            position: position readings, (n,).

        Returns:
            The control signals that the motors get from now on, (n,).
        """
        velocity = self._measure_velocity(position)
        error = set_point - position
        rate_error = self._feed_forward * set_point_velocity - velocity
        if self._type == "cascade_p_pi":
            error = self._position_gain * error + rate_error
            proportional = self._velocity_gain * error
        else:
            proportional = self._position_gain * error + self._velocity_gain * rate_error
        wanted = proportional + self._output_per_integral * self._integral
        output = np.minimum(np.maximum(wanted, -self._limit), self._limit)
        winding_up = (wanted - output) * error > 0.0
        self._integral = self._integral + np.where(winding_up, 0.0, self._sample_time * error)
        return self._delayed(output)

    def _measure_velocity(self, position: FloatArray) -> FloatArray:
        difference = (position - self._positions[self._oldest]) * self._per_difference
        self._positions[self._oldest] = position
        self._oldest = (self._oldest + 1) % len(self._positions)
        self._velocity = self._velocity + self._filter_gain * (difference - self._velocity)
        return self._velocity

    def _delayed(self, output: FloatArray) -> FloatArray:
        self._outputs[self._next_output] = output
        self._next_output = (self._next_output + 1) % len(self._outputs)
        return np.array(self._outputs[self._next_output])
