"""What a URDF may say, element by element: anything else is a slip of the pen, and is refused.

A reader that takes a default for what it does not understand (a comma in a number, ``<colision>``,
``raduis``) drops a body from the collision check without a word. So every element that matters is checked
here before any library sees it: known children and attributes only, numbers as numbers, each within what an
arm can be.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite, pi
from pathlib import Path

from robots.errors import RobotFileError, shown
from robots.nearest import did_you_mean
from robots.urdf_elements import Element

_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_NAME = re.compile(r"[^\s<>&\"'](?:[^<>&\"'\t\r\n]*[^\s<>&\"'])?")

FARTHEST = 20.0
"""m; no part of an arm is farther from its neighbour, and none is larger."""
THINNEST = 1e-3
"""m; a collision body that is thinner is a slip of the pen: it watches nothing."""
LARGEST_ANGLE = 2 * pi
"""rad; an orientation beyond one turn is one in degrees."""


@dataclass(frozen=True)
class Numbers:
    """So many numbers, each within bounds."""

    count: int
    low: float
    high: float

    @property
    def allowed(self) -> str:
        """In words."""
        what = "a number" if self.count == 1 else f"{self.count} numbers with spaces between them, each"
        return f"{what} from {self.low:.6g} to {self.high:.6g}"


NAME = "name"
TEXT = "text"
Values = Numbers | str


@dataclass(frozen=True)
class Rule:
    """What one element may hold.

    Attributes:
        attributes: what each one is: numbers, a name, or any text.
        required: attributes that must be there.
        children: how often each may be there: ``1`` exactly once, ``?`` at most once, ``*`` any number.
        one_of: children of which exactly one must be there.
        ignored: children that say nothing of the arm's bodies and motion; what is in them is not read.
    """

    attributes: Mapping[str, Values] = field(default_factory=dict)
    required: tuple[str, ...] = ()
    children: Mapping[str, str] = field(default_factory=dict)
    one_of: tuple[str, ...] = ()
    ignored: tuple[str, ...] = ()

    @property
    def tags(self) -> tuple[str, ...]:
        """All children that may be there."""
        return (*self.children, *self.one_of, *self.ignored)


_SIZE = (THINNEST, FARTHEST)
_TENSOR = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
_LIMITS = {
    "lower": Numbers(1, -100.0, 100.0),
    "upper": Numbers(1, -100.0, 100.0),
    "velocity": Numbers(1, 1e-4, 100.0),
    "effort": Numbers(1, 1e-3, 1e6),
}

RULES: Mapping[str, Rule] = {
    "robot": Rule(
        attributes={"name": NAME, "version": TEXT},
        required=("name",),
        children={"link": "*", "joint": "*"},
        ignored=("material", "transmission", "gazebo", "ros2_control", "sensor", "mujoco"),
    ),
    "link": Rule(
        attributes={"name": NAME},
        required=("name",),
        children={"inertial": "?", "collision": "*"},
        ignored=("visual",),
    ),
    "inertial": Rule(children={"origin": "?", "mass": "1", "inertia": "1"}),
    "collision": Rule(attributes={"name": TEXT}, children={"origin": "?", "geometry": "1"}),
    "joint": Rule(
        attributes={"name": NAME, "type": TEXT},
        required=("name", "type"),
        children={"origin": "?", "parent": "1", "child": "1", "axis": "?", "limit": "?"},
        ignored=("dynamics", "safety_controller", "calibration"),
    ),
    "geometry": Rule(one_of=("box", "cylinder", "sphere", "mesh")),
    "origin": Rule(
        attributes={
            "xyz": Numbers(3, -FARTHEST, FARTHEST),
            "rpy": Numbers(3, -LARGEST_ANGLE, LARGEST_ANGLE),
        }
    ),
    "axis": Rule(attributes={"xyz": Numbers(3, -1.001, 1.001)}, required=("xyz",)),
    "mass": Rule(attributes={"value": Numbers(1, 1e-6, 1e4)}, required=("value",)),
    "inertia": Rule(attributes=dict.fromkeys(_TENSOR, Numbers(1, -1e6, 1e6)), required=_TENSOR),
    "limit": Rule(attributes=_LIMITS),
    "parent": Rule(attributes={"link": NAME}, required=("link",)),
    "child": Rule(attributes={"link": NAME}, required=("link",)),
    "box": Rule(attributes={"size": Numbers(3, *_SIZE)}, required=("size",)),
    "cylinder": Rule(
        attributes={"radius": Numbers(1, *_SIZE), "length": Numbers(1, *_SIZE)},
        required=("radius", "length"),
    ),
    "sphere": Rule(attributes={"radius": Numbers(1, *_SIZE)}, required=("radius",)),
    "mesh": Rule(attributes={"filename": TEXT, "scale": Numbers(3, 1e-6, 1e3)}, required=("filename",)),
}


def check_elements(root: Element, file: Path) -> None:
    """Check every element that matters.

    Raises:
        RobotFileError: the first that is not as it may be, with file and line.
    """
    if root.tag != "robot":
        raise RobotFileError(
            file, f"<{root.tag}> is not a URDF", line=root.line, allowed="<robot> at the top"
        )
    pending = [root]
    while pending:
        element = pending.pop()
        rule = RULES[element.tag]
        _check_attributes(element, rule, file)
        _check_children(element, rule, file)
        _check_text(element, file)
        pending += [child for child in reversed(element.children) if child.tag not in rule.ignored]


def numbers(element: Element, name: str) -> tuple[float, ...]:
    """The numbers of an attribute that has been checked."""
    return tuple(float(part) for part in element.attributes[name].split())


def _check_attributes(element: Element, rule: Rule, file: Path) -> None:
    for name, text in element.attributes.items():
        if element.tag == "robot" and (name == "xmlns" or name.startswith("xmlns:")):
            continue
        if name not in rule.attributes:
            hint = did_you_mean(name, tuple(rule.attributes))
            raise RobotFileError(
                file,
                f"{shown(text)} is given to an attribute that does not exist{hint}",
                line=element.line,
                key=f"<{element.tag} {name}>",
                allowed=", ".join(rule.attributes) or "no attribute",
            )
        _check_value(element, name, rule.attributes[name], file)
    for name in rule.required:
        if name not in element.attributes:
            raise _error(element, f'<{element.tag}> has no {name}="…"', file, _words(rule.attributes[name]))


def _check_value(element: Element, name: str, values: Values, file: Path) -> None:
    text = element.attributes[name]
    if isinstance(values, Numbers):
        parts = text.split()
        fits = len(parts) == values.count and all(_is_within(part, values) for part in parts)
        if not fits:
            what = "a number" if values.count == 1 else f"{values.count} numbers"
            readable = len(parts) == values.count and all(_NUMBER.fullmatch(part) for part in parts)
            problem = f"{shown(text)} is {'out of range' if readable else f'not {what}'}"
        allowed = values.allowed
    else:
        fits = bool(text.strip()) if values == TEXT else _NAME.fullmatch(text) is not None
        problem = f"{shown(text)} is not a {values}"
        allowed = _words(values)
    if not fits:
        key = f"<{element.tag} {name}>"
        raise RobotFileError(file, problem, line=element.line, key=key, allowed=allowed)


def _is_within(part: str, values: Numbers) -> bool:
    """As a number is written in XML: neither a comma nor ``1_000``, ``0x10``, ``nan`` or ``inf``."""
    if _NUMBER.fullmatch(part) is None:
        return False
    value = float(part)
    return isfinite(value) and values.low <= value <= values.high


def _check_children(element: Element, rule: Rule, file: Path) -> None:
    for child in element.children:
        if child.tag not in rule.tags:
            raise _unknown(child, element, rule, file)
    for tag, often in rule.children.items():
        found = element.of(tag)
        if often == "1" and not found:
            raise _error(element, f"<{element.tag}> has no <{tag}>", file, f"one <{tag}>")
        if often in "1?" and len(found) > 1:
            raise _error(found[1], f"<{element.tag}> has a second <{tag}>", file, f"one <{tag}>")
    if rule.one_of:
        found = [child for child in element.children if child.tag in rule.one_of]
        if len(found) != 1:
            place = found[1] if len(found) > 1 else element
            problem = f"<{element.tag}> holds {len(found)} shapes"
            raise _error(place, problem, file, f"one of {', '.join(f'<{tag}>' for tag in rule.one_of)}")


def _unknown(child: Element, element: Element, rule: Rule, file: Path) -> RobotFileError:
    if child.tag.startswith("xacro:"):
        return _error(child, f"<{child.tag}>: this is xacro, not yet a URDF", file, "the output of `xacro`")
    if child.tag == "mimic":
        return _error(
            child, "<mimic> makes a joint follow another", file, "a joint of its own, or a fixed one"
        )
    hint = did_you_mean(child.tag, rule.tags)
    problem = f"<{child.tag}> is not part of <{element.tag}>{hint}"
    return _error(child, problem, file, ", ".join(f"<{tag}>" for tag in rule.tags) or "nothing")


def _check_text(element: Element, file: Path) -> None:
    if element.text:
        problem = f"{shown(element.text)} stands in <{element.tag}> as text"
        raise _error(element, problem, file, "values in attributes, elements in elements")


def _words(values: Values) -> str:
    if isinstance(values, Numbers):
        return values.allowed
    return "a text" if values == TEXT else "a name without quotes, <, >, & or line ends"


def _error(element: Element, problem: str, file: Path, allowed: str) -> RobotFileError:
    name = element.attributes.get("name", "")
    key = f'{element.tag} "{name}"' if name else ""
    return RobotFileError(file, problem, line=element.line, key=key, allowed=allowed)
