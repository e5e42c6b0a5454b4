"""A check as its report shows it: the verdict, what moved and by how much, and beside which baseline."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from markupsafe import Markup

from daq.report.check_facts import facts_of, limit_words, units_of
from daq.report.check_picture import course_picture
from daq.report.gates import Fact
from daq.report.pictures import icon, scaled
from daq.text.numbers import NOTHING, percent, probability, significant

KINDS = {"ok": "good", "warning": "warn", "failed": "bad", "unknown": "unknown"}
"""Of a verdict: sign and colour."""
_Part = TypeVar("_Part")
WORDS = {"ok": "fine", "warning": "warning", "failed": "failed", "unknown": "not measurable"}


@dataclass(frozen=True)
class JointRow:
    """Change of the torque of one joint: text, share of its torque, and places on the bar in percent."""

    joint: int
    torque: str
    unit: str
    share: str
    width: float
    beyond: bool


@dataclass(frozen=True)
class MovedRow:
    """One named effect."""

    words: str
    change: str
    share: str
    torque: str
    warmth: str
    alternatives: str


@dataclass(frozen=True)
class UsualRow:
    """What is usual of one chart, and what was forgiven tonight."""

    chart: str
    prior: str
    posterior: str
    per_kelvin_prior: str
    per_kelvin: str
    forgiven: str


@dataclass(frozen=True)
class CheckView:
    """Everything that the check's part of a page shows, as text."""

    kind: str
    icon: Markup
    word: str
    headline: str
    sentence: str
    facts: tuple[Fact, ...]
    warnings: tuple[str, ...]
    findings: tuple[str, ...]
    picture: Markup
    picture_words: str
    picture_unit: str
    joints: tuple[JointRow, ...]
    tolerance: str
    tolerance_at: float
    moved: tuple[MovedRow, ...]
    parameters: tuple[tuple[str, str, str, str, str, str], ...]
    usual: tuple[UsualRow, ...]
    tests: tuple[tuple[str, str, str], ...]


def check_view(
    verdict: str,
    sentence: str,
    details: Mapping[str, Any],
    baseline: tuple[str, str],
    tonight: tuple[str, str],
) -> CheckView:
    """The view of a check.

    Args:
        verdict: in a word, as in the catalogue.
        sentence: what an operator reads.
        details: of the check as the catalogue keeps them.
        baseline: what it was compared with, and a note; empty where there is none.
        tonight: the run that was judged, and a note.
    """
    compared: Mapping[str, Any] = _kept(details, "comparison", {})
    tolerance = float(_kept(_kept(details, "settings", {}), "tolerance", 0.05))
    kind = KINDS.get(verdict, "unknown")
    lost: list[str] = []

    def shown(part: str, make: Callable[[], _Part], without: _Part) -> _Part:
        """A part of the page; without it where another version kept otherwise what it is made of."""
        try:
            return make()
        except (KeyError, TypeError, ValueError, IndexError, AttributeError):
            lost.append(part)
            return without

    course: Mapping[str, Any] = _kept(compared, "course", {})
    nothing = (Fact("Baseline", baseline[0] or "none", baseline[1]), Fact("This check", *tonight))
    no_joints: tuple[tuple[JointRow, ...], float] = ((), 0.0)
    joints, at = shown("change of torque", lambda: _joints(compared, tolerance), no_joints)
    view = CheckView(
        kind,
        icon(kind),  # type: ignore[arg-type]
        WORDS.get(verdict, verdict),
        shown("headline", lambda: _headline(verdict, compared, details), WORDS.get(verdict, verdict)),
        sentence,
        shown("figures", lambda: facts_of(compared, details, baseline, tonight, tolerance), nothing),
        tuple(_kept(details, "warnings", [])),
        tuple(_kept(details, "findings", [])),
        shown("picture", lambda: _course(course, compared["state"] == "unchanged"), Markup())
        if course
        else Markup(),
        str(course.get("chart", "")),
        str(course.get("unit", "")),
        joints,
        limit_words(tolerance),
        at,
        shown("effects", lambda: tuple(_moved(one, compared) for one in compared.get("changes", ())), ()),
        shown(
            "parameters", lambda: tuple(_parameter(one) for one in compared.get("parameters", ())[:12]), ()
        ),
        shown("what is usual", lambda: tuple(_usual(one) for one in compared.get("usual", ())), ()),
        shown("tests", lambda: _tests(compared), ()),
    )
    if not lost:
        return view
    words = f"another version of armhil kept this check; not shown: {', '.join(lost)}"
    return replace(view, warnings=(*view.warnings, words))


def _kept(details: Mapping[str, Any], key: str, without: _Part) -> _Part:
    """What a check kept under a key, if it is of the kind that it has to be."""
    found = details.get(key)
    return found if isinstance(found, type(without)) else without


