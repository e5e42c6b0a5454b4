"""The closed loop as evidence: bristles for signs, what repeats is simulated once."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import robots
from drivers.simulated import draw_truth
from drivers.simulated.drawing import exercise
from drivers.simulated.offline import simulate_offline
from ident import Recording, RegressorModel, base_parameters, identify
from ident.closed_loop import simulate
from ident.discrepancy.loop import COARSE, FINE, repeated, sample_of, settled, with_standstill_of
from ident.discrepancy.loop_evidence import LoopEvidence
from ident.discrepancy.loop_examination import LoopExamination, beside_found, examine_in_loop
from ident.discrepancy.prepared_recording import prepared_recording
from ident.discrepancy.settings import searching
from ident.effects import FrictionSign
from ident.effects.family import Place
from ident.effects.simulated import Bristle
from ident.effects.vocabulary import family_named
from ident.parameters.base import BaseParameters

WIDTH = 2e-5
"""rad over which the simulated arm's friction builds up."""
SMOOTH = 0.005
"""m/s over which friction turns its sign on an arm without bristles."""


@cache
def examined() -> LoopExamination:
    plain = robots.load("tx40")
    run = simulate_offline(plain, draw_truth(plain, 3), exercise(plain, duration=6.0), periods=2, seed=1)
    recording = Recording("clean", run.time, run.reference, run.position, run.control_signal)
    robot = searching(plain, recording)
    base: BaseParameters = base_parameters(RegressorModel.of(robot))
    beta = identify(plain, (recording,)).result.recommended.values
    return examine_in_loop(base, (prepared_recording(robot, recording),), None, beta)


def evidence() -> LoopEvidence:
    return examined().loop


def test_a_period_stands_for_all() -> None:
    found = evidence()
    piece = found.loop.prepared[0]
    start, period = settled(piece), piece.period or 0
    index = np.array([0, start - 1, start, start + period - 1, start + period, start + 2 * period])
    assert list(sample_of(piece, index)) == [0, start - 1, start, start + period - 1, start, start]
    signal = np.arange(float(start + period))[:, np.newaxis]
    whole = repeated(signal, piece)
    assert whole.shape[0] == piece.recording.time.shape[0]
    assert whole[start + period + 5, 0] == start + 5


def test_two_recordings_may_have_one_name() -> None:
    """As captures of one program do, each in a folder of its own."""
    found = evidence()
    (piece,) = found.loop.prepared
    shorter = replace(piece, recording=piece.recording.piece(slice(0, 2000), piece.recording.name))
    both = replace(
        found, loop=replace(found.loop, prepared=(piece, shorter)), motion=(*found.motion, *found.motion)
    )
    rows = [one.position.shape[0] for one in both.motion_of_rows()]
    assert rows == [both.loop.count(piece), both.loop.count(shorter)] and rows[0] > rows[1]


def test_the_pre_sliding_way_is_that_of_the_arm() -> None:
    lengths = [law.length for law in evidence().standstill if isinstance(law, Bristle)]
    assert lengths == pytest.approx([WIDTH] * 6, rel=0.15), "and not smoothed over a speed"


def test_friction_that_is_smoothed_over_a_speed_is_found_to_be() -> None:
    """No arm like that was ever clean: bristles do otherwise at each reversal."""
    plain = robots.load("emps")
    smooth = {"friction_sign": "tanh", "friction_width": SMOOTH}
    rig = plain.model_copy(update={"identification": plain.identification.model_copy(update=smooth)})
    path = simulate_offline(plain, draw_truth(plain, 3), exercise(plain, duration=5.0), periods=2, seed=1)
    model = RegressorModel.of(rig)
    given = Recording("given", path.time, path.reference, path.position, path.control_signal)
    run = simulate(model, model.prior(), given)
    noise = 1e-2 * np.random.default_rng(1).normal(size=run.control_signal.shape)
    recording = Recording("smooth", path.time, path.reference, run.position, run.control_signal + noise)
    robot = searching(rig, recording)
    base = base_parameters(RegressorModel.of(robot))
    found = examine_in_loop(base, (prepared_recording(robot, recording),), None, base.regroup(model.prior()))
    (law,) = found.loop.standstill
    assert isinstance(law, FrictionSign)
    assert law.width == pytest.approx(SMOOTH, rel=0.01), "5 % more is a sticking of 180 nats"


def test_a_clean_arm_leaves_noise_alone_reversals_included() -> None:
    found = examined()
    # Whitened, noise has a deviation of 1.
    assert float(found.residual[: found.data_rows].std()) == pytest.approx(1.0, abs=0.1)


def test_the_loop_answers_a_torque_with_the_same_torque_a_little_later() -> None:
    found = evidence()
    names = found.base.names
    which = [k for k, name in enumerate(names) if name.startswith(("Ia", "Fv", "Fc"))][:12]
    exact = np.stack([found.column(k, 0.05) for k in which], axis=2)
    assert found.answer is not None
    assert found.answer[0].sum() == pytest.approx(1.0, abs=0.15)
    about = found.screened_base()[:, :, which]
    left = np.sum((about - exact)[20:] ** 2, axis=(0, 1)) / np.sum(exact[20:] ** 2, axis=(0, 1))
    assert np.median(left) < 0.1


def test_friction_that_falls_steeply_with_speed_is_no_jump_at_a_reversal() -> None:
    """However coarse the integration, a sign that a film of lubricant takes away is that of bristles."""
    found, place = evidence(), Place("drive", (3,))
    effect = family_named("stribeck_friction").effect(found.robot, place, (0.02, 1.0), found.present)
    steep = with_standstill_of(
        found.variant(effect).simulated(np.array([0.8])), found.standstill, found.robot
    )
    assert isinstance(steep.friction[0].law, Bristle) and steep.friction[0].speed_factor is not None
    coarse, fine = (found.change(steep, substeps) for substeps in (COARSE, FINE))
    assert coarse is not None and fine is not None
    assert np.linalg.norm(coarse - fine) < 0.2 * np.linalg.norm(fine)


def test_a_small_effect_changes_in_the_loop_what_its_columns_say() -> None:
    found, place = examined(), Place("drive", (1,))
    loop = found.loop
    effect = family_named("nonlinear_viscous_friction").effect(loop.robot, place, (2.0,), loop.present)
    columns = found.columns_of(effect)
    assert columns is not None
    values = loop.probe(effect)
    parts = with_standstill_of(loop.variant(effect).simulated(values), loop.standstill, loop.robot)
    change = loop.change(parts, FINE)
    assert change is not None
    white = found.whiten([change[:, :, np.newaxis]])[:, 0]
    assert np.linalg.norm(white - columns @ values) < 0.1 * np.linalg.norm(white)


def test_beside_what_was_found_the_model_is_fitted_again() -> None:
    generator = np.random.default_rng(0)
    x = generator.standard_normal((40, 4))
    y = x @ np.array([1.0, -2.0, 3.0, 0.5])
    assert beside_found(x, y, np.array([9.0, 9.0, 9.0, 0.5]), 3) == pytest.approx([1.0, -2.0, 3.0, 0.5])
