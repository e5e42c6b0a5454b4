"""SCHUNK LWA4D and LWA4P (ERB and PRL modules; DCF of the LWA4D).

By the file: of the streamed modes interpolated position alone (6502 = 0x43); no 608F, 6091 and 6092; vendor
and product are open, so it is chosen by name. The unit is that of the ROS driver of this arm with the same
file (schunk_lwa4d/config/arm_driver.yaml of schunk_robots: only velocities are scaled there, positions by the
default of ros_canopen, degrees times 1000).
"""

from __future__ import annotations

from drivers.setup.profiles.profile import Profile

PROFILE = Profile(
    name="schunk_lwa4d",
    summary="SCHUNK LWA4D and LWA4P",
    torque=((0x6077, 0),),
    unit="thousandths of a degree of the joint: counts_per_output_turn = 360000",
)
