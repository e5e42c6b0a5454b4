"""A catalogue with arms, nights, verdicts and baselines in it, as the service finds it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from daq.catalogue import arms, baselines, checks, findings, models, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.values import ArmIdentity, CatalogueParameter, NewFinding, NewModel

NAMES = ("ZZ1R", "Fv1", "Fc1", "off1")
UNITS = ("kg", "N·s/m", "N", "N")


def fill(catalogue: Catalogue, folder: Path, nights: int = 12) -> str:
    """One arm with a baseline and nights after it; the last one has found something. Returns its label."""
    rng = np.random.default_rng(0)
    report = folder / "report.html"
    report.write_text("<!DOCTYPE html><title>report</title><p>one report</p>", encoding="utf-8")
    identity = ArmIdentity("emps", (7,), "0" * 64, simulated=True)
    baseline = None
    for night in range(nights):
        run = runs.begin(
            catalogue, identity, "check", trajectory="ruckig, seed 0, 4.0 s", note="<script>alert(1)</script>"
        )
        values = np.array([95.1, 203.5, 20.4, -3.2]) * (1 + 1e-3 * rng.normal(size=4))
        if night == nights - 1:
            values[2] *= 1.2
        new = NewModel(
            method="ls",
            verdict="exogenous",
            recommendation="use least squares",
            gates={
                "gates": [_gate("instruments", 0.2), _gate("rank", None), _gate("exogeneity", None, None)]
            },
            rows=1000,
            relative_error_percent=4.1,
            torque_rms=(0.5,),
            effects=(),
            parameters=tuple(
                CatalogueParameter(n, float(v), 0.01, u) for n, v, u in zip(NAMES, values, UNITS, strict=True)
            ),
            covariance_kind="ar",
            covariance=np.eye(4) * 1e-4,
            settings={},
            sources=(),
            description_sha256="0" * 64,
            armhil="0.1.0",
            report=str(report),
        )
        model = models.add(catalogue, run.id, new)
        runs.finish(catalogue, run.id, "completed", facts={"missed_cycles": 0, "cycles": 1000})
        if baseline is None:
            baseline = baselines.accept(catalogue, model.id, "Ada", "first <b>run</b>", str(report))
            continue
        last = night == nights - 1
        checks.add(
            catalogue,
            run.id,
            "failed" if last else "ok",
            "Coulomb friction of joint 1 +20 %" if last else "nothing has moved",
            {
                "state": "changed" if last else "unchanged",
                "warnings": ["4 SYNC cycles were missed"] if last else [],
                "celsius": [21.0],
                "comparison": _comparison(last),
            },
            model_id=model.id,
            baseline_id=baseline.id,
        )
        if last:
            found = NewFinding(
                effect="coulomb_friction",
                joints=(1,),
                sentence="more Coulomb friction on joint 1",
                parameters=(),
                p_value=1e-9,
                gap_before=2.0,
                gap_after=0.2,
                held_out_gain=0.9,
            )
            findings.add(catalogue, run.id, (found,), model.id)
    return arms.every(catalogue)[0].label


def _comparison(changed: bool) -> dict[str, object]:
    """As a check keeps it."""
    test = {"name": "Wald", "null": "none", "statistic": 9.0, "distribution": "F(4, 9)", "df": [4, 9]}
    change = {
        "effect": "coulomb_friction",
        "joint": 1,
        "words": "Coulomb friction of joint 1",
        "size": 4.0,
        "sigma": 0.1,
        "unit": "N",
        "relative": 0.2,
        "torque_rms": [1.0],
        "alternatives": [],
        "kelvin": 10.0,
    }
    return {
        "state": "changed" if changed else "unchanged",
        "stage": "learning",
        "wald": {**test, "p_value": 1e-9},
        "between_runs": {**test, "p_value": 1e-9},
        "unexplained": None,
        "parameters": [],
        "changes": [change] if changed else [],
        "torque_change": [1.0],
        "torque_rms": [10.0],
        "torque_units": ["N"],
        "large": changed,
        "colder": 0.5,
        "usual": [],
        "course": {
            "chart": "Coulomb friction of joint 1",
            "unit": "%",
            "day": [0.0, 1.0, 2.0],
            "amount": [0.0, 0.3, 20.0 if changed else 0.2],
            "clean": [True, True, True],
            "low": -3.0,
            "high": 3.0,
        },
    }


def _gate(name: str, p_value: float | None, passed: bool | None = True) -> dict[str, object]:
    return {
        "name": name,
        "null": "nothing",
        "passed": passed,
        "statistic": 1.5 if passed else None,
        "distribution": "F",
        "df": [3.0, 100.0] if passed else None,
        "p_value": p_value,
        "detail": "fine",
        "columns": [{"column": "Fc1", "size": 0.1, "limit": 5.0, "p_value": None, "passed": True}],
    }
