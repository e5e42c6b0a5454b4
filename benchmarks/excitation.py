"""Excitation benchmark: how much 10 s of motion tell about the base parameters of two six-axis arms.

Defined so that figures compare between planners. 10 s, rows at 100 Hz, at rest nowhere required, no collision
term. Columns: ten per link in pin's order, then Ia (TX40 only), Fv, sign(q̇) and an offset per joint; base
columns are the first independent ones in that order. W has its rows divided by σ_j, G = WᵀW, C = G⁻¹.
Reported: cond(W), −log det(G)/p and tr C of the best motion of each seed, and their medians.

    python benchmarks/excitation.py --arm tx40 --family ruckig --seeds 5
    python benchmarks/excitation.py --ends rest --collision

``--ends rest`` makes the motion begin and end at rest in the middle of the travel, ``--collision`` keeps it
10 mm clear of itself and of a floor at the height of the base, at every instant: the cost of a motion that
can be driven. Processor seconds are of all processes together, wall seconds what the machine made of it.

The TX40's URDF is read from $ARMHIL_DATA, or ../shared/data beside the clone; the UR10's from the package
example-robot-data. An arm whose URDF is not there is left out, with the reason.
"""

from __future__ import annotations

import argparse
import os
import resource
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from importlib import metadata
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")  # many small solves are quicker on one thread

import numpy as np
import pinocchio
from joblib.externals.loky import get_reusable_executor

from robots.arrays import FloatArray, IntArray
from robots.description import Robot
from robots.loading import load, robot_from_text
from trajectories.constraints.collision import CollisionCheck
from trajectories.constraints.surroundings import Surroundings
from trajectories.constraints.torque import TorqueCheck
from trajectories.information.matrix import Criterion, Information, Objective
from trajectories.limits import Limits
from trajectories.motions.motion import Extremes, Motion, MotionState
from trajectories.motions.segments import Waypoint
from trajectories.search.fourier_search import FourierSearch
from trajectories.search.multi_start import best_of
from trajectories.search.optimise import WaypointSearch
from trajectories.search.problem import Check, ExcitationProblem

DURATION = 10.0
ROW_PERIOD = 0.01
CONDITION_CAP = 147.0
"""A little below 150: the search's rows are not at the times of the figures' rows."""

DEPENDENT = 0.02
"""A column of unit norm with less than this left beside those before it counts as dependent. The TX40's URDF
writes π/2 with few digits, which leaves 0.4 % of a column that its kinematics would make dependent."""

PUBLISHED = {
    "tx40": (
        ("log shipped with FIGAROH, scaled to 1000 rows", 2216, -9.57, 1.10),
        ("Fourier, minimum condition", 42, -7.47, 0.221),
        ("cubic spline, minimum condition", 43, -7.43, 0.230),
        ("Fourier, log det, condition ≤ 150", 150, -9.10, 0.168),
        ("ruckig, log det, condition ≤ 150", 150, -9.35, 0.147),
    ),
    "ur10": (
        ("Fourier, log det, condition ≤ 150", 150, -8.68, 0.227),
        ("ruckig, log det, condition ≤ 150", 149, -8.91, 0.178),
    ),
}
"""Earlier rows to compare with: cond(W), −log det(G)/p, tr C; CMA-ES, 8000 evaluations, one seed."""


@dataclass(frozen=True)
class Arm:
    """An arm as the benchmark defines it; arrays (n,).

    ``bodies`` describes the arm with bodies that can touch; its joints read ``shift`` less than ``model``'s.
    """

    model: pinocchio.Model
    limits: Limits
    sigma: FloatArray
    inertia: FloatArray | None
    viscous: FloatArray
    coulomb: FloatArray
    bodies: Callable[[], Robot]
    shift: FloatArray


@dataclass(frozen=True)
class BenchmarkRegressor:
    """The columns of the definition, less the dependent ones."""

    model: pinocchio.Model
    with_inertia: bool
    kept: IntArray

    def __call__(self, state: MotionState) -> FloatArray:
        """samples × joints × b."""
        return all_columns(self.model, self.with_inertia, state)[:, :, self.kept]


