"""The simulated robot: the identified model under the same references and the same control law."""

from __future__ import annotations

from ident.closed_loop.leading import SimulatedRun
from ident.closed_loop.simulate import simulate, simulate_many

__all__ = ["SimulatedRun", "simulate", "simulate_many"]
