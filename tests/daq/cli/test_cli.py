"""The command line under the hands of a new user: wrong inputs, help, JSON, exit codes."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest
from typer.main import get_command

from daq.cli import entry as cli
from daq.cli.run_tests import pytest_arguments, run_tests
from daq.identification import identify
from drivers import ArmSession, Channel
from drivers.simulated import SimulatedArm
from robots import Robot
from tests.daq.calls import Call
from tests.daq.captures import record_cycles

COMMANDS = (
    "acknowledge",
    "baseline",
    "check",
    "commission",
    "compare",
    "controller",
    "demo",
    "diagnose",
    "doctor",
    "export",
    "export-model",
    "gain",
    "home",
    "identify",
    "import",
    "jog",
    "note",
    "plan",
    "protocol",
    "prune",
    "recover",
    "rerun",
    "robots",
    "run",
    "runs",
    "scan",
    "schedule",
    "serve",
    "show",
    "sim",
    "test",
)
STEP = re.compile(r"[A-Z][a-z ]+ …")


@dataclass(frozen=True)
class Answer:
    """What a call of the command line left behind."""

    code: int
    out: str
    err: str

    @property
    def refusal(self) -> str:
        """The one line of a refusal; fails where there is more than progress before it."""
        *before, last = self.err.splitlines()
        assert self.code == 2, self
        assert last.startswith("armhil: "), self
        assert all(STEP.fullmatch(line) for line in before), self
        assert "Traceback" not in self.out + self.err
        return last.removeprefix("armhil: ")


Armhil = Callable[..., Answer]


@pytest.fixture
def armhil(armhil: Call, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Armhil:
    """Calls the command line in this process, inside an empty folder."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments: object) -> Answer:
        return Answer(*armhil(*arguments))

    return call


def as_program(*arguments: object, cwd: Path, path: Path | None = None) -> Answer:
    """Calls the command line as a program of its own; ``path`` is where it is imported from."""
    root = path or Path(cli.__file__).parents[2]
    done = subprocess.run(
        [sys.executable, "-m", "daq", *map(str, arguments)],
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": str(root)},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    return Answer(done.returncode, done.stdout, done.stderr)


def edited_arm(folder: Path, file: str, pattern: str, replacement: str) -> Path:
    """A copy of the shipped six-axis arm with one edit."""
    arm = folder / "arm"
    shutil.copytree(Path(cli.__file__).parents[2] / "robots" / "tx40", arm)
    text = (arm / file).read_text(encoding="utf-8")
    edited, count = re.subn(pattern, replacement, text, count=1, flags=re.DOTALL)
    assert count == 1
    (arm / file).write_text(edited, encoding="utf-8")
    return arm


# The arm


def test_an_unknown_robot(armhil: Armhil) -> None:
    line = armhil("demo", "--robot", "tx50").refusal
    assert line.startswith("tx50: no robot of this name")
    assert 'did you mean "tx40"?' in line and "allowed: emps, tx40" in line


@pytest.mark.parametrize("source", ["", "nowhere", "nowhere/robot.toml"])
def test_a_robot_that_is_nowhere(armhil: Armhil, source: str) -> None:
    assert "allowed: emps, tx40, the path of a robot.toml" in armhil("demo", "--robot", source).refusal


def test_a_urdf_without_one_of_the_joints(armhil: Armhil, tmp_path: Path) -> None:
    arm = edited_arm(tmp_path, "tx40.urdf", '<joint name="joint_6".*?</joint>', "")
    line = armhil("demo", "--robot", arm).refusal
    assert re.match(rf"{arm / 'tx40.urdf'}:\d+: ", line) and "link_6" in line and "allowed: " in line


def test_a_urdf_without_the_last_joint_and_its_link(armhil: Armhil, tmp_path: Path) -> None:
    arm = edited_arm(
        tmp_path, "tx40.urdf", '<joint name="joint_6".*?</joint>(.*)<link name="link_6".*?</link>', r"\1"
    )
    line = armhil("demo", "--robot", arm).refusal
    assert str(arm) in line and "joint_6" in line and "allowed: " in line


def test_a_node_id_that_no_drive_can_have(armhil: Armhil, tmp_path: Path) -> None:
    arm = edited_arm(tmp_path, "robot.toml", "node_id = 2", "node_id = 200")
    line = armhil("demo", "--robot", arm).refusal
    assert re.match(rf"{re.escape(str(arm / 'robot.toml'))}:\d+: drive\[2\]\.node_id: 200 is too large", line)
    assert line.endswith("allowed: a whole number from 1 to 127")


# The bus


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (["--interface", "canny"], ["'canny'", "allowed: ", "socketcan", "udp_multicast"]),
        (["--channel", "10.0.0.1"], ["'10.0.0.1'", "allowed: 224.0.0.0 to 239.255.255.255"]),
        (["--channel", "239.1.2.3:99999"], ["'99999'", "allowed: 1 to 65535"]),
        (["--channel", ""], ["udp_multicast needs a channel"]),
        (["--interface", "virtual", "--channel", "here"], ["virtual:here", "inside one process"]),
        (["--interface", "socketcan", "--channel", "none7"], ["socketcan:none7"]),
    ],
)
def test_a_bus_that_cannot_be(
    armhil: Armhil, no_leftovers: None, options: list[str], named: list[str]
) -> None:
    line = armhil("demo", *options).refusal
    assert all(word in line for word in named), line


