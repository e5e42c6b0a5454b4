from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import can
import pytest

from drivers import BusError, BusLock, Channel, describe_cob_id, listen_for_traffic, open_bus

NewChannel = Callable[[], Channel]

PEER = """
import sys, can
from drivers import Channel, open_bus
with open_bus(Channel.parse(sys.argv[1])) as bus:
    for cob_id in map(int, sys.argv[2:]):
        bus.send(can.Message(arbitration_id=cob_id, data=b"peer", is_extended_id=False))
"""


def send_from_elsewhere(channel: Channel, *cob_ids: int) -> None:
    """Frames from another process: a bus of this process would not show what leaves it."""
    subprocess.run([sys.executable, "-c", PEER, str(channel), *map(str, cob_ids)], check=True, timeout=60)


def everything(bus: can.BusABC, seconds: float = 0.1) -> list[int]:
    found = []
    while (message := bus.recv(seconds)) is not None:
        found.append(message.arbitration_id)
    return found


def test_frames_of_another_process_arrive_where_they_are_accepted(new_channel: NewChannel) -> None:
    channel = new_channel()
    with open_bus(channel, [0x181, 0x701]) as some, open_bus(channel) as all_of_them:
        send_from_elsewhere(channel, 0x181, 0x200, 0x701, 0x182)
        assert everything(some) == [0x181, 0x701]
        assert everything(all_of_them) == [0x181, 0x200, 0x701, 0x182]


def test_own_frames_do_not_come_back(new_channel: NewChannel) -> None:
    channel = new_channel()
    with open_bus(channel) as one, open_bus(channel) as other:
        for _ in range(50):
            one.send(can.Message(arbitration_id=0x80, is_extended_id=False))
        assert everything(other) == [0x80] * 50
        assert one.recv(0.1) is None


def test_groups_and_ports_do_not_mix(new_channel: NewChannel) -> None:
    channel = new_channel()
    with (
        open_bus(channel) as here,
        open_bus(new_channel()) as other_group,
        open_bus(Channel("udp_multicast", f"{channel.name}:43114")) as other_port,
    ):
        send_from_elsewhere(channel, 0x80)
        assert everything(here) == [0x80]
        assert other_group.recv(0.05) is None
        assert other_port.recv(0.05) is None


def test_foreign_datagrams_are_passed_over(new_channel: NewChannel) -> None:
    import socket

    channel = new_channel()
    with open_bus(channel) as bus, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        sock.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
        for junk in (b"", b"hello", b"\x93\x01\x02\x03", b"\x81\xa1a\x01", bytes(200)):
            sock.sendto(junk, channel.group_and_port())
        send_from_elsewhere(channel, 0x123)
        assert everything(bus) == [0x123]


def test_a_burst_of_many_frames_is_kept(new_channel: NewChannel) -> None:
    channel = new_channel()
    with open_bus(channel) as sender, open_bus(channel) as receiver:
        for k in range(2000):
            sender.send(can.Message(arbitration_id=k % 0x700, is_extended_id=False))
        assert len(everything(receiver)) == 2000


@pytest.mark.parametrize(
    ("interface", "name", "message"),
    [
        ("udp-multicast", "239.1.2.3", "unknown interface 'udp-multicast'; allowed: .*udp_multicast"),
        ("udp_multicast", "10.0.0.1", "'10.0.0.1' is not an IPv4 multicast group; allowed: 224.0.0.0 to"),
        ("udp_multicast", "vcan0", "'vcan0' is not an IPv4 multicast group"),
        ("udp_multicast", "239.1.2.3:0", "port '0' is not a UDP port; allowed: 1 to 65535"),
        ("udp_multicast", "239.1.2.3:abc", "port 'abc' is not a UDP port"),
        ("socketcan", "", "interface socketcan needs a channel"),
    ],
)
def test_a_wrong_channel_is_one_clear_line(interface: str, name: str, message: str) -> None:
    with pytest.raises(BusError, match=message) as caught:
        Channel(interface, name)
    assert "\n" not in str(caught.value)


def test_a_can_device_that_is_not_there_is_one_clear_line() -> None:
    with pytest.raises(
        BusError, match=r"cannot open socketcan:nocan7: (there is no|this machine's kernel)"
    ) as caught:
        open_bus(Channel("socketcan", "nocan7"))
    assert "\n" not in str(caught.value)


def test_hardware_whose_driver_is_missing_is_one_clear_line() -> None:
    with pytest.raises(BusError, match="cannot open kvaser:0: ") as caught:
        open_bus(Channel("kvaser", "0"))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["udp_multicast:239.1.2.3:5000", "socketcan:can0", "virtual:x"])
def test_a_channel_reads_its_own_text(text: str) -> None:
    assert str(Channel.parse(text)) == text


def test_a_bare_name_is_on_the_given_interface() -> None:
    assert Channel.parse("239.1.2.3:5000") == Channel("udp_multicast", "239.1.2.3:5000")
    assert Channel.parse("can0", "socketcan") == Channel("socketcan", "can0")


def test_a_lock_is_held_once_and_dies_with_its_process(new_channel: NewChannel, own_state: Path) -> None:
    channel = new_channel()
    code = (
        "import sys; from drivers import *; lock = BusLock(Channel.parse(sys.argv[1])); print(1, flush=True);"
        " sys.stdin.read()"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code, str(channel)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == b"1\n"
        with pytest.raises(BusError, match="is occupied: another armhil run holds it as master"):
            BusLock(channel)
        with BusLock(channel, "drives"):
            pass
        holder.kill()
        holder.wait()
    with BusLock(channel) as lock:
        assert lock.path.exists()
    assert list(own_state.iterdir()) == []


def test_traffic_of_others_is_heard(new_channel: NewChannel) -> None:
    channel = new_channel()
    assert listen_for_traffic(channel, 0.05) == frozenset()
    code = PEER.replace("with open", "import time\nwith open").replace(
        'data=b"peer", is_extended_id=False))', "is_extended_id=False)); time.sleep(0.1)"
    )
    arguments = [str(channel), *["1793"] * 100]
    with subprocess.Popen([sys.executable, "-c", code, *arguments]) as peer:
        try:
            deadline = time.monotonic() + 30
            while not (heard := listen_for_traffic(channel)) and time.monotonic() < deadline:
                pass
            assert heard == {0x701}
            assert listen_for_traffic(channel, cob_ids=[0x80]) == frozenset()
        finally:
            peer.kill()


def test_cob_ids_in_words() -> None:
    assert describe_cob_id(0x701) == "0x701 (heartbeat of node 1)"
    assert describe_cob_id(0x080) == "0x080 (SYNC)"
    assert describe_cob_id(0x20A) == "0x20A (RPDO1 of node 10)"
