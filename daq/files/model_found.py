"""``[[found]]`` and ``[[term]]`` of a model file: effects that were added, and formulas without a name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from ident.effects.entry import EffectEntry
from ident.effects.term_family import TERM, is_term, term_of
from ident.results import Parameter
from robots import Robot

Finite = Annotated[float, Field(allow_inf_nan=False)]


class _Frozen(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


class ModelFound(_Frozen):
    """An effect that the discrepancy search found and added."""

    effect: Annotated[str, Field(min_length=1)]
    joints: tuple[Annotated[int, Field(ge=1)], ...]
    shape: dict[str, Finite] = Field(default={}, description="parameters that the torque is not linear in")


class ModelTerm(_Frozen):
    """A formula for what has no name: the joint's torque gets coefficient · formula."""

    joint: Annotated[int, Field(ge=1)]
    formula: Annotated[str, Field(min_length=1)]
    coefficient: Finite
    sigma: Annotated[float, Field(ge=0, allow_inf_nan=False)] = Field(description="standard deviation")
    unit: str = Field(description="of the coefficient")
    looks_like: str = Field(description="what in nature does")
    source: str = Field(description="where it came from")

    @property
    def name(self) -> str:
        """Among the effects."""
        return TERM + self.formula

    @property
    def parameter(self) -> str:
        """Of its coefficient."""
        return f"{self.formula}@{self.joint}"


def check_terms(
    effects: Sequence[str],
    found: Sequence[str],
    terms: Sequence[ModelTerm],
    parameters: Mapping[str, tuple[float, float, str]],
) -> None:
    """Refuse a file that says two things of its terms.

    Args:
        effects: of the model, those that were added last.
        found: names of those that have one.
        terms: the others.
        parameters: value, sigma and unit by name.

    Raises:
        ValueError: a term is no parameter, or another one there; or effects do not end with all.
    """
    for term in terms:
        own = parameters.get(term.parameter)
        if own is None:
            raise ValueError(f"term {term.formula}: parameter {term.parameter} is missing")
        if own != (term.coefficient, term.sigma, term.unit):
            raise ValueError(
                f"term {term.formula}: {term.coefficient!r} ± {term.sigma!r} {term.unit}; allowed: as"
                f" parameter {term.parameter}, {own[0]!r} ± {own[1]!r} {own[2]}"
            )
    listed = tuple(name for name in effects if is_term(name))
    names = tuple(term.name for term in terms)
    if listed != names:
        raise ValueError(
            f"terms {', '.join(names) or 'none'}; allowed: those of effects, {', '.join(listed) or 'none'}"
        )
    added = effects[len(effects) - len(found) - len(terms) :]
    if terms and tuple(name for name in added if not is_term(name)) != tuple(found):
        raise ValueError(f"effects end with {', '.join(added)}; allowed: all of found and term")


def added_entries(
    effects: Sequence[str], found: Sequence[ModelFound], terms: Sequence[ModelTerm]
) -> tuple[EffectEntry, ...]:
    """All that was added, in the order of the effects."""
    named, others, entries = iter(found), iter(terms), []
    for name in effects[len(effects) - len(found) - len(terms) :]:
        if is_term(name):
            term = next(others)
            entries.append(EffectEntry(name, (term.joint,), {}, term.source))
        else:
            one = next(named)
            entries.append(EffectEntry(one.effect, one.joints, dict(one.shape)))
    return tuple(entries)


def model_found(
    robot: Robot, entries: Sequence[EffectEntry], parameters: Sequence[Parameter]
) -> dict[str, tuple[dict[str, Any], ...]]:
    """Entries of ``[[found]]`` and ``[[term]]``.

    Args:
        robot: the arm.
        entries: all that was added.
        parameters: of the model; a term's has its formula and joint for a name.
    """
    own = {one.name: one for one in parameters}
    found = [entry for entry in entries if not is_term(entry.name)]
    terms = [entry for entry in entries if is_term(entry.name)]
    return {
        "found": tuple(
            {"effect": entry.name, "joints": entry.joints, "shape": dict(entry.shape)} for entry in found
        ),
        "term": tuple(_term(robot, entry, own) for entry in terms),
    }


def _term(robot: Robot, entry: EffectEntry, parameters: Mapping[str, Parameter]) -> dict[str, Any]:
    formula, (joint,) = entry.name.removeprefix(TERM), entry.joints
    parameter = parameters[f"{formula}@{joint}"]
    return {
        "joint": joint,
        "formula": formula,
        "coefficient": parameter.value,
        "sigma": parameter.sigma,
        "unit": parameter.unit,
        "looks_like": term_of(robot, formula, joint - 1).looks_like,
        "source": entry.source,
    }
