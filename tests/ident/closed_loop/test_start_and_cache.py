"""Recordings that start in motion, torque that is fed forward, and machine code that is not out of date."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numba.core import config
from numba.types import Literal

import robots
from ident import Recording, RegressorModel
from ident.closed_loop import simulate
from ident.closed_loop.leading import leading_of, start_velocity
from ident.closed_loop.simulate import run_in_python
from ident.closed_loop.torque_parts import ModelStructure
from ident.kernels import gears
from ident.kernels.compilation import compiled, making_arrays, stamp_of
from ident.kernels.friction import implicit_step
from ident.kernels.loop import closed_loop
from ident.preparation.set_points import set_point_accelerations

TX40 = robots.load("tx40")
MODEL = RegressorModel.of(TX40)
PERIOD = TX40.bus.cycle_time


def swing(samples: int = 300) -> Recording:
    time = PERIOD * np.arange(samples)
    shape = np.sin(2 * np.pi * 1.3 * time) * np.minimum(time / 0.3, 1.0) ** 3
    reference = np.array(TX40.home) + np.outer(shape, np.linspace(0.2, 0.4, 6))
    return Recording("swing", time, reference, reference.copy(), np.full(reference.shape, 0.1))


def piece(recording: Recording, first: int) -> Recording:
    assert recording.reference is not None
    return replace(
        recording,
        time=recording.time[first:],
        reference=recording.reference[first:],
        position=recording.position[first:],
        control_signal=recording.control_signal[first:],
    )


def test_a_piece_of_a_recording_goes_on_as_the_whole() -> None:
    whole = simulate(MODEL, MODEL.prior(), swing())
    recording = replace(swing(), position=whole.position, control_signal=whole.control_signal)
    part = piece(recording, 200)
    assert np.abs(whole.velocity[200]).max() > 0.5
    found = start_velocity(part, TX40.velocity_limits)
    np.testing.assert_allclose(found, whole.velocity[200], atol=0.02)
    run = simulate(MODEL, MODEL.prior(), part)
    swept = np.ptp(whole.position, axis=0).max()
    assert np.abs(run.position - whole.position[200:]).max() < 0.002 * swept
    # A start at rest would be off by much more.
    still = replace(part, position=np.repeat(part.position[:1], part.time.size, axis=0))
    at_rest = simulate(MODEL, MODEL.prior(), still)
    assert np.abs(at_rest.position - whole.position[200:]).max() > 0.01 * swept


def test_an_arm_that_starts_at_rest_starts_at_rest() -> None:
    recording = swing()
    noise = 2e-6 * np.random.default_rng(4).normal(size=recording.position.shape)
    assert not start_velocity(
        replace(recording, position=recording.position + noise), TX40.velocity_limits
    ).any()


def test_velocity_at_the_start_withstands_noise() -> None:
    time = 0.001 * np.arange(100)
    position = (0.3 + 1.2 * time + 5 * time**2)[:, np.newaxis]
    noise = 2e-6 * np.random.default_rng(5).normal(size=position.shape)
    recording = Recording("moving", time, None, position + noise, np.zeros_like(position))
    assert start_velocity(recording, np.ones(1))[0] == pytest.approx(1.2, abs=0.02)


def test_compiled_and_plain_runs_agree_from_motion_and_with_torque_fed_forward() -> None:
    controller = TX40.controller.model_copy(
        update={
            "friction_feed_forward": (0.2,) * 6,
            "acceleration_feed_forward": (0.02, 0.02, 0.01, 0.01, 0.01, 0.01),
            "velocity_difference_samples": 3,
            "delay_samples": 1,
        }
    )
    robot = TX40.model_copy(update={"controller": controller})
    model, recording = RegressorModel.of(robot), piece(swing(), 240)
    run = simulate(model, model.prior(), recording, 1)
    structure = ModelStructure(model)
    plain = run_in_python(structure, structure.parts(model.prior()), leading_of(robot, recording, 1))
    for name in ("position", "velocity", "control_signal"):
        np.testing.assert_allclose(getattr(run, name), getattr(plain, name), rtol=1e-8, atol=1e-9)
    without = simulate(MODEL, MODEL.prior(), recording, 1)
    assert np.abs(run.control_signal - without.control_signal).max() > 0.01


def test_torque_that_is_fed_forward_spares_following_error() -> None:
    """With all inertia and friction of a single mass fed forward the reference is followed at once."""
    robot = robots.load("emps")
    mass, viscous, gain = 95.0, 200.0, float(robot.gains[0])
    errors = []
    for share in (0.0, 1.0):
        controller = robot.controller.model_copy(
            update={
                "interpolation": "spline",
                "velocity_feed_forward": (1.0,),
                "friction_feed_forward": (share * viscous / gain,),
                "acceleration_feed_forward": (share * mass / gain,),
                "delay_samples": 0,
                "velocity_difference_samples": 1,
            }
        )
        fed = robot.model_copy(update={"controller": controller})
        model = RegressorModel.of(fed)
        time = 0.001 * np.arange(800)
        reference = 0.02 * (1 - np.cos(2 * np.pi * time))[:, np.newaxis] ** 2
        recording = Recording("fed", time, reference, reference.copy(), np.zeros_like(reference))
        run = simulate(model, model.standard_parameters({"M1": mass, "Fv1": viscous}), recording)
        errors.append(np.abs(run.position - leading_of(fed, recording, None).points)[50:].max())
    assert errors[1] < 0.1 * errors[0]


def test_acceleration_of_set_points_is_the_second_difference() -> None:
    time = 0.004 * np.arange(20)
    targets = (3.0 * time**2)[:, np.newaxis]
    found = set_point_accelerations(targets, 0.004, 4)
    assert found.shape == (80, 1)
    np.testing.assert_allclose(found[8:], 6.0, rtol=1e-9)
    np.testing.assert_allclose(set_point_accelerations(targets, 0.004, 4, moving=True), 6.0, rtol=1e-9)


_MODULES = {
    "inner.py": "from ident.kernels.compilation import compiled_with_stamp, stamp_of\n"
    "from pathlib import Path\n"
    "S = stamp_of(Path(__file__).parent)\n"
    "def value(x):\n    return x + {added}\n"
    "value = compiled_with_stamp(value, S)\n",
    "outer.py": "from inner import S, value\n"
    "from ident.kernels.compilation import compiled_with_stamp\n"
    "def twice(x):\n    return 2.0 * value(x)\n"
    "twice = compiled_with_stamp(twice, S)\n"
    "print(twice(1.0), sum(twice.stats.cache_hits.values()))\n",
}


def test_machine_code_follows_a_change_in_another_file(tmp_path: Path) -> None:
    """Without the stamp of all files the cached caller would go on with the old code of what it calls."""
    root = Path(__file__).parents[3]
    outputs = []
    for added in ("1.0", "1.0", "5.0"):
        for name, text in _MODULES.items():
            (tmp_path / name).write_text(text.replace("{added}", added))
        command = [sys.executable, str(tmp_path / "outer.py")]
        environment = {
            "PYTHONPATH": f"{root}:{tmp_path}",
            "NUMBA_CACHE_DIR": str(tmp_path / "cache"),
            # Bytecode is told by second and length of its source, and the change here may be of neither.
            "PYTHONDONTWRITEBYTECODE": "1",
        }
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
        outputs.append(done.stdout.split())
    assert outputs == [["4.0", "0"], ["4.0", "1"], ["12.0", "0"]]


def test_one_arm_is_compiled_once() -> None:
    """However its set-points are interpolated (held ones cannot be written), whatever a count begins with."""
    emps = robots.load("emps")
    time = emps.bus.cycle_time * np.arange(60)
    reference = 0.01 * (1 - np.cos(2 * np.pi * time))[:, np.newaxis]
    recording = Recording("swing", time, reference, reference.copy(), np.zeros_like(reference))
    for interpolation in ("hold", "linear"):
        controller = emps.controller.model_copy(update={"interpolation": interpolation})
        model = RegressorModel.of(emps.model_copy(update={"controller": controller}))
        simulate(model, model.prior(), recording)
    dispatcher: Any = closed_loop
    assert len([signature for signature in dispatcher.signatures if signature[0].count == 1]) == 1
    step: Any = implicit_step
    kept = [key[0] for key in step._cache._cache_file._load_index()]
    assert kept and not any(isinstance(one, Literal) for signature in kept for one in signature)


def test_what_has_to_be_compiled_first_is_known(tmp_path: Path, repository: Path) -> None:
    """Seconds for which progress would stand still are said; code is kept for each number of axes."""
    says = (
        "import robots; from ident.closed_loop.compiled import is_compiled, closed_loop;"
        "from numba import typeof;"
        "emps, tx40 = robots.load('emps'), robots.load('tx40'); print(is_compiled(emps));"
        "closed_loop._cache._cache_file._load_index = lambda: {((typeof((0,)),), 'machine', 'code'): 'file'};"
        "print(is_compiled(emps), is_compiled(tx40))"
    )
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    command = [sys.executable, "-c", says]
    done = subprocess.run(
        command, cwd=repository, env=environment, capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == ["False", "True", "False"]


def test_a_stamp_is_that_of_all_files(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text("x")
    one = stamp_of(tmp_path)
    (tmp_path / "b.py").write_text("")
    two = stamp_of(tmp_path)
    (tmp_path / "b.py").write_text("y")
    assert len({one, two, stamp_of(tmp_path)}) == 3


@pytest.mark.parametrize(("made", "counts"), [(compiled, False), (making_arrays, True)])
def test_machine_code_of_a_step_counts_no_references(
    made: Callable[..., Any], counts: bool, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """numba's setting for it has an underscore before its name; steps that count take half as long again."""
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path))  # what comes from there has no text to look at
    steps: Any = gears.links_behind_gears
    function, swing = made(steps.py_func), gears.Swing.of(np.zeros((1, 3)))
    function(np.ones((2, 1, 1, 3)), np.ones((2, 1)), 1e-3, 1, np.ones((1, 4)), 1, swing, np.ones((2, 1, 3)))
    (text,) = function.inspect_llvm().values()
    assert ("NRT_incref" in text) is counts
