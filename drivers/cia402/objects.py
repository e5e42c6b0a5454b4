"""Object indices of CiA 301 and CiA 402 that the set-up reads and writes."""

from __future__ import annotations

from typing import Final

CYCLIC_SYNCHRONOUS_POSITION: Final = 8
"""Value of 6060h for the mode csp."""
INTERPOLATED_POSITION: Final = 7
"""Value of 6060h for the mode ip."""
HOMING: Final = 6
"""Value of 6060h for homing mode."""

DEVICE_TYPE: Final = 0x1000
SYNC_COB_ID: Final = 0x1005
SYNC_PERIOD: Final = 0x1006
IDENTITY: Final = 0x1018
EMCY_COB_ID: Final = 0x1014
HEARTBEAT_CONSUMER: Final = 0x1016
HEARTBEAT_PRODUCER: Final = 0x1017
RPDO_COMMUNICATION: Final = 0x1400
RPDO_MAPPING: Final = 0x1600
TPDO_COMMUNICATION: Final = 0x1800
TPDO_MAPPING: Final = 0x1A00
ABORT_OPTION: Final = 0x6007
ERROR_CODE: Final = 0x603F
CONTROLWORD: Final = 0x6040
STATUSWORD: Final = 0x6041
MODE: Final = 0x6060
MODE_DISPLAY: Final = 0x6061
ACTUAL_POSITION: Final = 0x6064
TARGET_POSITION: Final = 0x607A
HOME_OFFSET: Final = 0x607C
HOMING_METHOD: Final = 0x6098
HOMING_SPEEDS: Final = 0x6099
HOMING_ACCELERATION: Final = 0x609A
INTERPOLATION_SUBMODE: Final = 0x60C0
INTERPOLATION_DATA: Final = 0x60C1
INTERPOLATION_PERIOD: Final = 0x60C2
SUPPORTED_MODES: Final = 0x6502

SETTINGS: Final[dict[str, tuple[int, int, bool]]] = {
    "1001": (0x1001, 0, False),
    "1016:01": (0x1016, 1, False),
    "1029:01": (0x1029, 1, False),
    "1400:05": (0x1400, 5, False),
    "6007": (0x6007, 0, True),
    "603F": (0x603F, 0, False),
    "605A": (0x605A, 0, True),
    "605B": (0x605B, 0, True),
    "605C": (0x605C, 0, True),
    "605D": (0x605D, 0, True),
    "605E": (0x605E, 0, True),
    "6065": (0x6065, 0, False),
    "6066": (0x6066, 0, False),
    "6072": (0x6072, 0, False),
    "6073": (0x6073, 0, False),
    "6076": (0x6076, 0, False),
    "607D:01": (0x607D, 1, True),
    "607D:02": (0x607D, 2, True),
    "607E": (0x607E, 0, False),
    "607F": (0x607F, 0, False),
    "6080": (0x6080, 0, False),
    "6085": (0x6085, 0, False),
    "608F:01": (0x608F, 1, False),
    "608F:02": (0x608F, 2, False),
    "6091:01": (0x6091, 1, False),
    "6091:02": (0x6091, 2, False),
    "6092:01": (0x6092, 1, False),
    "6092:02": (0x6092, 2, False),
    "6093:01": (0x6093, 1, False),
    "6093:02": (0x6093, 2, False),
    "6096:01": (0x6096, 1, False),
    "6096:02": (0x6096, 2, False),
    "60A8": (0x60A8, 0, False),
    "60A9": (0x60A9, 0, False),
}
"""Settings that matter for safety and units, read where a drive has them: index, subindex, signed."""
