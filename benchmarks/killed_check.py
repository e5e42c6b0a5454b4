"""One check that is killed at a point of its way: what :mod:`benchmarks.killed_checks` and a test start.

``python benchmarks/killed_check.py STAGE -- ARGUMENTS OF armhil check``
"""

from __future__ import annotations

import importlib
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NoReturn

ROOT = Path(__file__).resolve().parent.parent

When = Literal["before", "after", "inside"]
Left = Literal["nothing", "abandoned", "unjudged", "judged"]
Setting = Literal["accepted", "away", "first", "changed"]

_DRIVES = "drivers.simulated:SimulatedArm"
_CONNECTION = "drivers.setup.connection:Connection"
_CYCLIC = "drivers.cyclic.stream:_start"
_RECORDER = "daq.recording.recorder:Recorder"
_WRITE = f"{_RECORDER}.write"


@dataclass(frozen=True)
class KillPoint:
    """A place in the code at which the process gets SIGKILL.

    Attributes:
        stage: of a check, in words.
        where: ``module:name`` or ``module:class.name`` that is called there.
        when: before the call, after it, or inside: when it is about to commit to the catalogue.
        left: what the catalogue has of the killed check: no run of it, a run that was abandoned, a run that
            was recorded and not judged, or the verdict.
        setting: how the check is made: on drives that outlive it, from where the accepted trajectory begins
            (``accepted``) or from elsewhere (``away``); on simulated drives of its own, without a baseline
            (``first``) or with one and an effect that is searched for (``changed``).
        call: at which call of it, from 1.
        delay: s after that, in which everything goes on.
    """

    stage: str
    where: str
    when: When
    left: Left
    setting: Setting = "accepted"
    call: int = 1
    delay: float = 0.0


_BEGIN = (
    KillPoint("begin", "daq.catalogue.runs:settle_abandoned", "before", "nothing"),
    KillPoint("simulated drives: started", f"{_DRIVES}.__enter__", "after", "nothing", "first"),
    KillPoint("configure: bus about to be taken", f"{_CONNECTION}.open", "before", "nothing"),
    KillPoint("configure: drives set up", f"{_CONNECTION}.open", "after", "nothing"),
    KillPoint("lease: about to be taken", "daq.catalogue.leases:take", "inside", "nothing"),
    KillPoint("lease: taken", "daq.catalogue.leases:take", "after", "nothing"),
    KillPoint("preflight: motion read", "daq.check.recorded:_motion", "after", "nothing"),
    KillPoint("preflight: motion judged", "daq.check.recorded:refuse_undrivable", "after", "nothing"),
    KillPoint("plan: begins", "daq.session.exciting:plan", "before", "nothing", "first"),
    KillPoint("plan: in the search", "daq.session.exciting:plan", "before", "nothing", "first", delay=0.3),
    KillPoint("plan: written", "daq.session.exciting:write_trajectory", "after", "nothing", "first"),
    KillPoint("run: about to be begun", "daq.catalogue.runs:begin", "inside", "nothing"),
    KillPoint("run: begun", "daq.catalogue.runs:begin", "after", "abandoned"),
)
_MOTION = (
    KillPoint("enable: cyclic process started", _CYCLIC, "after", "abandoned"),
    KillPoint("enable: 0.4 s later", _CYCLIC, "after", "abandoned", delay=0.4),
    KillPoint("enable: 0.8 s later", _CYCLIC, "after", "abandoned", delay=0.8),
    KillPoint("approach: first samples", _WRITE, "before", "abandoned", "away"),
    KillPoint("approach: under way", _WRITE, "after", "abandoned", "away", call=30),
    KillPoint("stream: first samples", _WRITE, "before", "abandoned"),
    KillPoint("stream: under way", _WRITE, "after", "abandoned", call=60),
    KillPoint("stream: over, record open", f"{_RECORDER}.finish", "before", "abandoned"),
    KillPoint("record: closed", f"{_RECORDER}.finish", "after", "abandoned"),
    KillPoint("run: about to be ended", "daq.catalogue.runs:finish", "inside", "abandoned"),
    KillPoint("run: ended", "daq.catalogue.runs:finish", "after", "unjudged"),
    KillPoint("lease: about to be given back", "daq.catalogue.leases:release", "inside", "unjudged"),
    KillPoint("lease: given back", "daq.catalogue.leases:release", "after", "unjudged"),
)
_JUDGEMENT = (
    KillPoint("identify: begins", "daq.check.analysis:identify", "before", "unjudged"),
    KillPoint("identify: rows made", "ident.identification.identify:all_fits", "before", "unjudged"),
    KillPoint("test: begins", "ident.identification.identify:_test", "before", "unjudged"),
    KillPoint("test: done", "daq.check.analysis:identify", "after", "unjudged"),
    KillPoint("report: written", "daq.check.judged:write_results", "after", "unjudged"),
    KillPoint("model: about to be kept", "daq.catalogue.models:add", "inside", "unjudged"),
    KillPoint("model: kept", "daq.catalogue.models:add", "after", "unjudged"),
    KillPoint("compare: done", "daq.check.judged:_compared", "after", "unjudged"),
    KillPoint("search: begins", "daq.check.judged:run_diagnose", "before", "unjudged", "changed"),
    KillPoint("search: done", "daq.check.judged:run_diagnose", "after", "unjudged", "changed"),
    KillPoint("search: kept", "daq.check.judged:keep_diagnose_request", "after", "unjudged", "changed"),
    KillPoint("verdict: about to be kept", "daq.catalogue.checks:add", "inside", "unjudged"),
    KillPoint("verdict: kept", "daq.catalogue.checks:add", "after", "judged"),
    KillPoint("notify: about to tell", "daq.notify.notify:start_sender", "before", "judged", "changed"),
    KillPoint("notify: sender started", "daq.notify.notify:start_sender", "after", "judged", "changed"),
)
POINTS = (*_BEGIN, *_MOTION, *_JUDGEMENT)
"""In the order in which a check comes to them."""


