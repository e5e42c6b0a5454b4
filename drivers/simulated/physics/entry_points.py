"""What Python calls: compiled code kept on disk, stale as soon as any file of the physics changes."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from drivers.simulated.physics import base, loads, loop, step
from drivers.simulated.physics.chain import Chain, mass_matrix, place
from drivers.simulated.physics.chain import bias as chain_bias
from drivers.simulated.physics.compile import entry, on_disk, source_digest
from drivers.simulated.physics.loop import Law, Memory
from drivers.simulated.physics.records import Arm, Motion
from robots.arrays import FloatArray


class EntryPoints(NamedTuple):
    """Compiled functions; see the functions of these names below."""

    plant_step: Callable[[Arm, Motion, FloatArray], int]
    posture: Callable[[Arm, Motion], None]
    links: Callable[[Chain, FloatArray, FloatArray], None]
    static_loads: Callable[[Arm, Motion], None]
    control: Callable[[Law, Memory, FloatArray, FloatArray, FloatArray, FloatArray], None]
    sample: Callable[[Arm, Motion, Law, Memory, FloatArray, FloatArray, FloatArray, FloatArray], None]
    run: Callable[..., int]


def _made(digest: int) -> EntryPoints:  # noqa: C901 - functions side by side, not branches
    """The entry points, told apart on disk by the digest of the sources that they were made from."""

    def plant_step(arm: Arm, motion: Motion, torque: FloatArray) -> int:
        """One plant step under torques at the drive outputs, (n,)."""
        _ = digest
        for i in range(len(torque)):
            motion.motors[i].torque = torque[i]
        return step.advance(arm, motion)

    def posture(arm: Arm, motion: Motion) -> None:
        """Writes ``motion.mass`` and ``motion.loads`` of the present state."""
        _ = digest
        step.posture(arm, motion)

    def links(chain: Chain, position: FloatArray, matrix: FloatArray) -> None:
        """Writes the mass matrix of the links, (n, n), at joint positions (n,)."""
        _ = digest
        place(chain, position)
        mass_matrix(chain, matrix)

    def static_loads(arm: Arm, motion: Motion) -> None:
        """Writes ``motion.loads`` of the present posture, standing still, without touching the velocity."""
        _ = digest
        place(arm.chain, motion.position)
        for j in range(len(motion.right)):
            motion.right[j] = 0.0
        chain_bias(arm.chain, motion.right, motion.loads)
        if len(arm.base.stiffness) > 0:
            base.lean(arm.base, motion.rocking, motion.position, motion.loads)
        loads.add_joint_loads(
            arm.joints, motion.joints, motion.position, motion.right, motion.push, motion.loads
        )
        if arm.plane.stiffness > 0.0:
            loads.add_tool_contact(arm, motion)

    def control(
        law: Law,
        memory: Memory,
        set_point: FloatArray,
        slope: FloatArray,
        added: FloatArray,
        position: FloatArray,
    ) -> None:
        """One sample of the position loops."""
        _ = digest
        loop.control(law, memory, set_point, slope, added, position)

    def sample(
        arm: Arm,
        motion: Motion,
        law: Law,
        memory: Memory,
        set_point: FloatArray,
        slope: FloatArray,
        added: FloatArray,
        error: FloatArray,
    ) -> None:
        """One reading of the encoders and one sample of the position loops."""
        _ = digest
        loop.sample(arm, motion, law, memory, set_point, slope, added, error)

    def run(
        arm: Arm,
        motion: Motion,
        law: Law,
        memory: Memory,
        samples: int,
        sampled: bool,
        set_points: FloatArray,
        slopes: FloatArray,
        added: FloatArray,
        errors: FloatArray,
        scales: FloatArray,
        disturbance: FloatArray,
        counts: FloatArray,
        signal: FloatArray,
        position: FloatArray,
        velocity: FloatArray,
    ) -> int:
        """Whole SYNC periods of ``samples`` controller samples each.

        Args:
            arm, motion, law, memory: the plant and the drives.
            samples: per period.
            sampled: whether the very first sample has been taken already.
            set_points, slopes, added, errors, scales: (periods · samples, n), see ``loop``.
            disturbance: (periods · samples · steps, 2 n).
            counts, signal, position, velocity: (periods, n), written: what each SYNC sees.
        """
        _ = digest
        n = len(memory.output)
        for k in range(len(counts) * samples):
            if k > 0 or not sampled:
                loop.sample(arm, motion, law, memory, set_points[k], slopes[k], added[k], errors[k])
            if k % samples == 0:
                cycle = k // samples
                for i in range(n):
                    counts[cycle, i], signal[cycle, i] = memory.reported_counts[i], memory.reported_signal[i]
                    position[cycle, i] = step.reading(motion.position[i], motion.velocity[i], arm)
                    velocity[cycle, i] = motion.velocity[i]
            steps = disturbance[k * law.steps : (k + 1) * law.steps]
            state = loop.plant_steps(arm, motion, law, memory, scales[k], steps)
            if state != step.FINE:
                return state
        return step.FINE

    return EntryPoints(
        plant_step=entry(plant_step),
        posture=entry(posture),
        links=entry(links),
        static_loads=entry(static_loads),
        control=entry(control),
        sample=entry(sample),
        run=entry(run),
    )


compiled = _made(source_digest())


def is_compiled() -> bool:
    """Whether simulated drives start at once: what each of their cycles calls is on disk as machine code."""
    return on_disk(compiled.plant_step) and on_disk(compiled.sample)
