"""What a comparison takes in and gives back: small frozen values, nothing that computes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from robots.arrays import FloatArray

Shape = Literal["step", "ramp"]
State = Literal["unchanged", "changed"]
Stage = Literal["learning", "watching"]
"""While it learns, what the arm differs by from night to night comes mostly from priors."""
Detector = Literal["one night", "trend", "size", "anything else", "wald"]


@dataclass(frozen=True)
class Night:
    """One identification of the arm on its accepted trajectory.

    Attributes:
        day: when, in days from any origin.
        values: (b,) base parameters, SI.
        covariance: (b, b) of them within the run.
        celsius: (n,) temperature of each joint during the run, °C; None where none was recorded.
        clean: whether it may teach what is usual; False for a night on which something was found.
        label: what a reader knows it by, e.g. the number of the run.
    """

    day: float
    values: FloatArray
    covariance: FloatArray
    celsius: FloatArray | None = None
    clean: bool = True
    label: str = ""


@dataclass(frozen=True)
class DriftSettings:
    """How often a false alarm is allowed, and what counts as large.

    Attributes:
        false_alarms_per_year: expected number per arm, over all charts together.
        nights_per_year: how often the arm is checked.
        learning_nights: clean nights from which the run-to-run covariance is estimated; the charts speak from
            the first night on, wider until then.
        tolerance: change of the torque on a joint, as a share of that joint's rms torque on the trajectory,
            up to which a change is only a warning.
        negligible: the same share, below which a change is not worth reporting however sure it is: what a
            smooth temperature model leaves over a year is of that size.
        coulomb_per_kelvin, coulomb_per_kelvin_sigma: prior of the relative decrease of Coulomb friction for
            each kelvin, and by how much arms and joints differ in it.
        viscous_per_kelvin, viscous_per_kelvin_sigma: the same of viscous friction.
        hall_sigma: prior deviation of the hall's warmth where no temperature is recorded, K.
        gear_sigma: deviation of the warmth that one gear has of its own, K; friction that it makes at the
            prior's coefficients is not worth reporting.
        thermometer_sigma: by how much the gears' temperature may differ from what was recorded, K.
        possible_warmth: what a hall without a thermometer may differ by at the very most, K: up to there a
            change of friction is doubtful, and no failure.
        level: of the tests that name what has moved, after correction for how many were tried.
    """

    false_alarms_per_year: float = 0.5
    nights_per_year: float = 365.0
    learning_nights: int = 30
    tolerance: float = 0.05
    negligible: float = 0.002
    coulomb_per_kelvin: float = 0.005
    coulomb_per_kelvin_sigma: float = 0.005
    viscous_per_kelvin: float = 0.015
    viscous_per_kelvin_sigma: float = 0.005
    hall_sigma: float = 5.0
    gear_sigma: float = 2.0
    thermometer_sigma: float = 3.0
    possible_warmth: float = 15.0
    level: float = 0.01


@dataclass(frozen=True)
class DriftTest:
    """One test: what it takes for granted, what came out, and how likely that is under it."""

    name: str
    null: str
    statistic: float
    distribution: str
    df: tuple[float, ...]
    p_value: float


@dataclass(frozen=True)
class MovedParameter:
    """One base parameter beside its baseline, corrected for temperature where there is one.

    Attributes:
        change: in the parameter's unit.
        sigma: of the change, run-to-run variation included.
        p_value: two-sided, of this parameter alone.
        corrected: the same after Holm's correction over all parameters.
        torque_rms: of the change on the trajectory, over the joints, N·m (or N).
    """

    name: str
    change: float
    sigma: float
    unit: str
    p_value: float
    corrected: float
    torque_rms: float


@dataclass(frozen=True)
class NamedChange:
    """An effect that explains what has moved.

    Attributes:
        effect: name as in the vocabulary of effects.
        joint: from 1; None for the tool.
        words: for an operator, e.g. ``Coulomb friction of joint 2``.
        size, sigma: of the change, in ``unit``.
        unit: of them.
        relative: change as a share of the baseline's value; None where that has no meaning.
        explained: drop of the statistic by it.
        p_value: of that drop, corrected for the number of effects tried.
        torque_rms: (n,) of the change on the trajectory per joint, N·m (or N).
        kelvin: least warmth that would make it, K colder than usual; None where warmth makes none of it.
        alternatives: words of effects that explain it nearly as well.
    """

    effect: str
    joint: int | None
    words: str
    size: float
    sigma: float
    unit: str
    relative: float | None
    explained: float
    p_value: float
    torque_rms: FloatArray
    alternatives: tuple[str, ...] = ()
    kelvin: float | None = None


@dataclass(frozen=True)
class ChangePoint:
    """Since when, and how: a step or a ramp.

    Attributes:
        index, day, label: of its likeliest first night.
        shape: of the change.
        earliest, latest: labels of the nights between which it began with 95 %.
        wear: probability that it grows, and is no step.
    """

    index: int
    day: float
    shape: Shape
    label: str
    earliest: str
    latest: str
    wear: float


@dataclass(frozen=True)
class Alarm:
    """One chart beyond its threshold."""

    chart: str
    detector: Detector
    statistic: float
    threshold: float


@dataclass(frozen=True)
class Usual:
    """What is usual of one chart: prior → posterior, and what was forgiven tonight.

    Attributes:
        chart: words.
        unit: of sigma and forgiven: ``%`` of the baseline's value where that has a meaning.
        prior_sigma: deviation of a night, before there were nights.
        sigma, low, high: posterior median, 5 % and 95 % points.
        forgiven: how far tonight might have been off its prediction without an alarm.
        prior_per_kelvin, prior_per_kelvin_sigma: change per kelvin, before; None without a thermometer.
        per_kelvin, per_kelvin_sigma: posterior of it.
    """

    chart: str
    unit: str
    prior_sigma: float
    sigma: float
    low: float
    high: float
    forgiven: float
    prior_per_kelvin: float | None = None
    prior_per_kelvin_sigma: float | None = None
    per_kelvin: float | None = None
    per_kelvin_sigma: float | None = None


@dataclass(frozen=True)
class Course:
    """One chart over the nights, for a picture.

    Attributes:
        chart: words.
        unit: of the amounts: ``%`` of the baseline's value where that has a meaning.
        labels: (N,) of the nights, the baseline first.
        day: (N,) since the baseline.
        amount: (N,) beside the baseline, what the temperature makes taken out.
        clean: (N,) nights that teach.
        low, high: between which tonight would have been fine.
    """

    chart: str
    unit: str
    labels: tuple[str, ...]
    day: FloatArray
    amount: FloatArray
    clean: tuple[bool, ...]
    low: float
    high: float


@dataclass(frozen=True)
class Comparison:
    """Tonight beside the baseline.

    Attributes:
        state: whether anything has moved.
        stage: learning or watching.
        sentence: for an operator.
        wald: all parameters at once, with both covariances and nothing else: what one run can say.
        between_runs: the same with the run-to-run variation of this arm; None while it is not known.
        parameters: those that moved, the surest first.
        changes: effects that explain it; empty where nothing moved, or nothing explains it.
        since: None where nothing moved or one night is all there is.
        alarms: charts beyond their threshold.
        torque_change: (n,) rms change of the torque on the trajectory per joint, N·m (or N).
        torque_rms: (n,) of the torque itself there.
        torque_units: of both, N·m of a joint that turns and N of one that slides.
        large: whether something has moved, and by more than the tolerance on some joint.
        unexplained: test of what the named changes leave; None where nothing was named.
        doubtful: whether warmth that nobody measured may be all of it.
        colder: by how much the thermometers were below the clean nights' mean, K (largest joint).
        unmeasured: the night whose temperature is not known, where others have one: none counts then.
        usual: of each chart.
        course: of the chart that says most: named first, or nearest its limit.
    """

    state: State
    stage: Stage
    sentence: str
    wald: DriftTest
    between_runs: DriftTest | None
    parameters: tuple[MovedParameter, ...]
    changes: tuple[NamedChange, ...]
    since: ChangePoint | None
    alarms: tuple[Alarm, ...]
    torque_change: FloatArray
    torque_rms: FloatArray
    torque_units: tuple[str, ...]
    large: bool
    unexplained: DriftTest | None = None
    doubtful: bool = False
    colder: float | None = None
    unmeasured: str | None = None
    usual: tuple[Usual, ...] = ()
    course: Course | None = None
