"""Three-vectors and rotations as tuples of numbers: the compiler keeps them in registers.

A rotation is a tuple of nine numbers by rows.
"""

from __future__ import annotations

from drivers.simulated.physics.compile import inner
from robots.arrays import FloatArray

Vector = tuple[float, float, float]
Rotation = tuple[float, float, float, float, float, float, float, float, float]


@inner
def add(a: Vector, b: Vector) -> Vector:
    """a + b."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@inner
def subtract(a: Vector, b: Vector) -> Vector:
    """a − b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@inner
def scale(s: float, a: Vector) -> Vector:
    """s · a."""
    return (s * a[0], s * a[1], s * a[2])


@inner
def dot(a: Vector, b: Vector) -> float:
    """a · b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inner
def cross(a: Vector, b: Vector) -> Vector:
    """a × b."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@inner
def rotate(r: Rotation, a: Vector) -> Vector:
    """R a."""
    return (
        r[0] * a[0] + r[1] * a[1] + r[2] * a[2],
        r[3] * a[0] + r[4] * a[1] + r[5] * a[2],
        r[6] * a[0] + r[7] * a[1] + r[8] * a[2],
    )


@inner
def rotate_back(r: Rotation, a: Vector) -> Vector:
    """Rᵀ a."""
    return (
        r[0] * a[0] + r[3] * a[1] + r[6] * a[2],
        r[1] * a[0] + r[4] * a[1] + r[7] * a[2],
        r[2] * a[0] + r[5] * a[1] + r[8] * a[2],
    )


@inner
def turned_about_z(r: Rotation, c: float, s: float) -> Rotation:
    """R · Rz with the cosine and sine of the angle."""
    return (
        r[0] * c + r[1] * s,
        r[1] * c - r[0] * s,
        r[2],
        r[3] * c + r[4] * s,
        r[4] * c - r[3] * s,
        r[5],
        r[6] * c + r[7] * s,
        r[7] * c - r[6] * s,
        r[8],
    )


@inner
def load3(row: FloatArray, start: int) -> Vector:
    """Three neighbours of a row as a vector."""
    return (row[start], row[start + 1], row[start + 2])


@inner
def load9(row: FloatArray, start: int) -> Rotation:
    """Nine neighbours of a row as a rotation."""
    return (
        row[start],
        row[start + 1],
        row[start + 2],
        row[start + 3],
        row[start + 4],
        row[start + 5],
        row[start + 6],
        row[start + 7],
        row[start + 8],
    )


@inner
def store(row: FloatArray, start: int, a: tuple[float, ...]) -> None:
    """Writes a vector or rotation into a row."""
    for k in range(len(a)):
        row[start + k] = a[k]
