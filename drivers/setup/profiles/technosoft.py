"""Technosoft iPOS, IDM and ISCM, also under other names (DCF of a Danfoss ISD 860).

No 1016: it is watched by node guarding, which armhil does not speak, so 1400:05 is the one deadline that can
stop it. No 6077, no 60C2, one mappable entry in TPDO 1. 2022 is its control effort, 16 bits. Set-points are
interpolated over the SYNC period (1006).
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
