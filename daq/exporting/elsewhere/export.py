"""``armhil export-model``: an identified arm in the files of other programs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from daq.exporting.elsewhere.arm import IdentifiedArm, identified_arm
from daq.exporting.elsewhere.feed_forward import c_header, c_name, python_feed_forward
from daq.exporting.elsewhere.limits import joint_limits
from daq.exporting.elsewhere.mjcf import mjcf
from daq.exporting.elsewhere.pinocchio_module import pinocchio_module
from daq.exporting.elsewhere.sdf import sdf
from daq.exporting.elsewhere.urdf import urdf
from daq.files.model_file import ModelFileError, read_model
from daq.files.run_folder import OutputError
from robots import Robot

Written = tuple[bytes, tuple[str, ...]]
"""A file's content, and what it cannot express of the model, one sentence each."""


def _limits(arm: IdentifiedArm) -> Written:
    return joint_limits(arm.robot, arm.heading).encode(), ()


@dataclass(frozen=True)
class Kind:
    """A format: what the file is called after the arm's name, and who makes its content."""

    suffix: str
    make: Callable[[IdentifiedArm], Written]
    xml: bool = False


KINDS: dict[str, Kind] = {
    "urdf": Kind(".urdf", urdf, xml=True),
    "mjcf": Kind(".mjcf.xml", mjcf, xml=True),
    "sdf": Kind(".sdf", sdf, xml=True),
    "pinocchio": Kind("_pinocchio.py", pinocchio_module),
    "c": Kind("_feed_forward.h", c_header),
    "python": Kind("_feed_forward.py", python_feed_forward),
    "limits": Kind("_joint_limits.yaml", _limits),
}


@dataclass(frozen=True)
class ExportedModel:
    """One file that was written.

    Attributes:
        kind: of KINDS.
        path: the file.
        lost: what it cannot express of the model, one sentence each.
    """

    kind: str
    path: Path
    lost: tuple[str, ...]


def export_model(
    source: Path, robot: Robot, out: Path, kinds: Sequence[str] = ()
) -> tuple[ExportedModel, ...]:
    """Write an identified arm in other formats; all of them are made before one is written.

    Args:
        source: the model file.
        robot: the arm that it is of.
        out: folder, made where it is not there.
        kinds: of KINDS; all where empty.

    Raises:
        ModelFileError: the file cannot be read, is of another arm or description.
        OutputError: no such format, or a file exists already or cannot be written.
        IdentificationError: the solver of the consistent fit is needed and not installed.
    """
    for kind in kinds:
        if kind not in KINDS:
            raise OutputError(f"--format {kind}: is not known; allowed: {', '.join(KINDS)}")
    wanted = tuple(dict.fromkeys(kinds)) or tuple(KINDS)
    paths = {kind: out / f"{c_name(robot.name)}{KINDS[kind].suffix}" for kind in wanted}
    for path in paths.values():
        if path.exists():
            raise OutputError(f"{path}: exists already; allowed: --out FOLDER without it")
    try:
        arm = identified_arm(robot, read_model(source))
    except ModelFileError as error:
        text = str(error)
        raise ModelFileError(text if text.startswith(str(source)) else f"{source}: {text}") from None
    made = {kind: KINDS[kind].make(arm) for kind in wanted}
    found = []
    try:
        out.mkdir(parents=True, exist_ok=True)
        for kind, (content, lost) in made.items():
            if KINDS[kind].xml:
                content = _commented(content, arm.heading, lost)
            paths[kind].write_bytes(content)
            found.append(ExportedModel(kind, paths[kind], lost))
    except OSError as error:
        raise OutputError(f"{out}: cannot be written: {error.strerror or error}") from error
    return tuple(found)


def _commented(content: bytes, heading: str, lost: tuple[str, ...]) -> bytes:
    """An XML file with its origin and what it lacks in a comment before the root element."""
    lines = [heading, "Not in this file:", *(f"- {one}" for one in lost or ("nothing of the model.",))]
    comment = "\n".join(f"  {line}" for line in lines).replace("--", "‐‐")
    root = content[content.index(b"?>") + 2 :] if content.startswith(b"<?xml") else content
    start = '<?xml version="1.0" encoding="utf-8"?>'
    return f"{start}\n<!--\n{comment}\n-->\n".encode() + root.strip() + b"\n"


def export_model_json(source: Path, written: Sequence[ExportedModel]) -> dict[str, Any]:
    """As ``armhil export-model`` prints it."""
    files = [{"format": one.kind, "out": str(one.path), "missing": list(one.lost)} for one in written]
    return {"model": str(source), "files": files}


def in_no_file(written: Sequence[ExportedModel]) -> tuple[str, ...]:
    """What none of the files holds that hold the model's dynamics."""
    dynamic = [one for one in written if one.kind != "limits"]
    first = dynamic[0].lost if dynamic else ()
    return tuple(one for one in first if all(one in other.lost for other in dynamic))
