"""Size and power of the tests of exogeneity, by Monte Carlo.

A motion of harmonics gives the instruments Z; the measured motion deviates from it and gives X, both
through one filter. For size the deviation is a slow random motion, as of a tracking error that the simulation
does not know: V̂ is then correlated along time as the errors are, the hard case. For power it is encoder
noise.

Size: τ = Xβ + e, so that X is exogenous by construction; a test at 5 % should reject 5 %.
Power: τ = Zβ + e, so that the encoder's noise is in the errors too, through the parameters.

e is white or AR(1) on the rows, unlike from joint to joint in size. Each replicate has its own seed, in the
range that is printed. Shares come with their 95 % interval (Wilson).

    python benchmarks/exogeneity.py --arm one_axis --arm tx40 --replicates 500
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable
from dataclasses import dataclass

os.environ.setdefault("OMP_NUM_THREADS", "1")  # many small solves are quicker on one thread

import numpy as np
from scipy.signal import butter, lfilter, sosfiltfilt

import robots
from ident import BaseParameters, Recording, RegressorModel, base_parameters
from ident.covariances import covariance_named
from ident.exogeneity import GateSettings, TestedRows, WhiteRows, augmented_wald, textbook_test
from ident.exogeneity.instruments import instruments_gate
from ident.exogeneity.rank import rank_gate
from ident.exogeneity.revised import exogeneity_gate
from ident.preparation.observation import observed_columns
from ident.statistics.whitening import autoregressive_whitening
from ident.verdicts import Verdict
from robots.arrays import BoolArray, FloatArray, IntArray

LEVEL = 0.05
SEED = 20_000
DESIGNS = 4
"""Draws of the deviation; each is used for a quarter of the replicates."""

HARMONICS = 5
PERIOD = 5.0
DURATION = 10.0
RATE = 1000.0
ARMS = {"one_axis": "emps", "tx40": "tx40"}
ENCODER_NOISE = (1e-8, 3e-8, 1e-7, 3e-7, 1e-6)
"""rad or m, standard deviation; along the power curve."""

TRACKING = 1e-4
TRACKING_BAND = 3.0
"""rad or m, and Hz: the slow deviation of the measured motion."""

ERRORS = {"white": 0.0, "AR(1) 0.6": 0.6, "AR(1) 0.9": 0.9}
NO_KIND = "none"
KINDS = ("iid", "block", "hc", "hac", "ar", "bootstrap")


@dataclass(frozen=True)
class Design:
    """Regressor and instruments, samples × joints × b, and deviations of the error per joint."""

    names: tuple[str, ...]
    x: FloatArray
    z: FloatArray
    sigma: FloatArray

    @property
    def segment(self) -> IntArray:
        return np.zeros(self.x.shape[0], dtype=np.int64)

    @property
    def used(self) -> BoolArray:
        return np.ones(self.x.shape[:2], dtype=np.bool_)


def design(base: BaseParameters, noise: float, seed: int) -> Design:
    """A motion within the arm's limits, its instruments, and the regressor under encoder noise (rad or m).

    Without noise the measured motion deviates slowly.
    """
    robot = base.model.robot
    settings = robot.identification.model_copy(
        update={"cutoff_hz": 30.0, "decimation": 10, "trim_samples": (50, 50), "minimum_speed": 0.0}
    )
    time = np.arange(round(DURATION * RATE)) / RATE
    generator = np.random.default_rng(SEED)
    orders = np.arange(1, HARMONICS + 1)[:, np.newaxis]
    phase = generator.uniform(0.0, 2 * np.pi, size=(HARMONICS, robot.n))
    amplitude = generator.uniform(0.5, 1.0, size=(HARMONICS, robot.n)) / orders
    omega = 2 * np.pi / PERIOD * orders
    amplitude *= 0.6 * robot.velocity_limits / np.sum(omega * amplitude, axis=0)
    angle = omega[:, np.newaxis] * time[:, np.newaxis] + phase[:, np.newaxis]
    position = np.sum(amplitude[:, np.newaxis] * np.sin(angle), axis=0)
    deviation = np.random.default_rng(seed).normal(size=position.shape)
    measured = position + (noise * deviation if noise else TRACKING * slow(deviation))
    silent = np.zeros_like(position)
    z, x = (
        observed_columns(base, Recording("design", time, None, moved, silent), settings)
        for moved in (position, measured)
    )
    sigma = 0.05 * np.linalg.norm(z @ truth(base), axis=0) / np.sqrt(z.shape[0])
    return Design(base.names, x, z, sigma)


def slow(noise: FloatArray) -> FloatArray:
    """Low-pass of white noise, samples × joints, scaled to unit deviation."""
    sections = butter(2, TRACKING_BAND, fs=RATE, output="sos")
    smooth = sosfiltfilt(sections, noise, axis=0)
    return np.asarray(smooth / smooth.std(axis=0))


def truth(base: BaseParameters) -> FloatArray:
    """Parameters that the torque is made of: the arm's prior, friction included."""
    return np.asarray(base.regroup(base.model.prior()))


