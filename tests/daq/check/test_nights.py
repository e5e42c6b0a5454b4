"""Night after night through the catalogue: learned, watched, and since when something has moved."""

from __future__ import annotations

import json
import re
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from fastapi.testclient import TestClient
from rich.console import Console
from sqlalchemy import update

from daq.catalogue import arms, baselines, checks, models
from daq.catalogue.database import Catalogue
from daq.catalogue.schema import checks as table
from daq.check import check as check_module
from daq.check import nights as nights_module
from daq.check.check import run_check
from daq.check.recheck import recheck
from daq.check.request import CheckRequest, CheckResult, Verdict
from daq.check.residual import found_nothing
from daq.check.terminal import print_check
from daq.notify.notify import message_of
from daq.service.app import create_app
from daq.service.settings import Service
from daq.session.bench import ArmOrder
from daq.text.progress import Silent
from drivers import Channel
from ident.drift import DriftSettings
from robots import Robot
from tests.daq.calls import Call
from tests.daq.check.offline_arms import record_offline, write_motion

LEARNING = 8
COLDER_HALL = "format = 1\n[[drifting_friction]]\ndrive = 1\nstart = {kelvin}\nambient = {kelvin}\n"
WORN = "[[coulomb_friction]]\ndrive = 1\nchange = {share}\n"


