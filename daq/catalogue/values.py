"""What the catalogue hands out and takes in: frozen values, times in UTC, units SI."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any, Literal

from ident.effects.entry import EffectEntry
from robots.arrays import FloatArray, IntArray
from robots.errors import UserError
from robots.standard import torque_units_of

RunKind = Literal["demo", "plan", "check", "commission", "import", "run"]
RunState = Literal["running", "finished", "abandoned"]
"""``abandoned``: the process that made the run is gone and never said how it ended."""
RunOutcome = Literal["completed", "stopped", "aborted", "fault", "failed"]
"""Those of a stream, and ``failed`` where the run ended with an error before or after it."""
BaselineState = Literal["accepted", "rolled_back", "suspect"]


class CatalogueError(UserError):
    """The catalogue cannot be opened or does not hold what is asked for; one line for the user."""


class ArmMismatch(CatalogueError):
    """A file, or the drives on the bus, are of another arm; one line that names both sides."""


class LeaseHeld(CatalogueError):
    """Somebody else has the arm; one line that says who and until when."""


@dataclass(frozen=True)
class ArmIdentity:
    """By what an arm is known.

    Attributes:
        name: in its robot.toml.
        serials: of its drives in the order of the joints; None where a drive has none, () for a log.
        description_sha256: of its description: robot.toml, URDF and meshes (``robots.identity``).
        simulated: whether the drives are simulated ones.
        parts: of that description, checksums by name; empty where they are not known.
    """

    name: str
    serials: tuple[int | None, ...]
    description_sha256: str
    simulated: bool = False
    parts: Mapping[str, str] = field(default_factory=dict, compare=False, repr=False)


@dataclass(frozen=True)
class Arm:
    """One arm. ``label`` is its name, with a number behind it for the second and later of one name."""

    id: int
    label: str
    name: str
    serials: tuple[int | None, ...]
    simulated: bool
    description_sha256: str
    """Of the robot.toml that it was last run with."""
    first_seen: datetime


@dataclass(frozen=True)
class Run:
    """One run of one arm.

    Attributes:
        arm: label of the arm.
        stage: of commissioning; empty elsewhere.
        description_sha256: of the robot.toml that the run was made with.
        finished: None while it runs, and where it was abandoned.
        process: host, process id and its start, by which an abandoned run is told; empty once the run has
            ended and, of a check, its verdict is kept.
        capture: path; None where nothing was recorded.
        trajectory: in words or as a path.
        facts: what else is known: channel, seed, cycles, missed cycles, folder, report.
        seal: checksum that it was kept with (``daq.catalogue.seals``); empty where it has none.
    """

    id: int
    arm_id: int
    arm: str
    kind: RunKind
    stage: str
    description_sha256: str
    started: datetime
    finished: datetime | None
    who: str
    process: str
    capture: str | None
    capture_sha256: str | None
    trajectory: str
    state: RunState
    outcome: RunOutcome | Literal[""]
    reason: str
    facts: Mapping[str, Any]
    note: str
    seal: str = ""


@dataclass(frozen=True)
class CatalogueParameter:
    """One base parameter with its standard deviation."""

    name: str
    value: float
    sigma: float
    unit: str
    expression: str = ""


@dataclass(frozen=True)
class Source:
    """A recording that a model was made from."""

    path: str
    sha256: str


@dataclass(frozen=True, kw_only=True)
class NewModel:
    """A model on its way into the catalogue.

    Attributes:
        method: the estimator: ls, iv or robust.
        verdict: of the revised test.
        gates: the test as ``identify --json`` prints it.
        torque_rms: of the residual per joint, in ``torque_units``.
        effects: names, those that were found last.
        found: effects that a diagnosis had found, with place and shape.
        covariance: of the parameters, (b, b); None where it is not known.
        settings: what the identification was asked for, enough to do it again.
        file, report: paths; None where none was written.
    """

    method: str
    verdict: str
    recommendation: str
    gates: Mapping[str, Any]
    rows: int
    relative_error_percent: float
    torque_rms: tuple[float, ...]
    effects: tuple[str, ...]
    parameters: tuple[CatalogueParameter, ...]
    covariance_kind: str
    covariance: FloatArray | None
    settings: Mapping[str, Any]
    sources: tuple[Source, ...]
    description_sha256: str
    armhil: str
    file: str | None = None
    report: str | None = None
    found: tuple[EffectEntry, ...] = ()

    @property
    def torque_units(self) -> tuple[str, ...]:
        """Of the joints' torques: N·m, or N of a joint that slides."""
        units = {parameter.name: parameter.unit for parameter in self.parameters}
        return torque_units_of(units, len(self.torque_rms))


@dataclass(frozen=True, kw_only=True)
class Model(NewModel):
    """A model in the catalogue."""

    id: int
    arm_id: int
    run_id: int
    created: datetime
    who: str


@dataclass(frozen=True, eq=False)
class Course:
    """One parameter over the models of an arm, by the time of their runs; N models.

    Attributes:
        models, runs: (N,) their numbers.
        at: (N,) when the runs were started.
        seconds: (N,) the same in Unix time, s.
        values, sigmas: (N,) in ``unit``.
    """

    name: str
    unit: str
    models: IntArray
    runs: IntArray
    at: tuple[datetime, ...]
    seconds: FloatArray
    values: FloatArray
    sigmas: FloatArray


@dataclass(frozen=True)
class BaselineEvent:
    """Somebody accepted, suspected or took back a baseline."""

    state: BaselineState
    author: str
    reason: str
    report: str | None
    at: datetime


@dataclass(frozen=True)
class Baseline:
    """A model that counts, or counted, as what the arm is; ``events`` oldest first."""

    id: int
    arm_id: int
    model_id: int
    run_id: int
    state: BaselineState
    description_sha256: str
    accepted: datetime
    events: tuple[BaselineEvent, ...]


@dataclass(frozen=True, kw_only=True)
class NewFinding:
    """A missing effect that a diagnosis named; joints count from 1.

    Attributes:
        parameters: ``{"name", "value", "sigma", "unit", "shape"}`` each.
        gap_before, gap_after: rms torque residual over the joints on held-out data, N·m (or N).
        held_out_gain: share of the explainable gap that it closes there.
    """

    effect: str
    joints: tuple[int, ...]
    sentence: str
    parameters: tuple[Mapping[str, Any], ...]
    p_value: float
    gap_before: float | None
    gap_after: float | None
    held_out_gain: float | None


@dataclass(frozen=True, kw_only=True)
class CatalogueFinding(NewFinding):
    """A finding in the catalogue."""

    id: int
    arm_id: int
    run_id: int
    model_id: int | None
    created: datetime


@dataclass(frozen=True)
class CheckRecord:
    """The verdict of one check of an arm against its baseline.

    ``details`` is what it rests on; where many are listed, only what was asked for of it.
    """

    id: int
    arm_id: int
    run_id: int
    model_id: int | None
    baseline_id: int | None
    created: datetime
    verdict: str
    sentence: str
    details: Mapping[str, Any]


@dataclass(frozen=True)
class Lease:
    """Who may drive an arm, and until when."""

    arm_id: int
    holder: str
    taken: datetime
    expires: datetime
