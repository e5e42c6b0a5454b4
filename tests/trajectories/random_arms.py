"""Arms of random size, shape, joints, limits and drives, as descriptions on disk."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from robots import load
from robots.description import Robot


def random_arm(folder: Path, seed: int) -> Robot:
    """An arm of two to five links; one in five joints slides, some drives are coupled."""
    generator = np.random.default_rng(seed)
    n = int(generator.integers(2, 6))
    kinds = ["prismatic" if generator.random() < 0.2 else "revolute" for _ in range(n)]
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "arm.urdf").write_text(_urdf(generator, kinds), encoding="utf-8")
    (folder / "robot.toml").write_text(_toml(generator, kinds), encoding="utf-8")
    return load(folder)


def _urdf(generator: np.random.Generator, kinds: list[str]) -> str:
    lines = ['<robot name="arm">', '<link name="base"/>']
    for k, kind in enumerate(kinds, start=1):
        x, y, z = generator.uniform(-0.4, 0.4, 3)
        roll, pitch = generator.choice([0.0, np.pi / 2, -np.pi / 2], 2)
        axis = generator.permutation(["1 0 0", "0 1 0", "0 0 1"])[0]
        mass = generator.uniform(0.5, 5.0)
        size = mass * 0.01
        lines.append(
            f'<link name="link_{k}"><inertial><origin xyz="{x / 2} {y / 2} {z / 2}"/><mass value="{mass}"/>'
            f'<inertia ixx="{size}" iyy="{size}" izz="{size}" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        )
        lines.append(
            f'<joint name="joint_{k}" type="{kind}"><parent link="{"base" if k == 1 else f"link_{k - 1}"}"/>'
            f'<child link="link_{k}"/><origin xyz="{x} {y} {z}" rpy="{roll} {pitch} 0"/><axis xyz="{axis}"/>'
            '<limit lower="-3" upper="3" velocity="20" effort="5000"/></joint>'
        )
    return "\n".join([*lines, "</robot>"])


def _toml(generator: np.random.Generator, kinds: list[str]) -> str:
    n = len(kinds)
    transmission = np.eye(n)
    if n > 2 and generator.random() < 0.5:
        transmission[n - 1, n - 2] = 1.0
    lines = [
        'format = 1\nname = "arm"\ndescription = "random"\nurdf = "arm.urdf"',
        f"home = {[0.0] * n}",
        f"transmission = {transmission.tolist()}",
    ]
    for k, kind in enumerate(kinds, start=1):
        reach = generator.uniform(0.5, 2.5)
        lines.append(
            f'[[joint]]\nname = "joint_{k}"\nkind = "{kind}"\nposition = [{-reach}, {reach * 0.9}]\n'
            f"velocity = {generator.uniform(0.5, 6.0)}\nacceleration = {generator.uniform(3.0, 40.0)}\n"
            f"jerk = {generator.uniform(50.0, 2000.0)}\ntorque = 2000.0"
        )
    lines.extend(
        f"[[drive]]\nnode_id = {k}\nencoder_counts = 4096\ngear = 30.0\ngain = 10.0\n"
        "gain_relative_uncertainty = 0.02\n"
        "control_signal = { index = 0x6077, subindex = 0, per_count = 0.01 }\n"
        "dynamics = { inertia = 0.1, viscous = 1.0, coulomb = 2.0 }"
        for k in range(1, n + 1)
    )
    lines.append(
        f'[controller]\ntype = "pd"\nsample_time = 0.001\nposition_gain = {[20000.0] * n}\n'
        f"velocity_gain = {[5.0] * n}\nintegral_gain = {[0.0] * n}\n"
        f"velocity_feed_forward = {[0.0] * n}\nsaturation = {[300.0] * n}\n"
        "[bus]\ncycle_time = 0.002\n"
        "[identification]\ncutoff_hz = 20.0\ndecimation = 2\ntrim_samples = [10, 10]\n"
    )
    return "\n".join(lines)
