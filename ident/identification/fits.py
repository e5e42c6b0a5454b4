"""Every estimate that a method asks for, from rows and recordings."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from ident.errors import IdentificationError, SimulationError
from ident.estimators import ALTERNATIVES, LinearFit, Stacked, weighted_least_squares
from ident.identification.alignment import LagEstimate
from ident.identification.instruments import Instruments, iterate_instruments
from ident.identification.options import Options
from ident.identification.taken_up import TakenUp
from ident.parameters.base import BaseParameters
from ident.preparation.observation import Rows
from ident.recording import Recording
from ident.results import Rank
from ident.statistics.covariance import instrumental_covariance
from ident.statistics.restricted import regression_whitening
from ident.statistics.whitening import Whitening
from robots.arrays import FloatArray

Progress = Callable[[str, float], None]
"""Called with a step in words and the share of the whole that is done, 0 to 1."""


@dataclass(frozen=True)
class Prepared:
    """Rows with what was found out about them."""

    base: BaseParameters
    rows: Rows
    stacked: Stacked
    rank: Rank
    errors: Whitening
    lag: LagEstimate
    taken_up: TakenUp


@dataclass(frozen=True)
class Fits:
    """The estimates; ``reason`` says why there are no instruments, ``impossible`` whether that is
    because the estimated arm cannot be simulated. ``of_loads`` (b, b) is what the covariance of each holds
    of what is not known of the bodies that the arm carried; None where all is."""

    least_squares: LinearFit
    instrumental: LinearFit | None
    instruments: Instruments | None
    alternatives: Mapping[str, LinearFit]
    reason: str = ""
    impossible: bool = False
    of_loads: FloatArray | None = None

    def each(self, change: Callable[[LinearFit], LinearFit]) -> Fits:
        """The same with every estimate changed."""
        return replace(
            self,
            least_squares=change(self.least_squares),
            instrumental=None if self.instrumental is None else change(self.instrumental),
            alternatives={name: change(fit) for name, fit in self.alternatives.items()},
        )

    def widened(self, spread: Callable[[LinearFit], FloatArray | None]) -> Fits:
        """With covariances that hold what is not known of bodies that the arm carried."""
        more = spread(self.least_squares)
        if more is None:
            return self

        def wide(fit: LinearFit) -> LinearFit:
            return replace(fit, covariance=fit.covariance + more)

        return replace(self.each(wide), of_loads=more)


def all_fits(
    prepared: Prepared, recordings: tuple[Recording, ...], options: Options, progress: Progress
) -> Fits:
    """Every estimate that the method asks for, but the consistent one, which waits for the verdict.

    Raises:
        IdentificationError: the rows do not determine the parameters; or IV was asked for and cannot be had.
    """
    base, stacked = prepared.base, prepared.stacked
    settings = base.model.robot.identification
    progress("least squares", 0.65)
    plain = weighted_least_squares(stacked, base.names, settings.error_deviation)
    least_squares = _with_covariance(prepared, plain, None)
    others = {
        name: estimator.fit(stacked, base.names, settings.error_deviation)
        for name, estimator in ALTERNATIVES.items()
        if name == options.method
    }
    if options.method == "ls":
        return Fits(least_squares, None, None, others, "least squares alone was asked for")
    try:
        instruments, fit = _instrumental(prepared, recordings, plain, options, progress)
    except IdentificationError as error:
        if options.method == "iv":
            raise IdentificationError(f"no estimate by instrumental variables: {error}") from error
        impossible = isinstance(error, SimulationError)
        return Fits(least_squares, None, None, others, str(error), impossible)
    instrumental = _with_covariance(prepared, fit, instruments.columns)
    return Fits(least_squares, instrumental, instruments, others)


def _with_covariance(prepared: Prepared, fit: LinearFit, instruments: FloatArray | None) -> LinearFit:
    """The same estimate with the covariance of the arm's settings; LS (no instruments) has X as its own."""
    rows, name = prepared.rows, prepared.base.model.robot.identification.covariance
    if name == "block":  # the estimators' own
        return fit
    z = rows.regressor if instruments is None else instruments
    residual = rows.torque - rows.predicted(fit.beta)
    if name == "ar":
        errors = prepared.errors
        if instruments is not None:
            errors = regression_whitening(residual, instruments, rows.segment, rows.used)
        covariance = instrumental_covariance(z, rows.regressor, fit.sigma, errors, rows.segment, rows.used)
        return replace(fit, covariance=covariance, covariance_kind=errors.describe())
    from ident.covariances import (
        covariance_named,
        covariance_of,
        estimated_rows,
    )  # the kinds that few ask for

    kind = covariance_named(name)
    estimated = estimated_rows(rows.regressor, z, residual, fit.sigma, rows.segment, rows.used)
    return replace(fit, covariance=covariance_of(estimated, kind), covariance_kind=kind.describe(estimated))


def _instrumental(
    prepared: Prepared,
    recordings: tuple[Recording, ...],
    start: LinearFit,
    options: Options,
    progress: Progress,
) -> tuple[Instruments, LinearFit]:
    """Instruments and IDIM-IV fit.

    Raises:
        IdentificationError: there is no reference, or the loop cannot be simulated.
    """

    def step(iteration: int) -> None:
        # Imported here: what has no loop to simulate needs no compiler.
        from ident.closed_loop.compiled import is_compiled

        first = "" if iteration > 1 or is_compiled(prepared.base.model.robot) else ", compiled once"
        progress(f"closed-loop simulation {iteration}{first}", 0.65 + 0.2 * min(1.0, iteration / 4))

    def nearest_arm(fit: LinearFit) -> FloatArray:
        from ident.estimators.consistent import consistent_fit

        return consistent_fit(prepared.base, fit, prepared.stacked).standard

    if any(recording.reference is None for recording in recordings):
        raise IdentificationError("no position reference was recorded, so the loop cannot be simulated")
    if not prepared.base.model.robot.controller.is_given:
        raise IdentificationError("robot.toml describes no controller, so the loop cannot be simulated")
    standard = nearest_arm if options.method == "consistent" else None
    return iterate_instruments(
        prepared.base, recordings, prepared.rows, prepared.stacked, start, step, standard
    )
