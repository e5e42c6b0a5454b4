"""The learners' benchmark: what they see, what they are taught, what their answers count for."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import robots
from benchmarks.evidence.case import UNKNOWN
from benchmarks.evidence.drawn import draw_of, hidden, truth_of
from benchmarks.learning import heldout, published
from benchmarks.learning.boosting import classes, joined, joining, labels_of_drives
from benchmarks.learning.drawn import Drawn, turned
from benchmarks.learning.draws import SECONDS, recorded, ways
from benchmarks.learning.features import dictionary, features
from benchmarks.learning.judged import kind_of as kind_of_number
from benchmarks.learning.labels import CLEAN, OF_A_DRIVE, WHOLE_ARM, Hidden, answers, index_of, ranked
from benchmarks.learning.report import (
    interval,
    joint_right,
    kind_of,
    picture,
    report,
    shares_of,
    sign_test,
    with_published,
)
from benchmarks.learning.rows import CHANNELS, CONTEXT, LENGTH, RESIDUAL, Accepted
from benchmarks.learning.scoring import answer_of, calibration_error, sharpest, softmax, together
from benchmarks.learning.sizes import Sizes, measure
from drivers.simulated import draw_truth
from drivers.simulated.drawing import exercise
from drivers.simulated.scenario import Scenario
from ident.effects.vocabulary import VOCABULARY

_MISSING = [name for name in ("sklearn", "torch") if importlib.util.find_spec(name) is None]
learning = pytest.mark.skipif(bool(_MISSING), reason=f"no {' and no '.join(_MISSING)} here: benchmarks only")


def rows_of(drives: int = 3, seed: int = 0) -> Any:
    rng = np.random.default_rng(seed)
    time = np.linspace(0.0, 6.0, LENGTH)[:, np.newaxis]
    phase = rng.uniform(0.0, 6.0, drives)
    window = np.zeros((LENGTH, drives, len(CHANNELS)))
    window[..., 0], window[..., 1] = np.sin(2 * time + phase), 0.4 * np.cos(2 * time + phase)
    window[..., 2] = -0.2 * np.sin(2 * time + phase)
    window[..., 3] = window[..., 4] = 0.3 * np.sin(time + phase)
    window[..., RESIDUAL:] = rng.normal(size=(LENGTH, drives, 3))
    window[..., -1] = np.abs(window[..., -1])
    return window


def test_every_answer_of_the_vocabulary_is_there_once_for_each_drive() -> None:
    every = answers(6)
    assert len(set(every)) == len(every) == 1 + len(WHOLE_ARM) + 6 * len(OF_A_DRIVE)
    assert {one.effect for one in every} == {"clean", *(family.name for family in VOCABULARY)}
    for hidden_one in (CLEAN, Hidden("payload"), Hidden("time_delay"), Hidden("time_delay", (6,))):
        assert every[index_of(hidden_one, 6)] == hidden_one
    assert every[index_of(Hidden("wrist_coupling", (2, 3)), 6)] == Hidden("wrist_coupling", (2,))
    with pytest.raises(ValueError, match="not in"):
        index_of(Hidden("slosh", (1,)), 6)


def test_a_drive_is_taught_its_own_effect_and_the_arms_effects_are_every_drives() -> None:
    given = np.array([index_of(one, 2) for one in (CLEAN, Hidden("base_tilt"), Hidden("contact", (2,)))])
    contact = 1 + len(WHOLE_ARM) + OF_A_DRIVE.index("contact")
    tilt = 1 + WHOLE_ARM.index("base_tilt")
    assert labels_of_drives(given, 2).tolist() == [[0, 0], [tilt, tilt], [0, contact]]


def test_drives_are_joined_into_one_probability_of_the_arm() -> None:
    logs = np.full((2, classes()), np.log(0.001))
    logs[:, 0] = np.log(0.9)
    contact = 1 + len(WHOLE_ARM) + OF_A_DRIVE.index("contact")
    logs[1, [0, contact]] = np.log([0.02, 0.95])
    figures = np.array([0.0, 1.0, 1.0, 0.0])
    first, p = ranked(softmax(joined(logs, figures)), 2)[0]
    assert first == Hidden("contact", (2,)) and p > 0.9
    quiet = np.stack([logs[0], logs[0]])
    assert ranked(softmax(joined(quiet, figures)), 2)[0][0] == CLEAN
    both = np.stack([logs, quiet])
    truth = np.array([index_of(Hidden("contact", (2,)), 2), 0])
    better = softmax(joined(both, joining(both, truth)))[[0, 1], truth]
    assert (better >= softmax(joined(both, figures))[[0, 1], truth] - 1e-6).all()


def test_a_residual_that_goes_with_a_torque_of_the_dictionary_shows_in_its_feature() -> None:
    window, context = rows_of(), np.zeros((3, len(CONTEXT)))
    words = list(dictionary(window[:, 1]))
    first = 5  # three levels, the others' and their ratio stand before the correlations
    for name in ("speed", "position", "time sign", "load sign", "sin2 sign"):
        one = window.copy()
        one[:, 1, RESIDUAL] = 20.0 * dictionary(window[:, 1])[name]
        found = features(one, context)[:, first : first + len(words)]
        assert found[1, words.index(name)] == pytest.approx(1.0, abs=1e-5)
        assert np.abs(found[0, words.index(name)]) < 0.4
    assert np.isfinite(features(np.zeros_like(window), context)).all()


def test_the_sign_convention_of_a_drive_does_not_change_what_a_correlation_says() -> None:
    window = rows_of()
    window[:, 0, RESIDUAL] = 3.0 * window[:, 0, 1]
    flipped = [turned(window, np.random.default_rng(seed)) for seed in range(20)]
    signs = {float(np.sign(one[0, 0, 1] * window[0, 0, 1])) for one in flipped}
    assert signs == {-1.0, 1.0}
    for one in flipped:
        assert np.array_equal(one[..., -1], window[..., -1])
        assert np.allclose(one[:, 0, RESIDUAL], 3.0 * one[:, 0, 1])


def test_windows_of_a_log_make_one_probability_and_calibration_counts_what_is_said() -> None:
    scores = np.log(np.array([[0.6, 0.4], [0.7, 0.3], [0.45, 0.55]]))
    assert together(scores, 3.0)[0] > together(scores, 1.0)[0] > 0.5
    sure = [np.log(np.array([[0.8, 0.2]] * 4)) for _ in range(10)]
    assert sharpest(sure, [0] * 10) > 5.0
    assert sharpest(sure, [0, 1] * 5) < 0.5
    assert calibration_error(np.array([0.95, 0.95]), np.array([1.0, 0.0])) == pytest.approx(0.45)
    assert calibration_error(np.array([0.5, 0.5]), np.array([1.0, 0.0])) == pytest.approx(0.0)


def test_an_answer_is_a_name_a_doubt_or_clean() -> None:
    probability = np.zeros(len(answers(2)))
    contact = index_of(Hidden("contact", (2,)), 2)
    probability[[0, contact]] = 0.05, 0.95
    named = answer_of(probability, 2)
    assert named["verdict"] == "named" and named["names"][0]["named"]
    assert (named["names"][0]["name"], named["names"][0]["joints"]) == ("contact", [2])
    probability[[0, contact]] = 0.3, 0.7
    doubt = answer_of(probability, 2)
    assert doubt["verdict"] == "ambiguous" and not doubt["names"][0]["named"]
    probability[[0, contact]] = 0.7, 0.3
    assert answer_of(probability, 2)["verdict"] == "clean" and not answer_of(probability, 2)["names"]


def line(kind: str, name: str, search: str, truth: list[Any], said: str = "", p: float = 0.95) -> Any:
    names = [{"name": said, "joints": [1], "probability": p, "named": p >= 0.9}] if said else []
    answer = {"verdict": "named" if said else "clean", "names": names}
    return {"kind": kind, "name": name, "search": search, "truth": truth, "answer": answer}


def test_the_report_counts_right_wrong_missed_and_unknown_and_compares_the_same_logs(tmp_path: Path) -> None:
    contact, unknown = [["contact", [1]]], [[UNKNOWN, [1]]]
    lines = [
        line("own", "1", "evidence", contact, "contact"),
        line("own", "1", "boosting", contact, "backlash", 0.5),
        line("own", "1", "network", contact),
        line("own", "2", "boosting", [], "contact"),
        line("own", "3", "boosting", unknown, "contact"),
    ]
    assert [kind_of(one) for one in lines] == ["inside", "inside", "inside", "clean", "outside"]
    text = report(lines)
    assert (
        "| right name and joint first | 100 % [21, 100] of 1 | 0 % [0, 79] of 1 | 0 % [0, 79] of 1 |" in text
    )
    assert "| a name with 0.9 that is not there | 0 % [0, 79] of 1 | 67 % [21, 94] of 3 |" in text
    assert "| changed arm called clean | 0 % [0, 79] of 1 | 0 % [0, 79] of 1 | 100 % [21, 100] of 1 |" in text
    assert "| outside the vocabulary: no name with 0.9 | – | 0 % [0, 79] of 1 | – |" in text
    assert "the same 1 logs: search 1; gradient boosting 0 (search alone 1, it alone 0, p = 1); " in text
    assert shares_of(lines) == {"own": {"evidence": (1, 1), "boosting": (0, 1), "network": (0, 1)}}
    picture(lines, tmp_path / "picture.svg")
    assert "1 of 1" in (tmp_path / "picture.svg").read_text(encoding="utf-8")
    assert [joint_right(one) for one in lines] == [True, True, False, False, True]
    low, high = interval(5, 10)
    assert low == pytest.approx(0.237, abs=1e-3) and high == pytest.approx(0.763, abs=1e-3)


def test_published_answers_are_of_logs_with_a_prior_and_what_they_are_said_to_be() -> None:
    inside = (*published.FIRST_RIGHT, *published.FIRST_WRONG)
    assert len(set(published.SEEDS)) == len(published.SEEDS) == 42
    for seed in published.SEEDS:
        truth = truth_of(hidden(seed))
        assert not draw_of(seed).refit
        assert (not truth) == (seed in published.CLEAN)
        assert any(name == UNKNOWN for name, _ in truth) == (seed in published.OUTSIDE)
        assert bool(truth) == (seed in inside or seed in published.OUTSIDE)


def test_published_answers_stand_beside_the_learners_and_are_scored_like_them() -> None:
    truth = {
        str(seed): [[name, list(axes)] for name, axes in truth_of(hidden(seed))] for seed in published.SEEDS
    }
    lines = with_published([line("foreign", name, "boosting", one) for name, one in truth.items()])
    text = report(lines)
    assert shares_of(lines)["foreign"] == {"evidence": (26, 34), "boosting": (0, 34)}
    assert "| a name with 0.9 that is not there | 7 % [2, 19] of 42 |" in text
    assert "| changed arm called clean | 3 % [1, 15] of 34 |" in text
    assert "| clean arm called clean | 50 % [15, 85] of 4 |" in text
    assert "| right joint first, whatever the name | – |" in text
    assert published.answered("own", "1", []) is None
    recorded_log = published.answered("shared", "log_03", [])
    assert recorded_log is not None and recorded_log["answer"]["verdict"] == "clean"


def test_p_of_the_sign_test_is_that_of_a_fair_coin() -> None:
    assert sign_test(13, 5) == sign_test(5, 13) == pytest.approx(2 * 12616 / 2**18)
    assert sign_test(10, 0) == pytest.approx(2 / 2**10)
    assert sign_test(0, 0) == 1.0


def test_held_out_draws_count_right_changed_plain_and_how_sure_the_answer_was() -> None:
    contact = index_of(Hidden("contact", (2,)), 3)
    windows = np.stack([rows_of(seed=seed) for seed in range(4)])
    windows[[0, 3], :, 1, RESIDUAL] *= 6.0
    held = Drawn(windows, np.zeros((4, 3, len(CONTEXT))), np.array([0, 0, contact, contact]), np.arange(4))

    class Learner:
        """Says a contact at drive 2, with 0.8, of a loud window, and clean of any other."""

        def scores(self, window: Any, context: Any) -> Any:
            found = np.full((len(window), len(answers(3))), 1e-12)
            loud = heldout.loudness(window) > 3.0
            found[:, 0], found[:, contact] = np.where(loud, 0.2, 0.8), np.where(loud, 0.8, 0.2)
            return np.log(found)

    text = "right of all 50.0 % of 4, of changed 50.0 % of 2, of plain 100.0 % of 1; calibration error 0.300"
    assert heldout.told(Learner(), held) == text


def test_judged_logs_are_mixed_evenly() -> None:
    kinds = [kind_of_number(number) for number in range(80)]
    assert kinds.count("clean") == 16 and kinds.count("outside") == 8 and kinds.count("single") == 56


def test_sizes_lie_between_measured_ones_and_survive_a_file(tmp_path: Path) -> None:
    sizes = Sizes({"payload": {(): [(1.0, 10.0), (0.1, 1.0), (0.01, 0.3)]}, "contact": {}})
    assert sizes.effects == ["payload"] and sizes.places("payload") == [()]
    assert sizes.magnitude("payload", (), 10**0.5) == pytest.approx(10**-0.5, rel=1e-6)
    assert sizes.magnitude("payload", (), 100.0) == pytest.approx(1.0, rel=1e-6)
    sizes.save(tmp_path / "sizes.json")
    again = Sizes.load(tmp_path / "sizes.json")
    assert again.magnitude("payload", (), 2.0) == sizes.magnitude("payload", (), 2.0)


@pytest.mark.slow
def test_a_draw_shows_its_effect_at_its_drive_and_a_clean_one_shows_noise() -> None:
    robot = robots.load("tx40")
    truth, path = draw_truth(robot, 5), exercise(robot, 2 * SECONDS, 5)
    accepted = Accepted.on(robot, recorded(robot, truth, Scenario(), path, 1))
    assert accepted.context.shape == (6, len(CONTEXT)) and np.isfinite(accepted.context).all()
    clean = accepted.windows(recorded(robot, truth, Scenario(), path, 2))
    assert clean.shape == (2, LENGTH, 6, len(CHANNELS))
    loud = np.sqrt(np.mean(clean[..., RESIDUAL] ** 2, axis=(0, 1)))
    assert loud == pytest.approx(1.0, abs=0.3)
    sizes = measure(robot, ["viscous_friction"], 5, seconds=1.6)
    for drive in (1, 6):
        assert 0.0 < sizes.magnitude("viscous_friction", (drive,), 1.0) < 1.0
    changed = Scenario.from_dict({"viscous_friction": [{"drive": 3, "change": 0.2}]})
    window = accepted.windows(recorded(robot, truth, changed, path, 3))[0]
    shown = np.sqrt(np.mean(window[..., RESIDUAL] ** 2, axis=0)) - loud
    assert np.argmax(shown) == 2 and shown[2] > 5 * np.abs(np.delete(shown, 2)).max()
    speed = list(dictionary(window[:, 2])).index("speed")
    assert features(window, accepted.context)[2, 5 + speed] > 0.9


def test_ways_keep_to_the_limits_and_begin_at_home() -> None:
    robot = robots.load("tx40")
    for seed in range(5):
        path = ways(robot, SECONDS, np.random.default_rng(seed))
        speed = np.diff(path, axis=0) / robot.bus.cycle_time
        change = np.diff(speed, axis=0) / robot.bus.cycle_time
        assert np.allclose(path[0], robot.home)
        assert (path > robot.lower).all() and (path < robot.upper).all()
        assert (np.abs(speed).max(axis=0) <= 0.75 * robot.velocity_limits).all()
        assert (np.abs(change).max(axis=0) <= 1.05 * robot.acceleration_limits).all()


@learning
@pytest.mark.slow
def test_both_learners_learn_what_is_plain() -> None:
    from benchmarks.learning import boosting, network

    rng, hidden_ones = np.random.default_rng(0), (CLEAN, Hidden("viscous_friction", (2,)))
    windows = np.stack([rows_of(seed=seed) for seed in range(120)]).astype(np.float32)
    answer = np.array([index_of(hidden_ones[k % 2], 3) for k in range(120)])
    windows[1::2, :, 1, RESIDUAL] += 30.0 * windows[1::2, :, 1, 1]
    context = rng.normal(size=(120, 3, len(CONTEXT))).astype(np.float32)
    draws = Drawn(windows, context, answer, np.arange(120) // 2)
    for learner in (boosting.learn(draws), network.learn(draws, 60.0)):
        found = [learner.scores(w[np.newaxis], c)[0].argmax() for w, c in zip(windows, context, strict=True)]
        assert np.mean(np.array(found) == answer) > 0.9
