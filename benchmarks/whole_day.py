"""The whole day of an arm by the commands: commissioned, diagnosed, accepted, watched, worn, told.

    python -m benchmarks.whole_day --runs 2

Needs root and ``../shared/tools/vcan/vcan-run``: drives and commands share a SocketCAN device of a user-mode
kernel whose time is virtual, so nights are a day apart and take seconds. The arm hides two effects; its
drives are a process of their own that alone reads them, and the commands take it for a real arm: no
``--simulated``. Both runs have to tell the same.
"""

from __future__ import annotations

import argparse
import http.server
import json
import os
import queue
import re
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import robots
from benchmarks.shoulder_and_elbow import NAME, shoulder_and_elbow
from daq.files.toml_text import toml_text
from drivers import Channel
from drivers.simulated import SimulatedArm

ROOT = Path(__file__).resolve().parents[1]
TOOL = ROOT.parent / "shared" / "tools" / "vcan" / "vcan-run"
SEED = 41
HIDDEN: Mapping[str, list[dict[str, float]]] = {
    "stribeck_friction": [{"drive": 1, "rise": 0.6, "speed": 0.15, "exponent": 2.0}],
    "position_dependent_friction": [{"drive": 2, "wave": 0.3, "order": 2.0}],
}
"""What nobody tells the commands: oil in the shoulder, and an elbow gear that turns harder on one side."""
WORN_DRIVE = 2
"""Its Coulomb friction grows."""
NIGHT = 86_000
"""s between two checks, less what a check takes."""
ARRIVES = 300.0
"""s that a message may take: a process of its own sends it, and tries again."""
PATIENCE = 7200
"""s of processor time and waiting that a day may take on a busy machine."""


@dataclass(frozen=True)
class Size:
    """How long a day takes.

    Attributes:
        nights, worn: checks without wear, and with it at most.
        wear: of Coulomb friction, a night.
        first: s, one period of the motion that the arm is commissioned with; nights drive it.
        duration: s, one period of the other motion, which has two.
        evaluations: trials of a search for a motion.
    """

    nights: int
    worn: int
    wear: float
    first: float
    duration: float
    evaluations: int