def test_a_bus_that_already_has_drives(armhil: Armhil, channel: Channel, no_leftovers: None) -> None:
    with SimulatedArm("emps", channel):
        line = armhil("demo", "--robot", "emps", "--channel", channel.name).refusal
    assert str(channel) in line and "occupied" in line


def test_a_bus_that_has_a_master(armhil: Armhil, emps: Robot, channel: Channel, no_leftovers: None) -> None:
    with SimulatedArm("emps", channel), ArmSession(emps, channel):
        line = armhil("demo", "--robot", "emps", "--channel", channel.name).refusal
    assert str(channel) in line and "occupied" in line


# Where results go


@pytest.mark.parametrize("out", ["file", "file/below", "/proc/armhil"])
def test_results_that_cannot_be_written(armhil: Armhil, tmp_path: Path, out: str) -> None:
    (tmp_path / "file").write_text("")
    if out.startswith("/proc") and not Path("/proc/self").exists():
        pytest.skip("no /proc here")
    answer = armhil("demo", "--out", out)
    assert answer.refusal.startswith(f"{out}: cannot be written: ") and "--out" in answer.refusal
    assert answer.out == "", "refused before anything is started"


def test_a_folder_without_write_permission(armhil: Armhil, tmp_path: Path) -> None:
    locked = tmp_path / "locked"
    locked.mkdir(mode=0o555)
    if os.access(locked, os.W_OK):
        pytest.skip("the superuser may write everywhere")
    assert armhil("demo", "--out", locked).refusal.startswith(f"{locked}: cannot be written: Permission")


def test_an_earlier_capture_is_never_overwritten(armhil: Armhil, tmp_path: Path) -> None:
    capture = tmp_path / "run" / "capture.mcap"
    capture.parent.mkdir()
    capture.write_bytes(b"precious")
    line = armhil("demo", "--out", "run").refusal
    assert "capture.mcap of an earlier run" in line and "another --out" in line
    assert capture.read_bytes() == b"precious"


# Recordings


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("text.mcap", b"not a capture\n", "is a text file"),
        ("binary.mcap", bytes(range(256)) * 4, "is a binary file of another kind"),
        ("empty.mcap", b"", "is empty"),
        ("missing.mcap", None, "no such file"),
    ],
)
@pytest.mark.parametrize("options", [[], ["--robot", "tx40"]])
def test_a_capture_that_is_none(
    armhil: Armhil, tmp_path: Path, name: str, content: bytes | None, reason: str, options: list[str]
) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content)
    line = armhil("identify", name, *options).refusal
    assert line == f"{name}: {reason}; allowed: an MCAP capture recorded by armhil"


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("text.mat", b"not a MATLAB file\n", "is not a MATLAB file"),
        ("empty.mat", b"", "is not a MATLAB file"),
        ("missing.mat", None, "no such file; allowed: "),
        ("log.csv", b"t,q\n0.0,1.0\n0.001,2.0\n", "no variable 'qm'; present: q, t"),
        ("log.xlsx", b"PK", "cannot be imported; allowed: .csv, .mat, .parquet, "),
        ("noname", b"1", "cannot be imported; allowed: .csv, .mat, .parquet, "),
    ],
)
def test_a_log_that_is_none(
    armhil: Armhil, tmp_path: Path, name: str, content: bytes | None, reason: str
) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content)
    assert armhil("identify", name, "--robot", "emps").refusal.startswith(f"{name}: {reason}")