def _headline(verdict: str, compared: Mapping[str, Any], details: Mapping[str, Any]) -> str:
    if not compared:
        return "No baseline to compare with"
    if compared["state"] == "changed":
        if not compared["changes"]:
            return "Something has moved, and no known effect explains it"
        first = compared["changes"][0]
        more = len(compared["changes"]) - 1
        return f"{first['words']} {_share(first)}{f' and {more} more' if more else ''}"
    if details.get("grown"):
        return "The model leaves more of the torque than on the nights before"
    return "Nothing has moved" if verdict == "ok" else "Nothing has moved, with a warning"


def _share(change: Mapping[str, Any]) -> str:
    if change["relative"] is not None:
        return f"{100 * change['relative']:+.3g}\u00a0%".replace("-", "−")
    return f"{significant(change['size'], signed=True)}\u00a0{change['unit']}"


def _course(course: Mapping[str, Any], fine: bool) -> Markup:
    amounts = [float(value) for value in course["amount"]]
    days = [float(value) for value in course["day"]]
    band = (float(course["low"]), float(course["high"]))
    return course_picture(course["chart"], course["unit"], days, amounts, (*course["clean"][:-1], fine), band)


def _joints(compared: Mapping[str, Any], tolerance: float) -> tuple[tuple[JointRow, ...], float]:
    """One row a joint, and where the tolerance is on the bars, in percent."""
    if not compared:
        return (), 0.0
    pairs = list(zip(compared["torque_change"], compared["torque_rms"], strict=True))
    shares = [change / max(rms, 1e-12) for change, rms in pairs]
    limits = (0.0, 1.1 * max(2.0 * tolerance, *shares))
    rows = tuple(
        JointRow(
            joint,
            significant(change),
            unit,
            percent(100 * share),
            scaled(share, limits),
            share > tolerance,
        )
        for joint, ((change, _), unit, share) in enumerate(
            zip(pairs, units_of(compared), shares, strict=True), start=1
        )
    )
    return rows, scaled(tolerance, limits)


def _moved(change: Mapping[str, Any], compared: Mapping[str, Any]) -> MovedRow:
    torques = [float(value) for value in change["torque_rms"]]
    worst = max(range(len(torques)), key=torques.__getitem__)
    return MovedRow(
        change["words"],
        f"{significant(change['size'], signed=True)} ± {significant(change['sigma'], 2)} {change['unit']}",
        _share(change) if change["relative"] is not None else NOTHING,
        f"{significant(torques[worst])} {units_of(compared)[worst]} on joint {worst + 1}",
        _warmth(change.get("kelvin"), compared.get("colder"), compared.get("unmeasured")),
        " or ".join(change["alternatives"]) or NOTHING,
    )


def _warmth(kelvin: float | None, colder: float | None, unmeasured: str | None) -> str:
    if kelvin is None:
        return NOTHING
    way = "colder" if kelvin > 0 else "warmer"
    if colder is None:
        lacks = f"the temperature of {unmeasured} is not known" if unmeasured else "no thermometer"
        return f"{abs(kelvin):.2g} K {way} at least; {lacks}"
    said = f"{abs(colder):.2g} K {'colder' if colder > 0 else 'warmer'}"
    if round(abs(colder)) and colder * kelvin > 0.0:  # what measured warmth explains is no change
        return f"{abs(kelvin):.2g} K {way} at least, beyond the thermometer's {said}"
    return f"{abs(kelvin):.2g} K {way} at least; thermometer {said}"


def _parameter(one: Mapping[str, Any]) -> tuple[str, str, str, str, str, str]:
    return (
        one["name"],
        significant(one["change"], signed=True),
        significant(one["sigma"], 2),
        one["unit"],
        probability(one["corrected"]),
        significant(one["torque_rms"]),
    )


def _usual(one: Mapping[str, Any]) -> UsualRow:
    unit = one["unit"]

    between = f"{significant(one['low'], 2)} to {significant(one['high'], 2)}"

    def slope(mean: float | None, sigma: float | None) -> str:
        if mean is None or sigma is None:
            return NOTHING
        return f"{significant(mean, 2)} ± {significant(sigma, 2)}"

    return UsualRow(
        one["chart"],
        f"{significant(one['prior_sigma'], 2)} {unit}",
        f"{significant(one['sigma'], 2)} ({between}) {unit}",
        slope(one["prior_per_kelvin"], one["prior_per_kelvin_sigma"]),
        slope(one["per_kelvin"], one["per_kelvin_sigma"]),
        f"± {significant(one['forgiven'], 2)} {unit}",
    )


def _tests(compared: Mapping[str, Any]) -> tuple[tuple[str, str, str], ...]:
    found = [compared.get(key) for key in ("wald", "between_runs", "unexplained")]
    return tuple(
        (one["name"], f"{significant(one['statistic'])}, {one['distribution']}", probability(one["p_value"]))
        for one in found
        if one is not None
    )
