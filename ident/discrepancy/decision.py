"""From scores to a name, a set that cannot be told apart, or the admission that none fits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.discrepancy.component import Component
from ident.discrepancy.examination import Examination
from ident.discrepancy.library import Library, Trial
from ident.discrepancy.scoring import Score, best_per_place, noise_maxima, pairs, singles
from ident.discrepancy.settings import SearchSettings
from ident.discrepancy.shape_search import best_shapes
from ident.effects.gain_drift import UNNAMED_FAMILIES
from ident.effects.vocabulary import confused_with
from ident.parameters.present import Present
from robots.arrays import FloatArray

_UNNAMED = frozenset(family.name for family in UNNAMED_FAMILIES)

_LEADERS = 15
"""Single effects that are tried as one half of a pair."""

_POLISHED = 8
_WORTH = 0.15
"""Leaders whose shapes are refined before they are compared: so many, with this share of the best gain."""
_FEW = 14
"""Evaluations per shape that this may take."""

_SIMULATED, _FOLLOWED, _BESIDE = 8, 1, 3
"""Places simulated in closed loop: the best alone; beside so many leaders, so many each."""

_ALL_SHAPES = 5
"""Places of which all shapes are simulated."""

_GUMBEL_MEAN = 0.5772156649015329

_LEAST_TIE = 12.0
"""Scores within this are even whatever the data: likelihoods within e⁶ of each other."""


@dataclass(frozen=True)
class Choice:
    """What the search settles for at one step.

    Attributes:
        chosen: the effect, or the pair, that explains most; None where nothing passes.
        indistinguishable: other single candidates or pairs that this data cannot tell from it, best first.
        ranking: best score of each family and place, best first.
        threshold: what a score has to exceed.
        excess: residual sum of squares beyond noise before the choice.
        unexplained: the same beyond what is left without a missing effect, too, on the joints on which the
            chosen one acts: what another effect does to other joints is not for it to explain.
        p_value: chance that a clean arm reaches the chosen score somewhere, by calibration.
    """

    chosen: Score | None
    indistinguishable: tuple[Score, ...]
    ranking: tuple[Score, ...]
    threshold: float
    excess: float
    unexplained: float
    p_value: float


def choose(
    examination: Examination,
    library: Library,
    present: Present,
    settings: SearchSettings,
) -> Choice:
    """Rank all trials, alone and in pairs, and decide.

    Args:
        examination: the present model on the recordings.
        library: every trial on them.
        present: the present model, to refine shapes with.
        settings: thresholds.
    """
    rows = examination.torque.shape[0]
    calibration = _Calibration.of(library, rows, settings)
    library = _polished(examination, library, present)
    ranking = best_per_place(singles(library, library.score, rows))
    share = examination.smallest_share(settings)
    by_noise = max(calibration.threshold, settings.least_score)
    threshold = max(by_noise, share * rows)
    excess = examination.excess
    passing = [found for found in ranking if found.value >= _needed(found, by_noise, threshold)]
    best = (passing or ranking)[0]
    needed = _needed(best, by_noise, threshold)
    if not passing:
        return Choice(None, (), tuple(ranking), needed, excess, excess, calibration.p_value(best.value))
    tie = _TieTolerance(examination, library, settings)
    best = _simplest(best, ranking, tie)
    chosen, rivals = best, ranking
    left = excess - best.gain
    if left > threshold:
        pair = _best_pair(library, ranking, rows)
        if pair and pair[0].value - best.value > max(
            threshold, settings.indistinguishable * left, _share_of_second(pair[0], settings) * best.gain
        ):
            chosen, rivals = pair[0], pair
    indistinguishable = _indistinguishable(
        chosen, [rival for rival in rivals if rival.value >= by_noise], tie
    )
    unexplained = tie.unexplained(chosen)
    p_value = calibration.p_value(chosen.value)
    return Choice(chosen, indistinguishable, tuple(ranking), needed, excess, unexplained, p_value)


def _needed(found: Score, by_noise: float, threshold: float) -> float:
    """What a single candidate has to score.

    Evidence in the prior's rows is not weakened by a misfit of filters and friction: noise is its bound.
    """
    return by_noise + (1.0 - found.trials[0].prior_share) * (threshold - by_noise)


def _polished(examination: Examination, library: Library, present: Present) -> Library:
    """The library with the leaders' shapes refined: a resonance fits between two points of any grid."""
    rows = examination.torque.shape[0]
    if examination.simulations:
        library = _confirmed(examination, library, rows)
    ranking = best_per_place(singles(library, library.score, rows), each_form=True)
    leaders = [found.trials[0] for found in ranking[:_POLISHED] if found.gain > _WORTH * ranking[0].gain]
    robot = examination.base.model.robot
    better = []
    for trial in leaders:
        if any(not shape.fixed for shape in trial.family.shapes(robot, trial.place)):
            (best,) = best_shapes(examination, [Component.of(trial)], present, 0.5, _FEW, exact=False)
            better.append((trial.family, best.effect(examination, present)))
    return library.with_effects(examination, better) if better else library


