"""The search by evidence on a plant of another engine: nothing, and an effect made of every torque."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.evidence.recorded import recorded
from ident.discrepancy.by_evidence import EvidenceAnswer, diagnose_by_evidence


def answer(data: Path, folder: Path, name: str) -> EvidenceAnswer:
    if not (data / "foreign").is_dir():
        pytest.skip(f"no logs of a foreign plant in {data}")
    return diagnose_by_evidence(recorded(data, folder)[name]().question())


@pytest.mark.slow
def test_a_clean_arm_is_called_clean(shared_data: Path, tmp_path: Path) -> None:
    found = answer(shared_data, tmp_path, "log_03")
    assert found.gate_one_rejected is False
    assert found.verdict == "clean"


@pytest.mark.slow
def test_what_an_effect_does_is_not_made_of_its_own_torque(shared_data: Path, tmp_path: Path) -> None:
    """A delay's column, made of a model with the delay in it, gave half of it and left the rest to others."""
    (finding,) = answer(shared_data, tmp_path, "log_01").findings
    assert finding.name == "time_delay" and finding.named
    assert finding.parameters[0].value == pytest.approx(-0.004475, rel=0.06)
