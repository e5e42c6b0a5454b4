"""Controller identification: the published EMPS law, and laws that are known because they are simulated."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

import robots
from ident import IdentificationError, Recording, RegressorModel
from ident.closed_loop import simulate
from ident.controllers import IdentifiedController, identify_controller
from robots import Controller, Robot


@pytest.fixture(scope="module")
def emps() -> Robot:
    return robots.load("emps")


@pytest.fixture(scope="module")
def emps_log(shared_data: Path) -> Recording:
    log = loadmat(shared_data / "emps" / "DATA_EMPS.mat")
    time, reference, position, signal = (log[key].astype(np.float64) for key in ("t", "qg", "qm", "vir"))
    return Recording("DATA_EMPS.mat", time.ravel(), reference, position, signal)


def with_controller(robot: Robot, **changes: object) -> Robot:
    return robot.model_copy(update={"controller": robot.controller.model_copy(update=changes)})


def gain(found: IdentifiedController, key: str, drive: int = 0) -> float:
    assert found.controller is not None
    return float(getattr(found.controller, key)[drive])


def test_the_published_law_of_emps_is_found(emps: Robot, emps_log: Recording) -> None:
    scrambled = with_controller(
        emps,
        position_gain=(1.0,),
        velocity_gain=(1.0,),
        interpolation="linear",
        velocity_difference_samples=1,
        delay_samples=3,
    )
    found = identify_controller(scrambled, (emps_log,))
    assert found.trusted, found.reason
    assert (found.form.law, found.form.velocity_feed_forward) == ("pd", False)
    assert gain(found, "position_gain") == pytest.approx(160.18, rel=1e-3)
    assert gain(found, "velocity_gain") == pytest.approx(243.45, rel=1e-3)
    assert found.timing.difference == 2  # the difference of the two-point mean
    assert found.timing.cutoff_hz is None
    assert found.explained[0] > 0.999


def test_of_two_ways_to_write_one_law_the_one_with_fewer_gains_is_found(
    emps: Robot, emps_log: Recording
) -> None:
    # SYNC is the controller's period here: a ramp that is fed forward by one period is a held set-point. The
    # two errors differ in the ninth digit, so rounding must not choose, nor may the description.
    ramp = with_controller(emps, interpolation="linear", velocity_difference_samples=2, delay_samples=0)
    found = identify_controller(ramp, (emps_log,))
    assert (found.form.law, found.form.velocity_feed_forward) == ("pd", False)
    assert found.timing.interpolation == "hold"
    assert gain(found, "position_gain") == pytest.approx(160.18, rel=1e-3)


def test_a_signal_that_is_no_control_law_forbids_the_simulation(emps: Robot, emps_log: Recording) -> None:
    noise = np.random.default_rng(1).normal(size=emps_log.control_signal.shape)
    disturbed = Recording(
        "disturbed",
        emps_log.time,
        emps_log.reference,
        emps_log.position,
        emps_log.control_signal + 0.5 * emps_log.control_signal.std() * noise,
    )
    found = identify_controller(emps, (disturbed,))
    assert not found.trusted
    assert "of the control signal of drive 1 on blocks that it was not fitted on" in found.reason
    # A quarter of the variance is noise: the figure is what a held-out prediction can reach, no more.
    assert found.explained[0] == pytest.approx(0.8, abs=0.02)


LAWS = {
    "pd": {"type": "pd", "position_gain": (30000.0,), "velocity_gain": (200.0,)},
    "pd, fed forward": {
        "type": "pd",
        "position_gain": (30000.0,),
        "velocity_gain": (200.0,),
        "velocity_feed_forward": (0.8,),
    },
    "pid": {
        "type": "pid",
        "position_gain": (30000.0,),
        "velocity_gain": (200.0,),
        "integral_gain": (2e5,),
        "velocity_feed_forward": (0.5,),
    },
    "cascade": {"integral_gain": (15.0,), "velocity_feed_forward": (0.7,), "delay_samples": 2},
    "filtered": {"integral_gain": (15.0,), "velocity_cutoff_hz": 90.0, "velocity_difference_samples": 1},
}


@pytest.fixture(scope="module")
def recordings(emps: Robot) -> dict[str, tuple[Robot, Recording]]:
    """What the simulated axis does under each law, every fourth controller sample recorded."""
    time = np.arange(0.0, 8.0, 0.004)
    ramp = np.clip(np.minimum(time, time[-1] - time), 0.0, 1.0)
    window = ramp**3 * (10 - 15 * ramp + 6 * ramp**2)
    motion = sum(
        size * np.sin(2 * np.pi * f * time + f) for f, size in ((0.3, 0.05), (0.7, 0.02), (1.9, 0.004))
    )
    reference = (window * motion)[:, np.newaxis]
    found = {}
    for name, law in LAWS.items():
        robot = with_controller(
            emps, **({"interpolation": "spline", "delay_samples": 0, "saturation": (100.0,)} | law)
        )
        still = Recording(name, time, reference, reference, np.zeros_like(reference))
        run = simulate(RegressorModel.of(robot), RegressorModel.of(robot).prior(), still)
        generator = np.random.default_rng(7)
        signal = run.control_signal + 5e-4 * generator.uniform(-0.5, 0.5, run.control_signal.shape)
        found[name] = (robot, Recording(name, time, reference, run.position, signal))
    return found


@pytest.mark.slow
@pytest.mark.parametrize("name", LAWS)
def test_a_simulated_law_is_found(
    name: str, emps: Robot, recordings: dict[str, tuple[Robot, Recording]]
) -> None:
    robot, recording = recordings[name]
    truth = robot.controller
    # The description that it starts from is wrong in all that is looked for.
    found = identify_controller(with_controller(emps, saturation=(100.0,)), (recording,))
    assert found.trusted, found.reason
    controller = found.controller
    assert controller is not None
    assert isinstance(controller, Controller)
    assert controller.interpolation == "spline"
    assert controller.delay_samples == truth.delay_samples
    factor = 1.0
    if truth.type == "pd":  # a cascade without integral is the same law with the gains multiplied
        assert controller.type == "cascade_p_pi"
        factor = truth.velocity_gain[0]
    else:
        assert controller.type == truth.type
    assert controller.position_gain[0] * factor == pytest.approx(truth.position_gain[0], rel=0.02)
    assert controller.velocity_gain[0] == pytest.approx(truth.velocity_gain[0], rel=0.02)
    assert controller.integral_gain[0] == pytest.approx(truth.integral_gain[0], rel=0.02)
    assert controller.velocity_feed_forward[0] == pytest.approx(truth.velocity_feed_forward[0], abs=0.02)


def test_the_controller_found_simulates_the_recording(
    emps: Robot, recordings: dict[str, tuple[Robot, Recording]]
) -> None:
    _, recording = recordings["cascade"]
    found = identify_controller(with_controller(emps, saturation=(100.0,)), (recording,))
    robot = emps.model_copy(update={"controller": found.controller})
    model = RegressorModel.of(robot)
    run = simulate(model, model.prior(), recording)
    assert recording.reference is not None
    following = np.abs(recording.reference - recording.position).max()
    assert np.abs(run.position - recording.position).max() < 0.01 * following


def test_what_cannot_be_identified_is_refused(emps: Robot, emps_log: Recording) -> None:
    blind = Recording("log", emps_log.time, None, emps_log.position, emps_log.control_signal)
    with pytest.raises(IdentificationError, match="log: no position reference was recorded"):
        identify_controller(emps, (blind,))
    still = Recording(
        "still", emps_log.time, 0 * emps_log.position, emps_log.position, emps_log.control_signal
    )
    with pytest.raises(IdentificationError, match="drive 1 never moves"):
        identify_controller(emps, (still,))
    with pytest.raises(IdentificationError, match="no recording"):
        identify_controller(emps, ())
