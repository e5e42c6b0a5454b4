"""One axis with each part that an effect can have, against its differential equation solved by scipy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import robots
from ident import IdentificationError, Recording, RegressorModel
from ident.closed_loop import SimulatedRun, simulate
from ident.closed_loop.control_law import ControlLaw
from ident.effects import FrictionSign, State
from ident.effects.family import Place, StandardParameter
from ident.effects.simulated import (
    Bristle,
    DriveChange,
    FrictionTorque,
    GearError,
    GearSpring,
    PositionTorque,
    SimulatedParts,
    SoftConstraint,
    Table,
)
from robots.description import Robot

PERIOD = 0.001
MASS, VISCOUS, COULOMB, WIDTH, LINK = 95.0, 200.0, 20.0, 0.01, 40.0
"""kg, N·s/m, N, m/s; LINK kg of the mass are the link's, the rest is the rotor's."""
ONE = np.ones(1)


def axis() -> Robot:
    robot = robots.load("emps")
    settings = robot.identification.model_copy(update={"friction_sign": "tanh", "friction_width": WIDTH})
    controller = robot.controller.model_copy(
        update={"delay_samples": 0, "velocity_difference_samples": 1, "interpolation": "hold"}
    )
    return robot.model_copy(update={"identification": settings, "controller": controller})


EMPS = axis()
GAIN = float(EMPS.gains[0])


@dataclass(frozen=True)
class Fixed:
    """An effect that is some simulated parts."""

    parts: SimulatedParts
    name = "fixed"
    sentence = "parts as they are"
    parameters = (StandardParameter("fixed", Place("arm", ()), "fixed", "1"),)

    def columns(self, state: State) -> np.ndarray:
        return np.zeros((*state.velocity.shape, 1))

    def simulated(self, values: np.ndarray) -> SimulatedParts:
        return self.parts


def model_with(robot: Robot, *parts: SimulatedParts) -> tuple[RegressorModel, np.ndarray]:
    model = RegressorModel.of(robot)
    values = model.standard_parameters({"M1": LINK, "Ia1": MASS - LINK, "Fv1": VISCOUS, "Fc1": COULOMB})
    effects = tuple(Fixed(part) for part in parts)
    return replace(model, effects=(*model.effects, *effects)), np.append(values, np.ones(len(effects)))


@cache
def motion() -> Recording:
    time = np.arange(0.0, 0.6, PERIOD)
    reference = 0.02 * (1 - np.cos(2 * np.pi * 2.5 * time))[:, np.newaxis] * np.sin(9 * time)[:, np.newaxis]
    return Recording("motion", time, reference, reference.copy(), np.zeros(reference.shape))


def run(*parts: SimulatedParts) -> SimulatedRun:
    return simulate(*model_with(EMPS, *parts), motion(), substeps=20)


Rates = Callable[[float, np.ndarray, float], list[float]]


def solved(
    rates: Rates,
    states: int,
    seen: Callable[[np.ndarray], float] = lambda x: float(x[0]),
    sent: Callable[[list[float], float], float] = lambda past, ahead: past[-1],
    breaks: tuple[float, ...] = (),
) -> np.ndarray:
    """Positions at the samples: rates(t, state, control signal) between them, the control law at them.

    ``sent`` is the control signal that acts ``ahead`` s into a sample; it jumps at the ``breaks``.
    """
    recording = motion()
    assert recording.reference is not None
    law = ControlLaw(EMPS.controller, np.zeros(1), np.zeros(1))
    x, past, positions = np.zeros(states), [0.0] * 8, []
    previous = recording.reference[0]
    for instant, reference in zip(recording.time, recording.reference, strict=True):
        positions.append(seen(x))
        speed, previous = (reference - previous) / PERIOD, reference
        past.append(float(law.step(reference, speed, np.array([positions[-1]]))[0]))
        edges = (0.0, *breaks, PERIOD)
        for start, end in pairwise(edges):
            signal = sent(past, 0.5 * (start + end))
            x = solve_ivp(
                rates,
                (instant + start, instant + end),
                x,
                method="LSODA",
                args=(signal,),
                rtol=1e-8,
                atol=1e-11,
                max_step=2e-4,
            ).y[:, -1]
    return np.array(positions)


def friction(v: float) -> float:
    return VISCOUS * v + COULOMB * float(np.tanh(v / WIDTH))


def torque(parts: Callable[[float, float, float], float]) -> Rates:
    """An axis on which parts(t, q, v) acts besides."""
    return lambda t, x, u: [x[1], (GAIN * u - friction(x[1]) - parts(t, x[0], x[1])) / MASS]


def elastic(stiffness: float, damping: float, gap: float) -> Rates:
    def rates(t: float, x: np.ndarray, u: float) -> list[float]:
        stretch = x[2] - x[0]
        pressed = np.sign(stretch) * max(abs(stretch) - gap / 2, 0.0)
        touching = damping if abs(stretch) > gap / 2 else 0.0
        force = stiffness * pressed + touching * (x[3] - x[1])
        return [x[1], force / LINK, x[3], (GAIN * u - friction(x[3]) - force) / (MASS - LINK)]

    return rates


def giving_way(size: float, width: float, time: float) -> Rates:
    """A soft constraint: its force follows the acceleration that it makes."""

    def rates(t: float, x: np.ndarray, u: float) -> list[float]:
        rest = GAIN * u - friction(x[1])
        slow = (rest - size * x[1] / width) / (MASS + size * time / width)
        if abs(x[1] + time * slow) > width:
            slow = (rest - np.copysign(size, x[1] + time * slow)) / MASS
        return [x[1], slow]

    return rates


def dahl(size: float, length: float) -> Rates:
    def rates(t: float, x: np.ndarray, u: float) -> list[float]:
        acceleration = (GAIN * u - friction(x[1]) - size * x[2]) / MASS
        return [x[1], acceleration, (x[1] - abs(x[1]) * x[2]) / length]

    return rates


def kinematic(size: float, waves: float) -> Rates:
    """The encoder's coordinate q; the link is at q + size·sin(waves q)."""

    def rates(t: float, x: np.ndarray, u: float) -> list[float]:
        lever = 1 + size * waves * np.cos(waves * x[0])
        bend = -size * waves**2 * np.sin(waves * x[0]) * x[1] ** 2
        force = GAIN * u - friction(x[1]) - LINK * lever * bend
        return [x[1], force / (MASS - LINK + LINK * lever**2)]

    return rates


