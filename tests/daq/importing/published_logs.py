"""Recorded logs that others published, as their owners know them: for fits that share nothing with armhil."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.io

from tests.daq.importing.independent_fit import Array, percent_left

EMPS_URDF = Path(__file__).parents[3] / "robots" / "emps" / "emps.urdf"


@dataclass(frozen=True)
class PublishedLog:
    """A log and what one command asks of its user.

    Attributes:
        name: of the arm.
        log, urdf: below the folder of the published recordings; the arm's own URDF where None.
        options: of the command besides, as they are typed.
        known: what an independent least squares leaves per joint, %; of rows decimated through a filter
            where its second argument is true, plainly sliced ones otherwise.
    """

    name: str
    log: str
    urdf: str | None
    options: tuple[str, ...]
    known: Callable[[Path, bool], Array]


def _kr300(data: Path, filtered: bool) -> Array:
    rec = scipy.io.loadmat(data / "kr300/A/data.mat", struct_as_record=False, squeeze_me=True)["rec"]
    q = np.deg2rad(rec.act_pos_mot_deg.T) + np.array([0, -np.pi / 2, np.pi / 2, 0, 0, 0])
    ratio = np.array([1798 / 7, 1872 / 7, 757 / 3, 221, 5032 / 21, 206793 / 1340])
    torque = rec.act_torque_abs_nm.T * ratio
    return percent_left(data / "kr300/kr300.urdf", q, torque, 0.004, 12.0, 10, filtered=filtered)


def _emps(data: Path, filtered: bool) -> Array:
    log = scipy.io.loadmat(data / "emps/DATA_EMPS.mat", squeeze_me=True)
    force = log["vir"][:, np.newaxis] * log["gtau"]
    return percent_left(EMPS_URDF, log["qm"][:, np.newaxis], force, 0.001, 110.0, 4, filtered=filtered)


def _tx40(data: Path, filtered: bool) -> Array:
    ratio = np.array([32, 32, 45, -48, 45, 32.0])
    q, torque = (
        np.loadtxt(data / "tx40" / name, delimiter=",", skiprows=1)
        for name in ("pos_read_data.csv", "curr_data.csv")
    )
    wrist = np.eye(6)
    wrist[5, 4] = 1.0
    q = np.linalg.solve(wrist, (q / ratio).T).T + np.array([0, -np.pi / 2, np.pi / 2, 0, 0, 0])
    urdf = data / "tx40/tx40_mdh_modified.urdf"
    torque = torque * ratio @ wrist
    return percent_left(urdf, q, torque, 0.0002, 52.0, 48, coupled=True, filtered=filtered)


PUBLISHED = (
    PublishedLog("KR300", "kr300/A/data.mat", "kr300/kr300.urdf", (), _kr300),
    PublishedLog(
        "TX40",
        "tx40",
        "tx40/tx40_mdh_modified.urdf",
        ("--sample-rate", "5000", "--ratio=32,32,45,-48,45,32"),
        _tx40,
    ),
    PublishedLog("EMPS", "emps/DATA_EMPS.mat", None, (), _emps),
)
