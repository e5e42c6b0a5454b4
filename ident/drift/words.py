"""The sentence that an operator reads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ident.drift.patterns import WARMTH
from ident.drift.values import Alarm, Comparison, DriftSettings, NamedChange


def sentence_of(found: Comparison, learned: int, settings: DriftSettings) -> Comparison:
    """The comparison with its sentence.

    Args:
        found: without.
        learned: clean nights so far.
        settings: of the comparison.
    """
    return replace(found, sentence=_words(found, learned, settings))


def strongest(alarms: Sequence[Alarm]) -> Alarm:
    """The alarm that is furthest beyond its threshold."""
    return max(alarms, key=lambda alarm: alarm.statistic / alarm.threshold)


def change_words(change: NamedChange) -> str:
    """A named change, e.g. ``Coulomb friction of joint 2 +3.1 % (±0.4 %), +0.25 N·m``."""
    if change.effect == "drive_gain_error":
        text = f"{change.words} {100 * change.size:+.1f} % (±{100 * change.sigma:.1g} %)"
    elif change.relative is not None and change.size != 0.0:
        share = abs(change.relative / change.size) * change.sigma
        percent = f"{100 * change.relative:+.1f} % (±{100 * share:.1g} %)"
        text = f"{change.words} {percent}, {change.size:+.3g} {change.unit}"
    else:
        text = f"{change.words} {change.size:+.3g} ± {change.sigma:.1g} {change.unit}"
    return f"{text}; or {' or '.join(change.alternatives)}" if change.alternatives else text


def _words(found: Comparison, learned: int, settings: DriftSettings) -> str:
    if found.state == "unchanged":
        if found.stage == "learning":
            return (
                "no large change; the arm's usual variation is still being learned"
                f" ({learned} of {settings.learning_nights} nights)"
            )
        return "nothing has moved beyond what this arm varies by from night to night"
    since = ""
    if found.since is not None:
        how = "growing since" if found.since.shape == "ramp" else "since"
        between = f", with 95 % between {found.since.earliest} and {found.since.latest}"
        sure = found.since.earliest == found.since.latest == found.since.label
        since = f", {how} {found.since.label}{'' if sure else between}"
    what = "; ".join(change_words(change) + _warmth_words(change, found) for change in found.changes)
    if not what and found.alarms and found.alarms[0].detector != "anything else":
        what = f"{strongest(found.alarms).chart} has moved, too little so far to say by how much"
    if not what:
        names = ", ".join(parameter.name for parameter in found.parameters[:3])
        what = (
            f"changed and no known effect explains it (most of all {names})"
            if names
            else ("changed, and neither a parameter nor an effect stands out")
        )
    worst = int(np.argmax(found.torque_change / np.maximum(found.torque_rms, 1e-12)))
    share = 100 * found.torque_change[worst] / found.torque_rms[worst]
    limit = "beyond" if found.large else "within"
    torque = f"{found.torque_change[worst]:.2g} {found.torque_units[worst]} rms on joint {worst + 1}"
    return (
        f"{what}{since}: {torque},"
        f" {share:.2g} % of its torque, {limit} the tolerance of {100 * settings.tolerance:g} %"
        f"{'; warmth may be all of it' if found.doubtful else ''}"
    )


def _warmth_words(change: NamedChange, found: Comparison) -> str:
    """What warmth would have to be to make a change of friction, beside what the thermometer says."""
    if change.kelvin is None:
        return ""
    measured = (
        "; no thermometer" if found.colder is None else f"; the thermometer says {_apart(found.colder)}"
    )
    if found.unmeasured is not None:
        measured = f"; the temperature of {found.unmeasured} is not known"
    elif found.colder is not None and round(abs(found.colder)) and found.colder * change.kelvin > 0.0:
        # A change is what the measured warmth does not explain: the night is compared at its temperature.
        measured = f", beyond the {_apart(found.colder)} that the thermometer says"
    if change.effect == WARMTH:
        return f" ({measured[2:]})"
    return f" (would need {abs(change.kelvin):.2g} K {_way(change.kelvin)} at least{measured})"


def _apart(colder: float) -> str:
    return f"{abs(colder):.0f} K {_way(colder)}"


def _way(colder: float) -> str:
    return "colder" if colder > 0.0 else "warmer"
