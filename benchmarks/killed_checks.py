"""``armhil check`` gets SIGKILL at every stage and at random times: what it leaves, and the next check.

    PYTHONPATH=. python benchmarks/killed_checks.py --page benchmarks/killed_checks.md

Each check of the one-axis rig is made on drives in a process of their own, which outlive the check as real
ones do, or on simulated drives of its own. After each kill:

- **arm**: no drive carries torque and none moves, and how long that took; the check's own drives are gone;
- **processes**: nothing is left of the check;
- **lease**: free, or freed by the next check;
- **catalogue**: what the killed check left, and never a verdict that was not made;
- **next check**: has the arm at once, and finds nothing moved.

Ends with 2 where one of these does not hold. 25 minutes on one core.
"""

from __future__ import annotations

import argparse
import os
import signal
import struct
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from uuid import uuid4

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import robots
from benchmarks.killed_check import POINTS, KillPoint, Setting
from benchmarks.killed_page import After, page_of
from daq.catalogue import arms, checks, leases, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.values import Run
from drivers import Channel, open_bus
from drivers.simulated import SimulatedArm
from tests.processes import processes_marked

NAME, SEED = "emps", 3
STRIBECK = "format = 1\n[[stribeck_friction]]\ndrive = 1\nrise = 2.0\nspeed = 0.1\n"
MARK = "ARMHIL_KILLED"
_ENABLED = 0x27
_SDO_REQUEST, _SDO_ANSWER = 0x600, 0x580
_STATUSWORD, _POSITION = 0x6041, 0x6064
STILL = 1e-4
"""Change of position between two looks, 0.05 s apart, that the noise of an encoder may make, m."""


@dataclass(frozen=True)
class Place:
    """Where checks are made: a folder with a catalogue, and a bus."""

    folder: Path
    catalogue: Catalogue
    channel: Channel
    simulated: bool
    environment: dict[str, str]
    notify: Path

    def arguments(self, setting: Setting, out: Path) -> list[str]:
        """Of ``armhil check``."""
        words = [NAME, "--interface", self.channel.interface, "--channel", self.channel.name, "--quiet"]
        words += ["--out", str(out), "--duration", "4", "--evaluations", "300"]
        if self.simulated:
            words += ["--simulated", "--seed", str(SEED)]
        if setting == "changed":
            words += [
                "--scenario",
                str(self.folder / "scenario.toml"),
                "--search",
                "--notify",
                str(self.notify),
            ]
        return words


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--random", type=int, default=40, help="kills at random times")
    parser.add_argument("--seed", type=int, default=0, help="of those times")
    parser.add_argument("--stages", nargs="*", default=None, help="only stages that begin so")
    parser.add_argument("--page", type=Path, default=None, help="Markdown with the results")
    given = parser.parse_args()
    found: list[After] = []
    with tempfile.TemporaryDirectory() as folder:
        for one in all_kills(Path(folder), given.random, given.seed, given.stages):
            found.append(one)
            print(one.row(), flush=True)
            if given.page is not None:
                given.page.write_text(page_of(found, given.seed), encoding="utf-8")
    wrong = sum(bool(one.problems) for one in found)
    print(f"{len(found)} kills, {wrong} with a problem")
    return 2 if wrong else 0


def all_kills(folder: Path, times: int, seed: int, only: list[str] | None) -> Iterator[After]:
    """The matrix, then the random times."""
    wanted = [p for p in POINTS if only is None or any(p.stage.startswith(text) for text in only)]
    port = 20000 + os.getpid() % 12000
    with webhook() as url:
        lasting = [point for point in wanted if point.setting in ("accepted", "away")]
        if lasting or times:
            place = place_in(folder / "lasting", Channel("udp_multicast", f"239.74.200.1:{port}"), url, False)
            with SimulatedArm(NAME, place.channel, SEED):
                commission(place)
                for point in lasting:
                    yield killed_at(place, point)
                yield from killed_at_random(place, times, seed)
        for number, setting in enumerate(("first", "changed"), start=2):
            channel = Channel("udp_multicast", f"239.74.200.{number}:{port}")
            for k, point in enumerate(p for p in wanted if p.setting == setting):
                own = place_in(folder / f"{setting}-{k}", channel, url, True)
                if setting == "changed":
                    accept_first(own)
                yield killed_at(own, point)


def place_in(folder: Path, channel: Channel, url: str, simulated: bool) -> Place:
    """A folder with a catalogue of its own."""
    folder.mkdir()
    (folder / "scenario.toml").write_text(STRIBECK)
    notify = folder / "notify.toml"
    notify.write_text(f'format = 1\n[[webhook]]\nurl = "{url}"\n')
    database = str(folder / "catalogue.db")
    environment = {**os.environ, "ARMHIL_CATALOGUE": database, MARK: uuid4().hex}
    environment["PYTHONPATH"] = str(Path(__file__).resolve().parent.parent)
    return Place(folder, Catalogue(database), channel, simulated, environment, notify)


