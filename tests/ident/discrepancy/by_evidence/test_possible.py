"""Friction takes power from a drive and gives none: a set that has it otherwise is as unlikely as that."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import norm

from ident.discrepancy.by_evidence.decide import state
from ident.discrepancy.by_evidence.decide.possible import UsualFriction
from ident.discrepancy.by_evidence.evidence.known import Beta

DRIVE = (3,)
DRY, VISCOUS = 2.7, 1.3
"""N·m and N·m·s/rad, of the model beside the set."""

MOVED = 0.8
"""N·m, by which the set has changed the model's dry friction."""


def test_friction_of_a_drive_is_not_below_nothing() -> None:
    """Dry friction may go whole; less than none is as unlikely as the deviation of its size says."""
    assert possible(("Fc", -1.0, 0.1)) == pytest.approx(0.0, abs=1e-9)
    assert possible(("Fc", -2.7, 0.1)) == pytest.approx(np.log(0.5))
    assert possible(("Fc", -2.9, 0.1)) == pytest.approx(norm.logcdf(-2.0))
    assert possible(("Fn_linear", -1.4, 0.1)) == pytest.approx(norm.logcdf(-1.0))
    assert possible(("Fq_spot", -2.9, 0.1)) == pytest.approx(norm.logcdf(-2.0))
    both = possible(("Fc", -2.9, 0.1), ("Fn_linear", -1.4, 0.1))
    assert both == pytest.approx(norm.logcdf(-2.0) + norm.logcdf(-1.0))


def test_all_members_of_a_drive_together_are_asked() -> None:
    """Two drops that the drive could have alone; what one takes and the other gives; and what they share."""
    assert possible(("Fc", -2.0, 0.1), ("Fc_cold", -1.0, 0.1)) == pytest.approx(
        norm.logcdf(-0.3 / np.hypot(0.1, 0.1))
    )
    assert possible(("Fc", -4.0, 0.1), ("Fc_cold", 2.0, 0.1)) == pytest.approx(0.0, abs=1e-6)
    together = possible(("Fc", -2.0, 0.1), ("Fc_cold", -1.0, 0.1), correlation=-0.5)
    assert together == pytest.approx(norm.logcdf(-0.3 / 0.1))


def test_what_the_model_is_not_sure_of_counts() -> None:
    """After a refit the model's friction and its change may be anything, and their sum is known."""
    alone = possible(("Fc", -2.9, 0.3), doubt=0.4)
    assert alone == pytest.approx(norm.logcdf(-0.2 / 0.5))
    assert possible(("Fc", -2.9, 0.4), doubt=0.4, taken=0.875) == pytest.approx(norm.logcdf(-0.2 / 0.2))


def test_only_its_own_drive_and_only_a_change_of_friction_is_asked() -> None:
    assert possible(("Fs", -9.0, 0.1), ("mu", -9.0, 0.1)) == 0.0
    assert possible(("Fc", -1.0, 0.1), ("Fc", -9.0, 0.1), places=(DRIVE, (2,))) == pytest.approx(0.0)
    assert possible(("Fc", -9.0, 0.1), places=((),)) == 0.0


def test_a_set_has_the_probability_of_all_its_drives(monkeypatch: pytest.MonkeyPatch) -> None:
    """One that is explained by friction below nothing is as unlikely as that, however well it fits."""
    members, posterior = members_of((("Fc", -2.9, 0.1), ("Fc", -50.1, 0.1)), (DRIVE, (2,)))
    whole = norm.logcdf(-2.0) + norm.logcdf(-1.0)
    assert FRICTION.log_possible(members, posterior) == pytest.approx(whole)
    monkeypatch.setattr(state, "Gram", lambda *given: None)
    monkeypatch.setattr(state, "fitted", lambda *given: (40.0, None, posterior))
    problem: Any = SimpleNamespace(rows=None, misfit=None, friction=FRICTION)
    found = state.found_set(problem, [], None, ())  # type: ignore[arg-type]
    assert found.log_evidence == 40.0
    for one in members:
        one.volume = 0.0
    found = state.found_set(problem, members, None, ())  # type: ignore[arg-type]
    assert found.log_evidence == pytest.approx(40.0 + whole)


def possible(
    *sizes: tuple[str, float, float],
    places: tuple[Any, ...] = (),
    correlation: float = 0.0,
    doubt: float = 0.0,
    taken: float = 0.0,
) -> float:
    """Of the first of members that have one parameter each: symbol, value and deviation.

    Args:
        sizes: of each member.
        places: joints of each, from 0; the same drive where none is given.
        correlation: of each two parameters.
        doubt: deviation of the model's dry friction, N·m.
        taken: correlation of that, less one another, with the first parameter.
    """
    members, posterior = members_of(sizes, places, correlation, doubt, taken)
    return FRICTION.log_possible(members, posterior, places[0] if places else DRIVE)


def members_of(
    sizes: tuple[tuple[str, float, float], ...],
    places: tuple[Any, ...] = (),
    correlation: float = 0.0,
    doubt: float = 0.0,
    taken: float = 0.0,
) -> tuple[list[Any], Any]:
    """Members that have one parameter each, and their posterior; as of :func:`possible`."""
    scale = 2.0  # N·m, of each parameter: the posterior has them in units of it
    members = [
        SimpleNamespace(
            entry=SimpleNamespace(
                white=SimpleNamespace(scale=np.array([scale])),
                placed=SimpleNamespace(
                    parameters=(SimpleNamespace(symbol=symbol),), place=SimpleNamespace(joints=joints)
                ),
            ),
        )
        for (symbol, _, _), joints in zip(sizes, places or (DRIVE,) * len(sizes), strict=True)
    ]
    deviation = np.array([sigma for *_, sigma in sizes]) / scale
    mixed = np.full((len(sizes),) * 2, correlation) + (1.0 - correlation) * np.eye(len(sizes))
    covariance = np.eye(4 + len(sizes))  # four known factors first: friction of the drive, another, a lag
    covariance[:3, :3] = 0.0
    covariance[4:, 4:] = mixed * np.outer(deviation, deviation)
    covariance[0, 0], covariance[0, 4], covariance[4, 0] = doubt**2, *(-doubt * deviation[0] * taken,) * 2
    posterior = SimpleNamespace(
        known=np.array([MOVED, 0.0, 0.0, 0.0]),
        theta=np.array([value for _, value, _ in sizes]) / scale,
        covariance=covariance,
    )
    return members, posterior


PARAMETERS = [
    SimpleNamespace(symbol=symbol, joint=joint) for symbol, joint in (("Fc", 3), ("Fv", 3), ("Fc", 2))
]
MODEL: Any = SimpleNamespace(
    relation=np.eye(3),
    model=SimpleNamespace(parameters=PARAMETERS, prior=lambda: np.zeros(3), robot=SimpleNamespace(n=4)),
    standard_from=lambda base, prior: base,
)
FRICTION = UsualFriction.of(MODEL, Beta(np.array([DRY - MOVED, VISCOUS, 50.0]), np.eye(3)))
