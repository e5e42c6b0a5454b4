"""What a commissioning protocol says: who, when, which drives, which limits, which stages, which figures.

Everything comes from the catalogue and from the recording of the fastest stage that was driven; nothing is
asked for, so that what is signed is what was measured.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from datetime import datetime
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory

import robots
from daq.catalogue import arms, models, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.descriptions import Description, difference
from daq.catalogue.values import Arm, ArmIdentity, Run
from daq.protocol.joints import JointRow, joint_rows
from daq.recording.capture import Capture
from daq.recording.described_arm import robot_of
from daq.recording.reader import read_capture
from daq.recording.who import now, user
from daq.session.stages import LAST_BEFORE_USE, STAGES, StageStatus, status
from daq.text.numbers import NOTHING, percent
from robots import Robot
from robots.errors import UserError

_DRIVEN = ("full run", "slow run", "warm-up")
"""Stages whose recording has figures of every joint; the fastest first."""

_MOST_WORDS = 240
"""Characters of one remark: the page is one page."""


class ProtocolError(UserError):
    """There is nothing to write a protocol of, or it cannot be written; one line that says what to do."""


@dataclass(frozen=True)
class StageRow:
    """One stage: passed, open or locked; by which run, when, by whom, and what was found."""

    name: str
    state: str
    run: int | None
    finished: str
    who: str
    words: str
    cycles: str
    checksum: str


@dataclass(frozen=True)
class Protocol:
    """One page.

    Attributes:
        arm: label in the catalogue.
        commissioned: whether the full run has passed.
        verdict: in a sentence.
        facts: label and text.
        figures_of: what the three right columns of ``joints`` were measured in; empty where nothing was.
        remarks: of the operators, and what is open.
        made: when and by whom this page was made.
    """

    arm: str
    commissioned: bool
    simulated: bool
    verdict: str
    facts: tuple[tuple[str, str], ...]
    joints: tuple[JointRow, ...]
    stages: tuple[StageRow, ...]
    figures_of: str
    remarks: tuple[str, ...]
    made: str


def protocol_of(catalogue: Catalogue, label: str, source: str | None = None) -> Protocol:
    """The protocol of the commissioning that an arm went through last.

    Args:
        catalogue: where its stages are kept.
        label: of the arm.
        source: name or path of its description; None takes the one in the recordings.

    Raises:
        CatalogueError: there is no such arm.
        ProtocolError: it never went through a stage, or its description is not to be had.
        RobotFileError: the description is wrong.
        CaptureError: a recording of it cannot be read.
    """
    arm = arms.by_label(catalogue, label)
    kept = runs.every(catalogue, arm=label, kind="commission")
    walked = [run for run in kept if run.stage in STAGES]
    if not walked:
        raise ProtocolError(
            f"arm {label}: has gone through no stage of commissioning; begin with"
            f" `armhil commission {arm.name}`"
        )
    latest = walked[0]
    known = {name: str(latest.facts.get(name, "")) for name in _COUNTS_FOR}
    identity = ArmIdentity(arm.name, arm.serials, known["description"], arm.simulated)
    states = status(catalogue, identity, known["trajectory_sha256"], known["cell_sha256"])
    passed = {stage.name: stage.run for stage in states if stage.run is not None}
    with ExitStack() as stack:
        folder = Path(stack.enter_context(TemporaryDirectory(prefix="armhil-")))
        found = _recording([passed[name] for name in _DRIVEN if name in passed])
        robot = _description(catalogue, arm, known["description"], source, found, folder)
        return _protocol(catalogue, arm, robot, states, known, found)


_COUNTS_FOR = ("description", "trajectory_sha256", "cell_sha256")
"""Facts of a stage's run that say what it counts for (``session.stages.fingerprint``)."""


def _recording(driven: Sequence[Run]) -> tuple[Run, Capture] | None:
    """The first of these runs whose recording is still there, as it was kept."""
    for run in driven:
        if run.capture is not None and Path(run.capture).is_file():
            capture = read_capture(Path(run.capture))
            if capture.sha256 != run.capture_sha256:
                raise ProtocolError(
                    f"{run.capture}: is not what run {run.id} recorded (another checksum), so a protocol must"
                    " not rest on it; bring the recording back, or move this file away and give --robot"
                )
            return run, capture
    return None


