"""armhil doctor and armhil sim."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import can
import numpy as np
import pytest

import robots
from daq.doctor.check import CODES, Check, worst
from daq.doctor.doctor import adapter_checks, budget_check, bus_checks, describe, device_file_checks
from daq.doctor.environment import (
    catalogue_check,
    folder_check,
    governor_check,
    kernel_check,
    shadowing_checks,
    throttling_check,
    timer_check,
    wall_clock_check,
)
from drivers import ArmSession, Channel, Samples, listen_for_traffic, open_bus
from drivers.bus.bus_lock import BusLock
from drivers.simulated import PlantTruth, Scenario, open_seal, simulate_offline
from robots import Robot
from tests.drivers.setup.test_eds import fixed

EDS = Path(__file__).parents[1] / "drivers" / "setup" / "eds"


@pytest.fixture(scope="module")
def tx40() -> Robot:
    return robots.load("tx40")


def armhil(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "daq", *arguments], capture_output=True, text=True, timeout=100, check=False
    )


def test_json_exit_code_and_text_agree(channel: Channel) -> None:
    done = armhil("doctor", "tx40", "--channel", channel.name, "--json")
    answer = json.loads(done.stdout)
    assert set(answer) == {"armhil", "robot", "channel", "status", "checks"}
    assert (answer["robot"], answer["channel"]) == ("tx40", str(channel))
    assert done.returncode == CODES[answer["status"]]
    names = [check["name"] for check in answer["checks"]]
    assert {
        "python",
        "libraries",
        "packages",
        "bus",
        "bus load",
        "real-time priority",
        "locked memory",
    } <= set(names)
    for check in answer["checks"]:
        assert set(check) == {"name", "status", "detail", "remedy"}
        assert check["detail"]
        assert (check["status"] in ("ok", "unknown")) or check["remedy"], check
        assert f"{check['status']:8} {check['name']}: {check['detail']}" in done.stderr


def test_without_an_arm_the_machine_is_looked_at() -> None:
    done = armhil("doctor", "--json")
    answer = json.loads(done.stdout)
    assert (answer["robot"], answer["channel"]) == (None, None)
    names = {check["name"] for check in answer["checks"]}
    assert {"packages", "catalogue", "folder", "real-time share", "kernel", "clock", "time of day"} <= names
    assert not names & {"bus", "bus load"}
    assert done.returncode == CODES[answer["status"]]


def test_a_catalogue_that_cannot_be_is_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    assert catalogue_check().status == "ok"
    monkeypatch.setenv("ARMHIL_CATALOGUE", "mysql://host/db")
    assert catalogue_check().status == "failed" and "ARMHIL_CATALOGUE" in catalogue_check().remedy
    monkeypatch.setenv("ARMHIL_CATALOGUE", str(tmp_path / "not" / "there" / "yet.db"))
    assert catalogue_check().status == "ok"
    monkeypatch.setattr("daq.doctor.environment.os.access", lambda *_: False)
    refused = catalogue_check()
    assert (refused.status, refused.detail) == ("failed", f"{tmp_path} may not be written")
    assert folder_check(tmp_path).status == "warning"


def test_a_full_disk_is_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    class Full:
        free = 5e8

    assert folder_check(tmp_path).status in ("ok", "warning")
    monkeypatch.setattr("daq.doctor.environment.shutil.disk_usage", lambda _: Full)
    assert "armhil prune" in folder_check(tmp_path).remedy


@pytest.mark.parametrize(
    ("runtime", "status"), [("950000", "ok"), ("-1", "ok"), ("500000", "warning"), (None, "unknown")]
)
def test_the_share_of_real_time_processes(tmp_path: Path, runtime: str | None, status: str) -> None:
    (tmp_path / "sched_rt_period_us").write_text("1000000\n")
    if runtime is not None:
        (tmp_path / "sched_rt_runtime_us").write_text(f"{runtime}\n")
    assert throttling_check(tmp_path).status == status


@pytest.mark.parametrize(
    ("governors", "status"),
    [([], "ok"), (["performance"] * 2, "ok"), (["performance", "powersave"], "warning")],
)
def test_the_governor(tmp_path: Path, governors: list[str], status: str) -> None:
    for number, governor in enumerate(governors):
        folder = tmp_path / f"cpu{number}" / "cpufreq"
        folder.mkdir(parents=True)
        (folder / "scaling_governor").write_text(f"{governor}\n")
    assert governor_check(tmp_path).status == status


def test_the_kernel_and_the_time_of_day() -> None:
    assert kernel_check("6.1.0-rt #1 SMP PREEMPT_RT Debian").detail == "6.1.0-rt, PREEMPT_RT"
    assert kernel_check("6.1.0 #1 SMP PREEMPT_DYNAMIC").detail == "6.1.0, PREEMPT"
    assert kernel_check().detail
    told = wall_clock_check()
    assert told.status in ("ok", "warning", "unknown") and (told.status != "warning" or told.remedy)


def test_the_worst_check_decides() -> None:
    ok, warning, unknown, failed = (Check("x", s, "y", "z") for s in ("ok", "warning", "unknown", "failed"))
    assert worst([]) == worst([ok]) == "ok"
    assert CODES[worst([ok, warning])] == 1
    assert CODES[worst([unknown, warning])] == 3
    assert CODES[worst([failed, unknown, ok])] == 2
    assert "→ z" in describe((warning,)) and "→" not in describe((ok,))


def test_a_second_package_of_a_plain_name_is_told(tmp_path: Path) -> None:
    assert [check.status for check in shadowing_checks([])] == ["ok"]
    (tmp_path / "drivers").mkdir()
    (tmp_path / "drivers" / "__init__.py").write_text("")
    (found,) = shadowing_checks([str(tmp_path)])
    assert (found.status, str(tmp_path / "drivers") in found.detail) == ("warning", True)


def test_a_package_that_takes_our_place_is_a_failure(tmp_path: Path) -> None:
    (tmp_path / "ident.py").write_text("")
    home = Path(__file__).parents[2]
    program = (
        "from daq.doctor.environment import shadowing_checks; c, = shadowing_checks();"
        " print(c.status, c.detail)"
    )
    done = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path[:0] = [{str(home)!r}]; import daq.doctor.environment\n"
         f"sys.path.insert(0, {str(tmp_path)!r}); sys.modules.pop('ident', None)\n{program}"],
        capture_output=True, text=True, check=False, cwd=tmp_path,
    )  # fmt: skip
    assert done.stdout.startswith("failed another package is in the way: ident from"), done.stderr


def test_a_bus_that_does_not_open_has_a_remedy(channel: Channel) -> None:
    (found,) = bus_checks(Channel("socketcan", "nosuchcan0"))
    assert found.status == "failed" and found.remedy
    assert {check.status for check in bus_checks(channel)} <= {"ok", "warning"}
    with BusLock(channel):
        held = {check.name: check for check in bus_checks(channel)}
        assert held["master"].status == "failed" and "another armhil run" in held["master"].detail


@pytest.mark.parametrize(
    ("interface", "status", "words"),
    [
        ("socketcan", "ok", "tells the controller's state and receive times"),
        ("kvaser", "warning", "bus-off and error-passive are not told"),
        ("slcan", "warning", "no time stamps: recorded frames carry the time at which this program"),
        ("neovi", "unknown", "not known whether it tells"),
    ],
)
def test_what_an_interface_does_not_tell(interface: str, status: str, words: str) -> None:
    (check,) = adapter_checks(Channel(interface, "can0"))
    assert check.status == status and words in check.detail
    assert adapter_checks(Channel("virtual", "x")) == []


def test_a_full_bus_fails_with_the_cycle_that_is_safe(tx40: Robot, channel: Channel) -> None:
    assert budget_check(tx40, channel).status == "ok"
    fast = tx40.model_copy(update={"bus": tx40.bus.model_copy(update={"cycle_time": 0.002})})
    found = budget_check(fast, channel)
    assert (found.status, found.remedy) == ("failed", "set bus.cycle_time to 0.003 s or more")


def test_device_files_are_read(tx40: Robot, tmp_path: Path) -> None:
    def with_file(robot: Robot, name: str | Path) -> Robot:
        return robot.model_copy(
            update={"drive": tuple(d.model_copy(update={"eds": str(EDS / name)}) for d in robot.drive)}
        )

    assert device_file_checks(tx40) == []
    own = device_file_checks(with_file(tx40, "prbt_like.dcf"))
    everybody = "device file of joint_1, joint_2, joint_3, joint_4, joint_5, joint_6"
    shared_words = [check for check in own if check.name == everybody]
    assert shared_words and {check.status for check in shared_words} == {"warning"}
    assert len({(check.status, check.detail) for check in own}) == len(own), "said once"
    assert all("; 6" not in check.detail for check in own if check.status != "ok"), "one line for each"
    assert not any(check.name == "COB-IDs" for check in own)
    shared = device_file_checks(with_file(tx40, fixed(tmp_path)))
    assert shared[-1].name == "COB-IDs" and "0x183" in shared[-1].detail
    missing = device_file_checks(with_file(tx40, "nothing.eds"))
    assert {check.status for check in missing} == {"failed"} and len(missing) == 6


def test_a_late_machine_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    assert timer_check(1000.0).status == "ok"
    assert timer_check(0.0).status == "warning"
    assert replace(timer_check(0.0), detail="").remedy


def test_an_unknown_arm_is_one_line() -> None:
    done = armhil("doctor", "nonesuch")
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_sim_serves_anyone_and_ends_clean(
    number: signal.Signals, channel: Channel, no_leftovers: None
) -> None:
    command = [sys.executable, "-m", "daq", "sim", "emps", "--channel", channel.name, "--seed", "4"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None and process.stderr is not None
        try:
            assert "simulated drives on" in process.stdout.readline()
            with open_bus(channel, [0x581]) as bus:
                request = bytes([0x40, 0x00, 0x10, 0, 0, 0, 0, 0])
                bus.send(can.Message(arbitration_id=0x601, data=request, is_extended_id=False))
                answer = bus.recv(10.0)
            assert answer is not None and bytes(answer.data[4:]) == (0x00020192).to_bytes(4, "little")
            process.send_signal(number)
            assert process.wait(30) == 0
        finally:
            process.kill()
        assert process.stdout.read().strip() == "ended: no drive is left on the bus"
        assert process.stderr.read() == ""
    assert listen_for_traffic(channel, 0.15) == frozenset()


@pytest.mark.slow
def test_sim_hides_what_the_scenario_says_and_seals_it(
    tx40: Robot, channel: Channel, tmp_path: Path, no_leftovers: None
) -> None:
    scenario, seal = tmp_path / "hidden.toml", tmp_path / "truth.seal"
    scenario.write_text("[[current_offset]]\ndrive = 1\ntorque = 10.0\n", encoding="utf-8")
    files = ["--scenario", str(scenario), "--seal", str(seal)]
    command = [sys.executable, "-m", "daq", "sim", "tx40", "--channel", channel.name, "--seed", "4", *files]

    batches: list[Samples] = []
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            assert str(seal) in process.stdout.readline()
            assert "simulated drives on" in process.stdout.readline()
            with ArmSession(tx40, channel) as session:
                t = np.linspace(0.0, 1.0, 200)[:, None]
                reference = session.actual_position() + 0.1 * (64 * (t * (1 - t)) ** 3)
                assert session.stream(reference, batches.append).outcome == "completed"
            process.send_signal(signal.SIGTERM)
            assert process.wait(30) == 0
        finally:
            process.kill()
    measured = Samples.concatenate(batches).control_signal.mean(axis=0)

    content = open_seal(seal, by="test")
    truth = PlantTruth.from_dict(content["truth"])
    assert (content["scenario"], truth.seed) == ({"current_offset": [{"drive": 1, "torque": 10.0}]}, 4)
    hidden = Scenario.from_dict(content["scenario"])
    with_it, without = (
        simulate_offline(tx40, truth, reference, scenario=what).control_signal.mean(axis=0)
        for what in (hidden, Scenario())
    )
    np.testing.assert_allclose(measured, with_it, atol=0.02)
    # The drive asks for less by what its current loop adds unasked.
    assert without[0] - measured[0] == pytest.approx(10.0 / truth.gain[0], abs=0.03)


@pytest.mark.slow
def test_sim_writes_no_seal_over_another(channel: Channel, tmp_path: Path) -> None:
    seal = tmp_path / "truth.seal"
    seal.write_text("of another run", encoding="utf-8")
    done = armhil("sim", "emps", "--channel", channel.name, "--seal", str(seal))
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1), done.stderr
    assert str(seal) in done.stderr
    assert seal.read_text(encoding="utf-8") == "of another run"


def test_sim_refuses_a_bus_inside_one_process() -> None:
    done = armhil("sim", "emps", "--interface", "virtual", "--channel", "x")
    assert (done.returncode, "lives inside one process" in done.stderr) == (2, True)
