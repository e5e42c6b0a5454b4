"""Options of ``armhil identify`` that are texts or numbers on the command line and settings inside."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, cast

from ident import IdentificationError, Recording
from ident.covariances import covariance_kinds
from ident.estimators import METHODS
from ident.results import Method
from robots import Identification

FRICTIONS = ("symmetric", "asymmetric")


def method_of(text: str) -> Method:
    """The method of that name.

    Raises:
        IdentificationError: there is none.
    """
    return one_of("method", text, METHODS)


def cutoff_of(text: str | None) -> float | Literal["auto"] | None:
    """``auto``, or a number of Hz; which numbers make sense, the sampling rate decides later.

    Raises:
        IdentificationError: neither.
    """
    if text is None or text == "auto":
        return cast("Literal['auto'] | None", text)
    try:
        return float(text)
    except ValueError:
        raise IdentificationError(f"--cutoff {text}; allowed: auto, or a number of Hz above 0") from None


def one_of(option: str, text: str, allowed: Sequence[str]) -> str:
    """The text, if it is one of those allowed.

    Raises:
        IdentificationError: it is not.
    """
    if text not in allowed:
        raise IdentificationError(f"--{option} {text}; allowed: {', '.join(allowed)}")
    return text


def chosen_settings(
    settings: Identification,
    recording: Recording,
    *,
    cutoff_hz: float | None = None,
    rate_hz: float | None = None,
    covariance: str | None = None,
    friction: str | None = None,
) -> Identification:
    """The arm's settings with those of the call in their place; None leaves the arm's.

    Args:
        settings: of the arm or the column map.
        recording: its sampling rate turns rows per second into a decimation.
        cutoff_hz: of the positions' low-pass.
        rate_hz: rows per second.
        covariance: by name.
        friction: ``symmetric`` or ``asymmetric``.

    Raises:
        IdentificationError: a name that there is not, or more rows than samples.
    """
    changes: dict[str, object] = {}
    if cutoff_hz is not None:
        changes["cutoff_hz"] = cutoff_hz
    if covariance is not None:
        changes["covariance"] = one_of("covariance", covariance, covariance_kinds())
    if friction is not None:
        changes["friction"] = one_of("friction", friction, FRICTIONS)
    if rate_hz is not None:
        decimation = round(1.0 / (recording.sample_time * rate_hz))
        if decimation < 1:
            raise IdentificationError(
                f"--rate {rate_hz:g} Hz; allowed: up to {1.0 / recording.sample_time:g} Hz,"
                f" the sampling rate of {recording.name}"
            )
        changes["decimation"] = decimation
    return settings.model_copy(update=changes)