def commission(place: Place) -> None:
    """Through all stages, and a first check whose model is the baseline."""
    where = ["--interface", place.channel.interface, "--channel", place.channel.name, "--quiet"]
    out = place.folder / "commission"
    plan = ["--duration", "4", "--evaluations", "300", "--periods", "1"]
    home = ",".join(f"{position:g}" for position in robots.load(NAME).home)
    moved = ["--move", "--yes", "--new-arm", "--stands-at", home, "--out", str(out)]
    _must(place, ["commission", NAME, *where, *plan, *moved])
    (motion,) = out.glob("*.trajectory.json")
    _must(
        place,
        ["check", *place.arguments("accepted", place.folder / "first"), "--trajectory", str(motion)],
        (3,),
    )
    run = runs.every(place.catalogue, kind="check")[0]
    _must(place, ["baseline", "accept", str(run.id), "--reason", "commissioned"])


def accept_first(place: Place) -> None:
    """A first check whose model is the baseline."""
    _must(place, ["check", *place.arguments("accepted", place.folder / "accepted")], (3,))
    _must(place, ["baseline", "accept", "1", "--reason", "first"])


def _armhil(place: Place, words: list[str]) -> subprocess.CompletedProcess[str]:
    """A command that is left to end."""
    return subprocess.run(
        [sys.executable, "-m", "daq", *words],
        capture_output=True,
        text=True,
        check=False,
        env=place.environment,
        cwd=place.folder,
        stdin=subprocess.DEVNULL,
    )


def _must(place: Place, words: list[str], allowed: tuple[int, ...] = (0,)) -> str:
    done = _armhil(place, words)
    assert done.returncode in allowed, f"{words}: {done.returncode} {done.stderr[-800:]}"
    return done.stdout


def killed_at(place: Place, point: KillPoint) -> After:
    """Kill a check at a point, and look."""
    if point.setting == "away":
        move_away(place)
    program = Path(__file__).parent / "killed_check.py"
    before = runs.every(place.catalogue)
    words = place.arguments(point.setting, place.folder / f"killed-{len(before)}-{time.monotonic_ns()}")
    process = start(place, [str(program), point.stage, "--", *words])
    code = process.wait(timeout=240)
    found = look(place, After(point.stage, point.setting), before)
    if code != -signal.SIGKILL:
        found.problems.append(
            f"was not killed: exit code {code}: {(place.folder / 'said').read_text()[-300:]}"
        )
    if found.left != point.left:
        found.problems.append(f"left {found.left}, expected {point.left}")
    return next_check(place, found)


def move_away(place: Place) -> None:
    """Leave the arm where a check was killed in its middle."""
    middle = next(point for point in POINTS if point.stage == "stream: under way")
    words = place.arguments("accepted", place.folder / f"away-{time.monotonic_ns()}")
    program = Path(__file__).parent / "killed_check.py"
    assert start(place, [str(program), middle.stage, "--", *words]).wait(timeout=240) == -signal.SIGKILL
    look(place, After("", ""), runs.every(place.catalogue))


def killed_at_random(place: Place, times: int, seed: int) -> Iterator[After]:
    """Kill checks at times that are uniform over the length of one that is left alone."""
    if not times:
        return
    begun = time.monotonic()
    _must(place, ["check", *place.arguments("accepted", place.folder / "whole")], (0,))
    whole = time.monotonic() - begun
    for k, moment in enumerate(np.random.default_rng(seed).uniform(0.0, whole, times), start=1):
        before = runs.every(place.catalogue)
        words = place.arguments("accepted", place.folder / f"random-{k}")
        process = start(place, ["-m", "daq", "check", *words])
        try:
            process.wait(timeout=float(moment))
        except subprocess.TimeoutExpired:
            process.kill()
        ended = process.wait() >= 0
        found = look(place, After(f"{moment:.2f} s", "random"), before)
        if ended:
            found.left += " (ended before)"
        yield next_check(place, found)


def start(place: Place, words: list[str]) -> subprocess.Popen[bytes]:
    """A process that is going to be killed."""
    with (place.folder / "said").open("wb") as said:
        return subprocess.Popen(
            [sys.executable, *words],
            stdin=subprocess.DEVNULL,
            stdout=said,
            stderr=said,
            env=place.environment,
            cwd=place.folder,
        )