def _confirmed(examination: Examination, library: Library, rows: int) -> Library:
    """The trials that lead, alone or beside a leader, with their columns simulated."""
    ranking = best_per_place(singles(library, library.score, rows))
    chosen = ranking[:_SIMULATED]
    families = {found.trials[0].family.name for found in chosen}
    for found in ranking[_SIMULATED:]:
        if found.trials[0].family.name not in families and found.gain > 0.0:
            families.add(found.trials[0].family.name)
            chosen.append(found)
    wanted = [found.trials[0] for found in chosen]
    for leader in ranking[:_FOLLOWED]:
        beside = best_per_place(pairs(library, [leader], library.score, rows))
        wanted += [pair.trials[1] for pair in beside[:_BESIDE]]
    for leader in ranking[:_ALL_SHAPES]:
        key = leader.trials[0].key
        wanted += [trial for trial in library.trials if trial.key == key]
    unique = {(trial.key, trial.effect.shape): trial for trial in wanted}
    return library.without_trials().with_effects(
        examination, [(trial.family, trial.effect) for trial in unique.values()]
    )


def _best_pair(library: Library, ranking: Sequence[Score], rows: int) -> list[Score]:
    """An unnamed family is no half of a pair: it would take the name away from the other half."""
    leaders = [found for found in ranking if not _is_unnamed(found.trials[0])][:_LEADERS]
    both = pairs(library, leaders, library.score, rows)
    return best_per_place([pair for pair in both if not any(map(_is_unnamed, pair.trials))])


def _is_unnamed(trial: Trial) -> bool:
    return trial.family.name in _UNNAMED


def _indistinguishable(chosen: Score, rivals: Sequence[Score], tie: _TieTolerance) -> tuple[Score, ...]:
    """Rivals whose score is so near that the difference decides nothing."""
    keys = {trial.key for trial in chosen.trials}
    return tuple(
        rival
        for rival in rivals
        if {trial.key for trial in rival.trials} != keys
        and not _general_form(rival, chosen)
        and chosen.value - rival.value <= tie.allowed(chosen, rival)
    )


def _general_form(rival: Score, chosen: Score) -> bool:
    """Whether the rival differs from the chosen one by a general form in place of its limit, or as well."""
    mine = {trial.key for trial in chosen.trials}
    others = [trial for trial in rival.trials if trial.key not in mine]
    left = [trial for trial in chosen.trials if trial.key not in {t.key for t in rival.trials}]
    return bool(others) and all(any(_is_limit(limit, other) for limit in left) for other in others)


def _is_limit(limit: Trial, general: Trial) -> bool:
    """A limit has no more shapes than the general form: a spring between anchors is none of a cable."""
    named = limit.family.name in general.family.contains
    return named and limit.shapes <= general.shapes and _sits_with(limit, general)


