"""The compiled closed loop against the same model in plain Python, and what is refused."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import robots
from ident import IdentificationError, Recording, RegressorModel
from ident.closed_loop import SimulatedRun, simulate, simulate_many
from ident.closed_loop.leading import leading_of
from ident.closed_loop.simulate import run_in_python
from ident.closed_loop.torque_parts import ModelStructure
from ident.effects import Effect, FrictionSign, State
from ident.effects.family import Place, StandardParameter
from ident.effects.simulated import DriveChange, SimulatedParts
from robots.description import Robot
from tests.ident.closed_loop.held_torque import held_torque

TX40 = robots.load("tx40")


def swing(robot: Robot, duration: float = 0.25, period: float = 0.004) -> Recording:
    """Every joint leaves home and comes back, so that each passes a standstill."""
    time = np.arange(0.0, duration, period)
    shape = np.sin(np.pi * time / duration) ** 2 * np.sin(2 * np.pi * time / duration)
    reference = np.array(robot.home) + np.outer(shape, np.linspace(0.05, 0.1, robot.n))
    return Recording("swing", time, reference, reference.copy(), np.full(reference.shape, 0.1))


def with_controller(robot: Robot, **changes: Any) -> Robot:
    return robot.model_copy(update={"controller": robot.controller.model_copy(update=changes)})


def in_python(
    model: RegressorModel, standard: np.ndarray, recording: Recording, substeps: int
) -> SimulatedRun:
    structure = ModelStructure(model)
    return run_in_python(structure, structure.parts(standard), leading_of(model.robot, recording, substeps))


def assert_same(one: SimulatedRun, other: SimulatedRun, tolerance: float = 1e-9) -> None:
    for name in ("position", "velocity", "control_signal"):
        difference = np.abs(getattr(one, name) - getattr(other, name)).max()
        assert difference <= tolerance * (1 + np.abs(getattr(other, name)).max()), name


CONTROLLERS: dict[str, dict[str, Any]] = {
    "as shipped": {},
    "hold": {"interpolation": "hold"},
    "linear, low-pass and delay": {
        "interpolation": "linear",
        "velocity_cutoff_hz": 200.0,
        "delay_samples": 2,
        "velocity_difference_samples": 3,
    },
    "pd": {
        "type": "pd",
        "position_gain": tuple(40.0 * g for g in TX40.controller.velocity_gain),
        "integral_gain": (0.0,) * 6,
    },
    "pid": {
        "type": "pid",
        "position_gain": tuple(40.0 * g for g in TX40.controller.velocity_gain),
        "integral_gain": (50.0,) * 6,
    },
    "saturated": {"saturation": (0.5, 1.5, 0.8, 0.2, 0.2, 0.2)},
}


@pytest.mark.parametrize("name", CONTROLLERS)
def test_compiled_and_plain_runs_agree(name: str) -> None:
    robot = with_controller(TX40, **CONTROLLERS[name])
    model = RegressorModel.of(robot)
    recording = swing(robot)
    assert_same(simulate(model, model.prior(), recording, 2), in_python(model, model.prior(), recording, 2))


def test_exact_signs_agree_on_one_axis() -> None:
    robot = robots.load("emps")
    assert robot.identification.friction_sign == "sign"
    model = RegressorModel.of(robot)
    recording = swing(robot, period=0.001)
    assert_same(simulate(model, model.prior(), recording), in_python(model, model.prior(), recording, 4))


@pytest.mark.parametrize("name", robots.shipped())
def test_asymmetric_friction_agrees_too(name: str) -> None:
    robot = robots.load(name)
    settings = robot.identification.model_copy(update={"friction": "asymmetric"})
    model = RegressorModel.of(robot.model_copy(update={"identification": settings}))
    named = {}
    for joint in range(1, robot.n + 1):
        named |= {f"Fvp{joint}": 2.0, f"Fcp{joint}": 1.5, f"Fvn{joint}": 1.0, f"Fcn{joint}": 0.5}
    standard = model.prior() + model.standard_parameters(named)
    recording = swing(robot, period=robot.bus.cycle_time)
    assert_same(simulate(model, standard, recording, 2), in_python(model, standard, recording, 2))


@pytest.mark.parametrize("name", robots.shipped())
@pytest.mark.parametrize("friction", ["symmetric", "asymmetric"])
def test_the_usual_models_are_all_compiled(name: str, friction: str) -> None:
    robot = robots.load(name)
    settings = robot.identification.model_copy(update={"friction": friction})
    model = RegressorModel.of(robot.model_copy(update={"identification": settings}))
    assert ModelStructure(model).parts(np.ones(len(model.names))).others == ()


def test_friction_holds_an_arm_at_rest() -> None:
    """Within its Coulomb friction an axis creeps no faster than the steep sign allows."""
    robot = robots.load("emps")
    time = np.arange(0.0, 0.2, 0.001)
    still = np.zeros((time.size, 1))
    recording = Recording("rest", time, still, still, still + 0.2)
    robot = with_controller(robot, integral_gain=(1e-12,))
    model = RegressorModel.of(robot)
    assert in_python(model, model.prior(), recording, 1).position == pytest.approx(0.0, abs=1e-6)
    assert simulate(model, model.prior(), recording).position == pytest.approx(0.0, abs=1e-6)


@dataclass(frozen=True)
class Drag:
    """A torque that is no speed term: quadratic in the speed."""

    robot: Robot
    sign: FrictionSign
    name = "drag"
    sentence = "grows with the square of the speed"

    parameters = (StandardParameter("drag", Place("arm", ()), "drag", "N·m·s²"),)

    def columns(self, state: State) -> np.ndarray:
        return (self.sign(state.velocity) * state.velocity**2)[:, :, np.newaxis]


def test_effects_of_another_shape_are_simulated_too() -> None:
    usual = RegressorModel.of(TX40)
    drag: Effect = Drag(TX40, FrictionSign("tanh", 0.1))
    model = replace(usual, effects=(*usual.effects, drag))
    recording = swing(TX40)
    none = simulate(model, np.append(usual.prior(), 0.0), recording, 1)
    assert_same(none, simulate(usual, usual.prior(), recording, 1))
    some = simulate(model, np.append(usual.prior(), 3.0), recording, 1)
    assert np.abs(some.position - none.position).max() > 1e-5


@dataclass(frozen=True)
class Lagging:
    """A lag of the first drive's torque, which is compiled or nothing."""

    robot: Robot
    name = "lagging"
    sentence = "torque that comes late"
    parameters = (StandardParameter("lag", Place("arm", ()), "lagging", "s"),)

    def columns(self, state: State) -> np.ndarray:
        return np.zeros((*state.velocity.shape, 1))

    def simulated(self, values: np.ndarray) -> SimulatedParts:
        return SimulatedParts(drives=(DriveChange(0, lag=float(values[0])),))


