"""Slips of the pen in a URDF, made at random with a seed.

A mutation is a *slip* (no author means it: it must be refused, or change nothing) or an *edit* (a figure or
a whole optional element is another one: the arm is then another arm, and must be exactly that of the file).
"""

from __future__ import annotations

import random
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Literal

Kind = Literal["slip", "edit"]

BAD_NUMBERS = (
    "0,028", "nan", "inf", "-inf", "NaN", "AAAA", "", "1e400", "0x10", "1_0", "--1", "1.2.3", "28mm", "٣",
    "1e", "- 1", "${r}", "1/2", "1;", "(1)",
)  # fmt: skip
ONE_MORE = ("1", "0", "0 0")
NUMERIC = {
    "origin": ("xyz", "rpy"),
    "axis": ("xyz",),
    "mass": ("value",),
    "inertia": ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"),
    "limit": ("lower", "upper", "velocity", "effort"),
    "box": ("size",),
    "cylinder": ("radius", "length"),
    "sphere": ("radius",),
}
POSITIVE = {
    ("mass", "value"),
    ("box", "size"),
    ("cylinder", "radius"),
    ("cylinder", "length"),
    ("sphere", "radius"),
}


@dataclass(frozen=True)
class Mutation:
    """A changed file; ``what`` says how, for the message of a failure."""

    text: str
    kind: Kind
    what: str


def mutated_urdf(text: str, seed: int) -> Mutation:
    """One to two mutations of a URDF."""
    generator = random.Random(f"urdf {seed}")
    kind, words = "edit", []
    for _ in range(generator.choice((1, 1, 1, 2))):
        change = generator.choice(_CHANGES)
        found = change(text, generator)
        if found is None:
            continue
        text, made, what = found
        kind = "slip" if made == "slip" else kind
        words.append(what)
    return Mutation(text, kind, "; ".join(words))


Change = Callable[[str, random.Random], "tuple[str, Kind, str] | None"]


def _tags(text: str) -> list[re.Match[str]]:
    """Start tags with attributes and elements, comments left out."""
    bare = re.sub(r"<!--.*?-->", lambda comment: " " * len(comment[0]), text, flags=re.DOTALL)
    return list(re.finditer(r"<([a-z_]+)((?:\s+[a-z]+=\"[^\"]*\")*)\s*(/?)>", bare))


def _put(text: str, start: int, end: int, new: str) -> str:
    return text[:start] + new + text[end:]


def _numbers(text: str) -> Iterator[tuple[str, str, int, int]]:
    for tag in _tags(text):
        for found in re.finditer(r"([a-z]+)=\"([^\"]*)\"", tag[2]):
            if found[1] in NUMERIC.get(tag[1], ()):
                yield tag[1], found[1], tag.start(2) + found.start(2), tag.start(2) + found.end(2)


def _bad_number(text: str, generator: random.Random) -> tuple[str, Kind, str]:
    tag, name, start, end = generator.choice(list(_numbers(text)))
    parts = text[start:end].split()
    bad = generator.choice(BAD_NUMBERS)
    parts[generator.randrange(len(parts))] = bad
    return _put(text, start, end, " ".join(parts)), "slip", f"<{tag} {name}> has {bad!r}"


def _bad_count(text: str, generator: random.Random) -> tuple[str, Kind, str]:
    tag, name, start, end = generator.choice(list(_numbers(text)))
    parts = text[start:end].split()
    if generator.random() < 0.5:
        del parts[generator.randrange(len(parts))]
    else:
        parts.append(generator.choice(ONE_MORE))
    return _put(text, start, end, " ".join(parts)), "slip", f"<{tag} {name}> has {len(parts)} numbers"


def _bad_sign(text: str, generator: random.Random) -> tuple[str, Kind, str]:
    choices = [found for found in _numbers(text) if found[:2] in POSITIVE]
    tag, name, start, end = generator.choice(choices)
    parts = text[start:end].split()
    k = generator.randrange(len(parts))
    parts[k] = generator.choice(("0", f"-{parts[k]}", "-1", "1e308", "1e-320", "0.0"))
    return _put(text, start, end, " ".join(parts)), "slip", f"<{tag} {name}> has {parts[k]}"


