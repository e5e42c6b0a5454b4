"""Streams of one open arm, each recorded and kept in the catalogue."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path

from daq.catalogue.database import Catalogue
from daq.catalogue.identity import SIMULATED
from daq.catalogue.kept_run import KeptRun, kept_run, trajectory_words
from daq.catalogue.values import RunKind
from daq.recording.capture import Facts
from daq.session.bench import ArmOrder, OpenArm
from daq.session.session_error import RunFailed, RunInterrupted
from daq.session.states import Conduct
from daq.session.streaming import StreamOrder, Watcher, stream_recorded
from drivers import StreamResult
from trajectories import Trajectory

Conducting = Callable[[], AbstractContextManager[Conduct]]
"""Gives the conduct of one stream, and conducts it by keyboard or page for the length of the block."""


@contextmanager
def unconducted() -> Iterator[Conduct]:
    """Nobody conducts the stream but Ctrl-C and SIGTERM."""
    yield Conduct()


CELSIUS = "celsius"
"""Among the facts of a run: the temperature of its hall, °C."""


@dataclass(frozen=True)
class Recording:
    """Streams motions of one open arm and keeps each in the catalogue."""

    arm: OpenArm
    order: ArmOrder
    catalogue: Catalogue | None
    watcher: Watcher
    conducting: Conducting
    note: str = ""
    celsius: float | None = None
    """Of the hall, where somebody said it."""

    def record(
        self,
        kind: RunKind,
        title: str,
        trajectory: Trajectory,
        path: Path,
        *,
        stage: str = "",
        facts: Facts | None = None,
    ) -> tuple[KeptRun, StreamResult]:
        """Stream and record a motion.

        Args:
            kind, stage: in the catalogue.
            title: for whoever watches.
            trajectory: begins where the arm stands.
            path: of the new capture.
            facts: for catalogue and capture besides.

        Raises:
            SessionError: the motion is faster than this arm may be driven; nothing has moved.
        """
        self.arm.admission.admit(self.order.robot, trajectory)
        facts = {**(facts or {}), **({} if self.celsius is None else {CELSIUS: f"{self.celsius:g}"})}
        run = {"kind": SIMULATED if self.order.simulated else "real", "note": self.note, **facts}
        simulated = _simulated_facts(self.order)
        run |= {name: str(value) for name, value in simulated.items()}
        with (
            kept_run(
                self.catalogue,
                self.arm.identity,
                kind,
                stage=stage,
                capture=path,
                trajectory=trajectory_words(trajectory),
                facts={"channel": str(self.arm.channel), **simulated, **facts},
                note=self.note,
            ) as kept,
            self.conducting() as conduct,
        ):
            order = StreamOrder(title, trajectory, path, run, arrive=stage in _ARRIVING)
            result = stream_recorded(self.arm.session, order, self.watcher, conduct)
            kept.streamed(result, path)
        return kept, result


_ARRIVING = frozenset({"jog", "approach", "return"})
"""Stages that are slow moves to a place."""


def _simulated_facts(order: ArmOrder) -> dict[str, str | int]:
    """What it takes to simulate a run again; nothing of a real arm."""
    if not order.simulated:
        return {}
    noise = order.seed if order.noise_seed is None else order.noise_seed
    hidden = {} if order.scenario is None else {"scenario": str(order.scenario)}
    return {"seed": order.seed, "noise_seed": noise, **hidden}


def require_completed(result: StreamResult, path: Path) -> None:
    """Was a motion driven to its end?

    Raises:
        RunInterrupted: it was stopped on request.
        RunFailed: the arm ended it itself.
    """
    if result.outcome == "stopped":
        raise RunInterrupted(
            f"stopped ({result.reason}): {result.ending}; {result.cycles_words} kept in {path}"
        )
    if result.outcome != "completed":
        raise RunFailed(
            f"the run ended early: {result.reason}; {result.ending}; {result.cycles_words} kept in {path}"
        )
