"""Arms in MuJoCo whose logs and truth are foreign to armhil: nothing of ident or of the simulated drives.

``python -m benchmarks.foreign_plant --help`` writes one arm's logs (``fit.csv``, ``validate.csv``), its
description (``arm.urdf``, ``robot.toml``, ``import.toml``) and what is hidden in it (``truth.json``).
"""

from __future__ import annotations

from benchmarks.foreign_plant.arms import ARMS, Arm
from benchmarks.foreign_plant.effects import NAMES, Effect, parse_effect
from benchmarks.foreign_plant.record import Log, record
from benchmarks.foreign_plant.settings import Settings

__all__ = ["ARMS", "NAMES", "Arm", "Effect", "Log", "Settings", "parse_effect", "record"]