def _sits_with(limit: Trial, general: Trial) -> bool:
    """At the same place; the drive of coupled axes is that of the second."""
    if limit.place.scope == "joint_pair" and general.place.scope == "drive":
        return limit.place.joints[1] == general.place.joints[0]
    return limit.place.joints == general.place.joints


def _simplest(best: Score, ranking: Sequence[Score], tie: _TieTolerance) -> Score:
    """A limit of the best candidate that explains as much, where there is one."""
    for rival in ranking:
        simpler = rival is not best and _general_form(best, rival)
        if simpler and best.value - rival.value <= tie.allowed(best, rival):
            return rival
    return best


def _share_of_second(pair: Score, settings: SearchSettings) -> float:
    """What the second effect of a pair takes away at least, as a share of the first one's."""
    first, second = (set(trial.place.joints) for trial in pair.trials)
    return settings.form_share if first & second else settings.second_share


def _known_to_look_the_same(one: Score, other: Score) -> bool:
    """Whether they differ in names alone, at the same joints, which are known to pass for each other."""
    shared = {trial.key for trial in one.trials} & {trial.key for trial in other.trials}
    mine = [trial for trial in one.trials if trial.key not in shared]
    others = [trial for trial in other.trials if trial.key not in shared]
    return bool(others) and all(
        any(
            trial.place.joints == rival.place.joints and rival.family.name in confused_with(trial.family.name)
            for trial in mine
        )
        for rival in others
    )


@dataclass(frozen=True)
class _TieTolerance:
    """Differences of scores that decide nothing.

    What the better one leaves of the data measures how wrong the forms of effects are; evidence in the
    prior's rows has no form, but both candidates have to have theirs there. Names that are known to pass
    for each other need twice as much. Where noise is not told from repeats, scores are only known to a
    share.
    """

    examination: Examination
    library: Library
    settings: SearchSettings

    def unexplained(self, *scores: Score) -> float:
        """Residual sum of squares beyond noise and the usual misfit on the joints on which candidates act."""
        misfit = self.examination.misfit(self.settings)
        joint = self.examination.joint_of_rows
        trials = [trial for score in scores for trial in score.trials]
        acts = np.flatnonzero(self.library.joints_of(trials, joint))
        rows = int(np.isin(joint, acts).sum())
        return float(self.examination.excess_of_joints[acts].sum()) - misfit * rows

    def allowed(self, better: Score, worse: Score) -> float:
        """How much better the one may score and still be tie with the other."""
        if not self.examination.repeats:
            return max(_LEAST_TIE, self.settings.indistinguishable_without_repeats * better.gain)
        left = self.settings.indistinguishable * max(self.unexplained(better, worse) - better.gain, 0.0)
        if _known_to_look_the_same(better, worse):
            return max(_LEAST_TIE, 2.0 * left)
        of_data = 1.0 - min(trial.prior_share for trial in (*better.trials, *worse.trials))
        return max(_LEAST_TIE, of_data * left)


@dataclass(frozen=True)
class _Calibration:
    """Gumbel distribution of the largest score over all trials when nothing is missing."""

    location: float
    spread: float
    false_alarm: float

    @classmethod
    def of(cls, library: Library, rows: int, settings: SearchSettings) -> _Calibration:
        zero: FloatArray = np.zeros(library.score.size)
        largest = noise_maxima(library, zero, rows, settings.draws, settings.seed)
        spread = float(largest.std() * np.sqrt(6) / np.pi)
        return cls(float(largest.mean() - _GUMBEL_MEAN * spread), spread, settings.false_alarm)

    @property
    def threshold(self) -> float:
        return self.location - self.spread * float(np.log(-np.log1p(-self.false_alarm)))

    def p_value(self, value: float) -> float:
        return float(-np.expm1(-np.exp(-(value - self.location) / self.spread)))
