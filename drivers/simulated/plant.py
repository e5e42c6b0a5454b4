"""The arm as truth: coupled axes with rotor inertia, dry and viscous friction, offsets and brakes.

With w = T q̇ at the drive outputs, T the transmission matrix and off a torque offset per joint,

    (M(q) + Tᵀ diag(Ia) T) q̈ = Tᵀ (τ − Fv∘w − dry friction − brake) − off − c(q, q̇) − g(q).

The step is semi-implicit (symplectic) Euler: velocities first, positions with the new velocities. Viscous
friction enters as the mean of old and new velocity, dry friction at the new one, so that neither limits
the step nor acts as extra inertia.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from scipy.linalg.lapack import dposv

from drivers.errors import DriveError
from drivers.simulated.brake import Brakes
from drivers.simulated.friction import Bristle
from drivers.simulated.truth import PlantTruth
from robots import Robot, rigid_body_model
from robots.arrays import BoolArray, FloatArray

STEP_RATE = 4000.0
"""Plant steps per second, rounded up so that a controller sample holds a whole number of them."""
BRAKE_RATIO = 3.0
"""Holding torque of a brake over the torque limit of its axis."""
_STANDSTILL = 1e-4
"""Drive output speed below which engaged brakes hold for good, rad/s or m/s."""


class Plant:
    """Positions and velocities of the arm, moved by drive torques.

    Args:
        robot: transmission, limits and URDF (gravity, kinematics).
        truth: inertial and friction figures; they replace those of the URDF.
        step: s.

    Raises:
        DriveError: the mass matrix of this truth is not positive definite.
    """

    def __init__(self, robot: Robot, truth: PlantTruth, step: float = 1.0 / STEP_RATE) -> None:
        self.step_time = step
        self.model = true_model(robot, truth)
        self._data = self.model.createData()
        self.transmission = robot.transmission_matrix
        self._back = np.ascontiguousarray(self.transmission.T)
        self.rotor_inertia = truth.per_drive("Ia")
        self.viscous = truth.per_drive("Fv")
        self.offset = truth.per_drive("off")
        self.position = np.array(robot.home, dtype=np.float64)
        self.velocity = np.zeros(robot.n)
        self._last_change = np.zeros(robot.n)
        width = np.array(truth.bristle_width)
        inertia = np.maximum(self.rotor_inertia, 1e-9)
        self.friction = Bristle(truth.per_drive("Fc"), width, inertia, step)
        torque_limits = np.abs(np.linalg.inv(self.transmission).T) @ robot.torque_limits
        self.brakes = Brakes(BRAKE_RATIO * torque_limits)
        self.at_rest = True
        """True where every brake is engaged and nothing moves any more."""
        self._constant_mass = self._back @ np.diag(self.rotor_inertia) @ self.transmission

    def drive_position(self) -> FloatArray:
        """Positions of the drive outputs, (n,), rad or m."""
        return np.asarray(self.transmission @ self.position)

    def drive_velocity(self) -> FloatArray:
        """Velocities of the drive outputs, (n,)."""
        return np.asarray(self.transmission @ self.velocity)

    def mass_matrix(self) -> FloatArray:
        """M(q) + Tᵀ diag(Ia) T, n × n."""
        links = pin.crba(self.model, self._data, self.position)
        return np.asarray(links + self._constant_mass)

    def holding_torque(self) -> FloatArray:
        """Torque at the drive outputs that holds the arm still without friction, (n,), N·m."""
        gravity = pin.computeGeneralizedGravity(self.model, self._data, self.position)
        return np.asarray(np.linalg.solve(self._back, gravity + self.offset))

    def energy(self) -> float:
        """Kinetic and potential energy, rotors included, J."""
        kinetic = 0.5 * self.velocity @ self.mass_matrix() @ self.velocity
        return float(kinetic + pin.computePotentialEnergy(self.model, self._data, self.position))

    def engage(self, braked: BoolArray) -> None:
        """Engages the brakes that are True and releases the others, (n,)."""
        self.brakes.engage(braked)
        self.at_rest = self.at_rest and self.brakes.all

    def step(self, drive_torque: FloatArray) -> None:
        """Moves the arm by one step under constant torques at the drive outputs, (n,), N·m.

        Raises:
            DriveError: the mass matrix is not positive definite in this posture.
        """
        if self.at_rest:
            return
        step = self.step_time
        speed = self.transmission @ self.velocity
        predicted = speed + self._last_change
        dry, slope = self.friction.linearise(predicted)
        if self.brakes.any:
            slope = slope + self.brakes.slope(speed)
        drive = drive_torque - self.viscous * speed - dry - slope * speed
        bias = pin.nonLinearEffects(self.model, self._data, self.position, self.velocity)
        damped = self.rotor_inertia + step * (0.5 * self.viscous + slope)
        mass = pin.crba(self.model, self._data, self.position) + (self._back * damped) @ self.transmission
        _, change, info = dposv(mass, step * (self._back @ drive - self.offset - bias))
        if info:
            where = self.position.round(3).tolist()
            raise DriveError(f"simulated arm: the mass matrix is not positive definite at {where}")
        self.velocity += change
        self._last_change = self.transmission @ change
        self.position += step * self.velocity
        new_speed = speed + self._last_change
        self.friction.advance(new_speed)
        if self.brakes.all:
            self._settle(new_speed)

    def _settle(self, speed: FloatArray) -> None:
        if np.abs(speed).max() < _STANDSTILL:
            self.velocity[:] = 0.0
            self._last_change[:] = 0.0
            self.friction.reset()
            self.at_rest = True


def true_model(robot: Robot, truth: PlantTruth) -> pin.Model:
    """The arm's rigid-body model with the links of ``truth`` in place of those of the URDF."""
    model = rigid_body_model(robot)
    for j in range(1, robot.n + 1):
        link = truth.link(j)
        inertia = pin.Inertia.FromDynamicParameters(link) if link[0] > 0 else pin.Inertia.Zero()
        model.inertias[j] = inertia
    return model
