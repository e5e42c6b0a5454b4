"""Identifying an arm from recordings of one motion again and again: what noise does not change is made once.

That is the base parameters, their rank, the spectrum and cut-off that is proposed of the positions, and the
instruments, which are simulated with the estimate of a recording without noise. What a replicate identifies
with them differs from what it would by itself by a share of the estimate's own error (of second order).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any
from unittest.mock import patch

from ident import Recording, identify
from ident.estimators import LinearFit, Stacked, instrumental_variables
from ident.estimators.fit import stack_columns
from ident.identification.instruments import Instruments, iterate_instruments
from ident.parameters.base import BaseParameters
from ident.preparation.observation import Rows
from robots import Robot

_ONCE = ("base_parameters", "position_spectrum", "proposed_for", "rank_of")
"""Of :mod:`ident.identification.identify`."""


@contextmanager
def made_once(robot: Robot, quiet: tuple[Recording, ...]) -> Iterator[None]:
    """Within it :func:`ident.identify` of that arm with those settings goes the short way.

    Args:
        robot: with its settings.
        quiet: recordings of the motion without noise.
    """
    kept: list[Instruments] = []

    def whole(*given: Any, **more: Any) -> tuple[Instruments, LinearFit]:
        found = iterate_instruments(*given, **more)
        kept.append(found[0])
        return found

    def short(
        base: BaseParameters,
        recordings: tuple[Recording, ...],
        rows: Rows,
        stacked: Stacked,
        start: LinearFit,
        *_: Any,
    ) -> tuple[Instruments, LinearFit]:
        return kept[0], instrumental_variables(
            stacked, stack_columns(kept[0].columns, rows.used), start.sigma
        )

    with ExitStack() as stack:
        for name in _ONCE:
            target = f"ident.identification.identify.{name}"
            stack.enter_context(patch(target, _once(_named(name))))
        with patch("ident.identification.fits.iterate_instruments", whole):
            identify(robot, quiet)
        stack.enter_context(patch("ident.identification.fits.iterate_instruments", short))
        yield


def _named(name: str) -> Callable[..., Any]:
    from ident.identification import identify as module

    found: Callable[..., Any] = getattr(module, name)
    return found


def _once(make: Callable[..., Any]) -> Callable[..., Any]:
    """Gives what it gave first."""
    made: list[Any] = []

    def first(*given: Any, **more: Any) -> Any:
        if not made:
            made.append(make(*given, **more))
        return made[0]

    return first
