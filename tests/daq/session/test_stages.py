"""Which stages of commissioning are open: each after the one before it, on this arm, with these files."""

from __future__ import annotations

from dataclasses import replace

import pytest

from daq.catalogue import runs
from daq.catalogue.database import Catalogue
from daq.catalogue.values import ArmIdentity, RunOutcome
from daq.session.session_error import SessionError
from daq.session.stages import STAGES, StageName, fingerprint, stage_of, stages_to_do, status
from tests.daq.catalogue.entries import OTHER_SHA, identity

TRAJECTORY = "c3" * 32


def keep(
    catalogue: Catalogue,
    name: StageName,
    outcome: RunOutcome = "completed",
    arm: ArmIdentity | None = None,
    trajectory: str = TRAJECTORY,
) -> None:
    arm = arm or identity()
    run = runs.begin(catalogue, arm, "commission", stage=name, facts=fingerprint(arm, trajectory))
    runs.finish(catalogue, run.id, outcome)


def states(catalogue: Catalogue, arm: ArmIdentity | None = None, trajectory: str = TRAJECTORY) -> str:
    """One letter for each stage: passed, open, locked."""
    return "".join(entry.state[0] for entry in status(catalogue, arm or identity(), trajectory))


def test_each_stage_opens_the_next() -> None:
    with Catalogue() as catalogue:
        for k, name in enumerate(STAGES):
            assert states(catalogue) == "p" * k + "o" + "l" * (len(STAGES) - k - 1)
            keep(catalogue, name)
        assert states(catalogue) == "pppppppp"


@pytest.mark.parametrize("outcome", ["stopped", "aborted", "fault", "failed"])
def test_only_what_was_completed_has_passed(outcome: RunOutcome) -> None:
    with Catalogue() as catalogue:
        keep(catalogue, "plan")
        keep(catalogue, "check", outcome)
        assert states(catalogue) == "pollllll"
        runs.begin(
            catalogue, identity(), "commission", stage="check", facts=fingerprint(identity(), TRAJECTORY)
        )
        assert states(catalogue) == "pollllll", "it goes on"


def test_a_stage_that_passed_before_a_locked_one_does_not_count() -> None:
    with Catalogue() as catalogue:
        for name in STAGES:
            if name != "slow run":
                keep(catalogue, name)
        assert states(catalogue) == "pppppoll"


def test_a_pass_counts_for_one_arm_one_description_and_one_trajectory() -> None:
    with Catalogue() as catalogue:
        for name in STAGES:
            keep(catalogue, name)
        for other in (
            identity(first=200),
            identity(sha256=OTHER_SHA),
            identity(simulated=True),
            replace(identity(), name="another"),
        ):
            assert states(catalogue, other) == "olllllll"
        assert states(catalogue, trajectory="d4" * 32) == "olllllll"
        found = status(catalogue, identity(), TRAJECTORY, "e5" * 32)
        assert [entry.state for entry in found] == ["open", *["locked"] * 7], "in another cell"
        assert states(catalogue) == "pppppppp"


def test_what_passed_before_cells_were_remembered_counts_where_there_is_none() -> None:
    with Catalogue() as catalogue:
        facts = {"description": identity().description_sha256, "trajectory_sha256": TRAJECTORY}
        run = runs.begin(catalogue, identity(), "commission", stage="plan", facts=facts)
        runs.finish(catalogue, run.id, "completed")
        assert states(catalogue) == "pollllll"
        assert status(catalogue, identity(), TRAJECTORY, "e5" * 32)[0].state == "open"


def test_what_is_to_be_done() -> None:
    with Catalogue() as catalogue:
        for name in STAGES[:5]:
            keep(catalogue, name)
        found = status(catalogue, identity(), TRAJECTORY)
    assert stages_to_do(found, None, None) == ("slow run", "full run", "return")
    assert stages_to_do(found, None, "slow run") == ("slow run",)
    assert stages_to_do(found, "check", "approach") == ("check", "first move", "approach")
    assert stages_to_do(found, "slow run", None) == ("slow run", "full run", "return")
    assert stages_to_do(found, None, "check") == (), "it has passed"
    with pytest.raises(
        SessionError, match=r"^stage full run is locked: slow run has not passed yet on this arm"
    ):
        stages_to_do(found, "full run", None)
    with pytest.raises(SessionError, match=r"^--from warm-up comes after --until check$"):
        stages_to_do(found, "warm-up", "check")


def test_without_a_catalogue_or_an_arm_everything_is_to_be_done() -> None:
    assert [entry.state for entry in status(None, identity(), TRAJECTORY)][:2] == ["open", "locked"]
    with Catalogue() as catalogue:
        assert [entry.state for entry in status(catalogue, None, TRAJECTORY)][:2] == ["open", "locked"]


def test_names_of_stages() -> None:
    assert stage_of("--from", "slow-run") == "slow run" == stage_of("--from", "slow run")
    assert stage_of("--from", "warm-up") == "warm-up"
    assert stage_of("--from", None) is None
    with pytest.raises(
        SessionError,
        match=r"^--until fast; allowed: plan, check, first-move, approach, warm-up, slow-run, full-run",
    ):
        stage_of("--until", "fast")
