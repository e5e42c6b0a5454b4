"""The arm as truth: links, drives and gears with states of their own, moved by compiled code.

The equations stand in :mod:`drivers.simulated.physics.step`, which also says at what instants velocities and
positions are.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from drivers.errors import DriveError
from drivers.simulated.physics import records
from drivers.simulated.physics.assemble import assemble, true_model
from drivers.simulated.physics.entry_points import compiled
from drivers.simulated.physics.records import SLIP_ELEMENTS, Arm, Motion
from drivers.simulated.physics.standing import gear_stretch
from drivers.simulated.physics.step import FINE
from drivers.simulated.scenario import EMPTY, Scenario
from drivers.simulated.truth import PlantTruth
from robots import Robot
from robots.arrays import BoolArray, FloatArray

STEP_RATE = 4000.0
"""Plant steps per second, rounded up so that a controller sample holds a whole number of them."""


class Plant:
    """Positions and velocities of the arm, moved by drive torques.

    Args:
        robot: transmission, limits and URDF (gravity, kinematics).
        truth: inertial and friction figures; they replace those of the URDF.
        step: s.
        scenario: what the arm has besides.

    Raises:
        DriveError: the scenario names an axis that the arm does not have, or a gear is too stiff.
    """

    def __init__(
        self,
        robot: Robot,
        truth: PlantTruth,
        step: float = 1.0 / STEP_RATE,
        scenario: Scenario = EMPTY,
    ) -> None:
        scenario.check(robot)
        self.step_time = step
        self.model = true_model(robot, truth, scenario)
        self._data = self.model.createData()
        self.arm = assemble(robot, truth, scenario, self.model, step)
        self._n = robot.n
        self._half_step = 0.5 * self.arm.step_time / self.arm.substeps
        self._described = robot.transmission_matrix
        self.motion = records.resting(
            np.array(robot.home), len(self.arm.drives), len(self.arm.base.stiffness)
        )
        self.stand(np.array(robot.home))

    @property
    def position(self) -> FloatArray:
        """Positions of the joints, (n,), rad or m; may be written to while every gear is rigid.

        Of the middle of the coming step, half a step ahead of the velocity; at rest there is no difference.
        """
        return self.motion.position

    @property
    def velocity(self) -> FloatArray:
        """Velocities of the joints, (n,); may be written to while every gear is rigid."""
        return self.motion.velocity

    @property
    def at_rest(self) -> bool:
        """Whether every brake is engaged and nothing moves any more."""
        return bool(self.motion.at_rest[0])

    @property
    def braked(self) -> BoolArray:
        """Which brakes are engaged, (n,)."""
        return self.motion.braked[: self._n].copy()

    def stand(self, position: FloatArray) -> None:
        """Puts the braked arm where its drives read this posture, at rest and cold.

        Gears that give way are wound up by gravity, so that the brakes' release starts no swing.

        Args:
            position: joint positions as the described transmission understands the drives, (n,).
        """
        drives = len(self.arm.drives)
        fresh = records.resting(position, drives, len(self.arm.base.stiffness))
        for ours, new in zip(self.motion, fresh, strict=True):
            ours[...] = new
        rotors = self._described @ position
        active = self.arm.transmission[: self._n]
        self.motion.position[:] = np.linalg.solve(active, rotors)
        for _ in range(20):
            holding = self.holding_torque()
            wound = gear_stretch(self.arm, self.motion, rotors, holding)
            self.motion.position[:] = np.linalg.solve(active, rotors - wound)
        self.motion.motors["position"] = self.arm.transmission @ self.motion.position
        self.motion.motors["position"][: self._n] = rotors
        self.motion.motors["warmth"] = self.arm.drives["start_warmth"]
        self.motion.joints["slosh_position"] = self.motion.position
        self.motion.motors["load"][: self._n] = self.holding_torque()

    def drive_position(self) -> FloatArray:
        """Positions that the encoders see: of the rotors, at the drive outputs, (n,), rad or m."""
        motors = self.motion.motors[: self._n]
        return np.asarray(motors["position"] - self._half_step * motors["velocity"])

    def joint_position(self) -> FloatArray:
        """Positions of the joints at the instant of their velocities, (n,), rad or m."""
        return np.asarray(self.motion.position - self._half_step * self.motion.velocity)

    def drive_velocity(self) -> FloatArray:
        """Velocities of the rotors at the drive outputs, (n,)."""
        return np.array(self.motion.motors["velocity"][: self._n])

    def temperature(self) -> FloatArray:
        """Warmth of the gears above that at which their figures hold, (n,), K."""
        return np.array(self.motion.motors["warmth"][: self._n])

    def mass_matrix(self) -> FloatArray:
        """M(q) + Tᵀ diag(Ia) T of links and of the drives that move rigidly with them, n × n."""
        compiled.posture(self.arm, self.motion)
        rigid = np.where(self.arm.drives["compliant"] == 0, self.arm.drives["inertia"], 0.0)
        matrix = self.arm.transmission
        return np.asarray(self.motion.mass + (matrix.T * rigid) @ matrix)

    def holding_torque(self) -> FloatArray:
        """Torque at the drive outputs that holds the arm still without friction, (n,), N·m."""
        moving = self.motion.velocity.copy()
        self.motion.velocity[:] = 0.0
        compiled.static_loads(self.arm, self.motion)
        self.motion.velocity[:] = moving
        active = self.arm.transmission[: self._n]
        return np.asarray(np.linalg.solve(active.T, self.motion.loads))

    def energy(self) -> float:
        """Kinetic and potential energy, rotors, gears and springs included, J."""
        kinetic = 0.5 * self.velocity @ self.mass_matrix() @ self.velocity
        soft = self.arm.drives["compliant"] != 0
        kinetic += 0.5 * np.sum(
            (self.arm.drives["inertia"] * np.square(self.motion.motors["velocity"]))[soft]
        )
        gravity = pin.computePotentialEnergy(self.model, self._data, self.position)
        return float(kinetic + gravity + stored_in_gears(self.arm, self.motion)) + stored_in_joints(
            self.arm, self.motion
        )

    def engage(self, braked: BoolArray) -> None:
        """Engages the brakes that are True and releases the others, (n,)."""
        self.motion.braked[: self._n] = braked
        self.motion.braked[self._n :] = braked.all()
        self.motion.at_rest[0] = self.motion.at_rest[0] and bool(braked.all())

    def step(self, drive_torque: FloatArray) -> None:
        """Moves the arm by one step under constant torques at the drive outputs, (n,), N·m.

        Raises:
            DriveError: the mass matrix is not positive definite in this posture.
        """
        self.require_fine(
            compiled.plant_step(self.arm, self.motion, np.asarray(drive_torque, dtype=np.float64))
        )

    def require_fine(self, state: int) -> None:
        """Raises DriveError where compiled code ended with a mass matrix that is not positive definite."""
        if state != FINE:
            where = self.position.round(3).tolist()
            raise DriveError(f"simulated arm: the mass matrix is not positive definite at {where}")


def stored_in_gears(arm: Arm, motion: Motion) -> float:
    """Potential energy of the gears' springs and slip elements."""
    drives = arm.drives
    stretch = motion.motors["stretch"]
    x = stretch - np.clip(stretch, -drives["gap"], drives["gap"])
    springs = 0.5 * drives["stiffness"] * x**2 + 0.25 * drives["cubic_stiffness"] * x**4
    elements = 0.5 * drives["slip_stiffness"] / SLIP_ELEMENTS * np.square(motion.slip).sum(axis=1)
    dragged = 0.5 * drives["drag_stiffness"] / SLIP_ELEMENTS * np.square(motion.dragged).sum(axis=1)
    return float(np.sum((springs + elements)[drives["compliant"] != 0]) + dragged.sum())


