"""Commissioning of six foreign drives with an arm behind them, from the command line, as a program.

Device, slave and a folder are its arguments; it is started by test_foreign_slave.py. The slaves turn a plant
of their own (``foreign_slave/src/plant.rs``): loops as described, inertia, dry friction, the gravity of the
links. The figures of the description are written for them here; what they make of them is theirs. The answer
is one JSON line.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any

import can
import numpy as np
import pinocchio

import robots
from drivers import Channel
from robots import Robot, rigid_body_model
from tests.drivers.foreign_drives import slaves, wait_for

COUNTS = (360_000.0, 1_000_000.0, 1_000_000.0, 360_000.0, 720_000.0, 360_000.0)
"""6092 of the slaves: position units per turn of the output."""
TOOL, LOAD = 6, 20.0
"""The link that carries it, and kg."""
MOVED = 0.02
"""rad of the fourth drive: the run is under way."""


def described(folder: Path) -> Robot:
    """The TX40 with these drives, as a folder that somebody would write."""
    shutil.copytree(Path(robots.__file__).parent / "tx40", folder)
    file = folder / "robot.toml"
    lines, counts = [], iter(COUNTS)
    for line in file.read_text("utf-8").splitlines():
        key = line.partition(" =")[0]
        if key == "encoder_counts":
            lines.append("encoder_counts = 4096")
        elif key == "gear":
            lines += ["gear = 100.0", f"counts_per_output_turn = {next(counts)}"]
        else:
            lines.append(line)
    file.write_text("\n".join(lines) + "\n", "utf-8")
    return robots.load(folder)


def write_plant(robot: Robot, path: Path, load: float = 0.0) -> Path:
    """Numbers of the arm for the slaves: links, coupling, drives, and kg of an undescribed load."""
    model = rigid_body_model(robot)
    numbers: list[Any] = [robot.n, robot.gravity]
    placed = zip(model.joints, model.jointPlacements, model.inertias, strict=True)
    for number, (joint, place, body) in enumerate(placed):
        if number == 0:
            continue  # the world
        turned = joint.createData()
        joint.calc(turned, np.full(model.nq, np.pi / 2), np.zeros(model.nv))
        mass = body.mass + (load if number == TOOL else 0.0)
        numbers += [place.rotation, place.translation, turned.S[3:], mass, body.lever]
    to_joints = np.linalg.inv(robot.transmission_matrix)
    home = np.array(robot.home)
    inertia = to_joints.T @ pinocchio.crba(model, model.createData(), home) @ to_joints
    start = robot.transmission_matrix @ home
    numbers.append(to_joints)
    law = robot.controller
    for k, drive in enumerate(robot.drive):
        units = drive.sign * (drive.counts_per_output_turn or 0.0) / (2 * np.pi)
        numbers += [units, law.position_gain[k], law.velocity_gain[k], law.integral_gain[k]]
        numbers += [
            law.velocity_feed_forward[k],
            law.saturation[k],
            drive.gain,
            drive.control_signal.per_count,
        ]
        friction = drive.dynamics
        numbers += [inertia[k, k] + friction.inertia, friction.viscous, friction.coulomb, start[k]]
    flat = [float(number) for part in numbers for number in np.ravel(part)]
    path.write_text(" ".join(map(repr, flat)), "ascii")
    return path


def armhil(*words: str) -> dict[str, Any]:
    """Exit code, JSON and last lines of a call."""
    done = subprocess.run([sys.executable, "-m", "daq", *words], capture_output=True, text=True, check=False)
    answer: dict[str, Any] = {"code": done.returncode, "told": done.stderr.strip().splitlines()[-12:]}
    with suppress(json.JSONDecodeError):
        answer["json"] = json.loads(done.stdout)
    return answer


def killed_in_motion(
    running: list[subprocess.Popen[bytes]], device: str, words: Iterable[str]
) -> dict[str, Any]:
    """A run in which the fourth drive dies as soon as it has moved."""
    bus = can.Bus(interface="socketcan", channel=device)
    command = subprocess.Popen(
        [sys.executable, "-m", "daq", *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    first, far = None, MOVED * COUNTS[3] / (2 * np.pi)
    while command.poll() is None:
        frame = bus.recv(0.1)
        if frame is None or frame.arbitration_id != 0x184:
            continue
        at = int.from_bytes(frame.data[2:6], "little", signed=True)
        first = at if first is None else first
        if abs(at - first) > far:
            running[3].kill()
            break
    bus.shutdown()
    out, err = command.communicate()
    return {"code": command.returncode, "told": err.strip().splitlines()[-12:], "out": out[-3000:]}


def main(device: str, program: str, folder: Path) -> None:
    """An arm that is not as described; and one that is, from the doctor to a run that loses a drive."""
    arm = folder / "arm"
    robot = described(arm)
    nodes = range(1, robot.n + 1)
    bus = ["--interface", "socketcan", "--channel", device]
    stands = ["--stands-at", ",".join(map(str, robot.home))]
    commission = ["commission", str(arm), *bus, "--move", "--yes", "--looked", "--json"]
    commission += ["--duration", "3", "--periods", "1", "--evaluations", "100", "--out"]
    answer = dict[str, Any]()

    own_memory(folder / "loaded")
    with slaves(program, device, nodes, str(write_plant(robot, folder / "loaded.txt", LOAD))):
        wait_for(Channel("socketcan", device), robot.n)
        answer["loaded"] = armhil(*commission, str(folder / "loaded"), *stands)

    own_memory(folder / "right")
    with slaves(program, device, nodes, str(write_plant(robot, folder / "right.txt"))) as running:
        wait_for(Channel("socketcan", device), robot.n)
        answer["doctor"] = armhil("doctor", str(arm), *bus, "--json")
        answer["locked"] = armhil("jog", str(arm), "--joint", "1", "--by", "1deg", *bus, "--yes")
        answer["home"] = armhil("home", str(arm), *bus, *stands, "--json")
        answer["commission"] = armhil(*commission, str(folder / "right"))
        motion = str(folder / "right" / "tx40.trajectory.json")
        run = ["run", str(arm), motion, "--approach", *bus, "--yes", "--json", "--out"]
        answer["run"] = armhil(*run, str(folder / "run"))
        answer["killed"] = killed_in_motion(running, device, [*run, str(folder / "killed")])
        answer["after"] = armhil(*run, str(folder / "after"))
    sys.stdout.write(json.dumps(answer) + "\n")


def own_memory(folder: Path) -> None:
    """Catalogue and locks of the commands that follow."""
    os.environ |= {"ARMHIL_CATALOGUE": str(folder / "catalogue.db"), "ARMHIL_STATE": str(folder / "state")}


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], Path(sys.argv[3]))
