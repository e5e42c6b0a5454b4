"""What may be called named, and what clean: findings and models on data that was not fitted."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm

import robots
from ident.discrepancy import confirmation as confirmation_module
from ident.discrepancy.accepted import Accepted
from ident.discrepancy.basis import Basis
from ident.discrepancy.by_evidence.decide.names import Named
from ident.discrepancy.by_evidence.in_loop import InLoop, leaves_the_usual
from ident.discrepancy.component import Component
from ident.discrepancy.confirmation import Confirmation, Shown, shown_in_torque, shown_share
from ident.discrepancy.residual_dependence import ResidualDependence
from ident.discrepancy.results import Candidate
from ident.discrepancy.unexplained import Unexplained, unexplained_of
from ident.discrepancy.validation import Validation
from ident.discrepancy.verdict import Left, beside_gate, description, lags_of_noise, verdict_of
from ident.effects.family import Place
from ident.effects.vocabulary import family_named
from ident.parameters.present import Present
from ident.parameters.regressor import RegressorModel
from ident.verdicts import ColumnCheck

BLOCKS = np.repeat(np.arange(40), 50)


def change(seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=BLOCKS.size)


@pytest.mark.parametrize(
    ("true", "there", "contradicted"),
    [(1.0, True, False), (0.6, True, False), (0.48, False, False), (0.0, False, True), (-0.5, False, True)],
)
def test_a_finding_is_there_where_it_is_nearer_to_all_than_to_nothing(
    true: float, there: bool, contradicted: bool
) -> None:
    added = 0.5 * change()
    before = true * added + change(1)
    shown = shown_share(before, before - added, BLOCKS)
    assert shown.share == pytest.approx(true, abs=3 * shown.sigma)
    assert (shown.there, shown.contradicted) == (there, contradicted)
    grown = np.sum((before - added) ** 2) > np.sum(before**2)
    assert grown is np.bool_(shown.share < 0.5)


def test_what_noise_alone_could_show_confirms_nothing() -> None:
    """A share near one that is not told from zero."""
    assert not Shown(0.9, 0.6).there
    assert Shown(0.9, 0.3).there
    assert not Shown(0.45, 0.3).contradicted


def test_errors_that_go_on_through_a_block_make_a_share_less_sure() -> None:
    added, slow = np.repeat(change()[:40], 50), np.repeat(change(1)[:40], 50)
    together = shown_share(added + slow, slow, BLOCKS)
    alone = shown_share(added + slow, slow, np.arange(BLOCKS.size))
    assert together.sigma > 4 * alone.sigma


def test_no_row_tells_the_share_of_a_torque_better_than_to_a_tenth(monkeypatch: pytest.MonkeyPatch) -> None:
    """White rows of a drag are those of its ends: 4 ms early they are not there, and all between them is."""
    added = 2.0 * change()
    early, late = added.copy(), added.copy()
    early[500:1500:100], late[501:1501:100] = 300.0, 300.0
    noise = change(1)
    pieces: Any = [SimpleNamespace(rows=BLOCKS.size, moving=np.ones((BLOCKS.size, 1), dtype=np.bool_))]
    monkeypatch.setattr(confirmation_module, "block_labels", lambda *given: BLOCKS)
    rows: Any = SimpleNamespace(apply=lambda values, segment, used: values[:, 0])
    before, after = ([one[:, np.newaxis]] for one in (late + noise, late - early + noise))
    shown = shown_in_torque(pieces, before, after, rows)
    assert shown.there and shown.share == pytest.approx(0.85, abs=0.05)
    assert shown_share(before[0][:, 0], after[0][:, 0], BLOCKS).contradicted
    whole = [noise[:, np.newaxis]]
    assert shown_in_torque(pieces, before, whole, rows).share == pytest.approx(1.0, abs=0.05)


def test_a_share_has_nats_for_all_of_it_against_none() -> None:
    """Normal about one and about nothing."""
    shown = Shown(0.906, 0.081)
    both = norm.logpdf(0.906, 1.0, 0.081) - norm.logpdf(0.906, 0.0, 0.081)
    assert shown.nats == pytest.approx(both) and 61.0 < shown.nats < 63.0
    assert Shown(0.4, 0.081).nats < -5.0
    assert Shown(0.0, 0.0).nats == 0.0


@pytest.mark.parametrize(
    ("share", "sigma"), [(1.0, 0.1), (0.5, 0.1), (-0.4, 0.2), (1.3, 0.1), (0.2, 0.05), (0.8, 3.0)]
)
def test_of_what_has_no_name_any_share_may_be_there(share: float, sigma: float) -> None:
    mean = quad(lambda part: norm.pdf(share, part, sigma), 0.0, 1.0, points=[float(np.clip(share, 0, 1))])[0]
    assert Shown(share, sigma).nats_of_no_name == pytest.approx(np.log(mean) - norm.logpdf(share, 1.0, sigma))


def test_more_than_twice_is_as_far_off_as_so_much_less() -> None:
    """An eccentric encoder beside a wrist coupling had 3.22 ± 0.14 of itself on other motion, and 0.97."""
    more = Shown(3.2, 0.14).nats_of_no_name
    assert more == pytest.approx(Shown(-1.2, 0.14).nats_of_no_name) and more > 50.0
    assert Shown(2.2, 0.14).nats_of_no_name < 0.0


def test_a_share_far_off_stays_finite() -> None:
    assert Shown(0.5, 1e-4).nats_of_no_name == pytest.approx(1.25e7, rel=1e-3)
    assert np.isfinite(Shown(1.5, 1e-4).nats_of_no_name) and np.isfinite(Shown(-3.0, 1e-4).nats_of_no_name)
    assert Shown(0.0, 0.0).nats_of_no_name == 0.0


def test_a_change_that_is_rounding_is_none() -> None:
    """A contact that other motion does not reach had a share of −4·10¹¹ ± 4·10¹¹ of the last digits."""
    random = np.random.default_rng(3)
    before = random.normal(size=BLOCKS.size)
    shown = shown_share(before, before + 1e-13 * random.normal(size=BLOCKS.size), BLOCKS)
    assert shown == Shown(0.0, 0.0)
    assert not shown.there and not shown.contradicted
    confirmation = Confirmation(shown, shown)
    assert not confirmation.passed and not confirmation.refuted
    assert "does not move where it acts" in confirmation.reason


SURE = Shown(1.0, 0.02)


@pytest.mark.parametrize(
    ("confirmation", "says"),
    [
        (Confirmation(SURE, None), ""),
        (Confirmation(SURE, Shown(0.9, 0.1)), ""),
        (Confirmation(SURE, Shown(0.4, 0.2)), ""),
        (Confirmation(Shown(-3.0, 0.1), None), "shows -300 ± 10 %"),
        (Confirmation(SURE, Shown(-2.0, 0.1)), "the simulated closed loop is farther from the arm"),
        (Confirmation(SURE, None, "Fn1 is 0.2 ± 0.7 N·m"), "Fn1 is 0.2 ± 0.7"),
        # A gear's friction of the load, taken for a breakaway: the loop does twelve times as much otherwise.
        (
            Confirmation(SURE, Shown(12.4, 1.1), of_reversals=True),
            "closed loop, data that was not fitted shows 1240 ± 110 %",
        ),
        (Confirmation(SURE, Shown(2.1, 0.04), of_reversals=True), "shows 210 ± 4 %"),
        # A right static friction: the loop's own law at standstill is the description's.
        (Confirmation(SURE, Shown(1.96, 0.01), of_reversals=True), ""),
        (Confirmation(SURE, Shown(12.4, 6.0), of_reversals=True), ""),
        # An integral makes up for what a moving arm shows: its positions say nothing of the size.
        (Confirmation(SURE, Shown(87.6, 0.5)), ""),
        # A lag beside a brake that comes and goes; and a breakaway, which the loop's torque shows by halves.
        (
            Confirmation(Shown(8.56, 0.69), None),
            "of the torque that it adds, data that was not fitted shows 856",
        ),
        (Confirmation(Shown(2.7, 0.07), Shown(1.29, 0.05), of_reversals=True), ""),
        (Confirmation(Shown(8.0, 4.0), None), ""),
    ],
)
def test_why_a_finding_is_not_confirmed(confirmation: Confirmation, says: str) -> None:
    assert confirmation.passed is (says == "")
    assert says in confirmation.reason


def test_what_explains_a_part_of_what_the_loop_does_otherwise_is_refuted() -> None:
    """What reversals showed goes then, also alone; a finding of the moving arm is not asked."""
    twelve = Shown(12.4, 1.1)
    assert Confirmation(SURE, twelve, of_reversals=True).refuted and not Confirmation(SURE, twelve).refuted


def test_what_is_told_from_all_of_a_finding_speaks_for_something_that_is_only_like_it() -> None:
    """As of other motion: about 1, to what the form may be wrong by, or any share; more is as less."""
    less, more = Shown(0.12, 0.024), Shown(1.88, 0.024)
    sigma = np.hypot(0.024, 0.1)
    either = norm.cdf(0.88 / sigma) - norm.cdf(-0.12 / sigma)
    assert less.nats_against(0.1) == pytest.approx(np.log(either) - norm.logpdf(0.12, 1.0, sigma))
    assert more.nats_against(0.1) == pytest.approx(less.nats_against(0.1))
    assert Shown(1.0, 0.01).nats_against(0.1) == 0.0


def test_what_is_doubted_is_nothing_that_recordings_just_say_nothing_of() -> None:
    nothing = Shown(0.0, 0.0)
    assert Confirmation(nothing, None).unseen and not Confirmation(SURE, None).unseen
    assert not Confirmation(nothing, None, "may be nothing").unseen
    assert not Confirmation(nothing, Shown(0.1, 0.01)).unseen


def test_the_form_of_a_finding_makes_its_share_less_sure() -> None:
    assert Shown(0.7, 0.03).to_form(0.04) == Shown(0.7, pytest.approx(0.05))
    assert Shown(0.0, 0.0).to_form(0.1).of_nothing


def finding(confirmation: Confirmation, *alternatives: str) -> Any:
    return SimpleNamespace(confirmation=confirmation, indistinguishable_from=alternatives)


def left(**more: Any) -> Left:
    return replace(Left((), (), "", False, (), 0.05), **more)


def test_nothing_is_named_that_data_that_was_not_fitted_contradicts() -> None:
    good, bad = finding(Confirmation(SURE, None)), finding(Confirmation(Shown(0.2, 0.1), None))
    assert verdict_of([good], left()) == "named"
    assert verdict_of([good, bad], left()) == "not_confirmed"
    assert verdict_of([finding(bad.confirmation, "payload")], left()) == "not_confirmed"
    assert verdict_of([finding(good.confirmation, "payload")], left()) == "ambiguous"


def share(joint: int, least: float) -> Unexplained:
    return Unexplained(joint, 0.2, 0.01, 0.19, least, False)


def test_a_lag_that_noise_has_made_goes_again_where_nothing_is_left() -> None:
    no = Confirmation(Shown(0.2, 0.1), None)
    lag, delay = (lag_of(no, name, 2e-5) for name in ("current_loop_lag", "time_delay"))
    good = lag_of(Confirmation(SURE, None), "time_delay", 2e-5)
    friction = lag_of(no, "stribeck_friction", 2e-5)
    small, large, noise = share(3, 0.049), share(0, 0.051), np.array([0.0, 0.0, 0.0, 0.0099])
    assert lags_of_noise([lag, delay], True, [small], noise, 0.05)
    assert not lags_of_noise([lag, friction], True, [small], noise, 0.05)
    assert not lags_of_noise([lag, good], True, [small], noise, 0.05)
    assert not lags_of_noise([lag], False, [small], noise, 0.05)
    assert not lags_of_noise([lag], True, [small, large], noise, 0.05)
    assert not lags_of_noise([], True, [small], noise, 0.05)


@pytest.mark.parametrize(("size", "changed"), [(0.0, 0.0), (1.9e-5, 0.0), (2e-5, 0.0101)])
def test_no_lag_goes_again_that_the_fit_makes_nothing_of_or_that_is_above_the_noise(
    size: float, changed: float
) -> None:
    """A gravity spring that passed for a lag of 12 ms, and of which a fit made none."""
    lag = lag_of(Confirmation(Shown(0.2, 0.1), None), "current_loop_lag", size)
    assert not lags_of_noise([lag], True, [share(0, 0.04)], np.array([changed]), 0.05)


@pytest.mark.parametrize(("above", "usual"), [(0.09, True), (0.25, False)])
def test_what_evidence_leaves_beside_a_lag_is_misfit(above: float, usual: bool) -> None:
    """Where nothing repeats a measure of the residual is of no use: it is taken for the noise."""
    joints = [SimpleNamespace(above=0.0), SimpleNamespace(above=above)]
    answer: Any = SimpleNamespace(joints=joints)
    assert leaves_the_usual(answer) is usual


@pytest.mark.parametrize(
    ("rival", "standstill", "above", "more"),
    [
        ("static_friction", (), 0.0, False),
        ("static_friction", None, 0.0, True),
        ("static_friction", (), 0.5, True),
        ("stribeck_friction", (), 0.0, True),
    ],
)
def test_what_shows_at_reversals_alone_is_asked_of_the_loop_where_there_is_one(
    rival: str, standstill: Any, above: float, more: bool
) -> None:
    """A clean arm that creeps had static friction with 0.09 in its moving rows; its loop left noise alone."""
    robot = robots.load("emps")
    family, place = family_named(rival), Place("drive", (0,))
    placed: Any = SimpleNamespace(shape_names=tuple(shape.name for shape in family.shapes(robot, place)))
    ranking = (Named("nothing", (), 0.88), Named(rival, (0,), 0.12, placed))
    answer: Any = SimpleNamespace(
        verdict="unnamed",
        findings=(),
        ranking=ranking,
        probability_clean=0.88,
        joints=[SimpleNamespace(above=above)],
    )
    step = SimpleNamespace(base=SimpleNamespace(model=SimpleNamespace(robot=robot)))
    course: Any = SimpleNamespace(step=step)
    loop = InLoop(course, answer, (), standstill=standstill)
    assert loop.more_in_motion() is more
    answer.verdict = "clean"
    assert not loop.more_in_motion()


def test_what_a_lag_changes_is_a_share_of_the_torque_where_the_joint_moves() -> None:
    torque = np.array([[3.0, 1.0], [-3.0, 1.0], [90.0, 1.0]])
    moving = np.array([[True, True], [True, True], [False, True]])
    piece: Any = SimpleNamespace(moving=moving, torque=torque)
    before, after = (SimpleNamespace(residuals=lambda _, v=value: [v + 0.0 * torque]) for value in (0.5, 0.2))
    changed = Validation((piece,), Any).changes(before, after)  # type: ignore[arg-type]
    np.testing.assert_allclose(changed, [0.1, 0.3])


def lag_of(confirmation: Confirmation, name: str, size: float) -> Any:
    one = finding(confirmation)
    one.effect, one.parameters = name, (SimpleNamespace(value=size, sigma=1e-5, shape=False),)
    return one


def test_nothing_is_clean_of_whose_torque_more_than_the_margin_is_unexplained() -> None:
    small, large = left(unexplained=(share(3, 0.049),)), left(unexplained=(share(3, 0.16), share(0, 0.01)))
    assert verdict_of([], small) == "clean"
    assert verdict_of([], large) == "unnamed"
    assert description("unnamed", large, ()).startswith("of the torque on data that was not fitted")
    assert "19 % of joint 4 unexplained" in description("unnamed", large, ())


def test_what_is_likelier_than_all_else_and_too_little_for_a_name_is_said() -> None:
    """Coulomb friction with 0.78 "followed no effect of the vocabulary"."""
    rest = replace(left(), more_than_noise=True, dependences=(ResidualDependence(0, 0.14, (("time", 0.0),)),))
    ranking: Any = [Candidate("coulomb_friction", (1,), 1.8, p, None) for p in (0.78, 0.5)]  # type: ignore[arg-type]
    assert description("unnamed", rest, ranking).startswith(
        "it may be coulomb friction (joint 1), probability 0.78, which is too little for a name; joint 1"
    )
    for none in ((), ranking[1:]):
        assert description("unnamed", rest, none).startswith(
            "the residual follows no effect of the vocabulary"
        )


@pytest.mark.parametrize(("verdict", "after"), [("clean", "unnamed"), ("named", "named")])
def test_nothing_is_clean_beside_a_gate_that_rejects(verdict: str, after: str) -> None:
    checks = tuple(
        ColumnCheck(f"torque of joint {k}", size, 0.05, None, size < 0.05)
        for k, size in ((1, 0.01), (4, 0.16))
    )
    rejected: Any = SimpleNamespace(passed=False, columns=checks)
    accepted: Any = SimpleNamespace(passed=True, columns=checks[:1])

    @dataclass(frozen=True)
    class Told:
        verdict: str
        description: str = ""

    told: Any = Told(verdict)
    assert beside_gate(told, rejected).verdict == after
    assert beside_gate(told, accepted) is told
    assert beside_gate(told, None) is told
    if verdict == "clean":
        assert "torque of joint 4: 16 %, margin 5 %" in beside_gate(told, rejected).description


def piece(residual: np.ndarray, period: int | None = None) -> Any:
    generator = np.random.default_rng(9)
    return SimpleNamespace(
        moving=np.ones(residual.shape, dtype=np.bool_),
        torque=10.0 * generator.normal(size=residual.shape),
        time=0.01 * np.arange(residual.shape[0]),
        period=period,
        thin=lambda columns: columns,
    )


def test_without_repeats_noise_is_what_differs_from_row_to_row() -> None:
    generator, time = np.random.default_rng(3), np.arange(4000)
    noise = generator.normal(size=(4000, 2))
    residual = noise + np.column_stack([2.0 * np.sin(time / 40.0), np.zeros(4000)])
    first, second = unexplained_of([piece(residual)], [residual])
    assert (first.joint, second.joint) == (0, 1), "worst joint first"
    assert first.noise == pytest.approx(0.1, rel=0.05)
    assert first.share == pytest.approx(np.sqrt(2.0) / 10.0, rel=0.1)
    assert 0.05 < first.least < first.share
    assert second.least == 0.0, "noise alone is nothing unexplained"


def accepted(
    name: str,
    linear: list[float],
    sigma: list[float],
    shape: tuple[float, ...] = (),
    spread: tuple[float, ...] = (),
    size: float = 0.0,
    said: str | None = None,
) -> Accepted:
    robot, family = robots.load("tx40"), family_named(name)
    place = Place("drive", (1,))
    chosen = shape or tuple(one.grid[0] for one in family.shapes(robot, place))
    model = RegressorModel.of(robot)
    effect = family.effect(robot, place, chosen, Present(model, model.prior()))
    return Accepted(
        robot,
        Component(family, place, chosen),
        Basis(0.0, 100.0, 30.0, 1.0, (), (), unsure=said),
        effect,
        np.array(linear),
        np.array(sigma),
        np.array(spread or (0.0,) * len(chosen)),
        np.ones(len(linear), dtype=np.bool_),
        size,
        lambda: np.zeros(len(linear) + len(chosen)),
    )


def test_no_name_whose_deviation_exceeds_what_makes_it_that_effect() -> None:
    assert not accepted("nonlinear_viscous_friction", [2.0, 0.0], [0.3, 0.4], (2.0,), (0.2,)).unsure
    size = accepted("nonlinear_viscous_friction", [0.2, 3.0], [0.7, 0.1], (2.0,), (0.2,))
    assert size.unsure == "Fn2 is 0.2 ± 0.7 N·m, which may as well be nothing"
    power = accepted("nonlinear_viscous_friction", [2.0, 0.0], [0.3, 0.4], (0.2,), (3.0,))
    assert "power is 0.2 ± 3, which may as well be" in power.unsure


def test_what_a_search_says_of_its_own_sizes_comes_first() -> None:
    """Of a drift that a short recording shows part of, another fit has 27 ± 330 N·m, the search 27 ± 1."""
    loose = [[0.2, 3.0], [0.7, 0.1], (2.0,), (0.2,)]
    assert not accepted("nonlinear_viscous_friction", *loose, said="").unsure  # type: ignore[arg-type]
    clear = [[2.0, 0.0], [0.3, 0.4], (2.0,), (0.2,)]
    asked = accepted("nonlinear_viscous_friction", *clear, said="Fn2 is 1 ± 1 N·m")  # type: ignore[arg-type]
    assert asked.unsure == "Fn2 is 1 ± 1 N·m"


def test_an_effect_may_be_there_as_a_whole_though_none_of_its_parameters_is_sure() -> None:
    """By 95 % of as many deviations as two parameters and two shapes make: 3.08."""
    shared = "static_friction", [0.56, 2.1], [0.35, 1.6], (0.01, 4e-5), (0.005, 1e-5)
    assert accepted(*shared).unsure.startswith("Fbreak2 is 0.56 ± 0.35")
    assert accepted(*shared, size=0.33).unsure
    assert not accepted(*shared, size=0.32).unsure
    essential = accepted("nonlinear_viscous_friction", [0.2, 3.0], [0.7, 0.1], (2.0,), (0.2,), 0.01)
    assert essential.unsure


def test_what_the_shapes_alone_make_is_nearer_to_all_than_to_nothing() -> None:
    """A soft gear beside the soft one had 0.06 ± 0.02 of its torque, which was told from nothing."""
    stiff = (1.7e-4, 0.1)
    part = accepted("joint_elasticity", [0.06], [0.02], stiff, said="")
    assert part.unsure == "of what its compliance and damping_ratio make the fitted recordings show 6 ± 2 %"
    assert accepted("joint_elasticity", [0.06], [0.02], stiff).unsure == part.unsure
    for share, sigma in ((0.06, 0.3), (0.82, 0.05), (0.45, 0.03)):
        assert not accepted("joint_elasticity", [share], [sigma], stiff, said="").unsure
    assert not accepted("viscous_friction", [0.06], [0.02], said="").unsure


def test_of_an_effect_with_no_essential_parameter_the_surest_counts() -> None:
    assert not accepted("asymmetric_friction", [0.1, 2.0], [0.4, 0.2]).unsure
    for surest in (0, 1):
        values, names = [0.05, 0.05], ("dFv2", "dFc2")
        values[surest] = 0.3
        found = accepted("asymmetric_friction", values, [0.2, 0.2])
        assert found.unsure.startswith(found.placed.parameters[surest].name)
        assert {one.name for one in found.placed.parameters} == set(names)
