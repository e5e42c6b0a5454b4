"""The foreign plant is what its description says, and nothing of armhil."""

from __future__ import annotations

import ast
import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import robots
from benchmarks.foreign_plant import ARMS, NAMES, Effect, Settings, __main__, parse_effect, record
from benchmarks.foreign_plant.effects import OF_A_JOINT
from benchmarks.foreign_plant.files import write_description
from ident import Recording, RegressorModel
from ident.discrepancy.unknown_feed_forward import with_feed_forward
from ident.effects import State
from ident.signals import low_pass

SHORT = Settings(periods=1, period=2.0, noise=0.0)
FOLDER = Path(__file__).parents[1] / "benchmarks" / "foreign_plant"


def test_it_imports_nothing_of_armhil() -> None:
    for path in FOLDER.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom | ast.Import):
                names = [node.module] if isinstance(node, ast.ImportFrom) else [a.name for a in node.names]
                assert not any(
                    str(name).split(".")[0] in ("ident", "drivers", "daq", "robots") for name in names
                )


@pytest.mark.parametrize("name", ARMS)
def test_the_description_is_the_plant(name: str, tmp_path: Path) -> None:
    """The described arm's inverse dynamics along the motion is the torque that the log has."""
    arm = ARMS[name]
    write_description(tmp_path, arm, SHORT)
    robot = robots.load(tmp_path / "robot.toml")
    log = record(arm, SHORT, (), 3, 0)
    model = RegressorModel.of(robot)
    q = low_pass(log.position, 60.0, 1e-3, 4)
    v = np.gradient(q, 1e-3, axis=0)
    a = np.gradient(v, 1e-3, axis=0)
    said = model.columns(State(q, v, a)) @ model.prior()
    held = robot.joint_torque(log.control_signal)
    # Held from its sample on, a torque is on average that of half a sample before.
    torque = low_pass(0.5 * (held + np.vstack([held[:1], held[:-1]])), 60.0, 1e-3, 4)
    moving = np.abs(v) > 0.05 * robot.velocity_limits
    moving[:100], moving[-100:] = False, False
    away = np.sqrt(np.sum((said - torque)[moving] ** 2) / np.sum(torque[moving] ** 2))
    assert away < 0.01


def test_a_light_wrist_that_sticks_does_not_creep_under_its_own_dry_friction() -> None:
    """MuJoCo's constraint by default is viscous up to 0.15 rad/s there."""
    arm, settings = ARMS["compact6"], replace(SHORT, friction="stick", period=4.0)
    log = record(arm, settings, (), 97058, 0)
    wrist = arm.links[5]
    position, signal = (low_pass(one, 60.0, 1e-3, 4)[:, 5] for one in (log.position, log.control_signal))
    speed = np.gradient(position, log.time)
    acceleration = np.gradient(speed, log.time)
    rest = wrist.gain * signal - wrist.rotor * acceleration
    slow = (np.abs(speed) > 0.01) & (np.abs(speed) < 0.08) & (np.abs(acceleration) < 1.0)
    dry = (rest - wrist.viscous * speed)[slow] * np.sign(speed[slow])
    assert slow.sum() > 50
    assert np.median(dry) == pytest.approx(wrist.coulomb, rel=0.15)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_every_effect_acts(name: str) -> None:
    arm = ARMS["compact6"]
    sizes = {
        "joint_elasticity": 3e4,
        "saturation": 3.5,
        "cable_spring": 5.0,
        "contact": 100.0,
        "rotor_inertia": 0.05,
        "backlash": 5e-4,
        "base_compliance": 1e5,
    }
    times = {"time_delay": 2e-3, "current_loop_lag": 2e-3, "encoder_eccentricity": 1e-3, "base_tilt": 0.03}
    joint = 3 if name in OF_A_JOINT else -1
    size = {**sizes, **times}.get(name, 0.3)
    plain, hidden = record(arm, SHORT, (), 3, 0), record(arm, SHORT, (Effect(name, joint, size),), 3, 0)
    apart = (hidden.control_signal - plain.control_signal) * [link.gain for link in arm.links]
    assert np.abs(apart).max() > 0.05
    assert np.array_equal(plain.reference, hidden.reference)


def test_what_an_arm_presses_against_stands_where_it_stands(monkeypatch: pytest.MonkeyPatch) -> None:
    places: list[np.ndarray] = []
    plant = sys.modules[record.__module__]._plant

    def placed(*given: Any) -> Any:
        places.append(given[-1])
        return plant(*given)

    monkeypatch.setattr(sys.modules[record.__module__], "_plant", placed)
    fit, held = (record(ARMS["compact6"], SHORT, (), 3, part) for part in (0, 1))
    assert not np.array_equal(fit.reference, held.reference)
    assert np.array_equal(*places)
    assert places[0] == pytest.approx(np.quantile(fit.reference, 0.9, axis=0), abs=0.02)


@pytest.mark.parametrize(("law", "adds"), [("p_pi", False), ("pd_torque", True)])
def test_what_a_controller_adds_is_told_from_what_a_play_does(law: str, adds: bool, tmp_path: Path) -> None:
    """The described law explains the control signal of an arm with play as well as of any other."""
    settings = Settings(periods=3, period=2.0, law=law)
    arm = ARMS["compact6"]
    write_description(tmp_path, arm, settings)
    robot = robots.load(tmp_path / "robot.toml")
    log = record(arm, settings, (Effect("backlash", 1, 0.002),), 3, 0)
    given = Recording("play", log.time, log.reference, log.position, log.control_signal)
    (found,), words = with_feed_forward(robot, [given])
    assert [f"drive {k}" in "".join(words) for k in range(1, 7)] == [adds] * 6
    assert (found.added is not None) is adds


def test_the_command_writes_what_armhil_reads(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    wish = ["--arm", "seven", "--effect", "viscous_friction@2=1.5", "--periods", "1", "--period", "1"]
    monkeypatch.setattr(sys, "argv", ["foreign_plant", "--out", str(tmp_path), *wish, "--law", "pd"])
    assert __main__.main() == 0
    truth = json.loads((tmp_path / "truth.json").read_text())
    assert truth["effects"] == [
        {"name": "viscous_friction", "joint": 2, "size": 1.5, "unit": "N·m·s/rad more"}
    ]
    head = (tmp_path / "fit.csv").read_text().splitlines()[0].split(",")
    assert head[:2] == ["t", "q_ref_1"] and len(head) == 22
    assert robots.load(tmp_path / "robot.toml").n == 7


@pytest.mark.parametrize("text", ["nonsense@1=2", "payload@x", "saturation@9=1", "viscous_friction@1=much"])
def test_a_wrong_wish_says_what_is_allowed(text: str) -> None:
    with pytest.raises(ValueError, match=r"allowed|number"):
        parse_effect(text, 6)