def lagging(lag: float) -> Rates:
    return lambda t, x, u: [x[1], (GAIN * x[2] - friction(x[1])) / MASS, (u - x[2]) / lag]


def curve(function: Callable[[np.ndarray], np.ndarray]) -> SimulatedParts:
    return SimulatedParts(position=(PositionTorque(ONE, ONE, Table.of(function, -0.1, 0.1)),))


def dry(law: object, **more: object) -> SimulatedParts:
    return SimulatedParts(friction=(FrictionTorque(ONE, 10.0 * ONE, law, **more),))  # type: ignore[arg-type]


SIGN = FrictionSign("tanh", WIDTH)
COURSE = Table.of(lambda t: np.exp(-t / 0.2), 0.0, 1.0)
OVER_Q = Table.of(lambda q: np.cos(60 * q), -0.1, 0.1)
PARTS: dict[str, tuple[SimulatedParts, Callable[[], np.ndarray]]] = {
    "spring": (curve(lambda q: 2e4 * q), lambda: solved(torque(lambda t, q, v: 2e4 * q), 2)),
    "contact": (
        curve(lambda q: 2e5 * np.maximum(q - 0.01, 0)),
        lambda: solved(torque(lambda t, q, v: 2e5 * max(q - 0.01, 0)), 2),
    ),
    "ripple": (
        curve(lambda q: 8 * np.sin(700 * q)),
        lambda: solved(torque(lambda t, q, v: 8 * np.sin(700 * q)), 2),
    ),
    "falling friction": (
        dry(lambda v: np.tanh(v / WIDTH) * np.exp(-((v / 0.05) ** 2))),
        lambda: solved(torque(lambda t, q, v: 10 * np.tanh(v / WIDTH) * np.exp(-((v / 0.05) ** 2))), 2),
    ),
    "pushing friction": (
        dry(SIGN, direction=1),
        lambda: solved(torque(lambda t, q, v: 10 * np.tanh(max(v, 0) / WIDTH)), 2),
    ),
    "friction over position": (
        dry(SIGN, position_row=ONE, curve=OVER_Q),
        lambda: solved(torque(lambda t, q, v: 10 * np.tanh(v / WIDTH) * np.cos(60 * q)), 2),
    ),
    "friction over time": (
        dry(SIGN, course=COURSE),
        lambda: solved(torque(lambda t, q, v: 10 * np.tanh(v / WIDTH) * np.exp(-t / 0.2)), 2),
    ),
    "bristle": (dry(Bristle(2e-3, "exponential")), lambda: solved(dahl(10.0, 2e-3), 3)),
    "soft constraint": (dry(SoftConstraint(0.02, 0.008)), lambda: solved(giving_way(10.0, 0.02, 0.008), 2)),
    "elastic gear": (
        SimulatedParts(springs=(GearSpring(0, 1 / 2e5, 200.0),)),
        lambda: solved(elastic(2e5, 200.0, 0.0), 4, lambda x: float(x[2])),
    ),
    "loose gear": (
        SimulatedParts(springs=(GearSpring(0, 1 / 2e6, 3000.0, 5e-4),)),
        lambda: solved(elastic(2e6, 3000.0, 5e-4), 4, lambda x: float(x[2])),
    ),
    "kinematic error": (
        SimulatedParts(errors=(GearError(0, Table.of(lambda q: 1e-4 * np.sin(500 * q), -0.1, 0.1)),)),
        lambda: solved(kinematic(1e-4, 500.0), 2),
    ),
    "gain": (
        SimulatedParts(drives=(DriveChange(0, gain=0.1),)),
        lambda: solved(torque(lambda t, q, v: 0.0), 2, sent=lambda past, ahead: 1.1 * past[-1]),
    ),
    "limit": (
        SimulatedParts(drives=(DriveChange(0, limit=1.0),)),
        lambda: solved(
            torque(lambda t, q, v: 0.0), 2, sent=lambda past, ahead: min(max(past[-1], -1.0), 1.0)
        ),
    ),
    "delay": (
        SimulatedParts(drives=(DriveChange(0, delay=0.0014),)),
        lambda: solved(
            torque(lambda t, q, v: 0.0),
            2,
            sent=lambda past, ahead: past[-2] if ahead > 0.0004 else past[-3],
            breaks=(0.0004,),
        ),
    ),
    "lag": (SimulatedParts(drives=(DriveChange(0, lag=0.003),)), lambda: solved(lagging(0.003), 3)),
}


