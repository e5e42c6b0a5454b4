"""What a diagnosis is asked and what comes out."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from daq.diagnosis.apart import TellingApart
from daq.diagnosis.blind_spots import BlindSpot
from daq.diagnosis.more import More
from daq.identification.carried import Carried
from daq.importing.guess_log import GuessRequest
from ident.discrepancy import Diagnosis
from ident.discrepancy.before_after import Series
from ident.discrepancy.by_evidence import EvidenceAnswer
from ident.identification.found_effects import FoundModel
from robots import Robot


@dataclass(frozen=True)
class DiagnoseRequest:
    """What to look at.

    Attributes:
        fit: captures or logs to find and fit the effect on.
        validation: captures or logs to show the gap on; empty with ``split_half``.
        robot: name or path, or the arm itself; the first capture's own description where None.
        columns: a column map for logs; the robot's where None.
        split_half: take the first half of each record to fit and the second to validate.
        without: effects to leave out of the model that is examined.
        prior: an accepted model file, or ``cad``; None searches after a refit. Effects that the file has
            found are part of the model that is examined.
        out: folder for report, result and model file; nothing is written where None.
        cell: what stands around the arm, for the motion that tells candidates apart.
        evaluations: trials of the search for that motion; none is planned where 0.
        found: a model with found effects to examine where ``prior`` is no file.
        power: whether to say how small each effect would still have been named.
        guess: what a log is to be taken for by its URDF; None where its arm is described.
        carried: which recordings, of those to fit or to validate, were made with a known body on the arm.
    """

    fit: tuple[Path, ...]
    validation: tuple[Path, ...] = ()
    robot: str | Robot | None = None
    columns: Path | None = None
    split_half: bool = False
    without: tuple[str, ...] = ()
    prior: str | None = None
    out: Path | None = None
    cell: Path | None = None
    evaluations: int = 1500
    found: FoundModel | None = None
    power: bool = False
    guess: GuessRequest | None = None
    carried: tuple[Carried, ...] = ()


@dataclass(frozen=True)
class DiagnoseResult:
    """What came out.

    Attributes:
        robot: the arm, with the settings of the recordings.
        diagnosis: of the search.
        evidence: its names with probabilities, and what would still have been named.
        series: relative errors, gate 1 and pictures, before anything was found and after each finding.
        apart: what to do about each ambiguous finding; planned where results are written.
        blind: what these recordings could not have shown.
        content: what ``--json`` prints.
        folder: of the results; None where nothing was written.
        more: smallest sizes and terms.
        guessed: what a log was taken for, one sentence each.
        carried: what was found of bodies of which not all is known, one sentence each.
    """

    robot: Robot
    diagnosis: Diagnosis
    evidence: EvidenceAnswer
    series: Series
    apart: tuple[TellingApart, ...]
    blind: tuple[BlindSpot, ...]
    content: dict[str, Any]
    folder: Path | None
    more: More = field(default_factory=More)
    guessed: tuple[str, ...] = ()
    carried: tuple[str, ...] = ()
