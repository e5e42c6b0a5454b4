"""A check moves no real arm that has not been commissioned with that motion."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from daq.catalogue import arms, checks, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.identity import sha256_of
from daq.catalogue.values import Arm, ArmIdentity, Baseline
from daq.check.commissioned import require_commissioned
from daq.check.errors import CheckError
from daq.check.recorded import accepted_file, record_check
from daq.check.request import CheckRequest
from daq.session.bench import ArmOrder
from daq.session.recorded_runs import unconducted
from daq.session.session_error import SessionError
from daq.session.stages import STAGES, TRAJECTORY_FILE, fingerprint
from daq.session.watching import Nobody
from daq.text.progress import Silent
from drivers import Channel
from drivers.simulated import SimulatedArm
from robots import Robot
from tests.daq.check.offline_arms import write_motion
from tests.daq.session.commissioned import commissioned as passed_with_another_motion
from tests.daq.session.commissioned import real_identity

IDENTITY = ArmIdentity("emps", (7,), "d" * 64)
SHA256 = "a" * 64


def commissioned(catalogue: Catalogue, until: int, sha256: str = SHA256, cell: str = "") -> Arm:
    for stage in STAGES[:until]:
        facts = fingerprint(IDENTITY, sha256, cell)
        run = runs.begin(catalogue, IDENTITY, "commission", stage=stage, facts=facts)
        runs.finish(catalogue, run.id, "completed")
    return arms.register(catalogue, IDENTITY)


FULL = STAGES.index("full run") + 1


@pytest.mark.parametrize("cell", ["", "c" * 64])
def test_up_to_the_full_run(cell: str) -> None:
    with Catalogue() as catalogue:
        arm = commissioned(catalogue, FULL - 1, cell=cell)
        with pytest.raises(CheckError, match="arm emps: this trajectory has not passed `armhil commission`"):
            require_commissioned(catalogue, arm, IDENTITY, SHA256, cell)
        commissioned(catalogue, FULL, cell=cell)
        require_commissioned(catalogue, arm, IDENTITY, SHA256, cell)


@pytest.mark.parametrize(("then", "now"), [("c" * 64, ""), ("", "c" * 64), ("c" * 64, "d" * 64)])
def test_a_pass_in_another_cell_does_not_count(then: str, now: str) -> None:
    with Catalogue() as catalogue:
        arm = commissioned(catalogue, FULL, cell=then)
        with pytest.raises(CheckError, match=r"has passed `armhil commission` with .*give --cell as it was"):
            require_commissioned(catalogue, arm, IDENTITY, SHA256, now)


def test_what_it_does_not_count_for() -> None:
    with Catalogue() as catalogue:
        arm = commissioned(catalogue, FULL)
        other_drives = replace(IDENTITY, serials=(8,))
        other_description = replace(IDENTITY, description_sha256="e" * 64)
        for identity, sha256 in ((other_drives, SHA256), (other_description, SHA256), (IDENTITY, "b" * 64)):
            with pytest.raises(CheckError, match="has not passed"):
                require_commissioned(catalogue, arm, identity, sha256)
        with pytest.raises(CheckError, match="no trajectory has been accepted"):
            require_commissioned(catalogue, arm, IDENTITY, None)


def test_nights_drive_the_motion_of_an_accepted_full_run(tmp_path: Path) -> None:
    """A model of the full run is the baseline: nobody has to say again which motion that was."""
    file = tmp_path / "emps.trajectory.json"
    with Catalogue() as catalogue:
        facts = {**fingerprint(IDENTITY, SHA256), TRAJECTORY_FILE: str(file)}
        runs_of = [
            runs.begin(catalogue, IDENTITY, "commission", stage=stage, facts=facts if k else {})
            for k, stage in enumerate(("slow run", "full run"))
        ]
        for run, expected in zip(runs_of, (None, (file, SHA256)), strict=True):
            runs.finish(catalogue, run.id, "completed")
            arm = arms.register(catalogue, IDENTITY)
            accepted = Baseline(1, arm.id, 1, run.id, "accepted", SHA256, run.started, ())
            assert accepted_file(catalogue, accepted) == expected


@pytest.mark.slow
def test_a_real_arm_stands_still(emps: Robot, channel: Channel, tmp_path: Path, no_leftovers: None) -> None:
    """Drives on a bus that nobody calls simulated: refused before anything moves, the lease given back."""
    order = ArmOrder(emps, "emps", channel, new_arm=True)
    motion = write_motion(emps, tmp_path, 2.5)
    with Catalogue() as catalogue, SimulatedArm("emps", channel, 3):
        with pytest.raises(SessionError, match="arm emps has not been commissioned"):
            record_check(CheckRequest(order, tmp_path, catalogue, motion), Silent(), Nobody(), unconducted)
        passed_with_another_motion(real_identity(emps, 3))
        for trajectory, said in ((None, "no trajectory has been accepted"), (motion, "has not passed")):
            request = CheckRequest(order, tmp_path, catalogue, trajectory)
            with pytest.raises(CheckError, match=said):
                record_check(request, Silent(), Nobody(), unconducted)
        (arm,) = arms.every(catalogue)
        assert (
            not arm.simulated
            and not runs.every(catalogue, kind="check")
            and not checks.of_arm(catalogue, arm.id)
        )
        assert not list(tmp_path.glob("*.mcap"))
        sha256 = sha256_of(motion.read_text(encoding="utf-8"))
        identity = ArmIdentity(arm.name, arm.serials, arm.description_sha256)
        for stage in STAGES[:FULL]:
            run = runs.begin(
                catalogue, identity, "commission", stage=stage, facts=fingerprint(identity, sha256)
            )
            runs.finish(catalogue, run.id, "completed")
        recorded = record_check(
            CheckRequest(order, tmp_path, catalogue, motion), Silent(), Nobody(), unconducted
        )
    assert recorded.capture.exists()
