"""A check of every arm of a fleet."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

from daq.catalogue.database import Catalogue
from daq.check.analysis import attempted
from daq.check.check import run_fleet
from daq.check.check_json import check_json
from daq.check.fleet import Fleet, FleetArm, fleet_words
from daq.check.request import CheckRequest, CheckResult
from daq.files.run_folder import make_run_folder
from daq.session.cell import cell_of
from ident.drift import DriftSettings

REFUSED = 2


@dataclass(frozen=True)
class FleetChecked:
    """What became of each arm, in the order of the fleet."""

    names: tuple[str, ...]
    outcomes: tuple[CheckResult | Exception, ...]

    @property
    def results(self) -> tuple[CheckResult, ...]:
        """Those that were checked to the end."""
        return tuple(one for one in self.outcomes if isinstance(one, CheckResult))

    @property
    def exit_code(self) -> int:
        """The worst: failed before unknown before warning before fine."""
        codes = [one.verdict.exit_code if isinstance(one, CheckResult) else REFUSED for one in self.outcomes]
        return max(codes, key=lambda code: {0: 0, 1: 1, 3: 2, 2: 3}[code])

    def as_json(self) -> dict[str, Any]:
        """What ``check --all --json`` prints."""
        return {
            "armhil": version("armhil"),
            "exit_code": self.exit_code,
            "arms": [
                check_json(one)
                if isinstance(one, CheckResult)
                else {
                    "arm": name,
                    "verdict": "failed",
                    "exit_code": REFUSED,
                    "error": " ".join(str(one).split()),
                }
                for name, one in zip(self.names, self.outcomes, strict=True)
            ],
        }


def check_fleet(
    fleet: Fleet,
    catalogue: Catalogue,
    out: Path | None,
    settings: DriftSettings,
    celsius: float | None,
    *,
    at_once: int,
    jobs: int,
    backend: str,
    duration: float = 12.0,
    evaluations: int = 6000,
    search: bool = False,
) -> FleetChecked:
    """Check every arm; each has a folder of its own under ``out``.

    What is wrong with the description, the cell or the folder of one arm is its outcome, and the others are
    checked.
    """
    stamp = datetime.now(tz=UTC).strftime("%Y%m%d-%H%M%S")
    parent = out or Path("runs") / f"{stamp}-check-all"

    def request(number: int, arm: FleetArm) -> CheckRequest:
        order = arm.order()
        return CheckRequest(
            order,
            make_run_folder(parent / f"{number:02d}-{order.robot.name}", order.robot.name),
            catalogue,
            None if arm.trajectory is None else Path(arm.trajectory),
            duration,
            evaluations,
            celsius,
            search,
            settings,
            cell=cell_of(None if arm.cell is None else Path(arm.cell)),
        )

    made = [attempted(partial(request, number, arm)) for number, arm in enumerate(fleet.arm, start=1)]
    names = tuple(
        f"{one.arm.robot.name} on {one.arm.channel}" if isinstance(one, CheckRequest) else fleet_words(arm)
        for one, arm in zip(made, fleet.arm, strict=True)
    )
    requests = [one for one in made if isinstance(one, CheckRequest)]
    outcomes = iter(run_fleet(requests, at_once=at_once, backend=backend, jobs=jobs))
    return FleetChecked(
        names, tuple(next(outcomes) if isinstance(one, CheckRequest) else one for one in made)
    )