def test_a_log_of_no_arm(armhil: Armhil, tmp_path: Path) -> None:
    (tmp_path / "log.csv").touch()
    assert armhil("identify", "log.csv").refusal.endswith("of which arm it is; give --robot")


def test_a_capture_of_another_arm(
    armhil: Armhil, tmp_path: Path, tx40: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    record_cycles(tmp_path / "six.mcap", tx40, 100, monkeypatch)
    line = armhil("identify", "six.mcap", "--robot", "emps").refusal
    assert line.startswith("six.mcap: recorded of tx40") and "carriage" in line


def test_a_capture_that_is_too_short(
    armhil: Armhil, tmp_path: Path, tx40: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    record_cycles(tmp_path / "short.mcap", tx40, 100, monkeypatch)
    line = armhil("identify", "short.mcap").refusal
    assert line.startswith("short.mcap: ") and line.endswith("allowed: pieces of at least 2 s")


@pytest.mark.parametrize(
    ("options", "line"),
    [
        (["--cutoff", "600"], "cut-off 600 Hz; allowed: above 0 and below 500 Hz, half the sampling rate"),
        (["--cutoff", "-5"], "cut-off -5 Hz; allowed: above 0 and below 500 Hz, half the sampling rate"),
        (["--cutoff", "nan"], "cut-off nan Hz; allowed: above 0 and below 500 Hz, half the sampling rate"),
        (["--rate", "5000"], "--rate 5000 Hz; allowed: up to 1000 Hz, the sampling rate of axis.mcap"),
        (["--rate", "inf"], "--rate inf Hz; allowed: up to 1000 Hz, the sampling rate of axis.mcap"),
    ],
)
def test_settings_that_the_sampling_rate_forbids(
    armhil: Armhil,
    tmp_path: Path,
    emps: Robot,
    monkeypatch: pytest.MonkeyPatch,
    options: list[str],
    line: str,
) -> None:
    record_cycles(tmp_path / "axis.mcap", emps, 2100, monkeypatch)
    assert armhil("identify", "axis.mcap", *options).refusal == line


@pytest.mark.parametrize(
    ("content", "reason"),
    [(None, "no such file"), ("not a map", "not TOML"), ("format = 1\n", "1: time: missing")],
)
def test_a_column_map_that_is_none(armhil: Armhil, tmp_path: Path, content: str | None, reason: str) -> None:
    (tmp_path / "log.csv").write_text("t,q\n0.0,1.0\n")
    if content is not None:
        (tmp_path / "map.toml").write_text(content)
    line = armhil("identify", "log.csv", "--robot", "emps", "--columns", "map.toml").refusal
    assert line.startswith("map.toml:") and reason in line and "allowed: " in line


# Options and commands


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["demo", "--bogus"], ["--bogus"]),
        (["demo", "extra"], ["extra"]),
        (["demo", "--seed", "-1"], ["--seed", "greater than or equal to 0"]),
        (["demo", "--seed", "abc"], ["--seed", "integer"]),
        (["demo", "--duration", "1"], ["--duration", "greater than or equal to 2"]),
        (["demo", "--periods", "0"], ["--periods", "greater than or equal to 1"]),
        (["demo", "--evaluations", "99"], ["--evaluations", "greater than or equal to 100"]),
        (["demo", "--out"], ["--out"]),
        (["identify"], ["paths"]),
        (["identify", "a.mcap", "--rate", "0"], ["--rate", "greater than or equal to 0.1"]),
        (["robots", "--json"], ["--json"]),
        (["bogus"], ["bogus"]),
        (["--bogus"], ["--bogus"]),
    ],
)
def test_a_mistake_in_the_call(armhil: Armhil, arguments: list[str], named: list[str]) -> None:
    answer = armhil(*arguments)
    assert all(word in answer.refusal for word in named), answer
    assert answer.out == ""


def test_a_refusal_as_a_user_meets_it(tmp_path: Path) -> None:
    (tmp_path / "notes.mcap").write_text("not a capture\n")
    answer = as_program("identify", "notes.mcap", "--json", cwd=tmp_path)
    assert answer.refusal == (
        "notes.mcap: is a text file; allowed: an MCAP capture recorded by armhil;"
        " see `armhil identify --help`"
    )
    assert answer.out == "", "no JSON without a result"


