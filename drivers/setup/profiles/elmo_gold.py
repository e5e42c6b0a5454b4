"""Elmo Gold (DCF of a Gold Whistle).

As delivered 608F, 6091 and 6092 are 1/1: positions are increments of the encoder, and the drive does not know
how many make a turn. It has 1006, which is 0 as delivered. EMCY FF01 is a user program's message, no fault.
"""

from __future__ import annotations

from drivers.setup.profiles.profile import Profile

PROFILE = Profile(
    name="elmo_gold",
    summary="Elmo Gold (Whistle, Twitter …)",
    vendor=0x0000_009A,
    sync_period=True,
    warnings=frozenset({0xFF01}),
    unit="increments of the encoder: write counts_per_output_turn",
)
