"""Friction at standstill of no law that is known here: it is no finding, and no finding hides in it."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from drivers.simulated.scenario import Scenario
from ident import Recording
from ident.discrepancy.by_evidence import in_loop as module
from ident.discrepancy.by_evidence.reversals import posed_in_loop
from ident.discrepancy.loop import FINE, added, repeated
from ident.discrepancy.step import LoopStep
from ident.effects import FrictionSign
from ident.effects.family import Place
from ident.effects.scales import dry_friction
from ident.effects.simulated import FrictionTorque, SimulatedParts
from tests.ident.discrepancy.blind_search import hidden
from tests.ident.discrepancy.by_evidence.reversal_search import in_loop, looking, of_recording

WIDTH = 0.02
"""m/s over which a part of the friction of the arm that creeps turns its sign; the rest sticks."""
NOISE = 0.02
"""Of the control signal's, relative to its deviation in the recording that the arm is made of."""


@cache
def clean() -> LoopStep:
    return in_loop(Scenario())


@cache
def creeping() -> LoopStep:
    """The clean arm's loop with a third of its dry friction turning its sign slowly."""
    loop = clean().examination.loop
    row = loop.robot.transmission_matrix[0]
    size = dry_friction(loop.robot, Place("drive", (0,))) / 3.0 * row
    (own,) = loop.standstill
    slow = (FrictionTorque(row, size, FrictionSign("tanh", WIDTH)), FrictionTorque(row, -size, own))
    (run,) = loop.loop.run(added(loop.parts, SimulatedParts(friction=slow)), FINE)
    (piece,) = loop.loop.prepared
    before, random = piece.recording, np.random.default_rng(1)
    signal = repeated(run.control_signal, piece)
    signal = signal + NOISE * signal.std() * random.standard_normal(signal.shape)
    position = repeated(run.position, piece)
    return of_recording(Recording("creeping", before.time, before.reference, position, signal))


def told_of(step: LoopStep) -> Any:
    search = looking(step)
    search.course.reversing = step
    search.look_again([])
    return search


def test_an_arm_whose_friction_creeps_is_no_other_arm() -> None:
    assert "at joint 1" in module._otherwise(posed_in_loop(creeping()))
    told = told_of(creeping())
    assert not told.unnamed
    assert told.note == module.ANY_LAW
    assert told.standstill != clean().examination.loop.standstill, "the gate is asked with this one's"


def test_a_law_that_is_known_needs_no_other() -> None:
    told = told_of(clean())
    assert not told.unnamed and not told.note


def test_what_no_law_explains_is_told() -> None:
    """Friction that builds up over ways on which the drive has long been moving."""
    step = in_loop(hidden({"hysteresis": [{"drive": 1, "torque": 4.0, "displacement": 0.01}]}))
    told = told_of(step)
    assert "at joint 1" in told.unnamed and not told.note
