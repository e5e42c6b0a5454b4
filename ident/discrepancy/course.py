"""The model that a search goes on with: what was there before, and what was found."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from ident.discrepancy.accepted import Accepted
from ident.discrepancy.basis import Basis
from ident.discrepancy.component import Component
from ident.discrepancy.prepared_recording import PreparedRecording
from ident.discrepancy.prior import extended, extended_prior
from ident.discrepancy.refine import added_values, refit, with_effects
from ident.discrepancy.refined import Refined
from ident.discrepancy.results import Finding
from ident.discrepancy.sized_in_loop import sized_in_loop
from ident.discrepancy.step import LoopStep, Step
from ident.discrepancy.validation import LoopRun, Validation
from robots.arrays import FloatArray


@dataclass
class Course:
    """Where a search is.

    Attributes:
        prepared: recordings to fit.
        first: the model before anything was found.
        step: with all that was found.
        moving: with what the moving arm shows.
        reversing: the same in closed loop, once reversals are looked at.
        findings: in the order they were made.
    """

    prepared: tuple[PreparedRecording, ...]
    first: Step
    step: Step
    moving: Step
    reversing: LoopStep | None = None
    findings: list[Accepted] = field(default_factory=list)

    @classmethod
    def begun(cls, prepared: tuple[PreparedRecording, ...], first: Step) -> Course:
        return cls(prepared, first, first, first)

    def take(
        self,
        components: Sequence[Component],
        bases: Sequence[Basis],
        sizes: Sequence[FloatArray] = (),
        standard: FloatArray | None = None,
    ) -> None:
        """Fit what was found, all of it together, and go on with a model that has it.

        Args:
            components: with their shapes.
            bases: what each was settled for on.
            sizes: of each, where they are about known: what does not repeat beside these is noise.
            standard: (p,) parameters of the model beside them, where they are known.
        """
        if sizes:
            examination, present = self.first.examination, self.first.present
            self.first = self.first.beside([one.effect(examination, present) for one in components], sizes)
        self._go_on_with(self._refitted(components, sizes, standard), components, bases)

    def instead(self, components: Sequence[Component], bases: Sequence[Basis]) -> Course:
        """Where the search would be with other findings; their fit begins with the model that this one has.

        Fits that begin apart may end apart in what both have: beside a dead zone a delay of another drive was
        0, beside a current offset 31 µs, and by that the loop told these two (98696).

        Args:
            components, bases: as of :meth:`take`.

        Raises:
            ArithmeticError: one has no size.
        """
        other = Course.begun(self.prepared, self.first)
        refined = refit(self.first.examination, components, self.first.present, self.moving.present)
        other._go_on_with(refined, components, bases)
        return other

    def _go_on_with(self, refined: Refined, components: Sequence[Component], bases: Sequence[Basis]) -> None:
        """A model with effects that the moving arm shows, as they were fitted beside each other."""
        robot = self.first.base.model.robot
        pairs = enumerate(zip(components, bases, strict=True))
        self.findings = [Accepted.of(robot, one, basis, refined, k) for k, (one, basis) in pairs]
        self.step = self.moving = self._extended(self.first, refined)

    def add_in_loop(self, in_loop: LoopStep, component: Component, basis: Basis) -> None:
        """Size what the closed loop shows beside all that was found, and go on with a model that has it.

        Args:
            in_loop: the model with all that was found, in closed loop.
            component: with its shapes.
            basis: what it was settled for on.

        Raises:
            ArithmeticError, IdentificationError: it has no size there, or the loop with it cannot be
                simulated; nothing is changed then.
        """
        by_columns = refit(in_loop.examination, [component], in_loop.present)
        refined = sized_in_loop(in_loop.examination, by_columns)
        step = self._extended(in_loop, refined)
        _ = step.examination.covariance  # raises where rows of the loop determine too little
        robot = self.first.base.model.robot
        self.findings = [*self.findings, Accepted.of(robot, refined.components[0], basis, refined, 0)]
        self.step, self.reversing = step, in_loop

    def _fit_together(self, accepted: Sequence[Accepted]) -> None:
        """A model with some of the findings, each fitted again beside the others."""
        components = [one.component for one in accepted]
        standard = self.moving.present.standard[: self.first.present.standard.size]
        refined = self._refitted(components, [one.linear for one in accepted], standard)
        self._go_on_with(refined, components, [one.basis for one in accepted])

    def _refitted(
        self, components: Sequence[Component], sizes: Sequence[FloatArray], standard: FloatArray | None
    ) -> Refined:
        """Effects beside the first model; the fit begins with sizes and parameters that are about known."""
        examination, alone = self.first.examination, self.first.present
        about = None
        if standard is not None:
            about = with_effects(examination, components, alone, standard, sizes)
        return refit(examination, components, alone, about)

    def _extended(self, before: Step, refined: Refined) -> Step:
        return before.extended(
            extended(before.base, refined.effects, refined.seen),
            self.prepared,
            extended_prior(before.prior, int(sum(seen.sum() for seen in refined.seen))),
            np.concatenate([before.examination.beta, *added_values(refined)]),
        )

    def _in_motion(self) -> list[Accepted]:
        """What the moving arm shows; the rest was found at reversals, beside it."""
        return self.findings[: len(self.moving.base.model.effects) - len(self.first.base.model.effects)]

    def _without(self, position: int) -> Step:
        """The final model less one finding."""
        in_motion = self._in_motion()
        if position >= len(in_motion):
            assert self.reversing is not None
            return self.reversing
        others = [one for k, one in enumerate(in_motion) if k != position]
        if not others:
            return self.first
        seen = [one.seen for one in others]
        prior = extended_prior(self.first.prior, int(sum(one.sum() for one in seen)))
        base = extended(self.first.base, [one.placed for one in others], seen)
        whitening = self.first.examination.whitening
        return Step.of(base, self.prepared, prior, whitening, self.first.plain, simulated=False)

    def validated(
        self, validation: Validation, weighed: Callable[[Finding], Finding] = lambda finding: finding
    ) -> tuple[list[Finding], list[Finding], LoopRun]:
        """Findings that stay, those that data that was not fitted contradicts beside them, the final loop.

        A model is fitted again without what is contradicted: what is confirmed was fitted beside it. What was
        found at reversals was found beside all that moves, so of that nothing is taken away from under it; it
        goes alone, too, where it is refuted: a simulated loop that is a little wrong there explains itself by
        whatever the vocabulary has, and that does not last on other motion. That loop had the friction at
        standstill that the same recordings showed, so it is asked of the description's where that is nearer.

        What is doubted goes first: beside two delays that were not there a friction of which other motion
        showed 100.4 ± 0.5 % had gone. What the search itself doubts goes at once, since other motion does not
        change that. Where nothing is confirmed beside all the rest, they go as well, what explains least
        first, until something is; if nothing ever is, all of them stay, not confirmed, but for what is
        contradicted beside the one that explains most. What the recordings say nothing of stays beside all
        that: a drive that no other motion took to its limit. (Beside a base that gives way, of which other
        motion showed 93 ± 174 %, the counterbalance of a real arm had 79 ± 384 %; alone it has 82 ± 9 %.)

        Args:
            validation: recordings that were not fitted.
            weighed: a finding with what they say of it in its probability, and in what confirms it.
        """
        rejected: list[Finding] = []
        unconfirmed: tuple[Step, Step, list[Accepted], tuple[list[Finding], list[Finding], LoopRun]] | None
        unconfirmed = None
        while True:
            asked, last = self._asked_of(validation)
            found = [weighed(one) for one in asked]
            unseen = [k for k, one in enumerate(found) if one.confirmation.unseen]
            wrong = [k for k, one in enumerate(found) if not one.confirmation.passed and k not in unseen]
            confirmed, moving = len(found) - len(wrong) - len(unseen), len(self._in_motion())
            refuted = False
            if len(found) > moving:
                wrong = [k for k in wrong if k >= moving]
                refuted = any(found[k].confirmation.refuted for k in wrong)
            if not wrong:
                return found, rejected, last
            first = min(wrong, key=lambda k: _least_borne_out(found[k])) if confirmed else wrong[-1]
            gone = [k for k in wrong if self.findings[k].basis.doubt] or [first]
            if not (confirmed or refuted):
                if unconfirmed is None:
                    unconfirmed = (self.step, self.moving, self.findings, (found, list(rejected), last))
                if moving < len(found) or len(gone) + len(unseen) == len(found):
                    self.step, self.moving, self.findings, (found, rejected, last) = unconfirmed
                    gone, first, unconfirmed = self._contradicted(found), 0, None
                    if not gone:
                        return found, rejected, last
            rejected += [found[k] for k in gone]
            self.step = self.moving
            if first < moving:
                self._fit_together([one for k, one in enumerate(self._in_motion()) if k not in gone])
            else:
                self.findings = self._in_motion()

    def with_other_forms(self, found: Sequence[Finding]) -> list[Finding]:
        """What stays in the end, with deviations that hold what other forms would make of its sizes.

        Args:
            found: one per finding, in their order.
        """
        return [
            one.with_deviations_more(accepted.of_forms())
            for one, accepted in zip(found, self.findings, strict=True)
        ]

    def _contradicted(self, found: Sequence[Finding]) -> list[int]:
        """Findings that other motion speaks against, but for the first.

        None where one was found at reversals: that was found beside all the others.
        """
        if len(self._in_motion()) < len(found):
            return []
        return [k for k, one in enumerate(found) if k and one.confirmation.against]

    def _asked_of(self, validation: Validation) -> tuple[list[Finding], LoopRun]:
        """Findings beside each other on recordings that were not fitted, and the loop with all of them."""
        last = validation.loop_run(self.step)
        moving = last if self.step is self.moving else validation.loop_run(self.moving)
        found = []
        for k, one in enumerate(self.findings):
            without = self._without(k)
            whole = self.moving
            loops = (validation.loop_run(without), moving)
            if k >= len(self._in_motion()):
                whole, likelier = self.step, validation.by_likelier_law(self.step)
                loops = (likelier.loop_run(without), likelier.loop_run(whole))
            found.append(validation.finding(one, without, whole, loops))
        return found, last


def _least_borne_out(finding: Finding) -> tuple[bool, float]:
    """Order in which findings that are not confirmed go."""
    confirmation = finding.confirmation
    return not confirmation.unsure, confirmation.torque.share
