"""Where a commissioning protocol goes, and its JSON object."""

from __future__ import annotations

from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any

from daq.protocol.content import Protocol, ProtocolError
from daq.protocol.paper import pdf_of, render_protocol

_FORMATS = (".html", ".pdf")


def target_of(out: Path | None, label: str) -> Path:
    """The file to write; what may be signed already is never overwritten.

    Raises:
        ProtocolError: it is there, or is of no kind that is known.
    """
    target = Path(f"{label.replace('/', '-')}-commissioning.html") if out is None else out
    if target.suffix.lower() not in _FORMATS:
        raise ProtocolError(f"--out {target}: ends in none of {', '.join(_FORMATS)}; give one of them")
    if target.exists():
        raise ProtocolError(
            f"--out {target}: is there already and may be signed; give another, such as"
            f" --out {target.with_stem(f'{target.stem}-2')}"
        )
    return target


def write_protocol(target: Path, protocol: Protocol) -> None:
    """Write the page; a file that could not be made whole is not there.

    Raises:
        ProtocolError: it cannot be written.
    """
    pdf = target.suffix.lower() == ".pdf"
    content = pdf_of(protocol) if pdf else render_protocol(protocol).encode()
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(content)
    except OSError as error:
        raise ProtocolError(f"--out {target}: cannot be written: {error.strerror}; choose another") from error


def protocol_json(protocol: Protocol, target: Path) -> dict[str, Any]:
    """Of ``armhil protocol``; docs/reference/json.md documents it."""
    return {
        "armhil": version("armhil"),
        "file": str(target),
        **{name: value for name, value in asdict(protocol).items() if name != "facts"},
        "facts": dict(protocol.facts),
    }