def all_columns(model: pinocchio.Model, with_inertia: bool, state: MotionState) -> FloatArray:
    """samples × joints × p: links, then Ia, Fv, Fc and offset per joint."""
    samples, n = state.position.shape
    joints = np.arange(n)
    links = 10 * n
    per_joint = [state.acceleration] if with_inertia else []
    per_joint += [state.velocity, np.sign(state.velocity), np.ones_like(state.velocity)]
    columns = np.zeros((samples, n, links + len(per_joint) * n))
    data = model.createData()
    for k in range(samples):
        q, v, a = state.position[k], state.velocity[k], state.acceleration[k]
        columns[k, :, :links] = pinocchio.computeJointTorqueRegressor(model, data, q, v, a)
    for group, values in enumerate(per_joint):
        columns[:, joints, links + group * n + joints] = values
    return columns


def first_independent(columns: FloatArray) -> IntArray:
    """Indices of the columns that do not depend on those before them."""
    rows = columns.reshape(-1, columns.shape[2])
    norms = np.linalg.norm(rows, axis=0)
    unit = rows / np.where(norms > 1e-9 * norms.max(), norms, np.inf)
    left = np.abs(np.diag(np.linalg.qr(unit, mode="r")))
    return np.flatnonzero(left > DEPENDENT).astype(np.int64)


def tx40() -> Arm:
    """The TX40 of the recorded data, with the published drive figures."""
    data = Path(os.environ.get("ARMHIL_DATA", Path(__file__).resolve().parents[2] / "shared" / "data"))
    urdf = data / "tx40" / "tx40_mdh_modified.urdf"
    if not urdf.is_file():
        raise FileNotFoundError(f"no {urdf.name} in {data / 'tx40'} ($ARMHIL_DATA says where)")
    model = pinocchio.buildModelFromUrdf(str(urdf))
    centre = np.array([0.0, -np.pi / 2, np.pi / 2, 0.0, 0.0, 0.0])
    half = np.array([3.0, 2.1, 2.3, 4.0, 2.0, 4.0])
    velocity = 0.9 * np.array([5.0, 5.0, 7.5, 7.1, 5.5, 12.2])
    return Arm(
        model,
        arm_limits(model, centre, half, velocity, acceleration=20.0, jerk=400.0),
        sigma=np.array([3.05, 3.87, 2.31, 0.89, 1.6, 0.94]),
        inertia=np.array([0.362, 0.507, 0.0829, 0.0341, 0.0361, 0.0114]),
        viscous=np.array([7.94, 5.69, 1.98, 1.11, 1.60, 0.69]),
        coulomb=np.array([6.98, 7.83, 6.19, 2.41, 3.41, 1.83]),
        bodies=lambda: load("tx40"),
        shift=centre,
    )


def ur10() -> Arm:
    """The UR10 of example-robot-data."""
    try:
        files = metadata.files("example-robot-data") or []
    except metadata.PackageNotFoundError as error:
        raise FileNotFoundError("the package example-robot-data is not installed") from error
    urdf = next((file for file in files if file.name == "ur10_robot.urdf"), None)
    if urdf is None:
        raise FileNotFoundError("example-robot-data has no ur10_robot.urdf")
    model = pinocchio.buildModelFromUrdf(str(urdf.locate()))
    friction = np.array([15.0, 15.0, 10.0, 3.0, 3.0, 3.0])
    centre = np.array([0.0, -1.57, 0.0, 0.0, 0.0, 0.0])
    half = np.array([3.1, 1.5, 2.6, 3.1, 3.1, 3.1])
    return Arm(
        model,
        arm_limits(model, centre, half, 0.95 * model.velocityLimit, acceleration=10.0, jerk=150.0),
        sigma=0.01 * model.effortLimit,
        inertia=None,
        viscous=friction,
        coulomb=friction,
        bodies=lambda: ur10_bodies(Path(str(urdf.locate())), model),
        shift=np.zeros(6),
    )


