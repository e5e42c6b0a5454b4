"""A run under way for many who look on."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path

import numpy as np
import pytest
from fastapi.testclient import TestClient

from daq.catalogue import runs
from daq.catalogue.database import Catalogue
from daq.catalogue.values import ArmIdentity
from daq.service import live as live_module
from daq.service.live import MOST_LINES, OVER, Broadcaster, TooManyError
from daq.service.settings import Service
from daq.session.spool import Spooling, spool_path
from daq.session.states import Conduct
from daq.session.streaming import Nobody
from drivers import Samples
from robots import Robot
from trajectories import plan


def lines_of(path: Path) -> list[dict[str, object]]:
    return [json.loads(line) for line in path.read_text().splitlines()]


def samples(robot: Robot, first: int, count: int, late: int | None = None) -> Samples:
    empty = Samples.empty(robot.n)
    lateness = np.full(count, 1e-4)
    if late is not None:
        lateness[late] = 2.5 * robot.bus.cycle_time
    shape = (count, robot.n)
    cycle = np.arange(first, first + count)
    return type(empty)(
        cycle=cycle,
        time=cycle * robot.bus.cycle_time,
        reference=np.full(shape, 0.5),
        position=np.full(shape, 0.4),
        control_signal=np.full(shape, 0.1),
        statusword=np.zeros(shape, dtype=np.uint16),
        complete=np.ones(shape, dtype=bool),
        lateness=lateness,
    )


def test_what_is_spooled(emps: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("daq.session.spool.INTERVAL", 0.0)
    spool = Spooling(Nobody(), emps, tmp_path / "capture.mcap")
    motion = plan(emps, cycle_time=emps.bus.cycle_time, duration=2.0, seed=0, evaluations=100)
    spool.begin("Check", motion, Conduct())
    spool.samples(samples(emps, 0, 5))
    spool.samples(samples(emps, 5, 5, late=2))
    spool.end(None)
    begin, one, two, end = lines_of(spool_path(tmp_path / "capture.mcap"))
    assert begin["units"] == [["m", "N"]]
    assert begin["joints"] == [joint.name for joint in emps.joint] and begin["cycles"] == len(motion.time)
    assert one["cycle"] == 4 and one["missed"] == 0
    assert two["cycle"] == 9 and two["missed"] == 2
    assert two["torque"] == [round(float(emps.joint_torque(np.full((1, emps.n), 0.1))[0, 0]), 6)]
    assert end == {"kind": "end", "outcome": "failed", "missed": 0}


def test_few_lines_are_written_however_many_samples_come(emps: Robot, tmp_path: Path) -> None:
    spool = Spooling(Nobody(), emps, tmp_path / "capture.mcap")
    motion = plan(emps, cycle_time=emps.bus.cycle_time, duration=2.0, seed=0, evaluations=100)
    spool.begin("Check", motion, Conduct())
    for k in range(200):
        spool.samples(samples(emps, k, 1))
    spool.end(None)
    assert len(lines_of(spool_path(tmp_path / "capture.mcap"))) < 60


class _Heard(Nobody):
    """Notes what it is told."""

    def __init__(self) -> None:
        self.told: list[object] = []

    def begin(self, title: str, trajectory: object, conduct: object) -> None:
        self.told.append(title)

    def samples(self, samples: Samples) -> None:
        self.told.append(len(samples))

    def end(self, result: object) -> None:
        self.told.append(result)


def test_a_folder_that_is_gone_stops_no_arm(
    emps: Robot, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Who watches besides is told everything; the log says once that nobody can look on."""
    inner = _Heard()
    spool = Spooling(inner, emps, tmp_path / "gone" / "capture.mcap")
    motion = plan(emps, cycle_time=emps.bus.cycle_time, duration=2.0, seed=0, evaluations=100)
    with caplog.at_level("WARNING"):
        spool.begin("Check", motion, Conduct())
        spool.samples(samples(emps, 0, 5))
        spool.end(None)
    assert inner.told == ["Check", 5, None]
    assert [record.message.partition(": ")[2][:18] for record in caplog.records] == ["nobody can look on"]
    assert not (tmp_path / "gone").exists()


def test_fifty_look_on_and_one_reads(tmp_path: Path) -> None:
    """All see the same lines in order; who comes late is told the beginning; one task reads the file."""
    path = tmp_path / "capture.live"

    async def look() -> list[bytes]:
        return [piece async for piece in broadcaster.events(path, lambda: False)]

    async def everything() -> list[list[bytes]]:
        tasks = [asyncio.create_task(look()) for _ in range(50)]
        await asyncio.sleep(0.05)
        with path.open("w") as file:
            file.write('{"kind":"begin"}\n')
            for k in range(0, 20, 2):
                file.write("".join(f'{{"kind":"samples","cycle":{j}}}\n' for j in (k, k + 1)))
                file.flush()
                await asyncio.sleep(0.04)
                if k == 10:
                    assert broadcaster.reading == 1 and broadcaster.looking == 50
                    tasks.append(asyncio.create_task(look()))
            await asyncio.sleep(0.3)
            file.write('{"kind":"end"}\n')
        return await asyncio.gather(*tasks)

    broadcaster = Broadcaster()
    *early, late = asyncio.run(asyncio.wait_for(everything(), 30))
    for seen in (*early, late):
        assert seen[0] == b'data: {"kind":"begin"}\n\n' and seen[-1] == OVER
        cycles = [line["cycle"] for line in _lines(seen) if line["kind"] == "samples"]
        assert cycles == list(range(20))  # who came late was sent what had been before
    pieces = [tuple(map(id, seen)) for seen in early]
    assert len(set(pieces)) == 1, "every piece is made once, for all"
    assert len(early[0]) <= 13, "the lines of one look go together"
    assert broadcaster.looking == 0 and broadcaster.reading == 0


