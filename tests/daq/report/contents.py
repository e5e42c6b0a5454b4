"""Contents of a report, made up: every verdict, names that do harm, a model of two estimates."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from daq.report.page import ReportContent
from ident.effects.family import Place, StandardParameter
from ident.results import Estimate, Identification, Parameter, TorqueTrace
from ident.verdicts import ColumnCheck, Gate, GateName, RevisedTest, Verdict
from robots.description import Robot

JOINTS = 6
INJECTION = "<script>alert('a & b')</script>\"><img src=x onerror=alert(1)>"
LONG_NAME = "ZZ3R_with_a_name_that_somebody_imported_from_a_very_long_column_heading"


def robot(joints: int, kind: str = "revolute") -> Robot:
    axis = {
        "name": "axis",
        "kind": kind,
        "position": (-3.0, 3.0),
        "velocity": 5.0,
        "acceleration": 20.0,
        "jerk": 400.0,
        "torque": 200.0,
    }
    drive = {
        "encoder_counts": 4096,
        "gear": 32.0,
        "control_signal": {"per_count": 0.001},
        "gain": 35.0,
        "gain_relative_uncertainty": 0.02,
        "dynamics": {"inertia": 0.3, "viscous": 8.0, "coulomb": 7.0},
    }
    ones = (1.0,) * joints
    return Robot.model_validate(
        {
            "format": 1,
            "name": "bench",
            "description": "six axes " + INJECTION,
            "urdf": "bench.urdf",
            "home": (0.0,) * joints,
            "joint": tuple(axis | {"name": f"axis_{j + 1}"} for j in range(joints)),
            "drive": tuple(drive | {"node_id": j + 1} for j in range(joints)),
            "transmission": tuple(tuple(float(i == j) for j in range(joints)) for i in range(joints)),
            "controller": {
                "type": "cascade_p_pi",
                "sample_time": 0.001,
                "position_gain": ones,
                "velocity_gain": ones,
                "integral_gain": ones,
                "velocity_feed_forward": ones,
                "saturation": ones,
            },
            "identification": {"cutoff_hz": 50.0, "decimation": 10},
        }
    )


def names(joints: int) -> list[str]:
    kinds = ("ZZ", "XX", "XY", "XZ", "YZ", "MX", "MY", "Fv", "Fc")
    found = [f"{kind}{j + 1}R" for j in range(joints) for kind in kinds]
    found[4] = LONG_NAME
    found[7] = f"Fv1{INJECTION}"
    return found[:50]


def estimate(method: str, joints: int, seed: int) -> Estimate:
    random = np.random.default_rng(seed)
    parameters = []
    for k, name in enumerate(names(joints)):
        value = float(random.normal() * 10.0 ** random.integers(-3, 2))
        sigma = abs(value) * float(random.uniform(0.002, 0.3)) + 1e-5
        expression = f"{name} + Ia{k} - 0.225·d4²·M{k} + " + " + ".join(f"YY{i}" for i in range(k % 9))
        leading = StandardParameter("ZZ", Place("joint", (k // 9,)), "rigid_body", "kg·m²")
        parameters.append(Parameter(name, value, sigma, "kg·m²", expression, leading))
    parameters[2] = replace(parameters[2], value=0.0, sigma=0.02)
    parameters[3] = replace(parameters[3], value=math.nan, sigma=math.nan)
    parameters[5] = replace(parameters[5], sigma=math.inf)
    parameters[6] = replace(parameters[6], sigma=0.0)
    return Estimate(
        method="iv" if method == "iv" else "ls",
        parameters=tuple(parameters),
        covariance=np.eye(len(parameters)),
        covariance_kind="AR-prewhitened",
        condition=142.3,
        relative_error_percent=7.334,
        relative_error_percent_per_joint=random.uniform(3, 12, joints),
        torque_rms=random.uniform(0.2, 3, joints),
        lag1_autocorrelation=random.uniform(0, 0.9, joints),
        iterations=3,
    )


def gates(verdict: Verdict, joints: int) -> tuple[Gate, ...]:
    random = np.random.default_rng(5)
    reached = {"exogenous": 3, "endogenous": 3, "instruments_invalid": 1, "not_testable": 0}[verdict]
    outcome = [verdict != "instruments_invalid", True, verdict == "exogenous"]

    def columns(low: float, high: float, limit: float, small_is_bad: bool = False) -> tuple[ColumnCheck, ...]:
        sizes = 10 ** random.uniform(np.log10(low), np.log10(high), len(names(joints)))
        return tuple(
            ColumnCheck(name, float(size), limit, None, bool((size <= limit) != small_is_bad))
            for name, size in zip(names(joints), sizes, strict=True)
        )

    departures = columns(0.002, 0.3 if verdict == "instruments_invalid" else 0.045, 0.05)
    first = tuple(replace(check, p_value=0.04) for check in departures)
    made: tuple[tuple[GateName, str, str, tuple[ColumnCheck, ...]], ...] = (
        ("instruments", "Π = I: every instrument is the regressor without its noise", "F", first),
        (
            "rank",
            "V̂ = 0: nothing is left of the regressors beside the instruments",
            "rank",
            columns(1e-6, 1, 1e-3),
        ),
        (
            "exogeneity",
            "γ = 0: the torque error does not depend on V̂",
            "F",
            columns(1e-9, 1, 0.001, small_is_bad=True),
        ),
    )
    return tuple(
        Gate(
            name=name,
            null=null,
            passed=outcome[k] if k < reached else None,
            statistic=1.37 if k < reached and name != "rank" else None,
            distribution=distribution,
            df=(48.0, 5294.0) if k < reached else None,
            p_value=(0.043, None, 2e-9)[k] if k < reached else None,
            detail="The largest departure would move no parameter by more than 0.4 σ." if k < reached else "",
            columns=checks if k < reached else (),
        )
        for k, (name, null, distribution, checks) in enumerate(made)
    )


def content(verdict: Verdict = "exogenous", joints: int = JOINTS, samples: int = 6000) -> ReportContent:
    random = np.random.default_rng(1)
    time = np.arange(samples, dtype=np.float64) * 0.01
    frequency = random.uniform(0.1, 0.6, joints)
    measured = 40 * np.sin(2 * np.pi * time[:, None] * frequency) * random.uniform(0.1, 2, joints)
    measured = measured + 6 * np.sign(np.cos(2 * np.pi * time[:, None] * frequency))
    predicted = measured + random.normal(0, 1, (samples, joints))
    least_squares = estimate("ls", joints, 2)
    testable = verdict != "not_testable"
    instrumental = None
    if testable:
        moved = [
            replace(p, value=p.value + 0.8 * p.sigma * float(random.normal()), sigma=1.2 * p.sigma)
            for p in least_squares.parameters
        ]
        instrumental = replace(least_squares, method="iv", parameters=tuple(moved))
    truth = {p.name: p.value + p.sigma * float(random.normal()) for p in least_squares.parameters}
    textbook = replace(gates("endogenous", joints)[2], columns=(), detail="i.i.d. errors.")
    return ReportContent(
        title=f"bench: identification {INJECTION}",
        robot=robot(joints),
        joint_names=tuple(f"axis_{j + 1}" for j in range(joints)),
        identification=Identification(
            robot="bench",
            rows=samples * joints,
            by_estimator={e.method: e for e in (least_squares, instrumental) if e is not None},
            instrumental_reason="" if testable else "the log has no position reference",
            test=RevisedTest(
                verdict=verdict,
                recommendation=f"Use the model for feed-forward & simulation. {INJECTION}",
                covariance="AR(2) per joint, prewhitened",
                gates=gates(verdict, joints),
            ),
            textbook=textbook if testable else None,
            trace=TorqueTrace(time, measured, predicted),
            warnings=("joint 4 stands still for 22 % of the record", INJECTION),
        ),
        truth=truth if testable else None,
        facts={"Seed": "7", "Cycle time": "4 ms", "Missed cycles": "0", "Capture": INJECTION},
    )