def ur10_bodies(urdf: Path, model: pinocchio.Model) -> Robot:
    """The UR10 as a description; all that counts here are its names and the bodies of its URDF."""
    names = list(model.names)[1:]
    lines = [f'format = 1\nname = "ur10"\ndescription = "UR10"\nurdf = "{urdf.name}"\nhome = {[0.0] * 6}']
    lines.append(f"transmission = {np.eye(6).tolist()}")
    for name, speed in zip(names, model.velocityLimit, strict=True):
        lines.append(
            f'[[joint]]\nname = "{name}"\nposition = [-3.1, 3.1]\nvelocity = {speed}\n'
            "acceleration = 10.0\njerk = 150.0\ntorque = 50.0"
        )
    lines += [
        f"[[drive]]\nnode_id = {k + 1}\nencoder_counts = 4096\ngear = 100.0\ngain = 10.0\n"
        "gain_relative_uncertainty = 0.02\ncontrol_signal = { per_count = 0.01 }\n"
        "dynamics = { inertia = 0.0, viscous = 0.0, coulomb = 0.0 }"
        for k in range(6)
    ]
    lines.append(
        f'[controller]\ntype = "pd"\nsample_time = 0.001\nposition_gain = {[50.0] * 6}\n'
        f"velocity_gain = {[5.0] * 6}\nintegral_gain = {[0.0] * 6}\nvelocity_feed_forward = {[0.0] * 6}\n"
        f"saturation = {[100.0] * 6}\n[identification]\ncutoff_hz = 20.0\n"
    )
    robot = robot_from_text("\n".join(lines), urdf.parent / "robot.toml")
    # Its meshes are named from the folder above the package.
    share = next(parent for parent in urdf.parents if parent.name == "share")
    return robot.model_copy(update={"folder": share, "urdf": str(urdf.relative_to(share))})


@dataclass(frozen=True)
class Shifted:
    """A motion whose joints read ``shift`` (n,) less."""

    motion: Motion
    shift: FloatArray

    @property
    def duration(self) -> float:
        """s."""
        return self.motion.duration

    @property
    def joints(self) -> int:
        """n."""
        return self.motion.joints

    def at(self, time: FloatArray) -> MotionState:
        """The state at each time."""
        state = self.motion.at(time)
        return replace(state, position=state.position - self.shift)

    def breaks(self) -> FloatArray:
        """As the motion's."""
        return self.motion.breaks()

    def extremes(self) -> Extremes:
        """As the motion's, shifted."""
        extremes = self.motion.extremes()
        return replace(extremes, lowest=extremes.lowest - self.shift, highest=extremes.highest - self.shift)


@dataclass(frozen=True)
class ShiftedCollision:
    """The collision check of an arm whose joints read differently."""

    check: CollisionCheck
    shift: FloatArray

    def allows(self, motion: Motion) -> bool:
        """Whether a motion is proven to keep the clearance."""
        return self.check.allows(Shifted(motion, self.shift))

    def excess(self, motion: Motion) -> float:
        """How much of the clearance is missing, m."""
        return self.check.excess(Shifted(motion, self.shift))

    def require(self, motion: Motion) -> None:
        """Raise where the clearance is not kept."""
        self.check.require(Shifted(motion, self.shift))


def arm_limits(
    model: pinocchio.Model,
    centre: FloatArray,
    half: FloatArray,
    velocity: FloatArray,
    acceleration: float,
    jerk: float,
) -> Limits:
    """Limits of the definition, with the URDF's efforts at joints and at drives."""
    effort = model.effortLimit.copy()
    return Limits(
        names=tuple(model.names[1:]),
        lower=centre - half,
        upper=centre + half,
        velocity=velocity,
        acceleration=np.full(model.nv, acceleration),
        jerk=np.full(model.nv, jerk),
        torque=effort,
        drive_torque=effort,
    )


ARMS = {"tx40": tx40, "ur10": ur10}


def problem_of(arm: Arm, criterion: Criterion, at_rest: bool, collision: bool) -> ExcitationProblem:
    """The benchmark's definition as the planner's problem."""
    n, with_inertia = arm.model.nv, arm.inertia is not None
    inertia = arm.inertia if arm.inertia is not None else np.zeros(n)
    kept = first_independent(all_columns(arm.model, with_inertia, random_state(arm.limits)))
    checks: list[Check] = [TorqueCheck(arm.model, np.eye(n), inertia, arm.viscous, arm.coulomb, arm.limits)]
    if collision:
        checks.append(ShiftedCollision(CollisionCheck(arm.bodies(), Surroundings(floor=0.0)), arm.shift))
    rest = Waypoint.at_rest((arm.limits.upper + arm.limits.lower) / 2) if at_rest else None
    return ExcitationProblem(
        regressor=BenchmarkRegressor(arm.model, with_inertia, kept),
        sigma=arm.sigma,
        prior=np.zeros(len(kept)),  # torque is left to the check, which has the true links
        limits=arm.limits,
        duration=DURATION,
        start=rest,
        goal=rest,
        objective=Objective(criterion, condition_cap=CONDITION_CAP),
        slow_passes=True,
        checks=tuple(checks),
    )