def kill_at(point: KillPoint) -> None:
    """Have this process killed when it comes to a point."""
    module_name, _, path = point.where.partition(":")
    owner: Any = importlib.import_module(module_name)
    *parents, name = path.split(".")
    for parent in parents:
        owner = getattr(owner, parent)
    setattr(owner, name, _deadly(getattr(owner, name), point))


def _deadly(function: Callable[..., Any], point: KillPoint) -> Callable[..., Any]:
    calls = 0

    def deadly(*given: Any, **named: Any) -> Any:
        nonlocal calls
        calls += 1
        if calls != point.call:
            return function(*given, **named)
        if point.when == "before":
            _die(point.delay)
        if point.when == "inside":
            with _dying_at_commit():
                return function(*given, **named)
        found = function(*given, **named)
        _die(point.delay)
        return found

    return deadly


def _die(delay: float) -> None:
    if delay:
        threading.Timer(delay, _kill).start()
    else:
        _kill()


def _kill() -> NoReturn:
    os.kill(os.getpid(), signal.SIGKILL)
    time.sleep(60)
    raise AssertionError("a killed process goes on")


@contextmanager
def _dying_at_commit() -> Iterator[None]:
    from sqlalchemy import event
    from sqlalchemy.engine import Engine

    event.listen(Engine, "commit", lambda connection: _kill())
    yield
    raise AssertionError("nothing was committed")


def main() -> int:
    """Run ``armhil check`` until it is killed."""
    from daq.cli.entry import main as armhil

    stage, separator, *arguments = sys.argv[1:]
    assert separator == "--"
    kill_at(next(point for point in POINTS if point.stage == stage))
    sys.argv = ["armhil", "check", *arguments]
    return int(armhil() or 0)


if __name__ == "__main__":
    sys.path.insert(0, str(ROOT))
    sys.exit(main())