def errors(case: Design, correlation: float, generator: np.random.Generator) -> FloatArray:
    """AR(1) errors, samples × joints, of the design's deviations."""
    shocks = generator.normal(size=(case.x.shape[0] + 200, case.sigma.size))
    series = lfilter([np.sqrt(1 - correlation**2)], [1.0, -correlation], shocks, axis=0)[200:]
    return np.asarray(series * case.sigma)


def plain_rows(tested: TestedRows) -> WhiteRows:
    """Rows whitened as is usual: AR coefficients of the residuals as they are."""
    x = tested.regressor
    weight = 1.0 / tested.omega().sigma
    columns = (x * weight[:, np.newaxis]).reshape(-1, x.shape[2])
    solution = np.linalg.lstsq(columns, (tested.torque * weight).ravel(), rcond=None)[0]
    residual = tested.torque - x @ solution
    return tested.whitened(autoregressive_whitening(residual, tested.segment, tested.used, x.shape[2]))


def revised_verdict(tested: TestedRows, rows: WhiteRows, names: tuple[str, ...]) -> Verdict:
    """The gates in the order of :func:`ident.exogeneity.revised_test`, on rows that are white already."""
    settings = GateSettings(LEVEL)
    if not instruments_gate(tested, tested.omega(), rows, names, settings).passed:
        return "instruments_invalid"
    _, kept = rank_gate(rows, names)
    if kept.size == 0 or exogeneity_gate(rows, names, kept, LEVEL, "").passed:
        return "exogenous"
    return "endogenous"


def verdicts(case: Design, torque: FloatArray, kinds: tuple[str, ...], usual: bool) -> dict[str, bool]:
    """Which tests reject.

    Args:
        case: regressor and instruments.
        torque: samples × joints.
        kinds: covariances of the Wald test.
        usual: the textbook test on rows as they are usually whitened as well.
    """
    tested = TestedRows(torque, case.x, case.z, case.segment, case.used)
    rows = tested.whitened(tested.errors())
    verdict = revised_verdict(tested, rows, case.names)
    found = {
        "revised": verdict == "endogenous",
        "revised, gate 1 closed": verdict == "instruments_invalid",
        "textbook": textbook_test(rows, LEVEL).passed is False,
    }
    if usual:
        found["textbook, AR of the residuals"] = textbook_test(plain_rows(tested), LEVEL).passed is False
        found["textbook, i.i.d."] = textbook_test(tested.whitened(tested.omega()), LEVEL).passed is False
    for kind in kinds:
        test = augmented_wald(
            torque, case.x, case.z, tested.omega().sigma, case.segment, case.used, covariance_named(kind)
        )
        found[f"Wald, {kind}"] = test.rejects(LEVEL)
    return found