def armhil(*words: str) -> Any:
    """JSON of a command; ends the day where there is none."""
    command = [sys.executable, "-m", "daq", *words, "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    say(f"armhil {words[0]}: {done.returncode}")
    with suppress(json.JSONDecodeError):
        return json.loads(done.stdout)
    raise SystemExit(f"armhil {' '.join(words)}: {done.returncode}\n{done.stdout}{done.stderr}")


def say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


@contextmanager
def drives(arm: Path, device: str, folder: Path, night: int, worn: float = 0.0) -> Iterator[None]:
    """The arm on its bus, with the noise of a night."""
    hidden: dict[str, Any] = {"format": 1, **HIDDEN}
    if worn:
        hidden["coulomb_friction"] = [{"drive": WORN_DRIVE, "change": worn}]
    scenario = folder / f"hidden-{night}.toml"
    scenario.write_text(toml_text(hidden), encoding="utf-8")
    with SimulatedArm(str(arm), Channel("socketcan", device), SEED, noise_seed=night, scenario=scenario):
        yield


@contextmanager
def webhook() -> Iterator[tuple[int, queue.Queue[dict[str, Any]]]]:
    """A receiver of messages: its port, and what comes."""
    messages: queue.Queue[dict[str, Any]] = queue.Queue()

    class Receiver(http.server.BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            messages.put(json.loads(self.rfile.read(int(self.headers["Content-Length"]))))
            self.send_response(204)
            self.end_headers()

        def log_message(self, *_: object) -> None:
            """Not on the terminal."""

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Receiver)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield server.server_port, messages
    finally:
        server.shutdown()
        thread.join()


def day(device: str, folder: Path, size: Size) -> dict[str, Any]:
    """From a new arm to the page that says what has worn."""
    os.environ |= {"ARMHIL_CATALOGUE": str(folder / "catalogue.db"), "ARMHIL_STATE": str(folder / "state")}
    bus = ("--interface", "socketcan", "--channel", device)
    arm = shoulder_and_elbow(folder / "arm")
    with drives(arm, device, folder, 1000):
        told = first_model(arm, folder, bus, size)
    say(json.dumps(told, ensure_ascii=False))
    with webhook() as (port, messages):
        hook = {"format": 1, "webhook": [{"url": f"http://127.0.0.1:{port}/"}]}
        (folder / "notify.toml").write_text(toml_text(hook), encoding="utf-8")
        told["nights"] = nights(arm, folder, bus, size)
        verdicts = ["ok", *(one["verdict"] for one in told["nights"])]
        changes = [after for before, after in pairwise(verdicts) if after != before]
        told["messages"] = [messages.get(timeout=ARRIVES)["verdict"] for _ in changes]
    told["pages"] = pages(told["nights"][-1]["verdict"], WORN_DRIVE)
    return told


def first_model(arm: Path, folder: Path, bus: tuple[str, ...], size: Size) -> dict[str, Any]:
    """Commissioning, a first model, what it lacks by name, and the baseline.

    The longer motion is fitted, the other one validates.
    """
    stands = ",".join(map(str, robots.load(arm).home))
    trials = ("--evaluations", str(size.evaluations))
    twice = size.first >= size.duration
    first = ("--duration", str(size.first), *trials, "--periods", "2" if twice else "1")
    plan = ("--duration", str(size.duration), *trials, "--periods", "2")
    moving = ("--move", "--yes", "--looked", "--stands-at", stands, "--new-arm", "--celsius", "21")
    commissioned = armhil("commission", str(arm), *bus, *moving, *first, "--out", str(folder / "new"))
    (full,) = (one for one in commissioned["done"] if one["stage"] == "full run")
    armhil("plan", str(arm), "--seed", "2", *plan, "--out", str(folder / "plan"))
    motion, second = folder / "plan" / f"{NAME}.trajectory.json", folder / "second"
    armhil("run", str(arm), str(motion), *bus, "--approach", "--yes", "--out", str(second))
    model = armhil("identify", full["capture"], "--out", str(folder / "first"))
    recorded = (full["capture"], str(second / "capture.mcap"))
    fitted, other = recorded if twice else recorded[::-1]
    why = armhil("diagnose", fitted, "--validate", other, "--out", str(folder / "why"))
    known = ("--model", str(folder / "why" / f"{NAME}.model.toml"))
    whole = armhil("identify", full["capture"], *known, "--out", str(folder / "whole"))
    armhil("baseline", "accept", str(full["run"]), "--reason", "both effects are known", "--author", "Ada")
    return {
        "stages": [one["stage"] for one in commissioned["done"]],
        "first model, left %": model["estimates"]["ls"]["relative_error_percent"]["total"],
        "named": [[one["effect"], one["joints"], one["sentence"]] for one in why["findings"]],
        "accepted model, left %": whole["estimates"]["ls"]["relative_error_percent"]["total"],
        "verdicts": [model["test"]["verdict"], whole["test"]["verdict"]],
    }


def nights(arm: Path, folder: Path, bus: tuple[str, ...], size: Size) -> list[dict[str, Any]]:
    """Checks a day apart, until one fails or the wear has gone on for long enough."""
    told = []
    for night in range(1, size.nights + size.worn + 1):
        time.sleep(NIGHT)
        worn = size.wear * max(0, night - size.nights)
        out = ("--notify", str(folder / "notify.toml"), "--out", str(folder / f"night-{night}"))
        with drives(arm, bus[-1], folder, night, worn):
            found = armhil("check", str(arm), *bus, "--celsius", "21", *out)
        told.append(
            {"night": night, "worn": worn, "verdict": found["verdict"], "sentence": found["sentence"]}
        )
        say(f"night {night}, worn {worn:.0%}: {found['verdict']}: {found['sentence']}")
        if found["verdict"] == "failed":
            break
    return told


def pages(verdict: str, joint: int) -> dict[str, bool]:
    """Whether the pages and the metrics of the service say the verdict of the last night."""
    command = [sys.executable, "-m", "daq", "serve", "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as service:
        assert service.stdout is not None
        try:
            address = next(
                found[0] for line in service.stdout if (found := re.findall(r"http://[\d.:]+", line))
            )
            arm = json.loads(fetched(f"{address}/api/arms"))[0]["label"]
            home, own, metrics = (fetched(f"{address}/{path}") for path in ("", f"arms/{arm}", "metrics"))
        finally:
            service.terminate()
            service.wait(30)
    return {
        "overview": verdict in home,
        "arm": verdict in own and f"joint {joint}" in own,
        "metrics": any(line.startswith("armhil") and f'arm="{arm}"' in line for line in metrics.splitlines()),
    }


def fetched(address: str) -> str:
    with urllib.request.urlopen(address, timeout=60) as answer:
        return str(answer.read().decode())


def in_virtual_time(folder: Path, size: Size) -> dict[str, Any]:
    """One day in a kernel of its own."""
    words = [f"--{name}={value}" for name, value in asdict(size).items()]
    command = [
        str(TOOL),
        "-v",
        "-t",
        str(PATIENCE),
        "--",
        sys.executable,
        "-m",
        "benchmarks.whole_day",
        *words,
        "--inside",
        "vcan0",
        str(folder),
    ]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    began, last = time.monotonic(), ""
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) as kernel:
        assert kernel.stdout is not None
        for last in kernel.stdout:
            if not last.startswith("{"):
                say(f"{time.monotonic() - began:5.0f} s  {last.rstrip()}")
    if kernel.returncode:
        raise subprocess.CalledProcessError(kernel.returncode, command)
    told: dict[str, Any] = json.loads(last)
    return told


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--runs", type=int, default=2)
    parser.add_argument("--nights", type=int, default=30)
    parser.add_argument("--worn", type=int, default=10, help="nights with wear, at most")
    parser.add_argument("--wear", type=float, default=0.05, help="of Coulomb friction, a night")
    parser.add_argument("--first", type=float, default=8.0, help="s, a period of the motion of the nights")
    parser.add_argument("--duration", type=float, default=8.0, help="s, a period of the other motion")
    parser.add_argument("--evaluations", type=int, default=300)
    parser.add_argument("--inside", nargs=2, metavar=("DEVICE", "FOLDER"), help=argparse.SUPPRESS)
    given = parser.parse_args()
    size = Size(given.nights, given.worn, given.wear, given.first, given.duration, given.evaluations)
    if given.inside:
        print(json.dumps(day(given.inside[0], Path(given.inside[1]), size)))
        return 0
    days = []
    for _ in range(given.runs):
        with tempfile.TemporaryDirectory() as folder:
            began = time.monotonic()
            days.append(in_virtual_time(Path(folder), size))
            say(f"{time.monotonic() - began:.0f} s")
            print(json.dumps(days[-1], indent=1, ensure_ascii=False), flush=True)
    same = all(one == days[0] for one in days)
    print(f"{len(days)} days, {'the same' if same else 'not the same'}")
    return 0 if same else 2


if __name__ == "__main__":
    sys.exit(main())
