"""Elmo Gold (DCF of a Gold Whistle).

By the file: as delivered 608F, 6091 and 6092 are 1/1, so positions are increments of the encoder, and the
drive does not know how many make a turn; 1006 is 0 and can be written; the HighLimit of 1016:01 leaves no
room for a node id. That 1006 has to hold the SYNC period is a precaution, not in the file.
"""

from __future__ import annotations

from drivers.setup.profiles.profile import Profile

PROFILE = Profile(
    name="elmo_gold",
    summary="Elmo Gold (Whistle, Twitter …)",
    vendor=0x0000_009A,
    sync_period=True,
    temperature=(0x22A2, 0, 1.0),
    unit="increments of the encoder: write counts_per_output_turn",
)