def look(place: Place, found: After, before: tuple[Run, ...]) -> After:
    """At the arm, the processes and the catalogue, right after a kill."""
    begun = time.monotonic()
    if not place.simulated:
        found.rest = time_to_rest(place, begun)
        if found.rest is None:
            found.problems.append("the arm is not at rest without torque after 10 s")
    while left_of(place) and time.monotonic() < begun + 15.0:
        time.sleep(0.02)
    found.gone = time.monotonic() - begun
    if left := left_of(place):
        found.problems.append(f"processes left: {left}")
    known = {run.id for run in before}
    new = [run for run in runs.every(place.catalogue) if run.id not in known]
    runs.settle_abandoned(place.catalogue)
    new = [runs.get(place.catalogue, run.id) for run in new]
    found.left = left_words(place, new)
    for run in new:
        if run.state == "running":
            found.problems.append(f"run {run.id} is still called running")
        if run.state == "abandoned" and (run.outcome or checks.of_run(place.catalogue, run.id)):
            found.problems.append(f"run {run.id} was abandoned and has an outcome or a verdict")
    held = [a for a in arms.every(place.catalogue) if leases.holder_of(place.catalogue, a.id)]
    found.lease = "of the dead process" if held else "free"
    return found


def left_words(place: Place, new: list[Run]) -> str:
    """What the killed check left in the catalogue."""
    if not new:
        return "nothing"
    if new[0].state == "abandoned":
        return "abandoned"
    if checks.of_run(place.catalogue, new[0].id):
        return "judged"
    return "unjudged" if new[0].reason == runs.UNJUDGED else f"{new[0].state}, {new[0].outcome}"


def next_check(place: Place, found: After) -> After:
    """A check that nobody kills, with the catalogue as the killed one left it."""
    arguments = place.arguments("accepted", place.folder / f"next-{time.monotonic_ns()}")
    done = _armhil(place, ["check", *arguments])
    found.verdict = {0: "ok", 1: "warning", 2: "failed", 3: "no baseline"}.get(done.returncode, "?")
    wanted = "no baseline" if found.setting == "first" else "ok"
    if found.verdict != wanted:
        found.problems.append(
            f"next check: {found.verdict}: {' '.join((done.stdout + done.stderr).split())[:300]}"
        )
    for arm in arms.every(place.catalogue):
        if leases.holder_of(place.catalogue, arm.id) is not None:
            found.problems.append(f"arm {arm.label} is still leased after the next check")
    return found


def time_to_rest(place: Place, begun: float) -> float | None:
    """s until every drive carries no torque and none moves; None where that does not come."""
    robot = robots.load(NAME)
    still = STILL * np.abs(robot.counts_per_output_unit)
    with open_bus(place.channel, bitrate=robot.bus.bitrate) as bus:
        before: list[int | None] = [None] * robot.n
        while time.monotonic() < begun + 10.0:
            status = [_read(bus, drive.node_id, _STATUSWORD) for drive in robot.drive]
            position = [_read(bus, drive.node_id, _POSITION) for drive in robot.drive]
            seen = time.monotonic() - begun
            free = all(word is not None and word & 0x6F != _ENABLED for word in status)
            pairs = zip(position, before, still, strict=True)
            if free and all(None not in (now, then) and abs(now - then) < most for now, then, most in pairs):
                return seen
            before = position
            time.sleep(0.05)
    return None


def _read(bus: object, node: int, index: int) -> int | None:
    """One value of a drive by SDO; None where it does not answer."""
    import can

    assert isinstance(bus, can.BusABC)
    request = struct.pack("<BHB4x", 0x40, index, 0)
    bus.send(can.Message(arbitration_id=_SDO_REQUEST + node, data=request, is_extended_id=False))
    deadline = time.monotonic() + 0.5
    while time.monotonic() < deadline:
        message = bus.recv(0.1)
        if message is not None and message.arbitration_id == _SDO_ANSWER + node:
            command, answered, _, value = struct.unpack("<BHBi", bytes(message.data))
            if answered == index and command & 0xE0 == 0x40:
                return int(value if index == _POSITION else value & 0xFFFF)
    return None


def left_of(place: Place) -> list[str]:
    """Processes that a check of this place has started and that still live, senders of messages apart."""
    marked = processes_marked(f"{MARK}={place.environment[MARK]}")
    return [command for _, command in marked if "daq.notify" not in command]


@contextmanager
def webhook() -> Iterator[str]:
    """A server that takes every message."""

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            self.rfile.read(int(self.headers["Content-Length"]))
            self.send_response(204)
            self.end_headers()

        def log_message(self, format: str, *arguments: object) -> None:  # noqa: A002 (the library's name)
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_address[1]}/"
    finally:
        server.shutdown()
        thread.join()


if __name__ == "__main__":
    sys.exit(main())