@cache
def usual_motion() -> np.ndarray:
    return solved(torque(lambda t, q, v: 0.0), 2)


@pytest.mark.parametrize("steps", [1, 4])
def test_the_usual_axis_follows_its_equation(steps: int) -> None:
    """Steps of the controller's own sample time are short enough: a first-order step would miss by 2 %."""
    error = np.abs(simulate(*model_with(EMPS), motion(), substeps=steps).position[:, 0] - usual_motion())
    assert error.max() <= 5e-6 * np.abs(usual_motion()).max()


@pytest.mark.parametrize("name", PARTS)
def test_each_part_follows_its_equation(name: str) -> None:
    parts, reference = PARTS[name]
    change = run(parts).position[:, 0] - run().position[:, 0]
    expected = reference() - usual_motion()
    assert np.abs(expected).max() > 1e-6
    # What falls with speed is taken at the old velocity, so it is late by a step.
    share = 0.1 if name == "falling friction" else 0.03
    assert np.abs(change - expected).max() <= share * np.abs(expected).max()


def test_a_reading_that_is_late_is_late() -> None:
    """Late by a controller sample: the controller's own delay, seen by an encoder that is as late."""
    controller = EMPS.controller.model_copy(update={"delay_samples": 1})
    delayed = EMPS.model_copy(update={"controller": controller})
    there = simulate(*model_with(delayed), motion(), substeps=4)
    here = run_at(DriveChange(0, reading_delay=PERIOD))
    # Torque that comes late follows a late reference; a late reading shows the motion as much later.
    np.testing.assert_allclose(here.position, there.position, atol=1e-9)
    np.testing.assert_allclose(here.velocity, there.velocity, atol=1e-6)


