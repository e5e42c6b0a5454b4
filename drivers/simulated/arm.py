"""The parent's side of the simulated arm: starts the process of the drives, and ends it."""

from __future__ import annotations

import contextlib
import json
import os
import select
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from drivers.errors import BusError, BusOccupied, DriveError
from drivers.frames.channel import Channel
from drivers.simulated.faults import NO_FAULTS, Faults
from drivers.simulated.scenario import Scenario
from drivers.simulated.truth import PlantTruth

_START_TIMEOUT = 180.0
"""A first start compiles the plant: a quarter of a minute of an idle processor, s."""
_GRACE = 2.0
"""How long the process may take to end by itself, s."""


class SimulatedArm:
    """Simulated drives on a bus, in a process of their own that lives as long as this object.

    Args:
        robot_source: name of a shipped arm, or the path of a robot.toml; the process loads it itself.
        channel: which bus.
        seed: which arm is drawn around the description, and which noise it has.
        noise_seed: other noise than that of the seed, on the same arm with the same drives.
        faults: what goes wrong.
        truth: an arm to simulate instead of one drawn from the seed.
        scenario: what the arm has besides, or the file that says so; only the process of the drives reads it.
        seal: file into which that process writes the truth instead of telling it, see
            :mod:`drivers.simulated.seal`.
        profile: kind of drives, of :data:`drivers.simulated.quirks.KINDS`.

    Raises:
        BusError: the bus cannot be opened or is occupied.
        DriveError: the description cannot be loaded, or the process did not start.
    """

    def __init__(
        self,
        robot_source: str | Path,
        channel: Channel,
        seed: int = 0,
        *,
        noise_seed: int | None = None,
        faults: Faults = NO_FAULTS,
        truth: PlantTruth | None = None,
        scenario: str | Path | Scenario | None = None,
        seal: str | Path | None = None,
        profile: str = "cia402",
    ) -> None:
        order = {
            "robot": str(robot_source),
            "interface": channel.interface,
            "channel": channel.name,
            "seed": seed,
            "noise_seed": noise_seed,
            "faults": faults.as_dict(),
            "truth": truth.as_dict() if truth is not None else None,
            "scenario": _plain(scenario),
            "seal": str(seal) if seal is not None else None,
            "profile": profile,
        }
        self._process = subprocess.Popen(
            [sys.executable, "-m", "drivers.simulated"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=_environment(),
        )
        try:
            self._truth = self._start(order)
        except BaseException:
            self.close()
            raise

    @property
    def pid(self) -> int:
        """Process id of the drives."""
        return self._process.pid

    @property
    def running(self) -> bool:
        """Whether the drives still live."""
        return self._process.poll() is None

    def truth(self) -> PlantTruth:
        """What the arm really is; kept also after :meth:`close`.

        Raises:
            DriveError: it is sealed.
        """
        if self._truth is None:
            raise DriveError("the truth of the simulated arm is sealed; open_seal opens the file")
        return self._truth

    def close(self) -> None:
        """Ends the process: first by closing its lifeline, then by force."""
        process = self._process
        assert process.stdin is not None
        assert process.stdout is not None
        with contextlib.suppress(BrokenPipeError):
            process.stdin.close()
        for signal_number in (None, signal.SIGTERM, signal.SIGKILL):
            if signal_number is not None:
                process.send_signal(signal_number)
            try:
                process.wait(_GRACE)
                break
            except subprocess.TimeoutExpired:
                continue
        process.stdout.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _start(self, order: dict[str, Any]) -> PlantTruth | None:
        process = self._process
        assert process.stdin is not None
        try:
            process.stdin.write(json.dumps(order).encode() + b"\n")
            process.stdin.flush()
        except BrokenPipeError:
            raise DriveError("the simulated drives' process ended before it started") from None
        answer = self._answer()
        if "error" in answer:
            kinds = {kind.__name__: kind for kind in (BusError, BusOccupied)}
            raise kinds.get(answer["error"], DriveError)(answer["message"])
        return None if answer["truth"] is None else PlantTruth.from_dict(answer["truth"])

    def _answer(self) -> dict[str, Any]:
        """The process's first line."""
        stdout = self._process.stdout
        assert stdout is not None
        data = b""
        deadline = time.monotonic() + _START_TIMEOUT
        while not data.endswith(b"\n"):
            ready, _, _ = select.select([stdout], [], [], max(0.0, deadline - time.monotonic()))
            if not ready:
                raise DriveError(f"the simulated drives did not start within {_START_TIMEOUT:g} s")
            part = os.read(stdout.fileno(), 65536)
            if not part:
                raise DriveError("the simulated drives' process ended before it started")
            data += part
        answer: dict[str, Any] = json.loads(data)
        return answer


def _plain(scenario: str | Path | Scenario | None) -> str | dict[str, Any] | None:
    """A scenario as the process takes it: the path of its file, or plain numbers."""
    if scenario is None:
        return None
    return scenario.as_dict() if isinstance(scenario, Scenario) else str(scenario)


def _environment() -> dict[str, str]:
    """The parent's environment, with the packages importable from where the parent has them."""
    here = str(Path(__file__).resolve().parents[2])
    known = os.environ.get("PYTHONPATH")
    # One thread: the matrices are 6 × 6, and more threads would only wait for one another.
    return os.environ | {
        "PYTHONPATH": os.pathsep.join([here, known] if known else [here]),
        "OMP_NUM_THREADS": "1",
    }