def stored_in_joints(arm: Arm, motion: Motion) -> float:
    """Energy of springs, cables, walls and swinging masses at the joints, and of the constant offsets."""
    j, q, s = arm.joints, motion.position, motion.joints
    energy = j["offset"] * q + 0.5 * j["torsion_stiffness"] * (q - j["torsion_centre"]) ** 2
    x = q - j["cable_centre"]
    energy += 0.5 * j["cable_stiffness"] * x**2 + 0.25 * j["cable_cubic"] * x**4
    into_upper = np.maximum(q - j["wall_upper"], 0.0)
    into_lower = np.maximum(j["wall_lower"] - q, 0.0)
    energy += 0.5 * j["wall_stiffness"] * (into_upper**2 + into_lower**2)
    energy += 0.5 * j["slosh_inertia"] * s["slosh_velocity"] ** 2
    energy += 0.5 * j["slosh_stiffness"] * (q - s["slosh_position"]) ** 2
    fixed, moving = j["spring_fixed_radius"], j["spring_moving_radius"]
    turned = 2.0 * fixed * moving * (1.0 - np.cos(q - j["spring_angle"]))
    length = np.sqrt((fixed - moving) ** 2 + turned + 1e-12)
    energy += 0.5 * j["spring_stiffness"] * (length - j["spring_length"]) ** 2
    return float(energy.sum())
