"""The note of a stream: there before torque, for every user, on any bus, through nothing but real files."""

from __future__ import annotations

import json
import os
import stat
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest

import robots
from drivers import ArmSession, BusError, BusLock, Channel, DriveError
from drivers.bus import state_folder
from drivers.bus.last_rest import LastRest
from drivers.bus.lockout import Lockout
from drivers.frames import channel

CAN0, CAN1 = Channel("socketcan", "can0"), Channel("socketcan", "can1")
SERIALS = ("0000009A-00000001-77", "0000009A-00000001-78")


@pytest.fixture
def machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A machine of its own, of which nothing is configured."""
    monkeypatch.delenv("ARMHIL_STATE")
    monkeypatch.setattr(state_folder, "MACHINE", (tmp_path / "lib" / "armhil", tmp_path / "tmp" / "armhil"))
    (tmp_path / "lib").mkdir()
    (tmp_path / "tmp").mkdir()
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "me"))
    return tmp_path


def other_user(machine: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another environment; of the first one only what the machine shares is left."""
    for name in ("HOME", "TMPDIR", "XDG_STATE_HOME", "XDG_RUNTIME_DIR"):
        monkeypatch.setenv(name, str(machine / "other" / name))


def test_a_note_is_the_same_for_every_user_and_known_by_its_drives(
    machine: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Lockout(CAN0, "arm", SERIALS).begin()
    (note,) = (machine / "lib" / "armhil").iterdir()
    assert stat.S_IMODE(note.parent.stat().st_mode) == 0o1777
    other_user(machine, monkeypatch)
    for same in (Lockout(CAN0), Lockout(CAN1, "renamed", SERIALS[1:]), Lockout(CAN0, "another", ("x",))):
        assert f"process {os.getpid()} began" in str(same.reason)
    assert Lockout(CAN1, "arm", ("0000009A-00000001-79",)).reason is None
    Lockout(CAN1, "renamed", SERIALS).lift()
    assert Lockout(CAN0).reason is None and not note.exists()


def test_no_session_streams_or_homes_while_a_note_of_another_one_stands(machine: Path) -> None:
    """Beneath every command, for whoever uses the package itself."""
    session = ArmSession(robots.load("emps"), CAN0)
    session._refuse_stream()
    Lockout(CAN0, "emps").begin()
    with pytest.raises(DriveError, match=r"the last stream ended by itself .*`armhil acknowledge "):
        session._refuse_stream()


def test_the_first_cause_stays(machine: Path) -> None:
    lockout = Lockout(CAN0, "arm", SERIALS)
    lockout.begin()
    lockout.keep("drive 2 left operation enabled; EMCY 0x4310 (motor over-temperature)")
    Lockout(CAN0).keep("EMCY 0x8130 (heartbeat lost)")
    assert lockout.reason == "drive 2 left operation enabled; EMCY 0x4310 (motor over-temperature)"
    found = json.loads(next((machine / "lib" / "armhil").iterdir()).read_text())
    assert found["serials"] == list(SERIALS), "what the beginning knew is kept with it"


def test_a_note_of_a_user_who_can_write_elsewhere_only_is_found(
    machine: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for place in (machine / "lib" / "armhil", machine / "tmp" / "armhil", machine / "me" / "armhil"):
        with state_folder.StateFolder(place, create=True) as folder:
            folder.write("lockout-socketcan-can0.json", json.dumps(EXAMPLE | {"reason": place.parent.name}))
        assert Lockout(CAN0).reason == place.parent.name
        Lockout(CAN0).lift()
        assert Lockout(CAN0).reason is None


EXAMPLE = {
    "channel": "",
    "arm": "",
    "serials": [],
    "begun": "2026-01-01 00:00:00",
    "process": 1,
    "reason": None,
}


def test_it_is_on_the_disk_before_anything_moves(machine: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    synced: list[str] = []
    real = os.fsync

    def fsync(descriptor: int) -> None:
        synced.append("folder" if stat.S_ISDIR(os.fstat(descriptor).st_mode) else "file")
        real(descriptor)

    monkeypatch.setattr(os, "fsync", fsync)
    Lockout(CAN0).begin()
    assert synced == ["file", "folder"]
    Lockout(CAN0).keep("reason")
    Lockout(CAN0).lift()
    assert synced[2:] == ["file", "folder", "folder"]


def test_a_link_in_place_of_a_note_is_not_followed(machine: Path) -> None:
    Lockout(CAN0).begin()
    (note,) = (machine / "lib" / "armhil").iterdir()
    victim = machine / "victim"
    victim.write_text("precious")
    for make in (note.symlink_to, note.hardlink_to):
        note.unlink()
        make(victim)
        with pytest.raises(DriveError, match="nothing moves, because no note of it can be kept"):
            Lockout(CAN0).begin()
        assert "cannot be read" in str(Lockout(CAN0).reason)
        Lockout(CAN0).keep("anything")
        assert victim.read_text() == "precious"
    note.unlink()
    os.mkfifo(note)
    assert "cannot be read" in str(Lockout(CAN0).reason), "and nobody waits for somebody to write into it"


@pytest.mark.parametrize("kind", ["link", "loose", "file"])
def test_a_folder_that_others_have_laid_out_is_not_used(machine: Path, kind: str) -> None:
    bad = machine / "lib" / "armhil"
    if kind == "link":
        (machine / "elsewhere").mkdir()
        bad.symlink_to(machine / "elsewhere")
    elif kind == "loose":
        bad.mkdir()
        bad.chmod(0o777)
    else:
        bad.write_text("")
    Lockout(CAN0).begin()
    assert [path.name for path in (machine / "tmp" / "armhil").iterdir()] == ["lockout-socketcan-can0.json"]
    assert not list((machine / "elsewhere").iterdir()) if kind == "link" else True
    assert Lockout(CAN0).reason is not None


@pytest.mark.parametrize(("folder", "file"), [(0o1777, 0o666), (0o2770, 0o660), (0o700, 0o600)])
def test_who_may_write_in_the_folder_may_write_a_note_and_nobody_else(
    machine: Path, folder: int, file: int
) -> None:
    place = machine / "lib" / "armhil"
    place.mkdir()
    place.chmod(folder)
    Lockout(CAN0).begin()
    with BusLock(CAN0):
        assert {stat.S_IMODE(path.stat().st_mode) for path in place.iterdir()} == {file}
        assert len(list(place.iterdir())) == 2


def test_notes_that_may_not_be_looked_at_are_not_passed_over(
    machine: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Lockout(CAN0).begin()
    real = os.open

    def closed(path: object, *arguments: object, **options: object) -> int:
        if path == machine / "lib" / "armhil":
            raise PermissionError(13, "Permission denied")
        return real(path, *arguments, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(os, "open", closed)
    for look in (lambda: Lockout(CAN0).reason, Lockout(CAN0).lift, lambda: BusLock(CAN0)):
        with pytest.raises(BusError, match=r"lib/armhil may not be looked into.*join the group"):
            look()
    BusLock(Channel("udp_multicast", "239.74.4.4:4444")).release()


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can be two users")
def test_another_user_finds_it_adds_to_it_and_acknowledges_it(
    machine: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a folder for everybody, where nobody can take away another user's file."""
    code = (
        "import os, sys; from pathlib import Path; from drivers.bus import state_folder as s;"
        " s.MACHINE = (Path(sys.argv[1]),); from drivers import Channel;"
        " from drivers.bus.lockout import Lockout; os.setgid(65534); os.setuid(65534);"
        " note = Lockout(Channel('socketcan', 'can0')); print(note.reason);"
        " note.keep('second'); print(note.reason); note.lift(); print(note.reason);"
        " note.begin(); print(note.reason is not None)"
    )
    with tempfile.TemporaryDirectory() as name:
        Path(name).chmod(0o711)
        place = Path(name) / "armhil"
        monkeypatch.setattr(state_folder, "MACHINE", (place,))
        Lockout(CAN0, "arm", SERIALS).begin()
        words = [sys.executable, "-c", code, str(place)]
        told = subprocess.run(words, capture_output=True, text=True, check=True).stdout.splitlines()
        assert told[0].startswith(f"the stream that process {os.getpid()} began")
        assert told[1:] == ["second", "None", "True"]
        assert Lockout(CAN0).reason is not None, "and the first user finds the second one's"
        Lockout(CAN0).lift()
        assert Lockout(CAN0).reason is None


def test_where_no_note_can_be_kept_nothing_moves(machine: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (machine / "file").write_text("")
    monkeypatch.setattr(state_folder, "MACHINE", (machine / "file" / "a",))
    monkeypatch.setenv("XDG_STATE_HOME", str(machine / "file"))
    with pytest.raises(DriveError, match=r"install -d -m 1777 /var/lib/armhil.*ARMHIL_STATE"):
        Lockout(CAN0).begin()
    with pytest.raises(BusError, match="no folder for what has to outlive"):
        BusLock(CAN0)


BEYOND = "1e999"
INFINITE = json.dumps(
    {"channel": "", "arm": "", "serials": [], "begun": "", "process": 7, "reason": None}
).replace("7", BEYOND)


@pytest.mark.parametrize(
    "text", [BEYOND, "[" * 6000, f'{{"when": "", "offsets": [{BEYOND}], "position": [0.0]}}']
)
def test_a_damaged_record_of_a_rest_asks_for_a_look(machine: Path, text: str) -> None:
    rest = LastRest(CAN0, ["joint"], ["1"])
    rest.keep([0], np.zeros(1))
    (record,) = (machine / "lib" / "armhil").iterdir()
    record.write_text(text)
    assert rest.doubt([0], np.zeros(1)) == "the record of where it last stood is damaged"


@pytest.mark.parametrize("text", ["{", "[]", '"x"', '{"reason": 1}', "\x00\x01", "[" * 6000, INFINITE])
def test_a_damaged_note_still_stands(machine: Path, text: str) -> None:
    Lockout(CAN0).begin()
    (note,) = (machine / "lib" / "armhil").iterdir()
    note.write_text(text)
    assert Lockout(CAN0).reason == "the note of the last motion is damaged"


def test_an_emptied_note_is_none(machine: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As another user leaves it, who may not take it out of the folder."""
    Lockout(CAN0).begin()
    (note,) = (machine / "lib" / "armhil").iterdir()

    def refuse(*arguments: object, **options: object) -> None:
        raise PermissionError(1, "not permitted")

    with monkeypatch.context() as patch:
        patch.setattr(os, "unlink", refuse)
        Lockout(CAN0).lift()
    assert note.read_text() == "" and Lockout(CAN0).reason is None


def test_a_note_that_cannot_be_taken_away_is_told(machine: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*arguments: object, **options: object) -> None:
        raise PermissionError(1, "not permitted")

    Lockout(CAN0).begin()
    monkeypatch.setattr(os, "unlink", refuse)
    monkeypatch.setattr(os, "ftruncate", refuse)
    with pytest.raises(DriveError, match=r"lockout-socketcan-can0\.json: the lock-out cannot be lifted"):
        Lockout(CAN0).lift()
    assert Lockout(CAN0).reason is not None


def test_hardware_that_was_given_the_name_of_a_virtual_bus_has_notes_all_the_same(
    machine: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """``ip link set can0 name vcan0``."""
    vcan0 = Channel("socketcan", "vcan0")
    monkeypatch.setattr(channel, "NETWORK", machine / "net")
    (machine / "net" / "vcan0").mkdir(parents=True)
    Lockout(vcan0).begin()
    assert vcan0.only_simulated and Lockout(vcan0).reason is None
    (machine / "net" / "vcan0" / "device").mkdir()
    Lockout(vcan0).begin()
    assert not vcan0.only_simulated and Lockout(vcan0).reason is not None


def test_a_place_that_depends_on_where_one_stands_is_none(
    machine: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two programs in two folders would not find each other's notes."""
    for name in ("state", "~/state", "../state"):
        monkeypatch.setenv("ARMHIL_STATE", name)
        for look in (Lockout(CAN0).begin, lambda: Lockout(CAN0).reason, lambda: BusLock(CAN0)):
            with pytest.raises((BusError, DriveError), match="allowed: a path that begins with /"):
                look()
    monkeypatch.delenv("ARMHIL_STATE")
    monkeypatch.setenv("XDG_STATE_HOME", "state")
    monkeypatch.setenv("HOME", str(machine / "home"))
    assert state_folder.places()[-1] == machine / "home" / ".local" / "state" / "armhil"


def test_two_users_do_not_have_one_bus(machine: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The first can write nowhere but in a place that the second would not have chosen."""
    code = (
        "import sys; from pathlib import Path; from drivers.bus import state_folder as s;"
        " s.MACHINE = (Path(sys.argv[1]),); from drivers import BusLock, Channel;"
        " lock = BusLock(Channel('socketcan', 'can0')); print(1, flush=True); sys.stdin.read()"
    )
    place = str(machine / "tmp" / "armhil")
    with subprocess.Popen(
        [sys.executable, "-c", code, place], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as holder:
        assert holder.stdout is not None and holder.stdout.readline() == b"1\n"
        other_user(machine, monkeypatch)
        with pytest.raises(BusError, match="is occupied: another armhil run holds it as master"):
            BusLock(CAN0)
        BusLock(CAN1).release()
        holder.kill()
    with BusLock(CAN0) as lock:
        assert lock.path.parent == machine / "lib" / "armhil"