def wilson(hits: int, trials: int) -> tuple[float, float]:
    """95 % interval of a share."""
    share, z = hits / trials, 1.96
    centre = (share + z**2 / (2 * trials)) / (1 + z**2 / trials)
    half = z / (1 + z**2 / trials) * np.sqrt(share * (1 - share) / trials + z**2 / (4 * trials**2))
    return float(centre - half), float(centre + half)


Torque = Callable[[Design, FloatArray], FloatArray]


def exogenous(case: Design, beta: FloatArray) -> FloatArray:
    """Torque of the measured columns themselves."""
    return np.asarray(case.x @ beta)


def errors_in_variables(case: Design, beta: FloatArray) -> FloatArray:
    """Torque of the true motion."""
    return np.asarray(case.z @ beta)


def rejections(
    designs: list[Design],
    beta: FloatArray,
    torque: Torque,
    correlation: float,
    replicates: int,
    kinds: tuple[str, ...],
    usual: bool = True,
) -> dict[str, int]:
    """How often each test rejects."""
    counts: dict[str, int] = {}
    for index in range(replicates):
        case = designs[index % len(designs)]
        generator = np.random.default_rng(SEED + index)
        measured = torque(case, beta) + errors(case, correlation, generator)
        for name, rejected in verdicts(case, measured, kinds, usual).items():
            counts[name] = counts.get(name, 0) + rejected
    return counts


def report(title: str, counts: dict[str, int], replicates: int) -> None:
    """Rows of the table."""
    for name, hits in counts.items():
        low, high = wilson(hits, replicates)
        share = f"{100 * hits / replicates:.1f} [{100 * low:.1f}, {100 * high:.1f}]"
        print(f"| {title} | {name} | {share} |", flush=True)


def run(
    arm: str, replicates: int, kinds: tuple[str, ...], power: bool, usual: bool = True
) -> dict[tuple[str, str], int]:
    """Size, and power where it is asked for; returns the rejections by errors and test."""
    base = base_parameters(RegressorModel.of(robots.load(ARMS[arm])))
    beta = truth(base)
    designs = [design(base, 0.0, SEED + k) for k in range(DESIGNS)]
    shape = designs[0].x.shape
    print(
        f"\n{arm}: {shape[0]} samples, {shape[1]} joints, {shape[2]} columns; {replicates} replicates,",
        end="",
    )
    print(f" seeds {SEED} to {SEED + replicates - 1}; nominal {100 * LEVEL:g} %\n")
    print("| errors | test | rejects %, 95 % interval |\n|---|---|---|")
    found: dict[tuple[str, str], int] = {}
    for label, correlation in ERRORS.items():
        counts = rejections(designs, beta, exogenous, correlation, replicates, kinds, usual)
        report(label, counts, replicates)
        found |= {(label, name): hits for name, hits in counts.items()}
    for noise in ENCODER_NOISE if power else ():
        noisy = [design(base, noise, SEED + k) for k in range(DESIGNS)]
        counts = rejections(noisy, beta, errors_in_variables, 0.6, replicates, ())
        report(f"AR(1) 0.6 and encoder noise {noise:.2g}", counts, replicates)
    return found


def main() -> None:
    """Parse the command line and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--arm", action="append", choices=tuple(ARMS), help="default: both")
    parser.add_argument("--replicates", type=int, default=500)
    parser.add_argument(
        "--kind",
        action="append",
        choices=(*KINDS, NO_KIND),
        help="covariances of the Wald test; default: all",
    )
    parser.add_argument("--no-power", action="store_true", help="leave out the power curve")
    parser.add_argument("--no-usual", action="store_true", help="leave out the usual whitenings")
    options = parser.parse_args()
    kinds = tuple(kind for kind in options.kind or KINDS if kind != NO_KIND)
    for arm in options.arm or tuple(ARMS):
        run(arm, options.replicates, kinds, not options.no_power, not options.no_usual)


if __name__ == "__main__":
    main()
