"""The SDO server: frame by frame, and with the client of an independent library."""

from __future__ import annotations

import binascii
from collections.abc import Callable, Iterator

import canopen
import pytest
from canopen.sdo.exceptions import SdoAbortedError
from hypothesis import given
from hypothesis import strategies as st

from drivers import Channel, open_bus
from drivers.simulated.object_dictionary import EDS_PATH, ObjectDictionary, SdoAbort
from drivers.simulated.sdo_server import SdoServer
from robots import Robot


@pytest.fixture
def server() -> SdoServer:
    return SdoServer(ObjectDictionary(5))


def frame(text: str) -> bytes:
    return bytes.fromhex(text.replace(" ", ""))


@pytest.mark.parametrize(
    ("request_", "answer"),
    [
        ("40 00 10 00 00 00 00 00", "43 00 10 00 92 01 02 00"),  # 1000: four bytes
        ("40 17 10 00 00 00 00 00", "4B 17 10 00 64 00 00 00"),  # 1017: two bytes
        ("40 01 10 00 00 00 00 00", "4F 01 10 00 00 00 00 00"),  # 1001: one byte
        ("40 00 18 01 00 00 00 00", "43 00 18 01 85 01 00 00"),  # 1800:01 with the node id
        ("2B 17 10 00 F4 01 00 00", "60 17 10 00 00 00 00 00"),
        ("22 17 10 00 F4 01 00 00", "60 17 10 00 00 00 00 00"),  # size not said
        ("40 00 55 00 00 00 00 00", "80 00 55 00 00 00 02 06"),  # no such object
        ("40 18 10 09 00 00 00 00", "80 18 10 09 11 00 09 06"),  # no such sub-index
        ("23 00 10 00 01 00 00 00", "80 00 10 00 02 00 01 06"),  # read only
        ("2F 17 10 00 05 00 00 00", "80 17 10 00 13 00 07 06"),  # too short
        ("23 17 10 00 05 00 00 00", "80 17 10 00 12 00 07 06"),  # too long
        ("2B 5A 60 00 09 00 00 00", "80 5A 60 00 31 00 09 06"),  # above the limit
        ("2B 5A 60 00 FF FF 00 00", "80 5A 60 00 32 00 09 06"),  # below the limit
        ("C6 00 55 00 07 00 00 00", "80 00 55 00 00 00 02 06"),  # a block download to no object
        ("A4 00 55 00 7F 00 00 00", "80 00 55 00 00 00 02 06"),  # a block upload of none
        ("A4 08 10 00 00 00 00 00", "80 08 10 00 02 00 04 05"),  # in blocks of no segment
        ("A4 08 10 00 80 00 00 00", "80 08 10 00 02 00 04 05"),  # of more than a number can count
        ("A4 00 10 00 7F 04 00 00", "43 00 10 00 92 01 02 00"),  # not worth a block: four bytes
        ("A3 00 00 00 00 00 00 00", "80 00 00 00 01 00 04 05"),  # the start of a block upload of nothing
        ("E0 00 00 00 00 00 00 00", "80 00 00 00 01 00 04 05"),  # no command
        ("60 00 00 00 00 00 00 00", "80 00 00 00 01 00 04 05"),  # a segment of nothing
    ],
)
def test_one_request(server: SdoServer, request_: str, answer: str) -> None:
    assert server.answer(frame(request_)) == (frame(answer),)


def test_an_abort_and_a_short_frame_get_no_answer(server: SdoServer) -> None:
    assert server.answer(frame("80 00 10 00 00 00 00 00")) == ()
    assert server.answer(b"\x40\x00\x10") == ()


def test_segments_want_alternating_toggles(server: SdoServer) -> None:
    (first,) = server.answer(frame("40 08 10 00 00 00 00 00"))
    assert first[0] == 0x41
    (segment,) = server.answer(frame("60 00 00 00 00 00 00 00"))
    assert segment[0] & 0xF0 == 0x00
    assert server.answer(frame("60 00 00 00 00 00 00 00")) == (frame("80 08 10 00 00 00 03 05"),)


def test_a_wrong_announced_length_is_refused(server: SdoServer) -> None:
    server.answer(frame("21 00 21 00 09 00 00 00"))
    assert server.answer(frame("01 41 42 43 44 45 46 47")) == (frame("80 00 21 00 10 00 07 06"),)
    with pytest.raises(SdoAbort):
        ObjectDictionary(5).entry(0x2100, 1)