def _description(
    catalogue: Catalogue,
    arm: Arm,
    wanted: str,
    source: str | None,
    found: tuple[Run, Capture] | None,
    folder: Path,
) -> Robot:
    """The description that the stages were passed with, and no other."""
    if source is None and found is not None:
        return robot_of(found[1], folder)
    if source is None:
        raise ProtocolError(
            f"arm {arm.label}: no recording of its stages is left that says what its limits were; give its"
            f" description: `armhil protocol {arm.label} --robot {arm.name}` or a path of its robot.toml"
        )
    robot = robots.load(source)
    now_used = Description(robots.identity.description_sha256(robot.parts), robot.parts)
    changed = difference(catalogue, wanted, now_used)
    if changed:
        raise ProtocolError(
            f"--robot {source}: is not what arm {arm.label} was commissioned with: {changed}; give the"
            f" description of that time, or `armhil commission {source}` anew"
        )
    return robot


def _protocol(
    catalogue: Catalogue,
    arm: Arm,
    robot: Robot,
    states: tuple[StageStatus, ...],
    known: dict[str, str],
    found: tuple[Run, Capture] | None,
) -> Protocol:
    last = next(stage.run for stage in states if stage.name == LAST_BEFORE_USE)
    waiting = [stage.name for stage in states if stage.state != "passed"]
    stages = tuple(_stage_row(stage) for stage in states)
    done = [stage.run for stage in states if stage.run is not None]
    notes = dict.fromkeys(run.note for run in done if run.note)
    remarks = [_short(" ".join(note.split())) for note in notes]
    if waiting:
        remarks.insert(0, f"Open: {', '.join(waiting)}.")
    what = f"{arm.name} ({robot.description})" if robot.description else arm.name
    verdict = (
        "Commissioned: every stage up to the full run has passed"
        if last is not None
        else f"Not commissioned: {waiting[0]} has not passed"
    )
    facts = [
        ("Arm", f"{arm.label}: {what}"),
        ("Drives", "simulated" if arm.simulated else "real"),
        ("Bus", ", ".join(dict.fromkeys(str(run.facts.get("channel", NOTHING)) for run in done))),
        ("From – to", _span(min(run.started for run in done), max(map(_end, done)))),
        ("By", ", ".join(dict.fromkeys(run.who for run in done))),
        ("Description", f"SHA-256 {known['description'][:16]}…"),
        ("Trajectory", f"{_driven_words(states)}, SHA-256 {known['trajectory_sha256'][:16]}…"),
        ("Cell", f"SHA-256 {known['cell_sha256'][:16]}…" if known["cell_sha256"] else "none was given"),
        ("Model", _model_words(catalogue, last)),
    ]
    return Protocol(
        arm=arm.label,
        commissioned=last is not None,
        simulated=arm.simulated,
        verdict=verdict,
        facts=tuple(facts),
        joints=joint_rows(robot, arm, None if found is None else found[1]),
        stages=stages,
        figures_of="" if found is None else f"{found[0].stage}, run {found[0].id}",
        remarks=tuple(remarks),
        made=f"made {_moment(now())} by {user()} with armhil {version('armhil')}",
    )


def _stage_row(stage: StageStatus) -> StageRow:
    run = stage.run
    if run is None:
        return StageRow(stage.name, stage.state, None, NOTHING, NOTHING, "", NOTHING, NOTHING)
    cycles = str(run.facts.get("cycles", NOTHING))
    if run.facts.get("missed_cycles"):
        cycles += f" (deadlines missed: {run.facts['missed_cycles']})"
    return StageRow(
        name=stage.name,
        state=stage.state,
        run=run.id,
        finished=_moment(_end(run)),
        who=run.who,
        words=_short(str(run.facts.get("found", run.trajectory))),
        cycles=cycles,
        checksum=NOTHING if run.capture_sha256 is None else f"{run.capture_sha256[:12]}…",
    )


def _driven_words(states: tuple[StageStatus, ...]) -> str:
    found = [stage.run.trajectory for stage in states if stage.name == "full run" and stage.run is not None]
    return found[0] if found else "not driven in full yet"


def _model_words(catalogue: Catalogue, full: Run | None) -> str:
    made = () if full is None else models.of_run(catalogue, full.id)
    if not made:
        return "none identified from the full run yet"
    model = made[-1]
    return (
        f"{model.method}, relative error {percent(model.relative_error_percent)}, verdict"
        f" {model.verdict.replace('_', ' ')}"
    )


def _end(run: Run) -> datetime:
    return run.started if run.finished is None else run.finished


def _moment(at: datetime) -> str:
    return at.strftime("%Y-%m-%d %H:%M UTC")


def _span(begin: datetime, end: datetime) -> str:
    """From when to when; a day that is the same is said once, so that no line breaks within it."""
    if begin.date() == end.date():
        return f"{begin:%Y-%m-%d %H:%M} – {_moment(end)[11:]}"
    return f"{_moment(begin)} – {_moment(end)}"


def _short(text: str) -> str:
    return text if len(text) <= _MOST_WORDS else f"{text[: _MOST_WORDS - 1].rstrip()}…"
