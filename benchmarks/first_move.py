"""Wrong descriptions drawn at random against simulated arms: where each is caught, and how far a joint went.

    PYTHONPATH=. python benchmarks/first_move.py [--seed 20261122] [--single 25] [--pairs 15] [--right 20]
        [--page benchmarks/first_move.md]

Each arm is a draw of its own at a posture of its own. Counted are descriptions that nothing catches and
joints that move more than 1°; and right descriptions that are refused. Every wrong one is tried twice: as
commissioning does it, and once more without the guards before torque (attestation, 608F, 6076, figures),
as if the arm stood at its zero and its drives said nothing of themselves.

Ends with 2 where a wrong description passes, a joint moves more than 1°, or a right one does not pass.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np

import robots
from tests.daq.session.wrong_arms import WrongArm
from tests.daq.session.wrong_descriptions import (
    Slip,
    before_torque,
    drive,
    per_count,
    position_sign,
    right_arm,
    shifted,
    swapped,
    torque_sign,
)

NAME = "tx40"
MOST = 1.0
"""Degrees."""
FACTORS = (0.1, 0.25, 0.4, 2.5, 4.0, 10.0)
"""Of gears, encoders, gains and scales."""
ZEROS = (0.05, 1.0)
"""rad that a zero is off by."""
NOTHING = "NOT CAUGHT"


def drawn(rng: np.random.Generator) -> Slip:
    """One slip in a description."""
    k, factor = int(rng.integers(6)), float(rng.choice(FACTORS))
    i, j = (int(axis) for axis in rng.choice(6, 2, replace=False))
    by = float(rng.choice((-1.0, 1.0)) * rng.uniform(*ZEROS))
    kinds: tuple[Callable[[], Slip], ...] = (
        lambda: (f"sign of drive {k + 1}", drive(k, "sign", -1)),
        lambda: (f"control_signal.sign of drive {k + 1}", torque_sign(k)),
        lambda: (f"sign of the positions of drive {k + 1}", position_sign(k)),
        lambda: (f"per_count of drive {k + 1} × {factor:g}", per_count(k, factor)),
        lambda: (f"nodes {i + 1} and {j + 1} swapped", swapped(i, j)),
        lambda: (f"gear of drive {k + 1} × {factor:g}", drive(k, "gear", factor)),
        lambda: (f"encoder_counts of drive {k + 1} × {factor:g}", drive(k, "encoder_counts", factor)),
        lambda: (f"zero of drive {k + 1} off by {by:.2f} rad", shifted(k, by)),
        lambda: (f"gain of drive {k + 1} × {factor:g}", drive(k, "gain", factor)),
    )
    return kinds[int(rng.integers(len(kinds)))]()


def cases(seed: int, single: int, pairs: int) -> list[Slip]:
    """Slips alone, then two of different kinds at once; none twice."""
    rng = np.random.default_rng(seed)
    found: dict[str, Callable[[WrongArm], WrongArm]] = {}
    while len(found) < single:
        words, slip = drawn(rng)
        found[words] = slip
    while len(found) < single + pairs:
        (one, first), (other, second) = drawn(rng), drawn(rng)
        if one.split(" of ")[0] != other.split(" of ")[0]:
            found[f"{one}; {other}"] = lambda arm, a=first, b=second: b(a(arm))  # type: ignore[misc]
    return list(found.items())


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--seed", type=int, default=20261122)
    parser.add_argument("--single", type=int, default=25)
    parser.add_argument("--pairs", type=int, default=15)
    parser.add_argument("--right", type=int, default=20)
    parser.add_argument("--page", type=Path)
    given = parser.parse_args()
    robot = robots.load(NAME)
    rows, where, alone, farthest = [], Counter[str](), Counter[str](), [0.0, 0.0]
    for number, (words, slip) in enumerate(cases(given.seed, given.single, given.pairs)):
        arm = slip(right_arm(robot, given.seed + number))
        caught = before_torque(arm) or arm.first_contact() or NOTHING
        blind = slip(right_arm(robot, given.seed + number))
        unseen = blind.first_contact() or NOTHING
        went = [float(np.degrees(one.farthest)) for one in (arm, blind)]
        farthest = [max(pair) for pair in zip(farthest, went, strict=True)]
        where[caught] += 1
        alone[unseen] += 1
        rows.append(f"| {words} | {caught} | {unseen} | {went[0]:.2f} | {went[1]:.2f} |")
        print(rows[-1], flush=True)
    refused = 0
    for number in range(given.right):
        arm = right_arm(robot, given.seed + 1000 + number)
        refused += bool(before_torque(arm) or arm.first_contact())
    text = page(given.seed, rows, where, alone, farthest, (refused, given.right))
    print(text)
    if given.page is not None:
        given.page.write_text(text, encoding="utf-8")
    return 2 if where[NOTHING] or max(farthest) > MOST or refused else 0


def page(
    seed: int,
    rows: list[str],
    where: Counter[str],
    alone: Counter[str],
    farthest: list[float],
    right: tuple[int, int],
) -> str:
    """Markdown."""
    return "\n".join(
        [
            "# Wrong descriptions at first contact",
            "",
            f"{len(rows)} wrong descriptions of a simulated {NAME}, drawn with seed {seed}, which nobody had",
            "looked at before; scored once. `python benchmarks/first_move.py` measures it.",
            "",
            f"- As commissioning does it: {_counts(where)}.",
            f"- In motion, without the guards before torque: {_counts(alone)}.",
            f"- Farthest that any joint really went: {farthest[0]:.2f}°, without them {farthest[1]:.2f}°.",
            f"- Right descriptions that were refused: {right[0]} of {right[1]}.",
            "",
            _PASSES,
            "",
            "| what is wrong | caught | without the guards before torque | farthest, ° | without, ° |",
            "|---|---|---|---|---|",
            *rows,
            "",
        ]
    )


_PASSES = """\
A gain that is off by a factor k scales every torque that is read and changes nothing else: the drive's loop
answers a following error in control signal, not in torque, so the arm moves as described. Only what a torque
can be compared with shows it. First the drive's own rated torque (6076) behind its gear, of which 0.4 to 1.2
times can be. What the drives say here is what a gear that passes on 60 to 95 % and a motor within 10 % of its
name plate would have them say, drawn for each drive. Where a drive does not say it, friction is left, known
to a factor of 2.8 before an identification; and gravity g, where (k - 1) |g| is more than
0.3 (|g| + friction) + 3 % of the torque limit: the mean of both directions is gravity only as far as friction
is the same in both, and a current sensor has an offset. So in motion alone some gains of 2.5 or 0.4 pass, as
the third column has them. At half a degree a second inertia asks for less than a hundredth of friction, and
tells nothing. Without the guards before torque, a zero that is off passes too where gravity hardly changes
with it."""


def _counts(found: Counter[str]) -> str:
    return ", ".join(f"{count} {words}" for words, count in found.most_common())


if __name__ == "__main__":
    sys.exit(main())