def test_wear_is_told_with_the_run_that_it_began_with(
    emps: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(check_module, "record_check", record_offline)
    motion = write_motion(emps, tmp_path, 2.5)
    settings = DriftSettings(learning_nights=LEARNING)
    hall = np.random.default_rng(1).normal(0.0, 4.0, 20)

    def check(catalogue: Catalogue, night: int, worn: float = 0.0, given: Path = motion) -> CheckResult:
        folder = tmp_path / f"night{night}"
        folder.mkdir()
        hidden = folder / "scenario.toml"
        more = WORN.format(share=worn) if worn else ""
        hidden.write_text(COLDER_HALL.format(kelvin=hall[night]) + more)
        order = ArmOrder(emps, "emps", Channel("virtual", "offline"), True, 3, scenario=hidden)
        request = CheckRequest(order, folder, catalogue, given, celsius=22.0 + hall[night], settings=settings)
        return run_check(request, Silent())

    with Catalogue() as catalogue:
        first = check(catalogue, 0)
        baselines.accept(catalogue, first.model, "Ada", "first", None)
        quiet = [check(catalogue, night) for night in range(1, LEARNING + 4)]
        assert [one.verdict for one in quiet] == [Verdict.OK] * len(quiet), [one.sentence for one in quiet]
        stages = [one.comparison.stage for one in quiet if one.comparison is not None]
        assert stages == ["learning"] * (LEARNING - 1) + ["watching"] * 4  # the baseline teaches too

        (tmp_path / "other").mkdir()
        other = check(catalogue, 12, given=write_motion(emps, tmp_path / "other", 3.5))
        assert other.comparison is not None
        assert other.comparison.stage == "learning"  # nights of another motion teach nothing of this one

        found = [check(catalogue, night, worn=0.15) for night in (13, 14)]
        for one in found:
            assert one.verdict in (Verdict.WARNING, Verdict.FAILED), one.sentence
            assert one.sentence.startswith("Coulomb friction of joint 1 +"), one.sentence
            assert one.comparison is not None and one.comparison.since is not None
            assert one.comparison.since.label.startswith(f"run {found[0].run} (")
            assert f"since run {found[0].run} (" in one.sentence
        assert found[1].previous == found[0].verdict.value
        change = found[1].comparison.changes[0] if found[1].comparison else None
        assert change is not None and change.relative == pytest.approx(0.15, abs=0.06)
        (arm,) = arms.every(catalogue)
        states = [record.details["state"] for record in checks.of_arm(catalogue, arm.id)]
        assert states[:2] == ["changed", "changed"] and set(states[2:]) == {"unchanged"}
        assert len(models.courses(catalogue, arm.id, "Fc1")[0].values) == len(states)


def test_friction_that_nobody_measured_the_warmth_of_is_doubtful_and_no_lesson(
    emps: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, armhil: Call
) -> None:
    """+ 30 % on one night without a thermometer: told, with the warmth that it would take."""
    monkeypatch.setattr(check_module, "record_check", record_offline)
    motion = write_motion(emps, tmp_path, 2.5)

    def check(catalogue: Catalogue, night: int, worn: float = 0.0) -> CheckResult:
        folder = tmp_path / f"night{night}"
        folder.mkdir()
        hidden = folder / "scenario.toml"
        hidden.write_text("format = 1\n" + (WORN.format(share=worn) if worn else ""))
        order = ArmOrder(emps, "emps", Channel("virtual", "offline"), True, 3, scenario=hidden)
        settings = DriftSettings(tolerance=0.01)
        celsius = 21.0 if night == 2 else None
        request = CheckRequest(order, folder, catalogue, motion, celsius=celsius, settings=settings)
        return run_check(request, Silent())

    with Catalogue() as catalogue:
        first = check(catalogue, 0)
        baselines.accept(catalogue, first.model, "Ada", "first", None)
        assert check(catalogue, 1).verdict is Verdict.OK
        found = check(catalogue, 2, worn=0.3)
        assert found.verdict is Verdict.WARNING, found.sentence
        assert found.sentence.startswith("Coulomb friction of joint 1 +")
        assert f"K colder at least; the temperature of run {first.run} (" in found.sentence
        assert found.comparison is not None and found.comparison.large and found.comparison.doubtful
        page = found.report.read_text()
        assert page.index("Check: warning") < page.index("The identification that it rests on")
        assert "Coulomb friction of joint 1" in page and f"run {first.run}" in page
        assert page.count(f"of run {first.run} (") >= 2 and "no thermometer" not in page
        code, listed, _ = armhil("runs", "--json")
        verdicts = {run["run"]: run["verdict"] for run in json.loads(listed)["runs"]}
        assert code == 0 and verdicts[found.run] == "warning" and verdicts[first.run] == "unknown"
        code, listed, _ = armhil("runs")
        assert "verdict" in listed and "warning" in listed
        assert check(catalogue, 3).verdict is Verdict.OK
        kept = checks.of_run(catalogue, found.run)[0]
        assert not found_nothing(kept) and kept.details["comparison"]["doubtful"] is True
        old = {**kept.details["settings"], "unknown_warmth": 15.0}  # of a rule that is gone
        with catalogue.writing() as connection:
            change = update(table).where(table.c.id == kept.id)
            connection.execute(change.values(details={**kept.details, "settings": old}))
        assert recheck(catalogue, found.run, Silent()).differs == ()
        with monkeypatch.context() as patched:  # drives that report count for a baseline that was no check
            patched.setattr(nights_module, "reported_celsius", lambda *_: (20.0,) * emps.n)
            again = recheck(catalogue, found.run, Silent()).comparison
        assert again is not None and again.unmeasured is not None
        assert f"run {first.run} " not in again.unmeasured
        failed = check(catalogue, 4, worn=1.0)
        assert failed.verdict is Verdict.FAILED  # no hall makes that
        _leads_to_its_verdict(failed, catalogue, tmp_path)


def _leads_to_its_verdict(failed: CheckResult, catalogue: Catalogue, folder: Path) -> None:
    """Terminal, message without and with a service: whoever follows them reads first what the check says."""
    said = StringIO()
    print_check(Console(file=said, width=400), failed)
    (line,) = (line for line in said.getvalue().splitlines() if line.startswith("Report: "))
    page, served = (message_of(failed, base, told="ok") for base in ("", "http://localhost/"))
    assert page is not None and served is not None
    assert page.link == line.removeprefix("Report: ") in page.text
    client = TestClient(create_app(Service(), catalogue, folder), base_url="http://localhost")
    shown = client.get(served.link.removeprefix("http://localhost"))
    report = f"/api/runs/{failed.run}/report"
    assert f'href="{report}"' in shown.text
    for text in (Path(page.link).read_text(encoding="utf-8"), shown.text, client.get(report).text):
        read = " ".join(re.sub(r"<(style|script|svg).*?</\1>|<[^>]*>", " ", text, flags=re.DOTALL).split())
        verdict, sentence = read.index("Check: failed"), read.index(failed.sentence)
        assert verdict < sentence < read.index("Nights known"), read[:2000]
        assert "use the model" not in read[: read.index("Nights known")].lower()