def test_what_only_compiled_code_can_is_refused_beside_what_it_cannot() -> None:
    usual = RegressorModel.of(TX40)
    effects: tuple[Effect, ...] = (Drag(TX40, FrictionSign("tanh", 0.1)), Lagging(TX40))
    model = replace(usual, effects=(*usual.effects, *effects))
    with pytest.raises(IdentificationError, match=r"^drag has no compiled simulation"):
        simulate(model, np.append(usual.prior(), [1.0, 0.001]), swing(TX40))


def test_the_torque_of_the_simulated_motion_is_that_of_the_regressor() -> None:
    """One definition serves both: columns at the simulated states give back the torque that drove them."""
    # Every integration step is a controller sample and a recorded sample, so differences are exact.
    robot = with_controller(TX40, interpolation="hold")
    model = RegressorModel.of(robot)
    recording = swing(robot, period=0.001)
    run = simulate(model, model.prior(), recording, 1)
    torque = robot.joint_torque(run.control_signal[1:-1])
    taken = held_torque(model, model.prior(), run, recording.sample_time)
    assert np.abs(taken - torque).max() <= 1e-8 * np.abs(torque).max()


def test_many_vectors_give_what_each_gives_alone_whatever_the_threads() -> None:
    model, recording = RegressorModel.of(TX40), swing(TX40)
    vectors = model.prior() * np.linspace(0.9, 1.1, 5)[:, np.newaxis]
    alone = [simulate(model, vector, recording) for vector in vectors]
    for threads in (1, 3):
        runs = simulate_many(model, vectors, recording, threads=threads)
        for one, run in zip(alone, runs, strict=True):
            for name in ("position", "velocity", "control_signal"):
                np.testing.assert_array_equal(getattr(one, name), getattr(run, name))


def test_the_default_step_is_a_quarter_of_a_millisecond_at_most() -> None:
    assert leading_of(TX40, swing(TX40), None).substeps == 4
    slow = with_controller(TX40, sample_time=0.00033)
    assert leading_of(slow, swing(slow, period=0.00033), None).substeps == 2


def test_a_run_needs_a_reference() -> None:
    model, recording = RegressorModel.of(TX40), replace(swing(TX40), reference=None)
    with pytest.raises(IdentificationError, match="swing: no position reference was recorded"):
        simulate(model, model.prior(), recording)


def test_sampling_must_be_a_multiple_of_the_controllers() -> None:
    model, recording = RegressorModel.of(TX40), swing(TX40, period=0.0025)
    with pytest.raises(IdentificationError, match=r"sampled every 0\.0025 s, the controller every 0\.001 s"):
        simulate(model, model.prior(), recording)


def test_a_mass_matrix_that_no_arm_has_is_explained() -> None:
    model = RegressorModel.of(TX40)
    standard = model.prior()
    standard[model.names.index("Ia4")] = -1.0
    with pytest.raises(IdentificationError) as compiled:
        simulate(model, standard, swing(TX40), 1)
    posture = re.escape(", ".join(f"{q:.3f}" for q in TX40.home))
    assert re.match(
        rf"the identified mass matrix is not positive definite at q = \({posture}\): eigenvalue -.* joint 4",
        str(compiled.value),
    )
    with pytest.raises(IdentificationError) as plain:
        in_python(model, standard, swing(TX40), 1)
    assert str(plain.value) == str(compiled.value)


def test_an_unstable_loop_is_explained() -> None:
    gains = tuple(20 * g for g in TX40.controller.velocity_gain)
    robot = with_controller(TX40, velocity_gain=gains, saturation=(1e4,) * 6, delay_samples=3)
    model = RegressorModel.of(robot)
    with pytest.raises(
        IdentificationError, match=r"^the simulated loop is unstable: joint \d runs away at 0\.\d+ s"
    ):
        simulate(model, model.prior(), swing(robot))


def test_without_a_place_for_a_cache_it_still_compiles(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from ident.kernels import compilation

    def no_place(*_: object, **options: object) -> Any:
        if options.get("cache"):
            raise RuntimeError("cannot cache function: no locator available")
        return lambda function: function

    monkeypatch.setattr(compilation.numba, "njit", no_place)
    assert compilation.compiled(max) is max
