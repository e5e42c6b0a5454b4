"""maxon EPOS4 (DCF of the EPOS4 50/15).

By the file: it has no 608F, 6091 and 6092: its unit is the increment (60A8), its resolution stands in its own
objects (3010:01, pulses of the incremental encoder, four increments each). 60A9 is rev/min of the motor. It
has no 6074 and no 6078; its current is 30D1:02, an integer of 32 bits in mA. 3201:01 is the temperature of
the power stage; its limit 3201:04 is 950, so one count is a tenth of a degree.
"""

from __future__ import annotations

from drivers.setup.profiles.profile import Profile

PROFILE = Profile(
    name="maxon_epos4",
    summary="maxon EPOS4",
    vendor=0x0000_00FB,
    torque=((0x6077, 0), (0x30D1, 2)),
    widths=(((0x30D1, 2), 32),),
    temperature=(0x3201, 1, 0.1),
    unit="increments of the encoder: write encoder_counts",
)
