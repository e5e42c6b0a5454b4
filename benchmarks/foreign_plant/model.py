"""An arm as MuJoCo's XML, and as a URDF, from one table."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from benchmarks.foreign_plant.arms import Arm, Link
from benchmarks.foreign_plant.effects import Effect, total
from benchmarks.foreign_plant.settings import Settings

_SLOSH_LENGTH, _SLOSH_DAMPING = 0.08, 0.002
"""m, and N·m·s/rad."""

_SPLIT = ("joint_elasticity", "backlash")
_STICKS = 'solreffriction="0.001 1" solimpfriction="0.9999 0.9999 0.001 0.5 2"'
"""MuJoCo's sticking is a soft constraint. By its defaults a wrist creeps at up to 0.15 rad/s before
it slides, and its dry friction is viscous until then; with these figures it creeps at less than 1e-5."""


@dataclass(frozen=True)
class Model:
    """MuJoCo's model and where each joint's coordinates are.

    Attributes:
        mujoco: the model.
        rotor: (n,) coordinate of each joint's rotor, which the encoder reads.
        twist: (n,) coordinate of the gear's twist, link less rotor; −1 where it is rigid.
        base: coordinate of the base's tilt; −1 where it stands still.
    """

    mujoco: mujoco.MjModel
    rotor: np.ndarray
    twist: np.ndarray
    base: int


def build(arm: Arm, settings: Settings, effects: tuple[Effect, ...] = ()) -> Model:
    """The arm with what is hidden in its bodies; forces of the other effects belong to the loop."""
    split = [any(e.name in _SPLIT and e.joint == j for e in effects) for j in range(arm.n)]
    extra = [sum(e.size for e in effects if e.name == "rotor_inertia" and e.joint == j) for j in range(arm.n)]
    soft = total(effects, "base_compliance")
    tilt = total(effects, "base_tilt")
    body = _tool(total(effects, "payload"), total(effects, "slosh"))
    for j in reversed(range(arm.n)):
        body = _body(arm.links[j], j, split[j], extra[j], body)
    if soft:
        hinge = f'<joint name="base" axis="1 0 0" stiffness="{soft}" damping="{2e-3 * soft}"/>'
        plate = '<inertial pos="0 0 0" mass="60" diaginertia="4 4 4"/>'
        body = f'<body name="plate">{hinge}{plate}{body}</body>'
    gravity = f"0 {9.81 * np.sin(tilt)} {-9.81 * np.cos(tilt)}"
    text = f"""<mujoco><compiler angle="radian" eulerseq="XYZ" inertiafromgeom="false"/>
<option timestep="{settings.step}" gravity="{gravity}" integrator="Euler" iterations="50" tolerance="1e-12">
<flag contact="disable"/></option>
<default><joint {_STICKS}/></default><worldbody>{body}</worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(text)

    def coordinate(name: str) -> int:
        joint = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name)
        return -1 if joint < 0 else int(model.jnt_dofadr[joint])

    rotor = np.array([coordinate(f"q{j + 1}") for j in range(arm.n)])
    twist = np.array([coordinate(f"twist{j + 1}") for j in range(arm.n)])
    return Model(model, rotor, twist, coordinate("base"))


def _body(link: Link, j: int, split: bool, extra: float, inside: str) -> str:
    turned = mujoco.mju_euler2Quat
    quat = np.empty(4)
    # A URDF's roll, pitch, yaw turn about fixed axes.
    turned(quat, np.array(link.rpy, dtype=np.float64), "XYZ")
    joints = f'<joint name="q{j + 1}" axis="0 0 1" armature="{link.rotor + extra}"/>'
    if split:
        joints += f'<joint name="twist{j + 1}" axis="0 0 1"/>'
    inertial = (
        f'<inertial pos="{_spaced(link.centre)}" mass="{link.mass}" diaginertia="{_spaced(link.inertia)}"/>'
    )
    return f'<body pos="{_spaced(link.origin)}" quat="{_spaced(quat)}">{joints}{inertial}{inside}</body>'


def _tool(payload: float, slosh: float) -> str:
    text = ""
    if payload:
        size = 0.4 * payload * 0.05**2
        text += (
            f'<body pos="0.01 0 0.06"><inertial pos="0 0 0" mass="{payload}"'
            f' diaginertia="{size} {size} {size}"/></body>'
        )
    if slosh:
        size = 0.1 * slosh * _SLOSH_LENGTH**2
        joints = "".join(
            f'<joint name="slosh{axis}" axis="{axis}" damping="{_SLOSH_DAMPING * slosh}"/>'
            for axis in ("1 0 0", "0 1 0")
        )
        text += (
            f'<body pos="0 0 0.05">{joints}<inertial pos="0 0 {_SLOSH_LENGTH}" mass="{slosh}"'
            f' diaginertia="{size} {size} {size}"/></body>'
        )
    return text


def urdf(arm: Arm) -> str:
    """The nominal arm's links and joints."""
    lines = [f'<?xml version="1.0"?>\n<robot name="{arm.name}">', '<link name="base"/>']
    for j, link in enumerate(arm.links, start=1):
        xx, yy, zz = link.inertia
        parent = "base" if j == 1 else f"link{j - 1}"
        lines.append(
            f'<link name="link{j}"><inertial><origin xyz="{_spaced(link.centre)}" rpy="0 0 0"/>'
            f'<mass value="{link.mass}"/><inertia ixx="{xx}" iyy="{yy}" izz="{zz}" ixy="0" ixz="0" iyz="0"/>'
            "</inertial></link>"
        )
        lines.append(
            f'<joint name="q{j}" type="revolute"><parent link="{parent}"/><child link="link{j}"/>'
            f'<origin xyz="{_spaced(link.origin)}" rpy="{_spaced(link.rpy)}"/><axis xyz="0 0 1"/>'
            f'<limit lower="{link.travel[0]}" upper="{link.travel[1]}" effort="{link.torque}"'
            f' velocity="{link.speed}"/></joint>'
        )
    return "\n".join([*lines, "</robot>\n"])


def _spaced(values: object) -> str:
    return " ".join(f"{float(value):.15g}" for value in values)  # type: ignore[attr-defined]
