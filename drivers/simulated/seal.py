"""A sealed truth: what a blind test hides, in a file that nobody reads by accident.

The file is JSON: a digest, and the content compressed and in base64. Scoring opens it with
:func:`open_seal`, which leaves a line in a second file beside it; as long as that does not exist, nobody
has looked by this way. It is an envelope, not a safe.
"""

from __future__ import annotations

import base64
import binascii
import hashlib
import json
import zlib
from pathlib import Path
from typing import Any

from drivers.errors import DriveError
from drivers.simulated.scenario import Scenario
from drivers.simulated.truth import PlantTruth

_KIND = "armhil sealed truth"
_FORMAT = 1


class SealError(DriveError):
    """A sealed file cannot be written or opened; str() is one line."""


def sealed_content(truth: PlantTruth, scenario: Scenario, **more: Any) -> dict[str, Any]:
    """Everything that a simulated arm is, as plain numbers: what :func:`write_seal` takes."""
    return {"truth": truth.as_dict(), "scenario": scenario.as_dict(), **more}


def write_seal(path: str | Path, content: dict[str, Any]) -> None:
    """Writes a sealed file.

    Args:
        path: of the file; it must not exist.
        content: what JSON can hold.

    Raises:
        SealError: there is such a file already, or it cannot be written.
    """
    file = Path(path)
    plain = json.dumps(content, sort_keys=True, allow_nan=False).encode()
    envelope = {
        "kind": _KIND,
        "format": _FORMAT,
        "sha256": hashlib.sha256(plain).hexdigest(),
        "content": base64.b64encode(zlib.compress(plain, 9)).decode(),
    }
    try:
        with file.open("x", encoding="utf-8") as stream:
            stream.write(json.dumps(envelope, indent=1) + "\n")
    except FileExistsError:
        raise SealError(f"{file}: exists already; allowed: a new file") from None
    except OSError as error:
        raise SealError(f"{file}: cannot be written: {error.strerror}") from None


def open_seal(path: str | Path, *, by: str) -> dict[str, Any]:
    """Opens a sealed file and leaves a line that says so.

    Args:
        path: of the sealed file.
        by: who opens it and what for, in one line.

    Raises:
        SealError: it is not a sealed file, or its content does not fit its digest.
    """
    file = Path(path)
    try:
        envelope = json.loads(file.read_text(encoding="utf-8"))
        if not isinstance(envelope, dict) or envelope.get("kind") != _KIND:
            raise SealError(f"{file}: not a sealed truth")
        plain = zlib.decompress(base64.b64decode(envelope["content"], validate=True))
        digest = envelope["sha256"]
    except OSError as error:
        raise SealError(f"{file}: cannot be read: {error.strerror}") from None
    except (ValueError, KeyError, TypeError, zlib.error, binascii.Error):
        raise SealError(f"{file}: not a sealed truth, or damaged") from None
    if hashlib.sha256(plain).hexdigest() != digest:
        raise SealError(f"{file}: the content does not fit its digest")
    content: dict[str, Any] = json.loads(plain)
    with _opened_file(file).open("a", encoding="utf-8") as stream:
        stream.write(json.dumps({"sha256": digest, "by": by}) + "\n")
    return content


def was_opened(path: str | Path) -> tuple[str, ...]:
    """Who has opened a sealed file so far, in order; empty while nobody has."""
    file = _opened_file(Path(path))
    if not file.exists():
        return ()
    return tuple(json.loads(line)["by"] for line in file.read_text(encoding="utf-8").splitlines())


def truth_of(content: dict[str, Any]) -> tuple[PlantTruth, Scenario]:
    """The arm and the scenario of an opened seal."""
    return PlantTruth.from_dict(content["truth"]), Scenario.from_dict(content["scenario"])


def _opened_file(file: Path) -> Path:
    return file.with_name(file.name + ".opened")
