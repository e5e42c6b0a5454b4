"""EMCY: error codes, the error register, and the error objects of a drive (CiA 301, 7.2.7)."""

from __future__ import annotations

import struct
from enum import IntEnum

from drivers.simulated.object_dictionary import ObjectDictionary

_EMCY = struct.Struct("<HB5x")
_HISTORY = 8


class Emergency(IntEnum):
    """Error codes that the drive finds by itself (CiA 301 table 26, CiA 402)."""

    NO_ERROR = 0x0000
    MOTOR_TEMPERATURE = 0x4310
    PARAMETER = 0x6320
    COMMUNICATION = 0x8100
    HEARTBEAT = 0x8130
    RPDO_LENGTH = 0x8210
    RPDO_TIMEOUT = 0x8250
    FOLLOWING_ERROR = 0x8611


def record_error(dictionary: ObjectDictionary, code: int) -> bytes:
    """Enters an error into 603F, 1001 and the history 1003; code 0 says that errors are reset.

    Returns:
        The payload of the EMCY frame.
    """
    register = error_register(code)
    dictionary.set(0x603F, 0, code)
    dictionary.set(0x1001, 0, register)
    if code:
        count = min(dictionary.integer(0x1003, 0) + 1, _HISTORY)
        for k in range(count, 1, -1):
            dictionary.set(0x1003, k, dictionary.integer(0x1003, k - 1))
        dictionary.set(0x1003, 1, code)
        dictionary.set(0x1003, 0, count)
    return _EMCY.pack(code, register)


def error_register(code: int) -> int:
    """Object 1001 for an EMCY code: the generic bit, and the one of the code's class."""
    if code == 0:
        return 0
    if code >> 8 in (0x81, 0x82):
        return 0x11
    classes = {0x2: 0x02, 0x3: 0x04, 0x4: 0x08}
    return 0x01 | classes.get(code >> 12, 0x20)
