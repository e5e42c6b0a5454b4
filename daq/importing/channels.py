"""Which columns of a log belong together, one per joint, and what their names say that they are.

A name says little for sure; ``daq.importing.proof`` tests on the data what it says.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ident.listing import short
from robots.arrays import FloatArray

_NUMBER = re.compile(r"^(.*?)[ _:.\-\[(]*(\d+)[\])]?$")
_INNER = re.compile(r"^(.*?(?:joint|axis|achse|jnt|j|a)[ _]?)(\d+)(\D*)$", re.IGNORECASE)
_LAST = re.compile(r"^(.*?)(\d+)(\D*)$")
_WORDS = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+|[^\x00-\x7f]+")

KINDS: Mapping[str, frozenset[str]] = {
    kind: frozenset(words.split())
    for kind, words in {
        "position": "q qm qj qg pos position positions angle angles theta phi joint joints jnt jointpos jpos"
        " mp ip j axis axes winkel",
        "velocity": "dq qd qdot dqdt vel velocity velocities velo speed dphi dtheta omega jvel qp",
        "acceleration": "ddq qdd qddot acc accel acceleration ddphi qpp",
        "torque": "tau torque torques trq effort efforts moment moments nm mnm drehmoment force forces kraft"
        " jtor mt et",
        "current": "current currents cur curr i iq amp amps ampere strom",
        "signal": "v u vir volt voltage signal vtau",
        "temperature": "temp temperature temperatures temps",
        "time": "t time times stamp timestamp sec secs second seconds zeit clock duration",
        "complete": "complete valid ok answered",
    }.items()
}
MARKS: Mapping[str, frozenset[str]] = {
    mark: frozenset(words.split())
    for mark, words in {
        "reference": "ref reference cmd command commanded des desired target targets set setpoint soll goal"
        " demand qg qr as es ip ipo planned",
        "measured": "act actual meas measured mes m msr ist fb fbk feed feedback read ai ei mp mt",
        "error": "error err diff deviation following",
        "motor": "mot motor motors rotor ma",
        "second": "se link second secondary output load out",
        "external": "ext et external contact tcp cartesian pose wrench ft",
        "computed": "ff feedforward fwd model gravity grav g computed calc coriolis est estimated hat"
        " window mode",
    }.items()
}
_ORDER = (
    "complete", "temperature", "acceleration", "velocity", "torque", "current", "position", "signal", "time",
)  # fmt: skip
"""What counts where a name says several things."""
_ALONE = {"joint", "joints", "jnt", "j", "axis", "axes", "m", "a", "i"}
"""Words that say a kind only where no other does: "joint torque" is a torque, "joint 1" a position."""
_SHORT_REFERENCE = {"d", "r", "s"}
"""Marks of a reference where the quantity stands before: ``q_d``, ``tau_J_d``."""


_WIDE = 64
"""Characters of a group's label; of a longer one the first name stands for all."""
_LONG = 16
"""Characters that the names of a group have in common, and that its last one need not repeat."""


@dataclass(frozen=True, eq=False)
class Channels:
    """Columns that belong together.

    Attributes:
        stem: what their names have in common.
        columns: in the order of the joints.
        values: samples × columns; constants have few samples.
        file: in a folder of files.
        kind: of ``KINDS`` by name; empty where the name says nothing.
        marks: of ``MARKS`` by name.
        words: of the name, small letters.
    """

    stem: str
    columns: tuple[str, ...]
    values: FloatArray
    file: str | None
    kind: str
    marks: frozenset[str]
    words: tuple[str, ...]

    @property
    def label(self) -> str:
        """For messages."""
        first = short(self.columns[0])
        first = first if self.file is None else f"{self.file}: {first}"
        if len(self.columns) == 1:
            return first
        last = self.columns[-1]
        pairs = enumerate(zip(self.columns[0], last, strict=False))
        same = next((k for k, (a, b) in pairs if a != b), 0)
        same -= last[:same].endswith("[")
        whole = f"{first} … {short(last) if same < _LONG else last[same:]}"
        return whole if len(whole) <= _WIDE else f"{first} … ({len(self.columns)})"

    @property
    def parent(self) -> str:
        """Of which message or struct it is a field; empty where its name does not say."""
        return re.split(r"[/.](?!.*[/.])", self.stem)[0] if re.search(r"[/.]", self.stem) else ""


def words_of(name: str) -> tuple[str, ...]:
    """The words that a name is made of, small letters: ``actPos_deg`` is act, pos, deg."""
    parts = re.split(r"[^A-Za-z0-9\x80-\uffff]+", name)
    return tuple(word.lower() for part in parts for word in _WORDS.findall(part))


def kind_of(name: str) -> tuple[str, frozenset[str]]:
    """What a name says: a kind (or nothing) and marks."""
    words = words_of(name)
    last = re.split(r"[/.:]", name)[-1].lower()
    whole = last if last.isalpha() else ""  # q_d is the desired q, qd its velocity
    marks = {mark for mark, known in MARKS.items() if known & set(words)}
    kinds = [kind for kind, known in KINDS.items() if known & {*words, whole}]
    strong = [k for k in kinds if KINDS[k] & ({*words, whole} - _ALONE)] or kinds
    kind = next((k for k in _ORDER if k in strong), "")
    if kind and len(words) > 1 and words[-1] in _SHORT_REFERENCE and words[0] not in _SHORT_REFERENCE:
        marks.add("reference")
    if kind in ("torque", "current", "signal") and "reference" in marks:
        marks.add("computed")
    if "dtau" in words or ("joint" in words and {"control", "mode"} & set(words)):
        kind = ""  # how a torque changes; what a drive is told
    return kind, frozenset(marks)


def channels_of(
    columns: Mapping[str, FloatArray], joints: Sequence[str], file: str | None = None
) -> list[Channels]:
    """All groups of columns, single columns included, in file order.

    Args:
        columns: name → (samples,) of one file.
        joints: names of the arm's moving joints.
        file: its name, in a folder of files.
    """
    groups: dict[tuple[str, int], dict[int, str]] = {}
    for name, values in columns.items():
        stem, number = _stem_and_number(name, joints)
        groups.setdefault((stem, len(values)), {}).setdefault(number, name)
    found = []
    for (stem, _), members in groups.items():
        names = tuple(members[number] for number in sorted(members))
        table = np.column_stack([columns[name] for name in names])
        said = stem if any(kind_of(stem)) and words_of(stem) not in (("joint",), ("axis",), ("j",)) else ""
        kind, marks = kind_of(said or f"{(file or '').rpartition('.')[0]}_{stem}")
        found.append(Channels(stem, names, table, file, kind, marks, words_of(f"{file or ''}_{stem}")))
    return found


def _stem_and_number(name: str, joints: Sequence[str]) -> tuple[str, int]:
    """What a name has in common with its neighbours, and its place among them; −1 for a single one."""
    for k, joint in sorted(enumerate(joints), key=lambda entry: -len(entry[1])):
        if name.endswith(joint) and (stem := name[: -len(joint)].rstrip(" /_.:")):
            return stem, k
        if name.startswith(joint) and (stem := name[len(joint) :].lstrip(" /_.:")) and not stem[0].isdigit():
            return stem, k
    if numbered := _NUMBER.match(name):
        return numbered[1].rstrip(" _:.-[("), int(numbered[2])
    if inner := _INNER.match(name) or _LAST.match(name):
        return f"{inner[1]}#{inner[3]}", int(inner[2])
    return name, -1
