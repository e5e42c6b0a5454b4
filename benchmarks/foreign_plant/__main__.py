"""Write the logs, the description and the truth of one foreign arm."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import get_args

from benchmarks.foreign_plant import ARMS, NAMES, Settings, parse_effect, record
from benchmarks.foreign_plant.files import write_description, write_log, write_truth
from benchmarks.foreign_plant.settings import Friction, Law, Motion


def main() -> int:
    given = _arguments().parse_args()
    arm = ARMS[given.arm]
    settings = Settings(
        motion=given.motion,
        law=given.law,
        friction=given.friction,
        periods=given.periods,
        period=given.period,
        feed_forward=given.feed_forward,
        gain_error=given.gain_error,
        noise=given.noise,
    )
    try:
        effects = tuple(parse_effect(text, arm.n) for text in given.effect)
    except ValueError as error:
        print(error, file=sys.stderr)
        return 2
    out = Path(given.out)
    write_description(out, arm, settings)
    for part, name in enumerate(("fit", "validate")):
        write_log(out / f"{name}.csv", record(arm, settings, effects, given.seed, part))
    write_truth(out / "truth.json", arm, settings, effects, given.seed)
    print(f"{out}: {arm.name}, {'; '.join(e.words() for e in effects) or 'nothing hidden'}")
    return 0


def _arguments() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.foreign_plant",
        description=__doc__,
        epilog="effects: " + "; ".join(f"{name} ({size})" for name, size in NAMES.items()),
    )
    parser.add_argument("--out", required=True)
    parser.add_argument("--arm", choices=ARMS, default="compact6")
    parser.add_argument("--effect", action="append", default=[], metavar="NAME@JOINT=SIZE")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--motion", choices=get_args(Motion), default="waypoints")
    parser.add_argument("--law", choices=get_args(Law), default="p_pi")
    parser.add_argument("--friction", choices=get_args(Friction), default="tanh")
    parser.add_argument("--periods", type=int, default=3, help="1: the motion repeats nothing")
    parser.add_argument("--period", type=float, default=10.0, help="s")
    parser.add_argument("--feed-forward", type=float, default=1.0, help="share of the velocity")
    parser.add_argument("--gain-error", type=float, default=0.0, help="of the gains in robot.toml")
    parser.add_argument("--noise", type=float, default=1.0, help="factor")
    return parser


if __name__ == "__main__":
    sys.exit(main())
