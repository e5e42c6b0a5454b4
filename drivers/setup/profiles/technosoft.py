"""Technosoft iPOS, IDM and ISCM, also under other names (DCF of a Danfoss ISD 860).

By the file: no 1016 and no 1400:05 (it has node guarding, 100C and 100D, which armhil does not speak, so this
firmware is refused); no 6077 and no 60C2; one mappable entry in TPDO 1; 2022 is "control effort", 16 bits;
1006 is 0 and can be written. That 1006 has to hold the SYNC period is a precaution, not in the file.
"""

from __future__ import annotations

from drivers.setup.profiles.profile import Profile

PROFILE = Profile(
    name="technosoft",
    summary="Technosoft iPOS, IDM, ISCM; Danfoss ISD 860",
    vendor=0x0000_01A3,
    sync_period=True,
    interpolation_period=False,
    torque=((0x2022, 0),),
    widths=(((0x2022, 0), 16),),
    unit="increments of the encoder: write encoder_counts",
)
