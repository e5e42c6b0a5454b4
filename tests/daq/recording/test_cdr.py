"""CDR: what is encoded comes back, in both byte orders, and nonsense is refused."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.recording import messages
from daq.recording.cdr import CdrDecoder, CdrEncoder, CdrError

WHOLE = {"uint8": 8, "uint16": 16, "uint32": 32, "uint64": 64}
NUMBERS: dict[str, st.SearchStrategy[float]] = {
    "bool": st.booleans(),
    "int32": st.integers(-(2**31), 2**31 - 1),
    "float64": st.floats(allow_nan=False),
    **{kind: st.integers(0, 2**bits - 1) for kind, bits in WHOLE.items()},
}
TEXT = st.text(st.characters(exclude_characters="\x00", exclude_categories=["Cs"]), max_size=12)


@st.composite
def fields(draw: st.DrawFn) -> list[tuple[str, object]]:
    """Names of methods with what to encode: a message of any fields in any order."""
    found: list[tuple[str, object]] = []
    for _ in range(draw(st.integers(0, 8))):
        what = draw(st.sampled_from(["primitive", "sequence", "string", "strings"]))
        if what in ("string", "strings"):
            found.append((what, draw(TEXT if what == "string" else st.lists(TEXT, max_size=4))))
        else:
            kind = draw(st.sampled_from(sorted(NUMBERS)))
            one = NUMBERS[kind]
            found.append((f"{what} {kind}", draw(one if what == "primitive" else st.lists(one, max_size=5))))
    return found


def encoded(message: list[tuple[str, object]]) -> bytes:
    encoder = CdrEncoder()
    for what, value in message:
        method, *kind = what.split()
        getattr(encoder, method)(*kind, value)
    return encoder.finish()


def decoded(data: bytes, message: list[tuple[str, object]]) -> list[object]:
    decoder = CdrDecoder(data)
    return [getattr(decoder, what.split()[0])(*what.split()[1:]) for what, _ in message]


@given(fields())
def test_what_is_encoded_comes_back(message: list[tuple[str, object]]) -> None:
    assert decoded(encoded(message), message) == [value for _, value in message]


@given(fields(), st.data())
def test_a_message_cut_short_is_refused(message: list[tuple[str, object]], data: st.DataObject) -> None:
    whole = encoded(message)
    cut = data.draw(st.integers(0, len(whole) - 1))
    with pytest.raises(CdrError):
        decoded(whole[:cut], message)


@given(st.binary(max_size=200))
def test_random_bytes_are_a_message_or_a_cdr_error(data: bytes) -> None:
    try:
        state = messages.decode_joint_state(b"\x00\x01\x00\x00" + data)
    except CdrError:
        return
    assert len(state.position) * 8 <= len(data)


def test_alignment_counts_from_the_end_of_the_header() -> None:
    data = encoded(
        [("primitive uint8", 1), ("primitive float64", 2.0), ("string", "ab"), ("primitive uint16", 3)]
    )
    body = (
        b"\x01" + bytes(7) + struct.pack("<d", 2.0) + struct.pack("<I", 3) + b"ab\x00" + b"\x00" + b"\x03\x00"
    )
    assert data == b"\x00\x01\x00\x00" + body


def test_an_empty_sequence_is_not_padded_to_its_elements() -> None:
    assert encoded([("sequence float64", [])]) == b"\x00\x01\x00\x00" + bytes(4)


def test_big_endian_is_read() -> None:
    body = struct.pack(">i", -5) + struct.pack(">I", 7) + struct.pack(">I", 1) + b"\x00" + bytes(3)
    body += struct.pack(">I", 1) + struct.pack(">I", 7) + b"joint1\x00" + b"\x00"
    body += (
        struct.pack(">I", 1) + bytes(4) + struct.pack(">d", 1.5) + struct.pack(">I", 0) + struct.pack(">I", 0)
    )
    state = messages.decode_joint_state(b"\x00\x00\x00\x00" + body)
    assert state == messages.JointState(-5_000_000_000 + 7, ("joint1",), (1.5,), (), ())


@pytest.mark.parametrize("data", [b"", b"\x00\x01", b"\x00\x03\x00\x00", b"\x01\x01\x00\x00"])
def test_other_encapsulations_are_refused(data: bytes) -> None:
    with pytest.raises(CdrError):
        CdrDecoder(data)


@given(
    names=st.lists(TEXT, min_size=1, max_size=7),
    stamps=st.lists(st.integers(0, 2**60), min_size=1, max_size=5),
    effort=st.booleans(),
    seed=st.integers(0, 2**32),
)
def test_the_fast_encoder_writes_what_the_plain_one_does(
    names: list[str], stamps: list[int], effort: bool, seed: int
) -> None:
    values = np.random.default_rng(seed).normal(size=(2, len(stamps), len(names)))
    layout = messages.joint_state_layout(names, effort=effort)
    columns = {"position": values[0]} | ({"effort": values[1]} if effort else {})
    rows = layout.rows(np.array(stamps, dtype=np.int64), columns)
    encoded_messages = [row.tobytes() for row in rows]
    for row, data in enumerate(encoded_messages):
        state = messages.decode_joint_state(data)
        assert state.stamp == stamps[row]
        assert state.name == tuple(names)
        assert state.position == tuple(values[0, row])
        assert state.effort == (tuple(values[1, row]) if effort else ())
    records = layout.decode(rows)
    assert records is not None
    assert np.array_equal(records["position"], values[0])


def test_a_message_that_is_not_the_layout_is_not_decoded() -> None:
    layout = messages.joint_state_layout(["a", "b"])
    rows = layout.rows(np.array([0]), {"position": np.zeros((1, 2))})
    assert layout.decode(np.hstack([rows, np.zeros((1, 1), np.uint8)])) is None
    assert messages.joint_state_layout(["a", "c"]).decode(rows) is None
