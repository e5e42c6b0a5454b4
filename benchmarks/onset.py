"""When an effect began or ended, asked of its recording: the share of intervals that hold the instant.

One axis, two periods of 8 s, the arm accepted on a recording without the effect. Either a brake of the
simulated bench rubs until an instant, or a mass is taken up at one: its torque is put into the recording. The
effect is given its place and fitted over the whole recording, as after a search; then its onset is asked for.
Beside each a recording in which the friction is there all the time: no instant may be told.

    python -m benchmarks.onset --seed 52000 --scenarios 60
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from typing import Any

import numpy as np

import robots
from benchmarks.naming_report import share
from drivers.simulated.scenario import Scenario
from ident import Recording, identify
from ident.discrepancy import accepted_noise
from ident.discrepancy.by_evidence import accepted_prior
from ident.discrepancy.component import Component
from ident.discrepancy.onset import Onset, onset_of
from ident.discrepancy.prepared_recording import prepared_recordings
from ident.discrepancy.prior import extended, extended_prior
from ident.discrepancy.refine import refit
from ident.discrepancy.settings import searching
from ident.discrepancy.step import Step
from ident.effects.vocabulary import family_named
from ident.parameters.base import base_parameters
from ident.parameters.regressor import RegressorModel
from tests.ident.discrepancy.blind_search import hidden, recorded

ROBOT = robots.load("emps")
PERIOD = 8.0
MASS = 4.0
"""kg, of some 95."""


def onset(fit: Recording, accepted: Recording, effect: str) -> Onset | None:
    """Of an effect that is known to be there, against the accepted arm."""
    robot = searching(ROBOT, fit)
    estimate = identify(ROBOT, (accepted,)).result.recommended
    base = base_parameters(RegressorModel.of(robot))
    noise = accepted_noise(base, (accepted,))
    prior = accepted_prior(estimate.values, estimate.covariance, noise)
    prepared = prepared_recordings(robot, (fit,))
    step = Step.of(base, prepared, prior)
    family = family_named(effect)
    component = Component(family, family.places(robot)[0], ())
    refined = refit(step.examination, [component], step.present)
    whole = extended(base, refined.effects, refined.seen)
    more = extended_prior(prior, len(whole.names) - len(base.names))
    after = Step.of(whole, prepared, more, step.examination.whitening, base, simulated=False)
    return onset_of(after.examination, whole.columns_of_effects[-1][1])


def rubs_until(instant: float, rise: float = 0.3) -> Scenario:
    """A brake that lets go."""
    return hidden({"dragging_brake": [{"drive": 1, "rise": rise, "period": 200.0, "share": instant / 200.0}]})


def heavier_from(recording: Recording, instant: float) -> Recording:
    """A mass more from an instant on, in the control signal: no plant has it."""
    assert recording.reference is not None
    speed = np.gradient(recording.reference, recording.sample_time, axis=0)
    torque = MASS * np.gradient(speed, recording.sample_time, axis=0)
    torque *= (recording.time >= instant)[:, np.newaxis]
    return replace(recording, control_signal=recording.control_signal + torque / ROBOT.gains)


def scenario(seed: int) -> dict[str, Any]:
    """Both kinds of change and none, on one arm."""
    instant = float(np.random.default_rng([seed, 7]).uniform(1.0, 2 * PERIOD - 1.0))
    accepted = recorded(ROBOT, seed, Scenario(), 0, 10 * seed + 1, PERIOD)
    brake = recorded(ROBOT, seed, rubs_until(instant), 0, 10 * seed + 2, PERIOD)
    plain = recorded(ROBOT, seed, Scenario(), 0, 10 * seed + 3, PERIOD)
    always = recorded(
        ROBOT, seed, hidden({"coulomb_friction": [{"drive": 1, "change": 0.3}]}), 0, 10 * seed + 4, PERIOD
    )
    return {
        "seed": seed,
        "instant": instant,
        "brake": _line(onset(brake, accepted, "coulomb_friction")),
        "mass": _line(onset(heavier_from(plain, instant), accepted, "rotor_inertia")),
        "always": _line(onset(always, accepted, "coulomb_friction")),
    }


def _line(found: Onset | None) -> dict[str, Any] | None:
    if found is None:
        return None
    return {"kind": found.kind, "time": found.time, "interval": found.interval, "p": found.probability}


def main() -> None:
    """Run scenarios and print the figures."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--scenarios", type=int, default=20)
    asked = parser.parse_args()
    lines = []
    for seed in range(asked.seed, asked.seed + asked.scenarios):
        lines.append(scenario(seed))
        print(json.dumps(lines[-1]), flush=True)
    for kind, right in (("brake", "ends"), ("mass", "begins")):
        told = [(line["instant"], line[kind]) for line in lines if line[kind] is not None]
        steps = [(instant, found) for instant, found in told if found["kind"] != "drifts"]
        inside = [one["interval"][0] <= instant <= one["interval"][1] for instant, one in steps]
        width = np.median([one["interval"][1] - one["interval"][0] for _, one in steps])
        print(f"{kind}: told {share(line[kind] is not None for line in lines)},", end=" ")
        print(f"interval holds the instant {share(inside)}, median width {1e3 * width:.1f} ms,", end=" ")
        print(f"{right}: {share(one['kind'] == right for _, one in told)}")
    print(f"told though it is there all the time: {share(line['always'] is not None for line in lines)}")


if __name__ == "__main__":
    main()
