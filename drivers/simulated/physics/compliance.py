"""Gears that give way: figures from the scenario, resonances, and how finely they must be stepped."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np

from drivers.errors import DriveError
from drivers.simulated.physics.chain import Chain
from drivers.simulated.physics.entry_points import compiled
from drivers.simulated.physics.records import SLIP_ELEMENTS, Records
from drivers.simulated.scenario import Scenario
from robots import Robot
from robots.arrays import FloatArray

STIFF_RESONANCE = 150.0
"""Hz; resonance of a gear whose scenario gives no stiffness: far above the position loops."""
_MATERIAL_DAMPING = 0.03
_CONTACT_DAMPING = 0.2
"""Ratios to critical damping where a scenario gives no damping."""
_POSTURES = 40
_FINEST_PHASE = 0.3
"""Largest resonance times substep, rad: the frequency is then right within 0.4 %."""
_MOST_SUBSTEPS = 8


class Resonance:
    """How rotors and outputs swing against each other, over postures of the arm.

    Args:
        robot: for its joint limits.
        chain: of the links.
        transmission: (d, n).
        drives: inertias are read.
    """

    def __init__(self, robot: Robot, chain: Chain, transmission: FloatArray, drives: Records) -> None:
        self._robot, self._chain, self._transmission = robot, chain, transmission
        self._rotor = np.maximum(drives["inertia"], 1e-9)

    @cached_property
    def _outputs(self) -> FloatArray:
        """(postures, d) inertia at the outputs, kg·m²; asked for where a gear gives way."""
        rng = np.random.default_rng(0)
        postures = [rng.uniform(self._robot.lower, self._robot.upper) for _ in range(_POSTURES)]
        links = np.array([links_at(self._chain, posture) for posture in postures])
        there = self._transmission
        # A shaft that no body hangs on still has its joint's smallest share of the arm.
        mobility = np.einsum("ij,pjk,ik->pi", there, np.linalg.pinv(links), there)
        return np.asarray(1.0 / np.maximum(mobility, 1e-12))

    def reduced_inertia(self, drive: int) -> float:
        """Of rotor and output swinging against each other in a middling posture, kg·m²."""
        a, b = self._rotor[drive], np.median(self._outputs[:, drive])
        return float(a * b / (a + b))

    def highest(self, drive: int, stiffness: float) -> float:
        """Highest angular frequency of a stiffness over the postures, rad/s."""
        return float(math.sqrt(stiffness * (1.0 / self._rotor[drive] + 1.0 / self._outputs[:, drive].min())))


def links_at(chain: Chain, position: FloatArray) -> FloatArray:
    matrix = np.zeros((len(position), len(position)))
    compiled.links(chain, position, matrix)
    return matrix


def fill_gears(drives: Records, scenario: Scenario, resonance: Resonance) -> None:
    """Stiffness, damping, gap and slip of each compliant drive.

    Several of these effects may sit in one gear: the softest stiffness holds, and the largest damping.

    Raises:
        DriveError: a rotor has no inertia.
    """
    for elastic in (*scenario.joint_elasticity, *scenario.stiffening_elasticity):
        stiffness, damping = _figures(resonance, elastic.drive, elastic.stiffness, elastic.damping)
        _soften(drives, elastic.drive, stiffness, damping)
        drives["cubic_stiffness"][elastic.drive - 1] = elastic.cubic
    for play in scenario.backlash:
        stiffness, damping = _figures(
            resonance, play.drive, play.stiffness, play.damping, ratio=_CONTACT_DAMPING
        )
        _soften(drives, play.drive, stiffness, damping)
        drives["gap"][play.drive - 1] = 0.5 * play.width
    for lag in scenario.hysteresis:
        # Elements of equal stiffness slide one after the other: at the last, each carries its own limit.
        elements = lag.torque / (lag.displacement * _mean_limit_share())
        if lag.between == "rotor_and_housing":
            drives["drag_stiffness"][lag.drive - 1] = elements
            drives["drag_stretch"][lag.drive - 1] = lag.displacement
            continue
        stiffness, damping = _figures(resonance, lag.drive, lag.stiffness, lag.damping)
        _soften(drives, lag.drive, stiffness, damping)
        drives["slip_stiffness"][lag.drive - 1] = elements
        drives["slip_stretch"][lag.drive - 1] = lag.displacement
    for ripple in scenario.gear_ripple:
        stiffness, damping = _figures(resonance, ripple.drive, ripple.stiffness, None)
        _soften(drives, ripple.drive, stiffness, damping)


def substeps(drives: Records, resonance: Resonance, step: float) -> int:
    """How many substeps of a plant step follow the fastest gear.

    Raises:
        DriveError: more than are sensible.
    """
    fastest, where = 0.0, 0
    for i in np.flatnonzero(drives["compliant"]):
        whole = _largest_stiffness(drives, int(i))
        if (frequency := resonance.highest(int(i), float(whole))) > fastest:
            fastest, where = frequency, int(i)
    count = max(1, math.ceil(fastest * step / _FINEST_PHASE))
    if count > _MOST_SUBSTEPS:
        most = _MOST_SUBSTEPS * _FINEST_PHASE / step / (2 * math.pi)
        raise DriveError(
            f"scenario: the gear of drive {where + 1} swings at {fastest / (2 * math.pi):.0f} Hz; "
            f"allowed: at most {most:.0f} Hz, so choose a smaller stiffness"
        )
    return count


def _largest_stiffness(drives: Records, i: int) -> float:
    """Of a gear's spring, where it carries as much as the brake holds, and of all its elements."""
    linear, cubic = float(drives["stiffness"][i]), float(drives["cubic_stiffness"][i])
    whole = linear + float(drives["slip_stiffness"][i])
    if cubic > 0:
        roots = np.roots([cubic, 0.0, linear, -float(drives["brake"][i])])
        stretch = float(roots[np.abs(roots.imag).argmin()].real)
        whole += 3.0 * cubic * stretch**2
    return whole


def _figures(
    resonance: Resonance,
    drive: int,
    stiffness: float | None,
    damping: float | None,
    *,
    ratio: float = _MATERIAL_DAMPING,
) -> tuple[float, float]:
    inertia = resonance.reduced_inertia(drive - 1)
    if stiffness is None:
        stiffness = inertia * (2.0 * math.pi * STIFF_RESONANCE) ** 2
    if damping is None:
        damping = 2.0 * ratio * math.sqrt(stiffness * inertia)
    return stiffness, damping


def _soften(drives: Records, drive: int, stiffness: float, damping: float) -> None:
    i = drive - 1
    if not drives["inertia"][i] > 0:
        raise DriveError(
            f"scenario: the rotor of drive {drive} has no inertia of its own, so its gear cannot give way; "
            "allowed: drives with Ia > 0, or one more entry, rotor_inertia"
        )
    softer = stiffness if not drives["compliant"][i] else min(stiffness, float(drives["stiffness"][i]))
    drives["stiffness"][i] = softer
    drives["damping"][i] = max(damping, float(drives["damping"][i]))
    drives["compliant"][i] = 1


def _mean_limit_share() -> float:
    """Mean of the elements' limits over the last one's."""
    return (SLIP_ELEMENTS + 1) / (2 * SLIP_ELEMENTS)