def random_state(limits: Limits) -> MotionState:
    """Random states within the limits, to see which columns depend on each other."""
    generator = np.random.default_rng(0)
    shape = (200, limits.n)
    bounds = (limits.velocity, limits.acceleration, limits.jerk)
    return MotionState(
        generator.uniform(limits.lower, limits.upper, shape),
        *(generator.uniform(-1, 1, shape) * bound for bound in bounds),
    )


def figures(motion: Motion, problem: ExcitationProblem) -> tuple[float, float, float]:
    """cond(W), −log det(G)/p and tr C of a motion from its rows at 100 Hz."""
    state = motion.at(np.arange(0.0, motion.duration, ROW_PERIOD))
    rows = (problem.regressor(state) / problem.sigma[:, np.newaxis]).reshape(-1, len(problem.prior))
    information = Information(rows.T @ rows)
    return information.condition, information.log_det, information.trace


def run(arm: str, options: argparse.Namespace) -> Iterator[str]:
    """The table of one arm, line by line as it comes."""
    problem = problem_of(ARMS[arm](), options.criterion, options.ends == "rest", options.collision)
    ends = "at rest at both ends" if options.ends == "rest" else "ends free"
    kept = ends + (", clear of itself and the floor" if options.collision else "")
    trials = f"{options.searches} × {options.evaluations} evaluations"
    columns = len(problem.prior)
    yield f"\n{arm}: {columns} base columns, {trials}, {options.criterion} with condition ≤ 150, {kept}"
    yield "| motion | cond W | −log det(G)/p | tr C | processor s | wall s |"
    yield "|---|---|---|---|---|---|"
    for name, *earlier in PUBLISHED[arm]:
        yield "| {} (earlier) | {} | {:.2f} | {:.3f} | | |".format(name, *earlier)
    for family in options.family:
        results = []
        for seed in range(options.seeds):
            begin, began = processor_seconds(), time.perf_counter()
            motion = planned(problem, family, seed, options)
            wall = time.perf_counter() - began
            results.append((*figures(motion, problem), processor_seconds() - begin, wall))
            yield row(f"{family}, seed {seed}", results[-1])
        yield row(f"**{family}, median of {options.seeds}**", tuple(np.median(results, axis=0).tolist()))


def planned(problem: ExcitationProblem, family: str, seed: int, options: argparse.Namespace) -> Motion:
    """The best motion of one seed."""
    kind = WaypointSearch if family == "ruckig" else FourierSearch
    seeds = np.random.SeedSequence(seed).generate_state(options.searches)
    searches = [kind(problem, int(s), options.evaluations) for s in seeds]
    best, _ = best_of(searches, options.workers)
    get_reusable_executor().shutdown(wait=True)  # workers' processor time is known once they have ended
    return best.finished()


def processor_seconds() -> float:
    """Of this process and of the workers that have ended."""
    own, children = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return own.ru_utime + own.ru_stime + children.ru_utime + children.ru_stime


def row(name: str, result: tuple[float, ...]) -> str:
    """One line of the table."""
    return "| {} | {:.1f} | {:.3f} | {:.4f} | {:.0f} | {:.0f} |".format(name, *result)


def main() -> None:
    """Run what the command line asks for and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--arm", nargs="+", choices=tuple(ARMS), default=tuple(ARMS))
    parser.add_argument("--family", nargs="+", choices=("ruckig", "fourier"), default=("ruckig", "fourier"))
    parser.add_argument("--criterion", choices=("determinant", "trace"), default="determinant")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--evaluations", type=int, default=12_000, help="of each search")
    parser.add_argument("--searches", type=int, default=2, help="independent searches per seed")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    parser.add_argument("--ends", choices=("free", "rest"), default="free")
    parser.add_argument("--collision", action="store_true", help="clear of itself and of the floor")
    options = parser.parse_args()
    for arm in options.arm:
        try:
            for line in run(arm, options):
                print(line, flush=True)
        except FileNotFoundError as error:
            print(f"\n{arm}: skipped, {error}")


if __name__ == "__main__":
    main()