@given(st.text(st.characters(min_codepoint=32, max_codepoint=126), min_size=1, max_size=60))
def test_a_string_there_and_back_in_segments(text: str) -> None:
    server = SdoServer(ObjectDictionary(5))
    data = text.encode()
    server.answer(b"\x21\x00\x21\x00" + len(data).to_bytes(4, "little"))
    parts = [data[k : k + 7] for k in range(0, len(data), 7)]
    for k, part in enumerate(parts):
        last = k == len(parts) - 1
        command = (k % 2) << 4 | (7 - len(part)) << 1 | last
        (answer,) = server.answer(bytes([command]) + part.ljust(7, b"\0"))
        assert answer == bytes([0x20 | (k % 2) << 4]) + bytes(7)
    assert server._dictionary.read(0x2100, 0) == data


def block_frames(data: bytes) -> list[bytes]:
    """The segments of one block, at most 127 of them."""
    parts = [data[k : k + 7] for k in range(0, len(data), 7)]
    return [
        bytes([(k + 1) | (0x80 if k + 1 == len(parts) else 0)]) + part.ljust(7, b"\0")
        for k, part in enumerate(parts)
    ]


def end_of(data: bytes) -> bytes:
    unused = -len(data) % 7
    return bytes([0xC1 | unused << 2]) + binascii.crc_hqx(data, 0).to_bytes(2, "little") + bytes(5)


START_BLOCK = b"\xc6\x00\x21\x00"
LABEL = b"a label long enough for some segments"


def test_a_segment_lost_from_a_block_is_asked_for_again(server: SdoServer) -> None:
    size = len(LABEL).to_bytes(4, "little")
    assert server.answer(START_BLOCK + size) == (frame("A4 00 21 00 7F 00 00 00"),)
    segments = block_frames(LABEL)
    lost = [segment for k, segment in enumerate(segments) if k != 2]
    answers = [answer for segment in lost for answer in server.answer(segment)]
    assert answers == [frame("A2 02 7F 00 00 00 00 00")], "the second was the last in order"
    again = block_frames(LABEL[14:])
    answers = [answer for segment in again for answer in server.answer(segment)]
    assert answers == [bytes([0xA2, len(again), 0x7F, 0, 0, 0, 0, 0])]
    assert server.answer(end_of(LABEL)) == (frame("A1 00 00 00 00 00 00 00"),)
    assert server._dictionary.read(0x2100, 0) == LABEL


@pytest.mark.parametrize(
    ("size", "end", "code"),
    [
        (len(LABEL) + 1, end_of(LABEL), 0x06070010),
        (len(LABEL), end_of(LABEL)[:1] + b"\x12\x34" + bytes(5), 0x05040004),
        (len(LABEL), bytes(8), 0x05040001),
    ],
)
def test_a_block_that_is_not_what_was_announced_is_refused(
    server: SdoServer, size: int, end: bytes, code: int
) -> None:
    before = server._dictionary.read(0x2100, 0)
    server.answer(START_BLOCK + size.to_bytes(4, "little"))
    for segment in block_frames(LABEL):
        server.answer(segment)
    assert server.answer(end) == (frame("80 00 21 00") + code.to_bytes(4, "little"),)
    assert server._dictionary.read(0x2100, 0) == before
    assert server.answer(frame("40 00 10 00 00 00 00 00"))[0][0] == 0x43, "and the next request is answered"


def test_what_a_client_has_not_got_of_a_block_goes_out_again(server: SdoServer) -> None:
    server._dictionary.set(0x2100, 0, LABEL)
    (first,) = server.answer(frame("A4 00 21 00 04 00 00 00"))
    assert first == frame("C6 00 21 00") + len(LABEL).to_bytes(4, "little")
    block = server.answer(frame("A3 00 00 00 00 00 00 00"))
    assert [segment[0] for segment in block] == [1, 2, 3, 4]
    again = server.answer(frame("A2 02 04 00 00 00 00 00"))
    assert [segment[0] for segment in again] == [1, 2, 3, 0x84]
    assert b"".join(s[1:] for s in (*block[:2], *again))[: len(LABEL)] == LABEL
    assert server.answer(frame("A2 04 04 00 00 00 00 00")) == (end_of(LABEL),)
    assert server.answer(frame("A1 00 00 00 00 00 00 00")) == ()
    server.answer(frame("A4 00 21 00 04 00 00 00"))
    server.answer(frame("A3 00 00 00 00 00 00 00"))
    assert server.answer(frame("A2 09 04 00 00 00 00 00")) == (frame("80 00 21 00 03 00 04 05"),)


