"""A simulated arm that is described wrongly: counts go over the wire, the description says what they mean.

The simulated drives and the plant are built of the true description. The master's side reads and commands
through the wrong one, as it would: targets in counts, positions and control signals in counts.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from daq.session.first_judgement import Finding, judge_loop, judge_move, judge_rest
from daq.session.first_motion import FirstMotion, at_rest, half_degree, in_order, touch
from drivers.frames.samples import Samples
from drivers.frames.units import Units
from drivers.simulated.bench import Bench
from drivers.simulated.device import described_devices
from drivers.simulated.offline import control_signal_counts
from drivers.simulated.truth import PlantTruth
from robots import Robot
from robots.arrays import FloatArray


@dataclass
class WrongArm:
    """One arm and what is said of it.

    Attributes:
        true: the description that the arm has.
        wrong: the one that the master has.
        truth: the plant.
        posture: (n,) where it really stands, rad or m.
        order: (n,) which of the real drives answers as the k-th of the description.
        zero: (n,) counts that its encoders are off by.
        rated: (n,) what the real drives say of their motors' rated torques, mN·m (6076).
    """

    true: Robot
    wrong: Robot
    truth: PlantTruth
    posture: FloatArray
    order: tuple[int, ...]
    zero: FloatArray
    rated: FloatArray
    farthest: float = 0.0
    """rad or m that any joint really moved."""
    went: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    """Rows × n: how the joints really moved in the latest motion, rad or m."""
    findings: list[Finding] = field(default_factory=list)
    unjudged: list[str] = field(default_factory=list)

    def first_contact(self, *, looked: bool = True) -> str:
        """Go through the three motions until one is not as described; where it was caught, or nothing.

        Args:
            looked: whether somebody answers which way each joint went.
        """
        samples = self.stream(at_rest(self.wrong, self.reading()))
        self.findings, self.unjudged = judge_rest(self.wrong, samples)
        if self.findings:
            return "at rest"
        for joint in in_order(self.wrong):
            motion = touch(self.wrong, self.reading(), [joint])
            self.findings = judge_loop(self.wrong, self.stream(motion), motion)
            if self.findings:
                return "by a touch"
        for joint in in_order(self.wrong):
            motion = half_degree(self.wrong, self.reading(), [joint])
            samples = self.stream(motion)
            self.findings = judge_move(self.wrong, samples, motion)
            if self.findings:
                return "by half a degree"
            if looked and not self._went_as_told(motion):
                return "by a look at half a degree"
        return ""

    def _went_as_told(self, motion: FirstMotion) -> bool:
        """What somebody sees who looks which way the joint goes first."""
        (turn,) = motion.turns
        told = np.asarray(motion.trajectory.position)[:, turn.joint]
        first = int(np.abs(told - told[0]).argmax())
        return bool((self.went[first] - self.went[0])[turn.joint] * (told[first] - told[0]) > 0.0)

    def reading(self) -> FloatArray:
        """(n,) where the master reads the arm to stand."""
        return Units.of(self.wrong).position(np.rint(self._counts(self.posture))[np.newaxis])[0]

    def _counts(self, posture: FloatArray) -> FloatArray:
        """(n,) counts of the drives in the order of the description."""
        units = Units.of(self.true)
        counts = (self.true.transmission_matrix @ posture) * units.counts_per_output_unit
        return np.asarray((counts + self.zero)[list(self.order)])

    def stream(self, motion: FirstMotion) -> Samples:
        """What the master records of a motion."""
        reference = np.asarray(motion.trajectory.position)
        units, order = Units.of(self.wrong), list(self.order)
        targets = np.empty(reference.shape)
        targets[:, order] = units.counts(reference)
        bench = Bench(self.true, self.truth)
        bench.stand(self.posture)
        found = bench.run(targets - self.zero)
        self.went = found.position
        self.farthest = max(self.farthest, float(np.abs(found.position - self.posture).max()))
        counts = np.rint(found.counts + self.zero)[:, order]
        directions = np.array([device.direction for device in described_devices(self.true)])
        raw = (directions * control_signal_counts(self.true, found.control_signal))[:, order]
        n = len(reference)
        return Samples(
            cycle=np.arange(n),
            time=self.true.bus.cycle_time * np.arange(n),
            reference=units.position(units.counts(reference)),
            position=units.position(counts),
            control_signal=units.control_signal(raw),
            statusword=np.full(reference.shape, 0x1237, dtype=np.uint16),
            complete=np.ones(reference.shape, dtype=np.bool_),
            lateness=np.zeros(n),
        )
