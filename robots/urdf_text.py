"""The canonical text of a URDF: what was read of it and nothing else, every value written out.

It is what Pinocchio and coal are given, and what an arm's identity is made of: white space, comments, order
of links, ``<visual>`` and spelling of numbers make no difference; every figure of the motion, the masses and
the collision bodies does.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from robots.urdf import FIXED, LIMITS, Pose, Urdf, UrdfBody, UrdfInertial, UrdfJoint

_ENTITIES = str.maketrans(
    {"&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;", "\n": "&#10;", "\r": "&#13;", "\t": "&#9;"}
)

_TENSOR = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")

Naming = Callable[[UrdfBody], str]
"""What stands for a mesh: its file for a reader, its content's checksum for an identity."""


def urdf_text(urdf: Urdf, mesh: Naming, *, inertias: bool = True, bodies: bool = True) -> str:
    """The whole of a URDF as text.

    Args:
        urdf: as read.
        mesh: what is written as a mesh's file name.
        inertias: whether the links have their ``<inertial>``.
        bodies: whether they have their ``<collision>`` bodies.
    """
    parts = [f"<robot name={quoted(urdf.name)}>"]
    for link in sorted(urdf.links, key=lambda link: link.name):
        parts += [f"<link name={quoted(link.name)}>"]
        parts += [inertial_text(link.inertial)] if inertias and link.inertial is not None else []
        parts += [body_text(body, mesh) for body in link.bodies] if bodies else []
        parts += ["</link>"]
    parts += [joint_text(joint) for joint in sorted(urdf.joints, key=lambda joint: joint.name)]
    return "\n".join([*parts, "</robot>\n"])


def quoted(text: str) -> str:
    """The value of an attribute; ``xml.sax.saxutils`` loads all of ``urllib`` and TLS to write one."""
    return f'"{text.translate(_ENTITIES)}"'


def inertial_text(inertial: UrdfInertial) -> str:
    """``<inertial>``."""
    tensor = " ".join(f'{name}="{_one(v)}"' for name, v in zip(_TENSOR, inertial.tensor, strict=True))
    mass = f'<mass value="{_one(inertial.mass)}"/>'
    return f"<inertial>{_origin(inertial.pose)}{mass}<inertia {tensor}/></inertial>"


def body_text(body: UrdfBody, mesh: Naming) -> str:
    """``<collision>``."""
    if body.shape == "mesh":
        shape = f'<mesh filename={quoted(mesh(body))} scale="{_all(body.size)}"/>'
    elif body.shape == "cylinder":
        shape = f'<cylinder radius="{_one(body.size[0])}" length="{_one(body.size[1])}"/>'
    elif body.shape == "box":
        shape = f'<box size="{_all(body.size)}"/>'
    else:
        shape = f'<sphere radius="{_one(body.size[0])}"/>'
    return f"<collision>{_origin(body.pose)}<geometry>{shape}</geometry></collision>"


def joint_text(joint: UrdfJoint) -> str:
    """``<joint>``."""
    moves = ""
    if joint.kind != FIXED:
        limits = " ".join(f'{name}="{_one(joint.limits[name])}"' for name in LIMITS)
        moves = f'<axis xyz="{_all(joint.axis)}"/><limit {limits}/>'
    return (
        f'<joint name={quoted(joint.name)} type="{joint.kind}">{_origin(joint.pose)}'
        f"<parent link={quoted(joint.parent)}/><child link={quoted(joint.child)}/>{moves}</joint>"
    )


def _origin(pose: Pose) -> str:
    return f'<origin xyz="{_all(pose.xyz)}" rpy="{_all(pose.rpy)}"/>'


def _all(values: Iterable[float]) -> str:
    return " ".join(_one(value) for value in values)


def _one(value: float) -> str:
    """The shortest text that reads back as the same number; -0 is 0."""
    return repr(value + 0.0)
