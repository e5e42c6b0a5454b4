"""Right descriptions of arms whose friction is another than described: is a first move ever refused?

    PYTHONPATH=. python benchmarks/first_friction.py [--seed 20261125] [--arms 2]

Each arm is a draw of its own at a posture of its own; Coulomb and viscous friction of all drives are a factor
times the described ones, and the gears wind up over an arc at each reversal before they slip. Ends with 2
where a first move is refused.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace

import robots
from robots import Robot
from tests.daq.session.wrong_arms import WrongArm
from tests.daq.session.wrong_descriptions import right_arm

FACTORS = (0.5, 0.75, 1.0, 1.25, 1.5)
WIND_UPS = {"tx40": (2e-5, 2e-3), "emps": (2e-6, 2e-5)}
"""By arm, rad or m: as the simulated arms have it, and one that takes much of a first move."""


def arm_of(robot: Robot, seed: int, factor: float, wind_up: float) -> WrongArm:
    """An arm with so much friction, rightly described but for it."""
    arm = right_arm(robot, seed)
    parameters = dict(arm.truth.parameters)
    for number, drive in enumerate(robot.drive, start=1):
        parameters[f"Fc{number}"] = factor * drive.dynamics.coulomb
        parameters[f"Fv{number}"] = factor * drive.dynamics.viscous
    return replace(arm, truth=replace(arm.truth, parameters=parameters, bristle_width=(wind_up,) * robot.n))


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--seed", type=int, default=20261125)
    parser.add_argument("--arms", type=int, default=2)
    given = parser.parse_args()
    print("| arm | wind-up | " + " | ".join(f"{factor:g} ×" for factor in FACTORS) + " |")
    print("|---|---|" + "---|" * len(FACTORS))
    refused = 0
    for name, wind_ups in WIND_UPS.items():
        robot = robots.load(name)
        for wind_up in wind_ups:
            cells = []
            for factor in FACTORS:
                arms = [arm_of(robot, given.seed + k, factor, wind_up) for k in range(given.arms)]
                found = [(arm.first_contact(), [str(finding) for finding in arm.findings]) for arm in arms]
                for where, words in found if any(where for where, _ in found) else ():
                    print(name, wind_up, factor, where, words, file=sys.stderr)
                bad = sum(bool(where) for where, _ in found)
                cells.append(f"{bad} of {given.arms}")
                refused += bad
            print(f"| {name} | {wind_up:g} | " + " | ".join(cells) + " |", flush=True)
    return 2 if refused else 0


if __name__ == "__main__":
    sys.exit(main())
