"""Object indices of CiA 301 and CiA 402 that the set-up reads and writes."""

from __future__ import annotations

from typing import Final

CYCLIC_SYNCHRONOUS_POSITION: Final = 8
"""Value of 6060h for the mode csp."""

DEVICE_TYPE: Final = 0x1000
IDENTITY: Final = 0x1018
HEARTBEAT_CONSUMER: Final = 0x1016
HEARTBEAT_PRODUCER: Final = 0x1017
RPDO_COMMUNICATION: Final = 0x1400
RPDO_MAPPING: Final = 0x1600
TPDO_COMMUNICATION: Final = 0x1800
TPDO_MAPPING: Final = 0x1A00
CONTROLWORD: Final = 0x6040
STATUSWORD: Final = 0x6041
MODE: Final = 0x6060
MODE_DISPLAY: Final = 0x6061
ACTUAL_POSITION: Final = 0x6064
TARGET_POSITION: Final = 0x607A
INTERPOLATION_PERIOD: Final = 0x60C2
SUPPORTED_MODES: Final = 0x6502

SETTINGS: Final[dict[str, tuple[int, int, bool]]] = {
    "error behaviour on communication loss (1029:01)": (0x1029, 1, False),
    "heartbeat consumer (1016:01)": (0x1016, 1, False),
    "abort connection option (6007)": (0x6007, 0, True),
    "quick stop option (605A)": (0x605A, 0, True),
    "shutdown option (605B)": (0x605B, 0, True),
    "disable operation option (605C)": (0x605C, 0, True),
    "halt option (605D)": (0x605D, 0, True),
    "fault reaction option (605E)": (0x605E, 0, True),
    "following error window (6065)": (0x6065, 0, False),
    "following error time-out (6066)": (0x6066, 0, False),
    "maximum torque (6072)": (0x6072, 0, False),
    "software position limit, minimum (607D:01)": (0x607D, 1, True),
    "software position limit, maximum (607D:02)": (0x607D, 2, True),
    "maximum profile velocity (607F)": (0x607F, 0, False),
    "maximum motor speed (6080)": (0x6080, 0, False),
    "quick stop deceleration (6085)": (0x6085, 0, False),
}
"""Safety-relevant settings that are read where a drive has them: index, subindex, signed."""
