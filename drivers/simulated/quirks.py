"""How kinds of real drives differ from the standard, for the simulated ones; nothing is the master's.

Each was seen on a drive or in a device file. ``armhil sim --profile NAME`` makes all drives of an arm so.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from drivers.errors import DriveError
from drivers.simulated.object_dictionary import Entry, Key, ObjectDictionary

_RPDO_MAPPING, _TPDO, _TPDO_MAPPING = 0x1600, 0x1800, 0x1A00
MOST_SLOTS = 8
_SYNC_PERIOD = 0x1006


@dataclass(frozen=True)
class Quirks:
    """What a kind of drive does otherwise; the defaults are the standard's.

    Attributes:
        absent: indices of objects that it does not have.
        absent_entries: single entries of objects that it does not have.
        read_only: objects that cannot be written, with the values that they hold.
        absent_code: SDO abort code with which it says so; the standard's where 0.
        unsized: its expedited answers do not say how many bytes count.
        fixed_cob_ids: COB-IDs of PDOs cannot be written.
        fixed_mapping: mappings cannot be written.
        rpdo_types: transmission types that its RPDOs take; the standard's where empty.
        rpdo_slots: entries that its RPDO can map.
        tpdo_slots: entries that a TPDO can map.
        tpdo_delay: s after a SYNC when its TPDOs go out.
        tpdos: how many TPDOs it has, all of them sending as delivered where more than two.
        modes: 6502; the EDS's where None.
        period_fixed_when_enabled: refuses 60C2 in Operation enabled.
        mode_shown_late: 6061 shows the mode only when operation is enabled.
        needs_sync_period: ignores set-points while 1006 is 0.
        unlock: a maker's object, and the value that it must hold before set-points count.
        warning: EMCY code that it sends when it is enabled, without a fault; 0 for none.
        negated_home: reads −607C at its home, as CiA 402 may be read, too.
        homing_speed_factor: how many times faster it searches than 6099 says, in another unit of its own.
        homed_untruly: says that home is attained without having searched.
    """

    absent: tuple[int, ...] = ()
    absent_entries: tuple[Key, ...] = ()
    read_only: tuple[tuple[Key, int], ...] = ()
    absent_code: int = 0
    unsized: bool = False
    fixed_cob_ids: bool = False
    fixed_mapping: bool = False
    rpdo_types: tuple[int, ...] = ()
    rpdo_slots: int = MOST_SLOTS
    tpdo_slots: int = MOST_SLOTS
    tpdo_delay: float = 0.0
    tpdos: int = 2
    modes: int | None = None
    period_fixed_when_enabled: bool = False
    mode_shown_late: bool = False
    needs_sync_period: bool = False
    unlock: tuple[int, int] | None = None
    warning: int = 0
    negated_home: bool = False
    homing_speed_factor: int = 1
    homed_untruly: bool = False

    def apply(self, dictionary: ObjectDictionary, node: int) -> None:
        """Make a dictionary, filled in already, that of such a drive."""
        for index in self.absent:
            dictionary.remove(index)
        for entry in self.absent_entries:
            dictionary.remove_entry(*entry)
        while dictionary.integer(_TPDO_MAPPING, dictionary.integer(_TPDO_MAPPING, 0)) >> 16 in self.absent:
            dictionary.set(_TPDO_MAPPING, 0, dictionary.integer(_TPDO_MAPPING, 0) - 1)
        dictionary.absent_code = self.absent_code
        for number in range(2, self.tpdos):
            _add_tpdo(dictionary, number, node)
        _take_slots(dictionary, _RPDO_MAPPING, self.rpdo_slots)
        for number in range(self.tpdos):
            _take_slots(dictionary, _TPDO_MAPPING + number, self.tpdo_slots)
        if self.rpdo_types:
            dictionary.set(0x1400, 2, self.rpdo_types[0])
        if self.modes is not None:
            dictionary.set(0x6502, 0, self.modes)
        if self.unlock is not None:
            dictionary.add(Entry(self.unlock[0], 0, "H", "rw", 0, None, None, mappable=False))
        for key, value in self.read_only:
            dictionary.add(replace(dictionary.entry(*key), access="ro"))
            dictionary.set(*key, value)

    def holds_set_points(self, dictionary: ObjectDictionary) -> bool:
        """Whether the drive ignores set-points as it is set now."""
        if self.needs_sync_period and dictionary.integer(_SYNC_PERIOD) == 0:
            return True
        return self.unlock is not None and dictionary.integer(self.unlock[0]) != self.unlock[1]


STANDARD = Quirks()


def _take_slots(dictionary: ObjectDictionary, mapping: int, slots: int) -> None:
    """Leave a PDO so many entries."""
    if slots < MOST_SLOTS:
        for subindex in range(slots + 1, MOST_SLOTS + 1):
            dictionary.remove_entry(mapping, subindex)
        dictionary.set(mapping, 0, min(dictionary.integer(mapping, 0), slots))


def _add_tpdo(dictionary: ObjectDictionary, number: int, node: int) -> None:
    """A further TPDO like the second, which sends the statusword as delivered."""
    for base in (_TPDO, _TPDO_MAPPING):
        for subindex in range(9):
            if dictionary.has(base + 1, subindex):
                entry = replace(dictionary.entry(base + 1, subindex), index=base + number)
                dictionary.add(entry)
    cob_id = (0x180 + 0x100 * number if number < 4 else 0x1C0 + 0x100 * (number - 4)) + node
    dictionary.set(_TPDO + number, 1, cob_id)
    dictionary.set(_TPDO + number, 2, 1)
    dictionary.set(_TPDO_MAPPING + number, 0, 1)
    dictionary.set(_TPDO_MAPPING + number, 1, 0x6041_0010)


KINDS: dict[str, Quirks] = {
    "cia402": STANDARD,
    "fixed_cob_ids": Quirks(fixed_cob_ids=True),
    "fixed_cob_ids_four_tpdos": Quirks(fixed_cob_ids=True, tpdos=4),
    "fixed_mapping": Quirks(fixed_mapping=True),
    "immediate_rpdos": Quirks(rpdo_types=(255, 254)),
    "no_interpolation_period": Quirks(absent=(0x60C2,)),
    "no_heartbeat_consumer": Quirks(absent=(0x1016,)),
    "node_guarding_only": Quirks(absent=(0x1016,), absent_entries=((0x1400, 5),)),
    "period_fixed": Quirks(read_only=(((0x60C2, 1), 40), ((0x60C2, 2), -4))),
    "period_power_fixed": Quirks(read_only=(((0x60C2, 2), -4),)),
    "period_fixed_when_enabled": Quirks(period_fixed_when_enabled=True),
    "mode_fixed": Quirks(read_only=(((0x6060, 0), 8), ((0x6061, 0), 8))),
    "rpdo_type_fixed": Quirks(read_only=(((0x1400, 2), 240),)),
    "abort_option_fixed": Quirks(read_only=(((0x6007, 0), 2),)),
    "no_torque": Quirks(absent=(0x6077,)),
    "one_rpdo_slot": Quirks(rpdo_slots=1),
    "one_slot": Quirks(tpdo_slots=1, tpdos=4),
    "eight_tpdos": Quirks(tpdos=8),
    "interpolated_only": Quirks(modes=1 << 6),
    "mode_shown_late": Quirks(mode_shown_late=True),
    "absent_08000000": Quirks(absent=(0x6007, 0x605A), absent_code=0x0800_0000),
    "absent_06010000": Quirks(absent=(0x6007, 0x605A), absent_code=0x0601_0000),
    "absent_06040043": Quirks(absent=(0x6007, 0x605A), absent_code=0x0604_0043),
    "unsized": Quirks(unsized=True),
    "needs_sync_period": Quirks(needs_sync_period=True),
    "sync_period_fixed": Quirks(read_only=(((0x1006, 0), 10_000),)),
    "late_tpdos": Quirks(tpdo_delay=0.003),
    "locked": Quirks(unlock=(0x2F00, 1)),
    "warns_when_enabled": Quirks(warning=0xFF01),
    "negated_home": Quirks(negated_home=True),
    "fast_homing": Quirks(homing_speed_factor=30),
    "homed_untruly": Quirks(homed_untruly=True),
    "maxon_epos4": Quirks(absent=(0x608F, 0x6091, 0x6092, 0x6074, 0x6078, 0x60C1)),
    "elmo_gold": Quirks(needs_sync_period=True, tpdos=4),
    "technosoft": Quirks(absent=(0x60C2, 0x608F, 0x6091, 0x6092, 0x6007), tpdo_slots=1, tpdos=4),
    "schunk_lwa4d": Quirks(modes=1 << 6, absent=(0x6007, 0x605A, 0x608F, 0x6091, 0x6092, 0x6076), tpdos=4),
}
"""By name, for ``sim --profile``: single quirks, and makers' drives."""


def quirks_of(name: str) -> Quirks:
    """A kind of drives by its name.

    Raises:
        DriveError: there is none of this name.
    """
    if name not in KINDS:
        raise DriveError(f"simulated drives have no profile {name!r}; allowed: {', '.join(KINDS)}")
    return KINDS[name]