def test_for_a_developer_there_is_a_traceback(
    armhil: Armhil, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("ARMHIL_DEBUG", "1")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["armhil", "identify", "missing.mcap"])
    with pytest.raises(ValueError, match="no such file"):
        cli.main()


def test_ctrl_c_outside_of_a_stream_says_so(
    armhil: Armhil, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "any.mcap").touch()

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(identify, "run_identify", interrupted)
    answer = armhil("identify", "any.mcap")
    assert answer.code == 130
    assert answer.err.splitlines()[-1] == "armhil: interrupted"


# What is printed


def test_without_arguments_there_is_help(armhil: Armhil) -> None:
    answer = armhil()
    assert answer.code == 0 and answer.err == ""
    assert all(command in answer.out for command in COMMANDS)


@pytest.mark.parametrize("command", COMMANDS)
def test_help_of_each_command_has_an_example(command: str) -> None:
    commands = get_command(cli.app).commands  # type: ignore[attr-defined]
    assert set(commands) == set(COMMANDS)
    assert f"Example: [bold]armhil {command}" in commands[command].help


def test_every_command_of_the_help_stands_in_a_group(armhil: Armhil) -> None:
    text = armhil("--help").out
    assert re.search(r"^╭─ Commands ─", text, flags=re.MULTILINE) is None
    panels = re.findall(r"^╭─ (.*?) ─+╮$", text, flags=re.MULTILINE)
    assert panels[0] == "Options" and set(panels[1:]) == set(cli.GROUPS)


def test_help_has_an_example(armhil: Armhil) -> None:
    for arguments in (["--help"], ["demo", "-h"], ["identify", "--help"], ["robots", "--help"]):
        answer = armhil(*arguments)
        assert answer.code == 0
        assert "Example: armhil" in answer.out, arguments


def test_the_version(armhil: Armhil) -> None:
    answer = armhil("--version")
    assert answer.code == 0 and re.fullmatch(r"armhil \d+\.\d+\.\d+\S*\n", answer.out)


def test_the_arms_that_ship(armhil: Armhil) -> None:
    answer = armhil("robots")
    assert answer.code == 0 and answer.err == ""
    assert [line.split()[:3] for line in answer.out.splitlines()] == [
        ["emps", "1", "joints"],
        ["tx40", "6", "joints"],
    ]


def test_a_reader_that_leaves_is_no_error(tmp_path: Path) -> None:
    script = f"{sys.executable} -m daq robots | true; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(
        ["bash", "-c", script],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(Path(cli.__file__).parents[2])},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_json_is_one_object_and_nothing_else(armhil: Armhil, shared_data: Path) -> None:
    answer = armhil("identify", shared_data / "emps" / "DATA_EMPS.mat", "--robot", "emps", "--json")
    assert answer.code in {0, 1}
    assert json.loads(answer.out)["robot"] == "emps"
    assert "Model good to" in answer.err or "TRUST" in answer.err


# armhil test


def test_arguments_of_test_go_to_pytest(tmp_path: Path) -> None:
    answer = as_program("test", "--version", cwd=tmp_path)
    assert answer.code == 0
    assert (answer.out + answer.err).startswith("pytest ")


def test_test_runs_the_tests_of_the_clone_and_keeps_their_exit_code(tmp_path: Path) -> None:
    words = ("test", "-n", "0", "-k", "no_such_test", "tests/test_requirements.py", "-p", "no:cacheprovider")
    nothing = as_program(*words, cwd=tmp_path)
    assert nothing.code == pytest.ExitCode.NO_TESTS_COLLECTED
    assert re.search(r"^[1-9]\d* deselected", nothing.out, re.MULTILINE), nothing.out


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ([], ["-n", "3", "--dist", "worksteal", "-q", "-m", "not slow"]),
        (["--slow"], ["-n", "3", "--dist", "worksteal", "-q", "-m", "slow"]),
        (["-x"], ["-n", "3", "--dist", "worksteal", "-q", "-m", "not slow", "-x"]),
        (["-n", "0", "-k", "emps"], ["-q", "-m", "not slow", "-n", "0", "-k", "emps"]),
        (["tests/test_docs.py::x", "-v"], ["-n", "3", "--dist", "worksteal", "tests/test_docs.py::x", "-v"]),
        (["-m", "slow or not slow"], ["-n", "3", "--dist", "worksteal", "-q", "-m", "slow or not slow"]),
    ],
)
def test_test_keeps_its_workers_and_leaves_the_slow_ones_out(
    given: list[str], expected: list[str], repository: Path
) -> None:
    assert pytest_arguments(repository, given) == expected


