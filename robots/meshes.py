"""The meshes of collision bodies: which file is meant, and what box its vertices fill.

The vertices are read here a second time, so that a mesh that was cut off, is in millimetres, or that coal
reads otherwise is noticed. STL and OBJ are read; of a COLLADA file only coal knows the inside.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from robots.arrays import FloatArray
from robots.errors import RobotFileError, shown
from robots.urdf import Urdf, UrdfBody
from robots.urdf_rules import FARTHEST, THINNEST

KINDS = (".stl", ".obj", ".dae")
MAX_BYTES = 200_000_000

_HEADER, _FACET = 84, 50
_VERTEX = re.compile(rb"^[ \t]*(?:vertex|v)[ \t]+(\S+)[ \t]+(\S+)[ \t]+(\S+)", re.MULTILINE)


def mesh_file(urdf: Urdf, body: UrdfBody) -> Path:
    """The file of a mesh: relative to the URDF's folder; ``package://name/…`` in a folder around it.

    Raises:
        RobotFileError: there is none, or it is of no known kind.
    """
    folder, name = urdf.file.resolve().parent, body.mesh
    if name.startswith("package://"):
        inside = name.removeprefix("package://")
        package, _, rest = inside.partition("/")
        around = (folder, *folder.parents)
        choices = [above / inside for above in around]
        choices += [above / rest for above in around if above.name == package]
    else:
        choices = [folder / name.removeprefix("file://")]
    found = next((path for path in choices if path.is_file()), None)
    if found is None:
        raise _error(urdf, body, f"{shown(name)} is not a file beside {folder}", "a mesh that is there")
    if found.suffix.lower() not in KINDS:
        raise _error(urdf, body, f"{shown(name)} is no mesh that is known", ", ".join(KINDS))
    return found.resolve()


def mesh_extents(urdf: Urdf, body: UrdfBody, file: Path) -> FloatArray | None:
    """Lowest and highest corner (2, 3) of a mesh, scaled as the URDF says, m; None of a COLLADA file.

    Raises:
        RobotFileError: it cannot be read, is damaged, or is of a size that no link has.
    """
    content = mesh_content(urdf, body, file)
    if file.suffix.lower() == ".dae":
        return None
    vertices = _vertices(content)
    if vertices is None or not len(vertices) or not np.isfinite(vertices).all():
        raise _error(urdf, body, f"{file.name} is damaged or has no vertices", "a whole STL or OBJ file")
    vertices = vertices * np.array(body.size)
    extents = np.array([vertices.min(axis=0), vertices.max(axis=0)])
    largest = float((extents[1] - extents[0]).max())
    if not THINNEST <= largest <= FARTHEST:
        problem = f"{file.name} is {largest:.4g} m large with its scale"
        raise _error(urdf, body, problem, f"{THINNEST:g} m to {FARTHEST:g} m (a mesh in mm has scale 0.001)")
    return extents


def mesh_content(urdf: Urdf, body: UrdfBody, file: Path) -> bytes:
    """The bytes of a mesh; raises RobotFileError where it cannot be read or is too large."""
    try:
        if file.stat().st_size > MAX_BYTES:
            raise _error(urdf, body, f"{file.name} is larger than {MAX_BYTES} bytes", "a mesh for collisions")
        return file.read_bytes()
    except OSError as error:
        raise _error(urdf, body, f"{file.name} cannot be read: {error.strerror}", "a mesh") from None


def _vertices(content: bytes) -> FloatArray | None:
    """N × 3 vertices of an STL or OBJ file; None where it is neither, or is cut off."""
    if len(content) >= _HEADER:
        (count,) = struct.unpack_from("<I", content, 80)
        if len(content) == _HEADER + _FACET * count:
            facets = np.frombuffer(content, dtype=np.dtype((np.void, _FACET)), offset=_HEADER)
            words = np.frombuffer(facets.tobytes(), dtype=np.uint8).reshape(-1, _FACET)[:, 12:48]
            return np.frombuffer(words.tobytes(), dtype="<f4").reshape(-1, 3).astype(np.float64)
    is_text_stl = content.lstrip()[:5] == b"solid"
    if is_text_stl and not re.search(rb"endsolid[^\n]*\s*\Z", content):
        return None
    return _numbers(match.groups() for match in _VERTEX.finditer(content))


def _numbers(rows: Iterable[tuple[bytes, ...]]) -> FloatArray | None:
    try:
        return np.array([[float(part) for part in row] for row in rows], dtype=np.float64)
    except ValueError:
        return None


def _error(urdf: Urdf, body: UrdfBody, problem: str, allowed: str) -> RobotFileError:
    return RobotFileError(urdf.file, problem, line=body.line, key="<mesh filename>", allowed=allowed)