def _other_value(text: str, generator: random.Random) -> tuple[str, Kind, str]:
    tag, name, start, end = generator.choice(list(_numbers(text)))
    parts = text[start:end].split()
    k = generator.randrange(len(parts))
    factor = generator.choice((10.0, 0.1, -1.0, 57.0, 1000.0, 1.0001))
    parts[k] = repr(float(parts[k]) * factor)
    return _put(text, start, end, " ".join(parts)), "edit", f"<{tag} {name}> times {factor}"


def _misspelt(word: str, generator: random.Random) -> str:
    k = generator.randrange(len(word))
    ways = (
        word[:k] + word[k + 1 :],
        word[:k] + word[k] + word[k:],
        word[:k] + word[k].upper() + word[k + 1 :],
        word[:k] + word[k + 1 : k + 2] + word[k : k + 1] + word[k + 2 :],
        word + "s",
    )
    return next((way for way in generator.sample(ways, len(ways)) if way != word and way), word + "_")


def _misspelt_attribute(text: str, generator: random.Random) -> tuple[str, Kind, str]:
    tag = generator.choice([tag for tag in _tags(text) if tag[2]])
    found = generator.choice(list(re.finditer(r"([a-z]+)=", tag[2])))
    new = _misspelt(found[1], generator)
    start = tag.start(2) + found.start(1)
    return _put(text, start, start + len(found[1]), new), "slip", f"<{tag[1]} {found[1]}> is written {new}"


def _lost_attribute(text: str, generator: random.Random) -> tuple[str, Kind, str]:
    tag = generator.choice([tag for tag in _tags(text) if tag[2]])
    found = generator.choice(list(re.finditer(r"\s+([a-z]+)=\"[^\"]*\"", tag[2])))
    start, end = tag.start(2) + found.start(), tag.start(2) + found.end()
    kind: Kind = "edit" if tag[1] == "origin" else "slip"  # <origin> has defaults in every URDF
    return _put(text, start, end, ""), kind, f"<{tag[1]} {found[1]}> is lost"


def _added_attribute(text: str, generator: random.Random) -> tuple[str, Kind, str]:
    tag = generator.choice(_tags(text)[1:])
    name = generator.choice(("units", "unit", "scale", "raduis", "value2", "enabled"))
    return _put(text, tag.end(2), tag.end(2), f' {name}="mm"'), "slip", f"<{tag[1]} {name}> is new"


def _misspelt_element(text: str, generator: random.Random) -> tuple[str, Kind, str]:
    tag = generator.choice(_tags(text))
    new = _misspelt(tag[1], generator)
    if tag[3]:
        text = _put(text, tag.start(1), tag.end(1), new)
    else:
        start, end = _element(text, tag)
        inner = text[tag.end(1) : end - len(f"</{tag[1]}>")]
        text = _put(text, start, end, f"<{new}{inner}</{new}>")
    return text, "slip", f"<{tag[1]}> is written <{new}>"


def _element(text: str, tag: re.Match[str]) -> tuple[int, int]:
    if tag[3]:
        return tag.start(), tag.end()
    close = f"</{tag[1]}>"
    return tag.start(), text.index(close, tag.end()) + len(close)


_WHOLE = {"collision", "origin"}
"""Elements that a URDF may do without."""


def _lost_element(text: str, generator: random.Random) -> tuple[str, Kind, str]:
    tag = generator.choice(_tags(text)[1:])
    start, end = _element(text, tag)
    kind: Kind = "edit" if tag[1] in _WHOLE else "slip"
    return _put(text, start, end, ""), kind, f"a <{tag[1]}> is lost"


def _emptied_element(text: str, generator: random.Random) -> tuple[str, Kind, str]:
    tag = generator.choice([tag for tag in _tags(text)[1:] if not tag[3]])
    _, end = _element(text, tag)
    return _put(text, tag.end(), end - len(f"</{tag[1]}>"), ""), "edit", f"a <{tag[1]}> is emptied"


def _doubled_element(text: str, generator: random.Random) -> tuple[str, Kind, str]:
    tag = generator.choice(_tags(text)[1:])
    start, end = _element(text, tag)
    kind: Kind = "edit" if tag[1] == "collision" else "slip"
    return _put(text, end, end, text[start:end]), kind, f"a <{tag[1]}> is there twice"


