"""What is put into the catalogue comes out as it was, on SQLite and on PostgreSQL."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from itertools import pairwise

import numpy as np
import pytest

from daq.catalogue import arms, baselines, checks, findings, models, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.descriptions import Description
from daq.catalogue.values import ArmIdentity, ArmMismatch, CatalogueError, NewFinding
from tests.daq.catalogue.entries import OTHER_SHA, SHA, finished_run, identity, model


def test_an_arm_is_its_name_and_its_drives(catalogue: Catalogue) -> None:
    first = arms.register(catalogue, identity())
    assert (first.label, first.serials) == ("tx40", (100, 101, 102, 103, 104, 105))
    assert arms.register(catalogue, identity()) == first
    second = arms.register(catalogue, identity(first=200))
    assert (second.label, second.id != first.id) == ("tx40-2", True)
    simulated = arms.register(catalogue, identity(simulated=True))
    assert (simulated.label, simulated.simulated) == ("tx40-sim", True)
    assert arms.every(catalogue, name="tx40") == (first, second, simulated)
    assert arms.by_label(catalogue, "tx40-2") == second == arms.get(catalogue, second.id)
    assert arms.find(catalogue, identity(first=300)) is None
    with pytest.raises(CatalogueError, match=r"arm emps: .*allowed: tx40, tx40-2, tx40-sim$"):
        arms.by_label(catalogue, "emps")


def test_the_last_description_of_an_arm_is_kept(catalogue: Catalogue) -> None:
    first = arms.register(catalogue, identity())
    changed = arms.register(catalogue, identity(sha256=OTHER_SHA))
    assert (changed.id, changed.description_sha256) == (first.id, OTHER_SHA)
    run = runs.begin(catalogue, identity(), "run")
    assert (run.description_sha256, arms.get(catalogue, first.id).description_sha256) == (SHA, SHA)


def test_another_arm_is_told_in_one_line(catalogue: Catalogue) -> None:
    arm = arms.register(catalogue, identity())
    arms.require_same_drives(arm, arm.serials, "bus")
    arms.require_same_drives(arm, (), "a log")
    arms.require_same_drives(arm, (None, *arm.serials[1:]), "bus")
    with pytest.raises(ArmMismatch) as told:
        arms.require_same_drives(arm, (*arm.serials[:4], 9, 8), "udp_multicast 239.74.163.40")
    assert str(told.value) == (
        "udp_multicast 239.74.163.40: the drive of joint 5 has serial number 9;"
        " arm tx40 of the catalogue has 104: this is another arm"
    )
    with pytest.raises(ArmMismatch, match=r"^bus: has 1 drives; arm tx40 of the catalogue has 6$"):
        arms.require_same_drives(arm, (9,), "bus")
    arms.require_same_description(catalogue, arm, SHA, Description(SHA, {}), "baseline 1")
    with pytest.raises(ArmMismatch, match=r"^baseline 1: .* description a1a1a1a1a1a1… of arm tx40, it is"):
        arms.require_same_description(catalogue, arm, SHA, Description(OTHER_SHA, {}), "baseline 1")


def test_a_run_from_beginning_to_end(catalogue: Catalogue) -> None:
    before = datetime.now(tz=UTC)
    run = runs.begin(
        catalogue, identity(), "commission", stage="slow", capture="/data/a.mcap", facts={"seed": 3}
    )
    assert (run.arm, run.kind, run.stage, run.state) == ("tx40", "commission", "slow", "running")
    assert run.outcome == "" and run.finished is None and run.who
    assert before <= run.started <= datetime.now(tz=UTC) and run.started.tzinfo is not None
    ended = runs.finish(
        catalogue, run.id, "stopped", reason="stop requested", capture_sha256=SHA, facts={"cycles": 7}
    )
    assert (ended.state, ended.outcome, ended.reason) == ("finished", "stopped", "stop requested")
    assert ended.facts == {"seed": 3, "cycles": 7}
    assert ended.finished is not None and ended.finished >= run.started
    assert runs.get(catalogue, run.id) == ended == runs.of_capture(catalogue, SHA)
    assert runs.of_capture(catalogue, OTHER_SHA) is None
    for missing in (lambda: runs.get(catalogue, 99), lambda: runs.finish(catalogue, 99, "failed")):
        with pytest.raises(CatalogueError, match=r"^run 99: is not in the catalogue; `armhil runs` lists"):
            missing()


def test_notes_are_added_and_never_replaced(catalogue: Catalogue) -> None:
    run = runs.begin(catalogue, identity(), "run", note="cold start")
    assert runs.note(catalogue, run.id, "noise at joint 3").note == "cold start\nnoise at joint 3"


def test_runs_are_listed_newest_first_and_by_what_is_asked(catalogue: Catalogue) -> None:
    made = [
        runs.begin(catalogue, identity(name), kind)
        for name, kind in (("tx40", "demo"), ("emps", "run"), ("tx40", "run"))
    ]
    assert [run.id for run in runs.every(catalogue)] == [run.id for run in reversed(made)]
    assert [run.id for run in runs.every(catalogue, arm="tx40")] == [made[2].id, made[0].id]
    assert [run.id for run in runs.every(catalogue, arm="tx40", kind="run")] == [made[2].id]
    assert [run.id for run in runs.every(catalogue, limit=1)] == [made[2].id]
    later = datetime.now(tz=UTC) + timedelta(seconds=1)
    assert runs.every(catalogue, since=later) == ()
    assert len(runs.every(catalogue, before=later)) == 3


def test_a_model_comes_back_bit_for_bit(catalogue: Catalogue) -> None:
    run, new = finished_run(catalogue), model(seed=4)
    kept = models.add(catalogue, run.id, new)
    assert (kept.run_id, kept.arm_id) == (run.id, run.arm_id)
    for found in (kept, models.get(catalogue, kept.id), models.latest_of(catalogue, run.id)):
        assert found.parameters == new.parameters
        assert found.torque_rms == new.torque_rms and found.sources == new.sources
        assert found.gates == new.gates and found.settings == new.settings and found.effects == new.effects
        assert found.covariance is not None and new.covariance is not None
        assert np.array_equal(found.covariance, new.covariance)
    without = models.add(catalogue, run.id, model(size=0))
    assert without.covariance is not None and without.covariance.shape == (0, 0)
    assert [found.id for found in models.of_run(catalogue, run.id)] == [kept.id, without.id]
    assert [found.id for found in models.of_arm(catalogue, run.arm_id, limit=1)] == [without.id]
    empty = finished_run(catalogue)
    with pytest.raises(
        CatalogueError,
        match=rf"^run {empty.id}: has no model; make one: `armhil identify /data/tx40.mcap --out FOLDER`$",
    ):
        models.latest_of(catalogue, empty.id)
    with pytest.raises(CatalogueError, match=r"^run 77: is not in the catalogue"):
        models.latest_of(catalogue, 77)


def test_the_course_of_a_parameter(catalogue: Catalogue) -> None:
    made = [models.add(catalogue, finished_run(catalogue).id, model(seed)) for seed in range(3)]
    models.add(catalogue, finished_run(catalogue, "emps").id, model(9))
    (course,) = models.courses(catalogue, made[0].arm_id, "Fv2")
    assert course.values.tolist() == [entry.parameters[1].value for entry in made]
    assert course.sigmas.tolist() == [entry.parameters[1].sigma for entry in made]
    assert course.models.tolist() == [entry.id for entry in made] and (course.name, course.unit) == (
        "Fv2",
        "N·m·s",
    )
    assert all(a <= b for a, b in pairwise(course.at))
    assert course.runs.tolist() == [entry.run_id for entry in made]
    assert list(course.at) == [runs.get(catalogue, entry.run_id).started for entry in made]
    assert course.seconds.tolist() == [at.timestamp() for at in course.at]
    every = models.courses(catalogue, made[0].arm_id)
    assert [(one.name, len(one.values)) for one in every] == [(f"Fv{k}", 3) for k in range(1, 6)]
    assert models.courses(catalogue, made[0].arm_id, "Fc1") == ()


def test_a_baseline_and_everything_that_is_said_of_it(catalogue: Catalogue) -> None:
    first, second = (models.add(catalogue, finished_run(catalogue).id, model(seed)) for seed in (1, 2))
    arm = first.arm_id
    assert baselines.current(catalogue, arm) is None
    for change in (baselines.suspect, baselines.roll_back, baselines.trust):
        with pytest.raises(
            CatalogueError,
            match=r"^arm tx40: has no baseline; `armhil baseline accept RUN --reason WHY` makes",
        ):
            change(catalogue, arm, "ann", "why")
    old = baselines.accept(catalogue, first.id, "ann", "first light", "/data/report.html")
    new = baselines.accept(catalogue, second.id, "ben", "after service")
    assert baselines.current(catalogue, arm) == new
    doubted = baselines.suspect(catalogue, arm, "ann", "joint 2 drifts")
    assert (doubted.id, doubted.state) == (new.id, "suspect")
    assert baselines.trust(catalogue, arm, "ann", "it was the cable").state == "accepted"
    assert baselines.roll_back(catalogue, arm, "ben", "wrong tool") == old
    events = baselines.of_arm(catalogue, arm)[0].events
    assert [(event.state, event.author, event.reason) for event in events] == [
        ("accepted", "ben", "after service"),
        ("suspect", "ann", "joint 2 drifts"),
        ("accepted", "ann", "it was the cable"),
        ("rolled_back", "ben", "wrong tool"),
    ]
    assert (old.events[0].report, old.run_id, old.description_sha256) == (
        "/data/report.html",
        first.run_id,
        SHA,
    )
    assert baselines.roll_back(catalogue, arm, "ben", "all wrong") is None
    assert [entry.state for entry in baselines.of_arm(catalogue, arm)] == ["rolled_back", "rolled_back"]


def test_recordings_that_a_baseline_rests_on_are_known(catalogue: Catalogue) -> None:
    run = finished_run(catalogue, capture_sha256="c3" * 32)
    kept = models.add(catalogue, run.id, model(capture_sha256="d4" * 32))
    models.add(catalogue, finished_run(catalogue, capture_sha256="e5" * 32).id, model())
    assert baselines.guarded_captures(catalogue) == frozenset()
    baselines.accept(catalogue, kept.id, "ann", "fine")
    baselines.roll_back(catalogue, kept.arm_id, "ann", "not so fine")
    assert baselines.guarded_captures(catalogue) == {"c3" * 32, "d4" * 32}


def test_findings_and_checks(catalogue: Catalogue) -> None:
    run = finished_run(catalogue)
    kept = models.add(catalogue, run.id, model())
    new = tuple(
        NewFinding(
            effect=effect,
            joints=joints,
            sentence=f"joint 2 has {effect}",
            parameters=({"name": "vs2", "value": 0.1, "sigma": 0.01, "unit": "rad/s", "shape": True},),
            p_value=1e-9,
            gap_before=5.0,
            gap_after=2.5,
            held_out_gain=0.8,
        )
        for effect, joints in (("stribeck_friction", (2,)), ("wrist_coupling", (5, 6)))
    )
    found = findings.add(catalogue, run.id, new, kept.id)
    assert [(entry.effect, entry.joints, entry.model_id) for entry in found] == [
        ("stribeck_friction", (2,), kept.id),
        ("wrist_coupling", (5, 6), kept.id),
    ]
    assert found[0].parameters == new[0].parameters and found[0].gap_after == 2.5
    assert findings.of_run(catalogue, run.id) == found
    assert findings.of_arm(catalogue, run.arm_id) == found[::-1]
    baseline = baselines.accept(catalogue, kept.id, "ann", "fine")
    check = checks.add(
        catalogue,
        run.id,
        "drift",
        "Fc2 moved",
        {"p": 0.001},
        model_id=kept.id,
        baseline_id=baseline.id,
    )
    assert (check.verdict, check.details, check.baseline_id) == ("drift", {"p": 0.001}, baseline.id)
    assert checks.of_run(catalogue, run.id) == (check,) == checks.of_arm(catalogue, run.arm_id, limit=5)


def test_what_fails_leaves_nothing(catalogue: Catalogue) -> None:
    run = finished_run(catalogue)
    twice = model(size=2)
    broken = NewFinding(
        effect="x",
        joints=(1,),
        sentence="",
        parameters=({"value": object()},),
        p_value=0.0,
        gap_before=None,
        gap_after=None,
        held_out_gain=None,
    )
    good = NewFinding(**{**broken.__dict__, "parameters": ()})
    with pytest.raises(Exception, match="serializable"):
        findings.add(catalogue, run.id, (good, broken))
    assert findings.of_run(catalogue, run.id) == ()
    with pytest.raises(CatalogueError, match=r"^run 55: is not in the catalogue"):
        models.add(catalogue, 55, twice)
    assert models.of_arm(catalogue, run.arm_id) == ()


def test_an_arm_is_a_real_one_unless_it_is_said_to_be_simulated(catalogue: Catalogue) -> None:
    assert arms.register(catalogue, ArmIdentity("emps", (7,), "0" * 64)).label == "emps"
    assert arms.register(catalogue, ArmIdentity("emps", (7,), "0" * 64, simulated=True)).label == "emps-sim"
