"""What a kind of drive needs beside CiA 402, as a value: one object per kind, in a file of its own."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class StartUpWrite:
    """One object that a kind of drive wants written before it is configured, and read back.

    Attributes:
        index, subindex, bits: which object, and how wide it is.
        value: what is written.
        why: in words, for messages.
    """

    index: int
    subindex: int
    bits: int
    value: int
    why: str


@dataclass(frozen=True)
class Profile:
    """A kind of drive. The defaults are a drive as CiA 301 and CiA 402 have it.

    What a drive says by itself is not in here: fixed COB-IDs and mappings, refused transmission types, TPDOs
    with few slots, more than four PDOs and modes are found at the opening.

    Attributes:
        name: as robot.toml has it (``profile``).
        summary: which drives, in a line.
        vendor, products: of the identity object (1018); no products are all of this vendor.
        startup: written before anything else, in this order.
        sync_period: whether 1006 must hold the SYNC period: else the drive ignores set-points.
        interpolation_period: whether the drive has 60C2; without it, it interpolates its own way.
        mode_shown_when_enabled: whether 6061 shows the mode only when operation is enabled.
        warnings: EMCY codes that are no faults.
        tpdo_delay: s that its TPDOs may come after the SYNC, beside what the machine needs.
        torque: objects that may carry the control signal, the best one first.
        widths: bits of maker's objects that are uploaded without a size, by index and subindex.
        home_offset_negated: whether it reads −607C at its home: its zero is home + offset.
        temperature: where it says how warm it is: index, subindex, °C per count; None where it does not.
        unit: what its position unit is as delivered, in words; for the draft of a robot.toml.
    """

    name: str
    summary: str
    vendor: int | None = None
    products: tuple[int, ...] = ()
    startup: tuple[StartUpWrite, ...] = ()
    sync_period: bool = False
    interpolation_period: bool = True
    mode_shown_when_enabled: bool = False
    warnings: frozenset[int] = frozenset()
    tpdo_delay: float = 0.0
    torque: tuple[tuple[int, int], ...] = ((0x6077, 0), (0x6078, 0), (0x6074, 0))
    widths: tuple[tuple[tuple[int, int], int], ...] = ()
    home_offset_negated: bool = False
    temperature: tuple[int, int, float] | None = None
    unit: str = "as 608F, 6091 and 6092 say"

    def fits(self, vendor: int | None, product: int | None) -> bool:
        """Whether an identity (1018) is of this kind."""
        if self.vendor is None or vendor != self.vendor:
            return False
        return not self.products or product in self.products
