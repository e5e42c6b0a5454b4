"""The arm's URDF with the identified inertias, for simulators that read URDF."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

from daq.files.run_folder import OutputError
from daq.text.verdict_words import words_of
from ident import Fitted, IdentificationError
from ident.estimators.consistent import consistent_standard, require_solver
from robots import Robot
from robots.arrays import FloatArray
from robots.pseudo_inertia import LINK_SIZE
from robots.urdf_export import urdf_with_links


def check_urdf_path(path: Path, robot: Robot) -> None:
    """Refuse before anything is computed what could not be written after it.

    Raises:
        OutputError: the folder is not there, the path is a folder, or it is the arm's own URDF.
        IdentificationError: the solver of the consistent fit is not installed.
    """
    require_solver()
    if not path.parent.is_dir():
        raise OutputError(
            f"--save-urdf {path}: no folder {path.parent}; allowed: a file in an existing folder"
        )
    if path.is_dir():
        raise OutputError(f"--save-urdf {path}: is a folder; allowed: a file")
    if path.resolve() == robot.urdf_path.resolve():
        raise OutputError(f"--save-urdf {path}: is the arm's own description; allowed: another file")


def write_urdf(path: Path, fitted: Fitted, sources: Sequence[Path]) -> None:
    """Write the URDF with links that give the torques of the estimate that is recommended.

    Args:
        path: of the new file.
        fitted: the identification.
        sources: what it was made from, named in a comment.

    Raises:
        IdentificationError: no arm that can exist has the base parameters of the estimate.
        OutputError: it cannot be written.
    """
    robot, estimate = fitted.base.model.robot, fitted.result.recommended
    standard = _standard(fitted)
    names = ", ".join(source.resolve().name for source in sources)
    note = (
        f"Inertias of {robot.name} identified by armhil {version('armhil')} from {names} by"
        f" {words_of(estimate.method)}; verdict {fitted.result.test.verdict}."
        " Rotor inertia, friction and offsets have no place in a URDF: they are in the model file."
    )
    text = urdf_with_links(robot, standard[: LINK_SIZE * robot.n].reshape(-1, LINK_SIZE), note)
    try:
        path.write_bytes(text)
    except OSError as error:
        raise OutputError(f"--save-urdf {path}: cannot be written: {error.strerror}") from error


def _standard(fitted: Fitted) -> FloatArray:
    """Standard parameters (p,) of an arm that can exist, with the estimate's base parameters."""
    if fitted.consistent is not None:
        return fitted.consistent.standard
    standard = consistent_standard(fitted.base, fitted.result.recommended.values)
    if standard is None:
        raise IdentificationError(
            "--save-urdf: no arm that can exist has these base parameters; identify with --method consistent,"
            " which finds the nearest one that can"
        )
    return standard
