"""Arms of any kind and logs of them, made with pinocchio from the text of a URDF alone."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pinocchio

from robots.arrays import FloatArray

VISCOUS, DRY, ROTOR = 2.0, 3.0, 0.2
PERIOD = 0.002


def _link(name: str, mass: float, generator: np.random.Generator) -> str:
    center = generator.uniform(-0.08, 0.08, 3)
    a, b, c = mass * generator.uniform(0.008, 0.012, 3)
    return (
        f'<link name="{name}"><inertial><origin xyz="{center[0]} {center[1]} {center[2]}"/>'
        f'<mass value="{mass}"/>'
        f'<inertia ixx="{a}" ixy="0" ixz="0" iyy="{b}" iyz="0" izz="{c}"/></inertial></link>'
    )


def _joint(
    name: str, kind: str, ends: tuple[str, str], origin: str, axis: str, limit: float, more: str = ""
) -> str:
    limits = f'<limit lower="{-limit}" upper="{limit}" velocity="3" effort="500"/>'
    return (
        f'<joint name="{name}" type="{kind}"><origin {origin}/><parent link="{ends[0]}"/>'
        f'<child link="{ends[1]}"/><axis xyz="{axis}"/>{limits}{more}</joint>'
    )


def seven_axes() -> str:
    """A redundant arm, right angles as people write them, and a gripper of two fingers that move together."""
    generator = np.random.default_rng(7)
    turns = ["0 0 0", "-1.5708 0 0", "1.5708 0 0", "1.5708 0 0", "-1.5708 0 0", "1.5708 0 0", "1.5708 0 0"]
    places = ["0 0 0.33", "0 0 0", "0 -0.31 0", "0.08 0 0", "-0.08 0.38 0", "0 0 0", "0.09 0 0"]
    parts = ['<robot name="seven"><link name="l0"/>']
    for k, (turn, place, mass) in enumerate(zip(turns, places, (5, 4, 4, 3, 3, 2, 1), strict=True)):
        origin = f'xyz="{place}" rpy="{turn}"'
        parts.append(_joint(f"j{k + 1}", "revolute", (f"l{k}", f"l{k + 1}"), origin, "0 0 1", 2.9))
        parts.append(_link(f"l{k + 1}", mass, generator))
    for k, more in ((1, ""), (2, '<mimic joint="finger1"/>')):
        origin = 'xyz="0 0 0.1"'
        parts.append(_joint(f"finger{k}", "prismatic", ("l7", f"f{k}"), origin, "0 1 0", 0.04, more))
        parts.append(_link(f"f{k}", 0.1, generator))
    return "".join([*parts, "</robot>"])


def scara() -> str:
    generator = np.random.default_rng(8)
    parts, parent = ['<robot name="scara"><link name="l0"/>'], "l0"
    for k, (kind, place, axis, limit, mass) in enumerate(
        (
            ("revolute", "0 0 0.3", "0 0 1", 2.6, 4),
            ("revolute", "0.3 0 0", "0 0 1", 2.6, 3),
            ("prismatic", "0.25 0 0", "0 0 -1", 0.25, 2),
            ("revolute", "0 0 0", "0 0 -1", 6.0, 1),
        ),
        start=1,
    ):
        parts.append(_joint(f"a{k}", kind, (parent, f"l{k}"), f'xyz="{place}"', axis, limit))
        parts.append(_link(f"l{k}", mass, generator))
        parent = f"l{k}"
    return "".join([*parts, "</robot>"])


def gantry() -> str:
    generator = np.random.default_rng(9)
    parts, parent = ['<robot name="gantry"><link name="l0"/>'], "l0"
    for k, (axis, limit, mass) in enumerate(
        (("1 0 0", 1.0, 40), ("0 1 0", 0.6, 20), ("0 0 1", 0.3, 8)), start=1
    ):
        parts.append(_joint(f"x{k}", "prismatic", (parent, f"l{k}"), 'xyz="0 0 0"', axis, limit))
        parts.append(_link(f"l{k}", mass, generator))
        parent = f"l{k}"
    return "".join([*parts, "</robot>"])


def motion_of(
    urdf: Path, sizes: Sequence[float], seconds: float = 16.0, dry: float = DRY, seed: int = 1
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Time, positions, speeds and torques, with friction, rotors, and noise of 2 % on the torques.

    Args:
        urdf: of the arm.
        sizes: of the motion of the first joints, rad or m; the others rest at 0.
        seconds: its length.
        dry: friction, N·m or N.
        seed: of motion and noise.
    """
    model = pinocchio.buildModelFromUrdf(str(urdf))
    data, n = model.createData(), len(sizes)
    t = np.arange(int(seconds / PERIOD)) * PERIOD
    generator = np.random.default_rng(seed)
    q, v, a = (np.zeros((t.size, model.nv)) for _ in range(3))
    for j, size in enumerate(sizes):
        for h in range(1, 5):
            w, phase = 2 * np.pi * 0.15 * h * (1 + 0.06 * j), generator.uniform(0, 6.28)
            amplitude = size * generator.uniform(0.5, 1.0) / h**1.2
            q[:, j] += amplitude * np.sin(w * t + phase)
            v[:, j] += amplitude * w * np.cos(w * t + phase)
            a[:, j] -= amplitude * w**2 * np.sin(w * t + phase)
    torque = np.array([pinocchio.rnea(model, data, *row) for row in zip(q, v, a, strict=True)])[:, :n]
    torque += ROTOR * a[:, :n] + VISCOUS * v[:, :n] + dry * np.sign(v[:, :n])
    noise = generator.standard_normal((2, t.size, n))
    return t, q[:, :n] + 1e-6 * noise[0], v[:, :n], torque + 0.02 * np.std(torque, axis=0) * noise[1]
