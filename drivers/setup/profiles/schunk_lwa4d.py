"""SCHUNK LWA4D and LWA4P (ERB and PRL modules; DCF of the LWA4D).

Interpolated position mode only; 60C2 in milliseconds. No 608F, 6091 and 6092. Its file leaves vendor and
product open, so it is chosen by name.
"""

from __future__ import annotations

from drivers.setup.profiles.profile import Profile

PROFILE = Profile(
    name="schunk_lwa4d",
    summary="SCHUNK LWA4D and LWA4P",
    torque=((0x6077, 0),),
    unit="thousandths of a degree of the joint: counts_per_output_turn = 360000",
)
