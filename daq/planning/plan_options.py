"""Options of ``armhil plan`` that are texts on the command line and values inside."""

from __future__ import annotations

from typing import cast, get_args

from trajectories import PlanError
from trajectories.information.matrix import Criterion
from trajectories.trajectory import ExcitingFamily


def family_of(text: str) -> ExcitingFamily:
    """The family of that name.

    Raises:
        PlanError: there is none.
    """
    return cast("ExcitingFamily", _one_of("family", text, get_args(ExcitingFamily)))


def criterion_of(text: str) -> Criterion:
    """The criterion of that name.

    Raises:
        PlanError: there is none.
    """
    return cast("Criterion", _one_of("objective", text, get_args(Criterion)))


def words_of(text: str | None) -> tuple[str, ...]:
    """The words between commas."""
    return () if text is None else tuple(word.strip() for word in text.split(",") if word.strip())


def posture_of(text: str | None) -> tuple[float, ...] | None:
    """Positions between commas, rad (or m).

    Raises:
        PlanError: one of them is no number.
    """
    if text is None:
        return None
    try:
        return tuple(float(word) for word in text.split(","))
    except ValueError:
        raise PlanError(
            f"--start {text}; allowed: one number per joint, separated by commas", constraint="start"
        ) from None


def _one_of(option: str, text: str, allowed: tuple[str, ...]) -> str:
    if text not in allowed:
        raise PlanError(f"--{option} {text}; allowed: {', '.join(allowed)}", constraint=option)
    return text