def test_what_tests_compile_is_kept(monkeypatch: pytest.MonkeyPatch, repository: Path) -> None:
    """Also where the environment says not to."""
    called = []

    def call(words: list[str], cwd: Path, env: dict[str, str]) -> int:
        called.append((words, cwd, env))
        return 3

    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")
    monkeypatch.setattr("daq.cli.run_tests.subprocess.call", call)
    assert run_tests(repository, ["tests/test_docs.py"]) == 3
    ((words, cwd, env),) = called
    assert words[:3] == [sys.executable, "-m", "pytest"] and cwd == repository
    assert "PYTHONDONTWRITEBYTECODE" not in env and os.environ["PYTHONDONTWRITEBYTECODE"] == "1"


def test_a_time_out_ends_one_test_and_not_the_worker(tmp_path: Path, repository: Path) -> None:
    """With what pyproject.toml says of time-outs, but for how long."""
    file = tmp_path / "test_two.py"
    file.write_text("import time\n\ndef test_hangs():\n    time.sleep(60)\n\ndef test_next():\n    pass\n")
    settings = ("-c", str(repository / "pyproject.toml"), "--rootdir", str(tmp_path), "-o", "timeout=0.2")
    done = subprocess.run(
        [sys.executable, "-m", "pytest", *settings, "-p", "no:cacheprovider", str(file)],
        capture_output=True,
        text=True,
        timeout=50,
        check=False,
    )
    assert "1 failed, 1 passed" in done.stdout and "Timeout" in done.stdout, done.stdout + done.stderr


def test_test_outside_of_a_clone(tmp_path: Path, repository: Path) -> None:
    for package in ("robots", "drivers", "trajectories", "ident", "daq"):
        shutil.copytree(repository / package, tmp_path / "installed" / package)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    line = as_program("test", cwd=elsewhere, path=tmp_path / "installed").refusal
    assert line == (
        f"no tests found: neither {tmp_path / 'installed'} nor {elsewhere} is a clone of armhil;"
        " see `armhil test --help`"
    )


def test_a_mistake_of_our_own_is_no_warning(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Exit code 1 would be a warning to whoever monitors a check."""

    def broken(*_: object, **__: object) -> None:
        raise ZeroDivisionError("made up")

    monkeypatch.setattr(cli, "app", broken)
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == 2
    assert "Traceback" in (told := capsys.readouterr().err) and "made up" in told


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("identify",), "Missing argument 'paths'; `armhil identify --help` shows what it takes"),
        (("demo", "--seed", "x"), "`armhil demo --help` shows what it takes, with an example"),
        (("baseline", "accept"), "`armhil baseline accept --help` shows"),
        (("identfy",), "Did you mean 'identify'?; `armhil --help` shows"),
        (("runs", "--sinse", "1"), "`armhil runs --help` shows"),
    ],
)
def test_a_call_that_is_wrong_says_which_help_to_read(
    armhil: Armhil, words: tuple[str, ...], told: str
) -> None:
    assert told in " ".join(armhil(*words).refusal.split())


def test_a_model_that_is_not_there_says_what_makes_one(armhil: Armhil) -> None:
    assert "`armhil identify CAPTURE --out FOLDER`" in armhil("export-model", "no.toml").refusal


@pytest.mark.parametrize(
    ("text", "words", "said"),
    [
        (
            "a.toml: no such file",
            ["baseline", "accept", "3"],
            "a.toml: no such file; see `armhil baseline accept --help`",
        ),
        ("no such arm", ["--log", "x", "identify", "plan"], "no such arm; see `armhil identify --help`"),
        (
            "nothing; `armhil runs` lists those that are",
            ["show", "9"],
            "nothing; `armhil runs` lists those that are",
        ),
        ("again: armhil commission tx40", ["rerun", "1"], "again: armhil commission tx40"),
        ("`a.csv`: is empty", ["import", "a.csv"], "`a.csv`: is empty; see `armhil import --help`"),
        ("x: python -m pip install 'armhil[pdf]'", ["runs"], "x: python -m pip install 'armhil[pdf]'"),
    ],
)
def test_every_refusal_names_a_command_to_go_on_with(text: str, words: list[str], said: str) -> None:
    assert cli._with_next(text, words) == said
