"""Which recording was made with which known body on the arm: ``--payload LOG=payload.toml``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from daq.files.payload_file import read_payload
from daq.importing.loaded import LoadedRecordings
from ident import IdentificationError
from robots import Robot
from robots.carried import Load
from robots.payload import Payload


@dataclass(frozen=True)
class Carried:
    """A recording and the body that the arm carried meanwhile.

    Attributes:
        log: as it is named among the recordings.
        payload: the body.
        name: of its file, for messages.
    """

    log: Path
    payload: Payload
    name: str

    def as_json(self) -> dict[str, Any]:
        """As the catalogue keeps it: the file may be another one when it is asked for again."""
        return {"log": str(self.log.absolute()), "name": self.name, "payload": asdict(self.payload)}

    @classmethod
    def of_json(cls, values: Mapping[str, Any]) -> Carried:
        """The same back."""
        of = values["payload"]
        center, inertia = (None if of[key] is None else tuple(of[key]) for key in ("center", "inertia"))
        payload = Payload(of["mass"], center, inertia, of["frame"], of["relative_uncertainty"])
        return cls(Path(values["log"]), payload, values["name"])


def carried_of(texts: Sequence[str]) -> tuple[Carried, ...]:
    """What ``--payload`` says.

    Raises:
        IdentificationError: no ``LOG=FILE``.
        PayloadFileError: the file cannot be read.
    """
    found: list[Carried] = []
    for text in texts:
        log, equals, file = text.rpartition("=")
        if not (log and equals and file):
            raise IdentificationError(
                f"--payload {text}; allowed: LOG=payload.toml, a recording and the file of what it was made"
                " with"
            )
        found.append(Carried(Path(log), read_payload(Path(file)), Path(file).name))
    return tuple(found)


def with_carried(
    loaded: Sequence[LoadedRecordings], carried: Sequence[Carried], robot: Robot
) -> list[LoadedRecordings]:
    """The recordings with the bodies that the arm carried; one that two recordings share stays one.

    Raises:
        PayloadError: a body does not fit the arm.
    """
    loads: dict[Payload, Load] = {}
    by_path = {}
    for one in carried:
        by_path[one.log.absolute()] = loads.setdefault(one.payload, one.payload.load(robot, one.name))
    found = []
    for part in loaded:
        load = by_path.get(part.path.absolute())
        recordings = tuple(replace(recording, load=load) for recording in part.recordings)
        found.append(part if load is None else replace(part, recordings=recordings))
    return found


def require_known(carried: Sequence[Carried], paths: Sequence[Path]) -> None:
    """Refuse a payload of a recording that is not there.

    Raises:
        IdentificationError: names it.
    """
    known = {path.absolute() for path in paths}
    for one in carried:
        if one.log.absolute() not in known:
            listed = ", ".join(str(path) for path in paths)
            raise IdentificationError(f"--payload {one.log}=…: is none of the recordings; allowed: {listed}")
