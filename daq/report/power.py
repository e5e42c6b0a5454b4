"""How small each effect could be and still be named: as a table, as a map of effects and joints, as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from rich.console import Console

from daq.text.numbers import percent, significant
from daq.text.wrapped import Column, write, write_table
from ident.discrepancy.by_evidence.power.planned import CHANNELS
from ident.discrepancy.by_evidence.power.smallest import CHANCE, Smallest, worst_first
from ident.discrepancy.by_evidence.report.as_json import smallest_json
from ident.effects.entry import joint_words
from robots import Robot

_SHOWN = 15
"""Rows on the terminal; the page and the JSON object have all."""

_DARKEST, _LIGHTEST = 0.1, 1e-3
"""Share of the joint's torque limit that a cell is darkest at, and has no colour at."""

TITLE = f"Smallest size that would be named rightly in {CHANCE:.0%} of recordings"


@dataclass(frozen=True)
class PowerCell:
    """One effect at one place.

    Attributes:
        size: with its unit; a dash where the effect has no such place.
        torque: root mean square of its torque at that size.
        more: the rest in a sentence: parameter, joint, shape, what it is last told from.
        dark: 0 to 1 by the torque that may hide.
        unseen: whether no size of it would be named.
    """

    size: str
    torque: str
    more: str
    dark: float
    unseen: bool


@dataclass(frozen=True)
class PowerMap:
    """Effects × joints, the effect with the worst place first; ``rows`` have a cell per column or None."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, tuple[PowerCell | None, ...]], ...]


def power_map(robot: Robot, sizes: Sequence[Smallest]) -> PowerMap:
    """The map of an arm. What sits between two joints stands at the farther one."""
    ordered = worst_first(sizes)
    everywhere = any(not one.joints for one in ordered)
    rows = []
    for name in dict.fromkeys(one.name for one in ordered):
        at = {one.joints[-1] if one.joints else 0: one for one in ordered if one.name == name}
        places = range(0 if everywhere else 1, robot.n + 1)
        rows.append((name.replace("_", " "), tuple(_cell(at.get(place)) for place in places)))
    heads = (*(("the arm",) if everywhere else ()), *(joint.name for joint in robot.joint))
    return PowerMap(TITLE, heads, tuple(rows))


def _cell(one: Smallest | None) -> PowerCell | None:
    if one is None:
        return None
    share = np.clip(one.torque_share, _LIGHTEST, _DARKEST)
    dark = float(np.log(share / _LIGHTEST) / np.log(_DARKEST / _LIGHTEST))
    shape = "".join(f", {name} {significant(value)} {unit}".rstrip() for name, value, unit in one.shape)
    torque = f"{significant(one.torque)} {one.torque_unit}" if one.seen else ""
    more = f"{one.parameter}{shape}; torque at joint {one.joint}; told last from {_rival(one)}"
    if not one.seen:
        more = f"{one.parameter}{shape}; not told from {_rival(one)}"
    return PowerCell(_size(one), torque, more, round(dark, 2), not one.seen)


def _size(one: Smallest) -> str:
    if not one.seen:
        return "none"
    least = "at most " if one.falls else ""
    return f"{least}{significant(one.size)} {'' if one.unit == '1' else one.unit}".rstrip()


def _rival(one: Smallest) -> str:
    name, joints = one.rival
    if name == "nothing":
        return "noise"
    words = name.replace("_", " ")
    return words if joints == one.joints or name == CHANNELS[0] else f"{words} of {joint_words(joints)}"


def print_power(console: Console, sizes: Sequence[Smallest]) -> None:
    """The worst places, as a table."""
    ordered = worst_first(sizes)
    columns = [Column("effect", right=False, wraps=True), Column("smallest size", wraps=True)]
    columns += [Column("its torque"), Column("of limit"), Column("told from", right=False, wraps=True)]
    rows = [
        [
            f"{one.name.replace('_', ' ')}, {joint_words(one.joints)}",
            f"{one.parameter} {_size(one)}" if one.seen else f"{one.parameter}: none",
            f"{significant(one.torque)} {one.torque_unit}" if one.seen else "",
            percent(100.0 * one.torque_share) if one.seen else "",
            _rival(one),
        ]
        for one in ordered[:_SHOWN]
    ]
    write_table(console, f"{TITLE}, worst first", columns, rows)
    if len(ordered) > _SHOWN:
        write(console, f"- {len(ordered) - _SHOWN} more: on the page of --out, and with --json.", style="dim")


def power_json(sizes: Sequence[Smallest]) -> dict[str, object]:
    """As JSON, worst first."""
    return {"chance": CHANCE, "smallest": [smallest_json(one) for one in worst_first(sizes)]}