@pytest.mark.parametrize("length", [1, 6, 7, 8, 889, 890, 3000])
def test_a_client_of_another_library_sends_and_fetches_blocks(node: canopen.RemoteNode, length: int) -> None:
    text = "".join(chr(33 + (7 * k) % 90) for k in range(length))
    with node.sdo[0x2100].open(
        "w", encoding="ascii", buffering=8000, size=length, block_transfer=True
    ) as stream:
        stream.write(text)
    assert node.sdo[0x2100].raw == text
    with node.sdo[0x2100].open("r", encoding="ascii", block_transfer=True) as stream:
        assert stream.read() == text


@pytest.fixture
def node(serve_drives: Callable[..., Channel]) -> Iterator[canopen.RemoteNode]:
    network = canopen.Network(open_bus(serve_drives()))
    network.NOTIFIER_CYCLE = 0.02
    network.connect()
    yield network.add_node(canopen.RemoteNode(2, str(EDS_PATH)))
    network.disconnect()


def test_a_client_reads_every_object(node: canopen.RemoteNode, tx40: Robot) -> None:
    assert node.sdo[0x1008].raw == "armhil simulated servo drive"
    assert node.sdo[0x6502].raw == 0xE0
    assert node.sdo[0x608F][1].raw == tx40.drive[1].encoder_counts
    assert node.sdo[0x6091][1].raw == 32
    assert node.sdo[0x60C2][1].raw * 10 ** node.sdo[0x60C2][2].raw == pytest.approx(0.004)
    for index, thing in node.object_dictionary.items():
        subindices = [0] if isinstance(thing, canopen.objectdictionary.ODVariable) else list(thing)
        for subindex in subindices if index != 0x1003 else [0]:  # no error, so no entry that could be read
            node.sdo.upload(index, subindex)


def test_a_client_writes_in_one_frame_and_in_segments(node: canopen.RemoteNode) -> None:
    node.sdo[0x6065].raw = 123456
    assert node.sdo[0x6065].raw == 123456
    label = "cell 7, arm on the left, exchanged after the collision in spring"
    node.sdo[0x2100].raw = label
    assert node.sdo[0x2100].raw == label


@pytest.mark.parametrize(
    ("index", "subindex", "data", "code"),
    [
        (0x6041, 0, b"\0\0", 0x06010002),
        (0x6041, 3, b"\0\0", 0x06090011),
        (0x5555, 0, b"\0", 0x06020000),
        (0x6060, 0, b"\x01", 0x06090030),
        (0x6065, 0, b"\0\0", 0x06070013),
        (0x1A00, 1, b"\x10\0\x41\x60", 0x08000022),  # mapping of a valid PDO
        (0x1400, 2, b"\xf1", 0x06090030),  # a transmission type that CiA 301 reserves
    ],
)
def test_a_client_is_refused_with_the_right_code(
    node: canopen.RemoteNode, index: int, subindex: int, data: bytes, code: int
) -> None:
    with pytest.raises(SdoAbortedError) as refusal:
        node.sdo.download(index, subindex, data)
    assert refusal.value.code == code


def test_a_client_changes_the_mapping_by_the_rules(node: canopen.RemoteNode) -> None:
    sdo = node.sdo
    sdo[0x1A00][0].raw  # noqa: B018  a read before the rules apply
    sdo[0x1800][1].raw = 0x182 | 1 << 31
    with pytest.raises(SdoAbortedError):  # still mapped
        sdo[0x1A00][1].raw = 0x60640020
    sdo[0x1A00][0].raw = 0
    for word, code in ((0x60640010, 0x06040041), (0x60FE0020, 0x06020000), (0x100800FF, 0x06040041)):
        with pytest.raises(SdoAbortedError) as refusal:
            sdo[0x1A00][1].raw = word
        assert refusal.value.code == code
    for k, word in enumerate((0x60640020, 0x60620020, 0x60410010), start=1):
        sdo[0x1A00][k].raw = word
    with pytest.raises(SdoAbortedError) as refusal:
        sdo[0x1A00][0].raw = 3
    assert refusal.value.code == 0x06040042
    sdo[0x1A00][0].raw = 2
    sdo[0x1800][1].raw = 0x182
    assert sdo[0x1A00][0].raw == 2
