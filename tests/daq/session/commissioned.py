"""An arm that has passed commissioning, as the catalogue knows it, without driving it through every stage."""

from __future__ import annotations

from dataclasses import replace

from daq.catalogue import arms, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.identity import identity_of_arm
from daq.catalogue.values import Arm, ArmIdentity
from daq.session.admission import SPEED
from daq.session.stages import STAGES, StageName, fingerprint
from drivers.simulated.group import serial_number
from robots import Robot

SHA256 = "a" * 64


def real_identity(robot: Robot, seed: int) -> ArmIdentity:
    """Of the simulated arm of a seed on a bus where nobody says that it is simulated."""
    serials = tuple(serial_number(robot, seed, axis) for axis in range(robot.n))
    return replace(identity_of_arm(robot), serials=serials)


def commissioned(
    identity: ArmIdentity,
    *,
    trajectory_sha256: str = SHA256,
    cell_sha256: str = "",
    until: StageName = "full run",
    speed: float = 1.0,
) -> Arm:
    """Keep a pass of every stage up to one."""
    with Catalogue() as catalogue:
        for stage in STAGES[: STAGES.index(until) + 1]:
            facts = {**fingerprint(identity, trajectory_sha256, cell_sha256), SPEED: f"{speed:g}"}
            run = runs.begin(catalogue, identity, "commission", stage=stage, facts=facts)
            runs.finish(catalogue, run.id, "completed")
        return arms.register(catalogue, identity)