def run_at(change: DriveChange) -> SimulatedRun:
    return simulate(*model_with(EMPS, SimulatedParts(drives=(change,))), motion(), substeps=4)


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        (SimulatedParts(drives=(DriveChange(0, lag=-1e-3),)), "drive 1 has a lag of -0.001 s"),
        (SimulatedParts(drives=(DriveChange(0, reading_delay=-1e-3),)), "position reading of drive 1"),
        (SimulatedParts(springs=(GearSpring(0, -1e-5),)), "the gear of drive 1 has a compliance of -1e-05"),
        (
            SimulatedParts(inertia=np.array([[-60.0]]), springs=(GearSpring(0, 1e-5),)),
            "the rotor inertia of drive 1 is -5",
        ),
        (
            SimulatedParts(links=np.array([[-60.0, *[0.0] * 9]]), springs=(GearSpring(0, 1e-5),)),
            "the identified mass matrix is not positive definite",
        ),
    ],
)
def test_parts_that_no_arm_has_are_refused(parts: SimulatedParts, message: str) -> None:
    with pytest.raises(IdentificationError, match=message):
        run(parts)


def test_friction_that_pushes_is_simulated() -> None:
    """A negative Coulomb friction, as an identification can give, as its equation has it."""
    model, values = model_with(EMPS)
    values[model.names.index("Fc1")] = -5.0
    position = simulate(model, values, motion(), substeps=20).position[:, 0]
    expected = solved(
        lambda t, x, u: [x[1], (GAIN * u - VISCOUS * x[1] + 5 * np.tanh(x[1] / WIDTH)) / MASS], 2
    )
    change, wanted = position - run().position[:, 0], expected - usual_motion()
    assert np.abs(change - wanted).max() <= 0.02 * np.abs(wanted).max()


def test_friction_that_lessens_friction_adds_up_with_it() -> None:
    model, values = model_with(EMPS)
    values[model.names.index("Fc1")] = COULOMB - 10.0
    less = run(dry(SIGN)), run(SimulatedParts(friction=(FrictionTorque(ONE, -10.0 * ONE, SIGN),)))
    np.testing.assert_allclose(
        less[1].position, simulate(model, values, motion(), substeps=20).position, atol=1e-13
    )
    values[model.names.index("Fc1")] = COULOMB + 10.0
    np.testing.assert_allclose(
        less[0].position, simulate(model, values, motion(), substeps=20).position, atol=1e-13
    )


def test_a_slipping_bristle_holds_like_a_spring_before_it_slips() -> None:
    slip = run(dry(Bristle(1.0, "slip")))  # 1 m until it slips: a spring of 10 N/m
    spring = run(curve(lambda q: 10.0 * q))
    assert (
        np.abs(slip.position - spring.position).max() <= 0.02 * np.abs(run().position - spring.position).max()
    )
    assert np.abs(run().position - spring.position).max() > 1e-7
