"""The page of one diagnosis: what is missing, what it depends on, how sure, the gap before and after."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from daq.diagnosis.apart import TellingApart
from daq.diagnosis.blind_spots import BlindSpot
from daq.diagnosis.diagnosis_words import headline, recommendation, sentence_of, spaced
from daq.diagnosis.finding_view import FindingView, finding_view
from daq.diagnosis.gap_tables import gap_rows, gate_change
from daq.diagnosis.plots import loop_plots
from daq.diagnosis.ranking_table import candidate_rows
from daq.diagnosis.unexplained_table import unexplained_remarks, unexplained_rows
from daq.report.parameters import joint_heading
from daq.report.pictures import icon
from daq.report.power import power_map
from daq.report.templates import templates, write_page
from daq.text.numbers import significant
from ident.discrepancy import Diagnosis
from ident.discrepancy.before_after import Series
from ident.discrepancy.by_evidence.power.smallest import Smallest
from robots.description import Robot


@dataclass(frozen=True)
class DiagnosisContent:
    """Everything that the page shows."""

    title: str
    robot: Robot
    diagnosis: Diagnosis
    series: Series
    apart: tuple[TellingApart, ...] = ()
    blind: tuple[BlindSpot, ...] = ()
    facts: Mapping[str, str] = field(default_factory=dict)
    """How it was made, label → text, in the order shown."""
    power: tuple[Smallest, ...] | None = None
    terms: tuple[str, ...] = ()
    when: tuple[str, ...] = ()


_KIND = {
    "clean": "good",
    "named": "switch",
    "ambiguous": "unknown",
    "not_confirmed": "bad",
    "unnamed": "bad",
}


def write_diagnosis_page(path: Path, content: DiagnosisContent) -> None:
    """Write the page: one HTML file that needs no other file and no network.

    Raises:
        ReportError: the file cannot be written.
    """
    write_page(path, render_diagnosis(content))


def render_diagnosis(content: DiagnosisContent) -> str:
    """The page as text."""
    diagnosis, robot = content.diagnosis, content.robot
    joints = [joint_heading(j, joint.name) for j, joint in enumerate(robot.joint)]
    return (
        templates()
        .get_template("diagnosis.html.j2")
        .render(
            title=content.title,
            kind=_KIND[diagnosis.verdict],
            icon=icon(_KIND[diagnosis.verdict]),  # type: ignore[arg-type]
            verdict=spaced(diagnosis.verdict),
            headline=headline(diagnosis),
            recommendation=recommendation(diagnosis),
            findings=_findings(content, joints),
            gate=gate_change(content.series.checks[0], content.series.checks[-1]),
            torque=gap_rows(diagnosis.torque, joints, [joint.torque_unit for joint in robot.joint]),
            position=None
            if diagnosis.position is None
            else gap_rows(diagnosis.position, joints, [joint.unit for joint in robot.joint]),
            loop_reason=diagnosis.loop_reason,
            loop=loop_plots(diagnosis, joints, robot),
            quantities=[name for name, _ in diagnosis.dependences[0].shares],
            dependences=[
                (joints[place.joint], significant(place.rms), [_share(share) for _, share in place.shares])
                for place in diagnosis.dependences
            ],
            unrepeated=[item.sentence for item in diagnosis.unrepeated],
            unexplained=unexplained_rows(diagnosis, joints),
            remarks=unexplained_remarks(diagnosis),
            candidates=candidate_rows(diagnosis),
            rejected=[(sentence_of(f.words()), f.confirmation.reason) for f in diagnosis.rejected],
            blind=[spot.words() for spot in content.blind],
            terms=content.terms,
            when=content.when,
            power=None if content.power is None else power_map(content.robot, content.power),
            facts=content.facts,
        )
    )


def _findings(content: DiagnosisContent, joints: list[str]) -> list[FindingView]:
    apart = {item.number: item for item in content.apart}
    return [
        finding_view(k, found, content.robot, content.series, apart.get(k), joints)
        for k, found in enumerate(content.diagnosis.findings, start=1)
    ]


def _share(share: float) -> tuple[str, float]:
    """Text of a share of variance, and how dark its cell is (0 to 1)."""
    return (f"{100 * share:.0f}", round(min(max(share, 0.0), 1.0), 2))
