"""When a finding began, in a sentence and as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from daq.text.numbers import json_number
from ident.discrepancy.onset import Onset


def onset_words(onset: Onset, names: Sequence[str]) -> str:
    """When it changed, how sure that is, and how large it was before and after.

    Args:
        onset: of a finding.
        names: of the recordings that were fitted.
    """
    before = f"{onset.before:.2f} ± {onset.before_sigma:.2f}"
    after = f"{onset.after:.2f} ± {onset.after_sigma:.2f}"
    sure = f"probability {onset.probability:.2f}"
    if onset.kind == "drifts":
        return (
            f"Finding {onset.finding} drifts over the recordings, from {before} to {after} of the size that"
            f" was found ({sure})."
        )
    low, high = onset.interval
    return (
        f"Finding {onset.finding} {onset.kind} at {onset.time:.2f} s of {names[onset.recording - 1]}, with"
        f" 95 % between {low:.2f} and {high:.2f} s ({sure}); before it is {before}, after it {after} of the"
        " size that was found."
    )


def onset_json(onset: Onset) -> dict[str, Any]:
    """As plain values."""
    low, high = onset.interval
    return {
        "finding": onset.finding,
        "kind": onset.kind,
        "probability": json_number(onset.probability),
        "recording": onset.recording,
        "time": json_number(onset.time),
        "interval": [json_number(low), json_number(high)],
        "before": {"share": json_number(onset.before), "sigma": json_number(onset.before_sigma)},
        "after": {"share": json_number(onset.after), "sigma": json_number(onset.after_sigma)},
    }
