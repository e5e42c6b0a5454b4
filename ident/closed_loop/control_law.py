"""The drives' position loop as difference equations (eq. 4 with sampling, filter, delay, saturation)."""

from __future__ import annotations

from collections import deque

import numpy as np

from robots.arrays import FloatArray
from robots.description import Controller


def fed_forward(controller: Controller, speeds: FloatArray, accelerations: FloatArray) -> FloatArray:
    """Control signal fed forward at each sample, (samples, n), or (0, n) where the gains are all zero.

    Args:
        controller: has the gains.
        speeds, accelerations: (samples, n) of the set-points at the drive outputs.
    """
    n = speeds.shape[1]
    viscous = np.array(controller.friction_feed_forward or (0.0,) * n)
    inertia = np.array(controller.acceleration_feed_forward or (0.0,) * n)
    if not (viscous.any() or inertia.any()):
        return np.empty((0, n))
    return np.asarray(viscous * speeds + inertia * accelerations)


class ControlLaw:
    """The sampled controller of all drives, at the drive outputs.

    One call of :meth:`step` is one controller sample; the state is the velocity filter, the integral and
    the outputs on their way.
    """

    def __init__(
        self,
        controller: Controller,
        position: FloatArray,
        control_signal: FloatArray,
        velocity: FloatArray | None = None,
    ) -> None:
        """Start at a drive position (n,) while the drives put out ``control_signal`` (n,).

        ``velocity`` (n,) is that of the drives; without it they are at rest.
        """
        velocity = np.zeros_like(position) if velocity is None else velocity
        self._controller = controller
        self._position_gain = np.array(controller.position_gain)
        self._velocity_gain = np.array(controller.velocity_gain)
        self._integral_gain = np.array(controller.integral_gain)
        self._feed_forward = np.array(controller.velocity_feed_forward)
        self._limit = np.array(controller.saturation)
        reach = controller.velocity_difference_samples
        steps = controller.sample_time * np.arange(-reach, 0)
        self._past = deque([position + step * velocity for step in steps], maxlen=reach)
        self._velocity = velocity.copy()
        self._integral: FloatArray | None = None
        self._start_signal = control_signal.copy()
        self._coming = deque(control_signal.copy() for _ in range(controller.delay_samples))
        cutoff = controller.velocity_cutoff_hz
        self._smoothing = (
            1.0 if cutoff is None else 1.0 - float(np.exp(-2 * np.pi * cutoff * controller.sample_time))
        )

    def step(
        self,
        reference: FloatArray,
        reference_velocity: FloatArray,
        position: FloatArray,
        added: FloatArray | None = None,
    ) -> FloatArray:
        """Control signal (n,) that acts from now on, given set-point and position at the drive outputs.

        ``added`` (n,) is what :func:`fed_forward` adds to it, if anything.
        """
        velocity = self._measured_velocity(position)
        proportional, rate = self._errors(reference - position, reference_velocity, velocity)
        output = self._integrate(proportional if added is None else proportional + added, rate)
        self._coming.append(output)
        return self._coming.popleft()

    def _measured_velocity(self, position: FloatArray) -> FloatArray:
        span = len(self._past) * self._controller.sample_time
        raw = (position - self._past[0]) / span
        self._past.append(position.copy())
        self._velocity = self._velocity + self._smoothing * (raw - self._velocity)
        return self._velocity

    def _errors(
        self, error: FloatArray, reference_velocity: FloatArray, velocity: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """The output without integral, and the rate at which the integral's output grows."""
        if self._controller.type == "cascade_p_pi":
            speed_error = self._position_gain * error + self._feed_forward * reference_velocity - velocity
            proportional = self._velocity_gain * speed_error
            return proportional, self._integral_gain * proportional
        damping = self._velocity_gain * (self._feed_forward * reference_velocity - velocity)
        return self._position_gain * error + damping, self._integral_gain * error

    def _integrate(self, proportional: FloatArray, rate: FloatArray) -> FloatArray:
        if self._integral is None:
            # At rest the integral holds whatever the proportional part does not.
            self._integral = np.where(self._integral_gain > 0, self._start_signal - proportional, 0.0)
        wanted = proportional + self._integral
        output = np.clip(wanted, -self._limit, self._limit)
        growing = (wanted != output) & (np.sign(rate) == np.sign(wanted))
        self._integral = self._integral + np.where(growing, 0.0, rate * self._controller.sample_time)
        return output