def _lines(pieces: list[bytes]) -> list[dict[str, object]]:
    events = b"".join(pieces).decode().split("\n\n")
    return [json.loads(event[6:]) for event in events if event.startswith("data: ")]


def test_who_looks_first_and_late_is_told_the_beginning(tmp_path: Path) -> None:
    """A run that has written more lines than are sent at once: the page cannot draw without the first."""
    path = tmp_path / "capture.live"
    lines = ['{"kind":"begin"}', *(f'{{"kind":"samples","cycle":{k}}}' for k in range(900)), '{"kind":"end"}']
    path.write_text("\n".join(lines) + "\n")

    async def look() -> list[bytes]:
        return [piece async for piece in Broadcaster().events(path, lambda: True)]

    found = _lines(asyncio.run(asyncio.wait_for(look(), 30))[:-1])
    assert found[0]["kind"] == "begin" and found[-1]["kind"] == "end"
    assert [line["cycle"] for line in found[1:-1]] == list(range(900 - MOST_LINES + 1, 900))


def test_who_comes_when_all_is_read_is_told_that_it_is_over(tmp_path: Path) -> None:
    path = tmp_path / "capture.live"
    path.write_text('{"kind":"begin"}\n{"kind":"end"}\n')

    async def everything() -> list[bytes]:
        broadcaster = Broadcaster()
        first = aiter(broadcaster.events(path, lambda: True))
        await anext(first)  # keeps the run open: it does not read on
        await asyncio.sleep(0.05)
        late = [piece async for piece in broadcaster.events(path, lambda: True)]
        await first.aclose()
        return late

    assert asyncio.run(asyncio.wait_for(everything(), 30))[-1] == OVER


def test_who_is_slow_holds_nobody_up(tmp_path: Path) -> None:
    path = tmp_path / "capture.live"
    path.write_text("".join(f'{{"cycle":{k}}}\n' for k in range(500)) + '{"kind":"end"}\n')

    async def slow() -> list[bytes]:
        seen = []
        async for event in Broadcaster().events(path, lambda: True):
            seen.append(event)
            await asyncio.sleep(0)
        return seen

    seen = asyncio.run(asyncio.wait_for(slow(), 30))
    assert seen[-1] == OVER and len(seen) <= 52


def test_a_run_that_died_is_over(tmp_path: Path) -> None:
    async def look() -> list[bytes]:
        return [piece async for piece in Broadcaster().events(tmp_path / "never.live", lambda: True)]

    assert asyncio.run(asyncio.wait_for(look(), 30)) == [OVER]


def test_more_than_are_allowed_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_module, "MOST_LOOKING", 0)

    async def look() -> None:
        async for _ in Broadcaster().events(tmp_path / "x.live", lambda: True):
            pass

    with pytest.raises(TooManyError, match="more than 0"):
        asyncio.run(look())


def test_beyond_the_limit_the_answer_is_503_also_in_a_burst(
    client: TestClient, filled: Catalogue, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The place is taken when the request is answered, not when the first line is sent."""
    broadcaster, path = Broadcaster(), tmp_path / "x.live"
    monkeypatch.setattr(live_module, "MOST_LOOKING", 3)

    async def burst() -> None:
        taken = [broadcaster.events(path, lambda: True) for _ in range(3)]
        with pytest.raises(TooManyError):
            broadcaster.events(path, lambda: True)
        assert broadcaster.looking == 3
        async for _ in (pieces := aiter(taken[0])):
            break
        await pieces.aclose()
        assert broadcaster.looking == 2
        broadcaster.events(path, lambda: True)

    asyncio.run(burst())
    monkeypatch.setattr(live_module, "MOST_LOOKING", 0)
    identity = ArmIdentity("emps", (7,), "0" * 64, simulated=True)
    run = runs.begin(filled, identity, "check", capture=str(tmp_path / "capture.mcap"))
    answer = client.get(f"/api/runs/{run.id}/live")
    assert answer.status_code == 503 and answer.headers["Retry-After"] == "10"


def test_the_stream_of_a_run(client_of, filled: Catalogue, tmp_path: Path) -> None:
    capture = tmp_path / "capture.mcap"
    spool_path(capture).write_text('{"kind":"begin"}\n{"kind":"end","outcome":"completed"}\n')
    identity = ArmIdentity("emps", (7,), "0" * 64, simulated=True)
    run = runs.begin(filled, identity, "check", capture=str(capture))
    client = client_of(Service())
    with client.stream("GET", f"/api/runs/{run.id}/live") as answer:
        assert answer.headers["content-type"].startswith("text/event-stream")
        text = "".join(answer.iter_text())
    assert '"kind":"begin"' in text and text.endswith("event: over\ndata: {}\n\n")
    assert client.get("/api/runs/1/live").status_code == 404
    assert client.get("/api/runs/999/live").status_code == 404
