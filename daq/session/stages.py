"""The stages of commissioning, and which of them are open: each after the one before it has passed.

What has passed is read from the catalogue. It counts for one arm (its drives), one description (robot.toml,
URDF, meshes), one trajectory and one cell (cell.toml); a change of any of them locks what it opened.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

from daq.catalogue import arms, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.descriptions import Description, difference
from daq.catalogue.seals import is_whole
from daq.catalogue.values import ArmIdentity, Run
from daq.session.session_error import SessionError

StageName = Literal["plan", "check", "first move", "approach", "warm-up", "slow run", "full run", "return"]
STAGES: tuple[StageName, ...] = get_args(StageName)

MOVING: tuple[StageName, ...] = ("first move", "approach", "warm-up", "slow run", "full run", "return")
"""Stages in which the arm moves."""

LAST_BEFORE_USE: StageName = "full run"
"""An arm that has passed it is commissioned."""

TRAJECTORY_FILE = "trajectory_file"
"""Among the facts of a full run and of a check: the file of its motion, which nights drive then."""

SLOW_SPEED = 0.1
"""Highest speed of the slow run, as a share of the planned one."""

PURPOSES: dict[StageName, str] = {
    "plan": "an exciting trajectory within every limit",
    "check": "drives, bus and machine are fit; nothing moves",
    "first move": "each joint half a degree to both sides, judged by torque against the description",
    "approach": "slowly to where the trajectory begins",
    "warm-up": "each joint alone, slowly, a little there and back",
    "slow run": "the whole trajectory at a tenth of its speed",
    "full run": "the whole trajectory as planned, for identification",
    "return": "slowly to where the arm rests",
}

StageState = Literal["passed", "open", "locked"]


@dataclass(frozen=True)
class StageStatus:
    """Where one stage stands; ``run`` is the one that passed it."""

    name: StageName
    state: StageState
    run: Run | None


def fingerprint(identity: ArmIdentity, trajectory_sha256: str, cell_sha256: str = "") -> dict[str, str]:
    """What a pass counts for, besides the arm; kept among the facts of its run.

    Args:
        identity: of the arm.
        trajectory_sha256: of the trajectory's file.
        cell_sha256: of the cell file; empty where there is none.
    """
    return {
        "description": identity.description_sha256,
        "trajectory_sha256": trajectory_sha256,
        "cell_sha256": cell_sha256,
    }


def status(
    catalogue: Catalogue | None,
    identity: ArmIdentity | None,
    trajectory_sha256: str,
    cell_sha256: str = "",
) -> tuple[StageStatus, ...]:
    """Where each stage stands, in order.

    Args:
        catalogue: where passes are kept; None where there is none.
        identity: of the arm; None where it is not known which one it is.
        trajectory_sha256, cell_sha256: as in :func:`fingerprint`.
    """
    passed: dict[str, Run] = {}
    arm = None if catalogue is None or identity is None else arms.find(catalogue, identity)
    if catalogue is not None and identity is not None and arm is not None:
        wanted = fingerprint(identity, trajectory_sha256, cell_sha256)
        for run in runs.every(catalogue, arm=arm.label, kind="commission"):
            if (
                run.outcome == "completed"
                and is_whole(run, identity)
                and wanted == {name: run.facts.get(name, "") for name in wanted}
            ):
                passed.setdefault(run.stage, run)
    states = []
    is_open = True
    for name in STAGES:
        run_of_stage = passed.get(name) if is_open else None
        state: StageState = "passed" if run_of_stage else "open" if is_open else "locked"
        states.append(StageStatus(name, state, run_of_stage))
        is_open = is_open and run_of_stage is not None
    return tuple(states)


def changed_since(catalogue: Catalogue | None, identity: ArmIdentity | None) -> str:
    """What of the description changed since the arm last passed a stage; empty where nothing did.

    Args:
        catalogue: where passes are kept; None where there is none.
        identity: of the arm, with its description as it is now.
    """
    arm = None if catalogue is None or identity is None else arms.find(catalogue, identity)
    if catalogue is None or identity is None or arm is None:
        return ""
    now = Description(identity.description_sha256, identity.parts)
    for run in runs.every(catalogue, arm=arm.label, kind="commission"):
        if run.outcome == "completed" and run.stage in STAGES:
            then = str(run.facts.get("description", ""))
            return difference(catalogue, then, now) and (
                f"since run {run.id} ({run.stage}) {difference(catalogue, then, now)};"
                " `armhil commission` goes through every stage again"
            )
    return ""


def stages_to_do(
    states: Sequence[StageStatus], first: StageName | None, last: StageName | None
) -> tuple[StageName, ...]:
    """The stages to go through now, in order.

    Args:
        states: where each stands.
        first: begin with this one, though it has passed; with the first that has not where None.
        last: end with this one; with the last of all where None.

    Raises:
        SessionError: the first one is locked, or comes after the last.
    """
    names = [status.name for status in states]
    todo = next((k for k, status in enumerate(states) if status.state != "passed"), len(names))
    begin = todo if first is None else names.index(first)
    if begin > todo:
        raise SessionError(
            f"stage {first} is locked: {names[todo]} has not passed yet on this arm with this description,"
            " this trajectory and this cell"
        )
    end = len(names) if last is None else names.index(last) + 1
    if first is not None and end <= begin:
        raise SessionError(f"--from {first} comes after --until {last}")
    return tuple(names[begin:end])


def stage_of(option: str, text: str | None) -> StageName | None:
    """The stage of that name; a hyphen is as good as a space.

    Raises:
        SessionError: there is none.
    """
    if text is None:
        return None
    for name in STAGES:
        if name.replace(" ", "-") == text.strip().replace(" ", "-"):
            return name
    allowed = ", ".join(name.replace(" ", "-") for name in STAGES)
    raise SessionError(f"{option} {text}; allowed: {allowed}")
