"""What an arm may be moved for, and how fast: by what it has passed in commissioning.

Drives that a command has started itself are simulated ones and may do what the limits allow. Every other arm
is a real one, on whatever bus: it may go as fast as it went when it passed ``armhil commission``, with the
same drives, description and cell. There is one way round that (``--not-commissioned``): slowly, and once
somebody has compared the drives' positions with the arm.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from daq.catalogue import arms, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.descriptions import Description, difference
from daq.catalogue.seals import is_whole
from daq.catalogue.values import ArmIdentity, Run
from daq.session.cell import Cell
from daq.session.motion_words import percent, speed_share
from daq.session.session_error import SessionError
from daq.session.stages import LAST_BEFORE_USE
from robots import Robot
from trajectories import Trajectory

NOT_COMMISSIONED_SPEED = 0.1
"""Share of the speed limits for an arm that has not been commissioned."""

SPEED = "speed_share"
"""Fact of a stage's run in the catalogue: its largest joint speed, as a share of that joint's limit."""

_ROUNDING = 1e-3
"""Of a share: the same path sampled anew is not faster."""


@dataclass(frozen=True)
class Admission:
    """How fast an arm may be driven.

    Attributes:
        speed: largest joint speed, as a share of that joint's limit.
        why: for people.
    """

    speed: float
    why: str

    def admit(self, robot: Robot, trajectory: Trajectory) -> None:
        """May this motion be driven?

        Raises:
            SessionError: it is too fast; says what would do.
        """
        share = speed_share(robot, trajectory)
        if share > self.speed + _ROUNDING:
            raise SessionError(
                f"the motion goes at up to {percent(share)} of the speed limits; allowed:"
                f" {percent(self.speed)}, {self.why}; {self.slower(robot, trajectory):.3g} of its speed"
                " would do"
            )

    def slower(self, robot: Robot, trajectory: Trajectory) -> float:
        """Share of a motion's speed at which it may be driven; 1 where it may as it is."""
        share = speed_share(robot, trajectory)
        return 1.0 if share <= self.speed + _ROUNDING else self.speed / share


SIMULATED = Admission(1.0, "as the limits allow on drives that this command has started")
STAGES = Admission(1.0, "as each stage allows")
NOTHING_MOVES = Admission(0.0, "nothing moves here")
NOT_COMMISSIONED = Admission(NOT_COMMISSIONED_SPEED, "on an arm that has not been commissioned")


def as_commissioned(
    catalogue: Catalogue | None, identity: ArmIdentity, cell: Cell | None, goes_on: str
) -> Admission:
    """How fast an arm may go by what it has passed.

    Args:
        catalogue: where passes are kept; None where they are not looked at.
        identity: of the arm with the drives that answered, and its description as it is now.
        cell: as it is now; None where motions are too small for one to matter.
        goes_on: the command that commissions it.

    Raises:
        SessionError: it has not been commissioned, or as something else; one line with what to do.
    """
    round_it = (
        f"--not-commissioned allows {percent(NOT_COMMISSIONED_SPEED)} of the speed limits, once somebody has"
        " compared the drives' positions with the arm"
    )
    if catalogue is None:
        raise SessionError(
            f"{identity.name}: whether it has been commissioned stands in the catalogue; leave out"
            f" --no-catalogue; {round_it}"
        )
    arm = arms.find(catalogue, identity)
    kept = (
        () if arm is None else runs.every(catalogue, arm=arm.label, kind="commission", stage=LAST_BEFORE_USE)
    )
    broken = [run for run in kept if run.state == "finished" and not is_whole(run, identity)]
    passed = [run for run in kept if run.outcome == "completed" and run not in broken]
    same = [run for run in passed if run.facts.get("description") == identity.description_sha256]
    here = [run for run in same if cell is None or run.facts.get("cell_sha256", "") == cell.sha256]
    if here:
        return Admission(_fastest(here), "as fast as it went when it was commissioned")
    if same:
        raise SessionError(
            f"arm {identity.name} was commissioned with another cell.toml or none; give --cell as it was"
            f" given there, or commission it in this one: {goes_on}"
        )
    what = "has not been commissioned"
    if passed:
        now = Description(identity.description_sha256, identity.parts)
        change = difference(catalogue, str(passed[0].facts.get("description", "")), now)
        what = f"was commissioned with another description ({change})"
    if broken:
        what += (
            f" (run {broken[0].id} of its {LAST_BEFORE_USE} is not as it was kept: the catalogue was changed)"
        )
    raise SessionError(f"arm {identity.name} {what}: {goes_on}; {round_it}")


def _fastest(passed: Sequence[Run]) -> float:
    """Of the runs of the last stage; one from before speeds were kept went as planned, up to the limits.

    A share that is none (nan in a damaged catalogue compares with nothing) allows no motion.
    """
    shares = [float(run.facts.get(SPEED, 1.0)) for run in passed]
    return max((share for share in shares if 0.0 < share <= 1.0 + _ROUNDING), default=0.0)