def _moved_element(text: str, generator: random.Random) -> tuple[str, Kind, str]:
    tag = generator.choice([tag for tag in _tags(text)[1:] if tag[1] not in ("link", "joint")])
    start, end = _element(text, tag)
    piece, rest = text[start:end], text[:start] + text[end:]
    place = generator.choice([tag for tag in _tags(rest) if not tag[3]])
    return _put(rest, place.end(), place.end(), piece), "edit", f"a <{tag[1]}> is moved into <{place[1]}>"


def _other_name(text: str, generator: random.Random) -> tuple[str, Kind, str] | None:
    names = [tag for tag in _tags(text) if tag[1] in ("link", "parent", "child", "joint")]
    tag = generator.choice(names)
    found = re.search(r"(?:name|link)=\"([^\"]*)\"", tag[2])
    if found is None:
        return None
    others = [m[1] for m in re.finditer(r"<link name=\"([^\"]*)\"", text) if m[1] != found[1]]
    new = generator.choice((generator.choice(others), found[1] + "_", found[1].upper(), "", "a\tb"))
    start = tag.start(2) + found.start(1)
    return _put(text, start, start + len(found[1]), new), "slip", f"<{tag[1]}> names {new!r}"


def _other_shape(text: str, generator: random.Random) -> tuple[str, Kind, str]:
    tag = generator.choice([tag for tag in _tags(text) if tag[1] in ("box", "cylinder", "sphere")])
    new = generator.choice(("capsule", "cone", "mesh", "box", "cylinder", "sphere", "ellipsoid"))
    kind: Kind = "edit" if new == tag[1] else "slip"
    return _put(text, tag.start(1), tag.end(1), new), kind, f"a <{tag[1]}> is a <{new}>"


def _other_type(text: str, generator: random.Random) -> tuple[str, Kind, str]:
    found = generator.choice(list(re.finditer(r"type=\"([a-z]+)\"", text)))
    new = generator.choice(
        ("fixed", "continuous", "Revolute", "floating", "planar", "prismatic", "revolut", "")
    )
    kind: Kind = "edit" if new == found[1] else "slip"
    return _put(text, found.start(1), found.end(1), new), kind, f"a joint is of type {new!r}"


def _stray_text(text: str, generator: random.Random) -> tuple[str, Kind, str]:
    tag = generator.choice([tag for tag in _tags(text) if not tag[3]])
    word = generator.choice(("0.5", "x", "<![CDATA[1]]>", "&#49;"))
    return _put(text, tag.end(), tag.end(), word), "slip", f"{word} stands in <{tag[1]}>"


def _commented_out(text: str, generator: random.Random) -> tuple[str, Kind, str] | None:
    tag = generator.choice(_tags(text)[1:])
    start, end = _element(text, tag)
    if "<!--" in text[start:end]:
        return None
    kind: Kind = "edit" if tag[1] in _WHOLE else "slip"
    return _put(text, start, end, f"<!-- {text[start:end]} -->"), kind, f"a <{tag[1]}> is commented out"


def _raw(text: str, generator: random.Random) -> tuple[str, Kind, str]:
    """The unlucky key: characters lost, doubled or replaced anywhere outside comments."""
    at = generator.choice([tag.start() + generator.randrange(len(tag[0])) for tag in _tags(text)])
    new = generator.choice(("", text[at] * 2, generator.choice("<>\"'&,;=/ 09.-eE\0"), "\n"))
    return _put(text, at, at + 1, new), "edit", f"{text[at]!r} is {new!r} at {at}"


def _same_arm(text: str, generator: random.Random) -> tuple[str, Kind, str]:
    """What makes no difference: white space, quotes, comments, other spellings of a number."""
    tag, name, start, end = generator.choice(list(_numbers(text)))
    same = " ".join(f"{float(part):+.17e}" for part in text[start:end].split())
    new = generator.choice((f"  {text[start:end]} ", same))
    return _put(text, start, end, new), "edit", f"<{tag} {name}> is written {new!r}"


_CHANGES: tuple[Change, ...] = (
    _bad_number, _bad_number, _bad_count, _bad_sign, _other_value, _misspelt_attribute, _lost_attribute,
    _added_attribute, _misspelt_element, _lost_element, _emptied_element, _doubled_element, _moved_element,
    _other_name, _other_shape, _other_type, _stray_text, _commented_out, _raw, _raw, _same_arm,
)  # fmt: skip
