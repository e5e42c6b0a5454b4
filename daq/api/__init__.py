"""armhil for people who write Python: load, identify, diagnose, simulate, plan, compare.

    from daq import api as armhil

    model = armhil.identify("runs/first/capture.mcap")
    print(model.summary())

Paths may be strings. Results have ``summary()``, ``to_frame()`` (needs pandas) and ``plot()``, which a
notebook shows and ``save`` writes. The rest is a call of ``armhil … --json``.
"""

from daq.api.drift import Drift, drift
from daq.api.identification import IdentifiedModel, Simulation, identify, simulate
from daq.api.picture import Picture
from daq.api.planning import Plan, plan
from daq.api.recordings import Log, load_arm, load_recording, simulated_recording
from daq.api.search import Diagnosed, diagnose

__all__ = [
    "Diagnosed",
    "Drift",
    "IdentifiedModel",
    "Log",
    "Picture",
    "Plan",
    "Simulation",
    "diagnose",
    "drift",
    "identify",
    "load_arm",
    "load_recording",
    "plan",
    "simulate",
    "simulated_recording",
]
