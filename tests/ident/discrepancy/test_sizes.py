"""Sizes come back with deviations that count what is not known of the arm that they were found on."""

from __future__ import annotations

import numpy as np

import robots
from drivers.simulated import draw_truth
from drivers.simulated.drawing import exercise
from drivers.simulated.offline import simulate_offline
from drivers.simulated.scenario import Scenario
from ident import BaseParameters, Recording, identify
from ident.discrepancy import Prior, Question, accepted_noise, accepted_prior, diagnose
from ident.effects.vocabulary import family_named

TRUTH, DRIVE, AMPLITUDE = 502, 4, 4e-4


def test_a_ripple_of_a_gear_whose_links_are_known_to_a_tenth() -> None:
    """The torque is known to a twentieth; that it takes to move the links by the error is not."""
    robot = robots.load("tx40")
    truth = draw_truth(robot, TRUTH)

    def recorded(scenario: Scenario, motion: int, seed: int) -> Recording:
        path = exercise(robot, duration=8.0, seed=motion)
        run = simulate_offline(robot, truth, path, scenario=scenario, periods=2, seed=seed)
        return Recording("sizes", run.time, run.reference, run.position, run.control_signal)

    accepted = recorded(Scenario(), 0, 1)
    estimate = identify(robot, (accepted,)).result.recommended

    def prior(base: BaseParameters) -> Prior:
        noise = accepted_noise(base, (accepted,))
        return accepted_prior(base, estimate.values, estimate.covariance, noise=noise)

    hidden = Scenario.from_dict(
        {"format": 1, "gear_ripple": [{"drive": DRIVE, "amplitude": AMPLITUDE, "order": 2.0}]}
    )
    vocabulary = (family_named("gear_ripple"),)
    found = diagnose(
        Question(
            robot, (recorded(hidden, 0, 2),), (recorded(hidden, 1, 3),), vocabulary, prior, at_reversals=False
        )
    )
    (finding,) = found.findings
    assert (finding.effect, finding.joints) == ("gear_ripple", (DRIVE,))
    values = {parameter.name: (parameter.value, parameter.sigma) for parameter in finding.parameters}
    cos, sin = (np.array(values[f"gear_error_{wave}{DRIVE}"]) for wave in ("cos", "sin"))
    amplitude = float(np.hypot(cos[0], sin[0]))
    sigma = float(np.hypot(cos[0] * cos[1], sin[0] * sin[1])) / amplitude
    assert abs(amplitude - AMPLITUDE) < 3.0 * sigma
    assert 0.05 < sigma / AMPLITUDE < 0.15
    assert values["periods_per_turn"] == (2.0, 0.0)  # tried, not fitted
