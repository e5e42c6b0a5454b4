"""Search for the waypoints of the most informative motion: one waypoint is changed at a time.

The information of a motion is the sum over its segments, and a waypoint touches two of them. So a trial
costs two segments and not a whole motion: the exchange idea of optimal design (Fedorov 1972), accepted by
simulated annealing (Kirkpatrick et al. 1983). Trials are counted, not timed, so a seed repeats exactly.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from trajectories.information.matrix import NONE
from trajectories.motions.motion import Motion
from trajectories.motions.segments import SegmentPlanner, hold, join
from trajectories.search.chain import Chain, ChainBuilder
from trajectories.search.problem import ExcitationProblem

START_TEMPERATURE = 0.01
SMALLEST_STEP, LARGEST_STEP = 0.005, 1.0
OVERTIME_COST = 5.0
"""Score per relative excess of the duration: more than the information that the time could bring."""

_INSERT, _REMOVE, _ANYWHERE = 0.04, 0.06, 0.10
"""Shares of the trials, cumulated: one more waypoint, one less, one anywhere else; the others are moved."""


@dataclass
class WaypointSearch:
    """One annealed search from one seed. :meth:`advance` it as far as time allows; the best is always valid.

    Attributes:
        problem: what is sought.
        seed: fixes every trial.
        evaluations: trials that the cooling is spread over.
        done: trials so far.
        best_score: of the best motion that keeps the duration.
    """

    problem: ExcitationProblem
    seed: int
    evaluations: int
    done: int = field(init=False, default=0)
    best_score: float = field(init=False)
    _builder: ChainBuilder = field(init=False, repr=False)
    _chain: Chain = field(init=False, repr=False)
    _score: float = field(init=False, repr=False)
    _best: Chain = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self._builder = ChainBuilder(self.problem, np.random.default_rng(self.seed))
        self._chain = self._best = self._builder.first_chain()
        self._score = self.best_score = self._score_of(self._chain, NONE)

    def finished(self) -> Motion:
        """The best motion with its last segment slowed down, or a pause added, to last the duration."""
        parts = [piece.motion for piece in self._best.pieces]
        missing = self.problem.duration - sum(part.duration for part in parts)
        if missing < 1e-6 or self.problem.goal is None:
            return join(parts)
        slower = SegmentPlanner(self.problem.limits).connect(
            self._best.waypoints[-2], self.problem.goal, parts[-1].duration + missing
        )
        if slower is not None and self.problem.allows(slower):
            return join([*parts[:-1], slower])
        return join([*parts, hold(self.problem.goal.position, missing)])

    def advance(self, trials: int) -> None:
        """Do some more trials, as many as are left of ``evaluations`` at most."""
        for _ in range(min(trials, self.evaluations - self.done)):
            self._trial()
            self.done += 1

    def _trial(self) -> None:
        random = self._builder.generator
        cooling = max(0.0, 1.0 - self.done / (0.8 * self.evaluations))
        worst = self._score - START_TEMPERATURE * cooling**2 * float(np.log(random.random()))
        index = int(random.integers(len(self._chain.waypoints)))
        kind = random.random()
        candidate = self._candidate(index, kind)
        accepted = candidate is not None and self._accept(candidate, worst)
        if kind >= _ANYWHERE:
            step = self._chain.steps[index] * (1.6 if accepted else 0.95)
            self._chain.steps[index] = min(max(step, SMALLEST_STEP), LARGEST_STEP)

    def _candidate(self, index: int, kind: float) -> Chain | None:
        chain, builder = self._chain, self._builder
        inside = 0 < index < len(chain.waypoints) - 1
        if kind < _INSERT:
            return builder.with_another(chain, index) if inside else None
        if kind < _REMOVE:
            return builder.rebuilt(chain, index, []) if inside else None
        if self._is_fixed(index):
            return None
        if kind < _ANYWHERE:
            return builder.rebuilt(chain, index, [builder.random_waypoint()])
        return builder.rebuilt(chain, index, [builder.near(chain.waypoints[index], chain.steps[index])])

    def _is_fixed(self, index: int) -> bool:
        if index == 0:
            return self.problem.start is not None
        return index == len(self._chain.waypoints) - 1 and self.problem.goal is not None

    def _accept(self, candidate: Chain, worst: float) -> bool:
        score = self._score_of(candidate, worst)
        if score > worst:
            return False
        fresh = (new for new in candidate.pieces if all(new is not known for known in self._chain.pieces))
        if not all(self.problem.allows(piece.motion) for piece in fresh):
            return False
        self._chain, self._score = candidate, score
        if score < self.best_score and candidate.duration <= self.problem.duration:
            self.best_score = score
            self._best = Chain(list(candidate.waypoints), list(candidate.pieces), [])
        return True

    def _score_of(self, chain: Chain, unless_above: float) -> float:
        overtime = OVERTIME_COST * max(0.0, chain.duration / self.problem.duration - 1.0)
        return self.problem.objective.score(chain.matrix, unless_above - overtime) + overtime
