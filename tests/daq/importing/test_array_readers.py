"""NumPy archives, HDF5, MATLAB 7.3 and ROS 1 bags, written by the libraries of their owners."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import scipy.io
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_typestore

from daq.importing.table_readers import READERS, read_mat
from daq.recording.errors import CaptureError

TIME = np.arange(5) * 0.01
Q = np.arange(10.0).reshape(5, 2)


def test_an_archive_of_arrays(tmp_path: Path) -> None:
    path = tmp_path / "log.npz"
    np.savez(path, t=TIME, q=Q, name=np.array("an arm"), flag=np.array([True] * 5))
    columns = READERS[".npz"](path)
    assert sorted(columns) == ["flag", "q:1", "q:2", "t"]
    assert columns["q:2"].tolist() == [1.0, 3.0, 5.0, 7.0, 9.0]


def test_a_structured_array(tmp_path: Path) -> None:
    table = np.zeros(5, dtype=[("t", "f8"), ("q", "f4", (2,))])
    table["t"], table["q"] = TIME, Q
    np.save(tmp_path / "log.npy", table)
    columns = READERS[".npy"](tmp_path / "log.npy")
    assert sorted(columns) == ["q:1", "q:2", "t"]
    np.save(tmp_path / "plain.npy", Q)
    assert sorted(READERS[".npy"](tmp_path / "plain.npy")) == ["data:1", "data:2"]


def test_pickled_objects_are_never_loaded(tmp_path: Path) -> None:
    path = tmp_path / "log.npz"
    np.savez(path, t=TIME, meta=np.array({"a": 1}, dtype=object), allow_pickle=True)
    with pytest.raises(CaptureError, match="is not a NumPy file of numbers"):
        READERS[".npz"](path)


def test_groups_and_tables_of_hdf5(tmp_path: Path) -> None:
    path = tmp_path / "log.h5"
    with h5py.File(path, "w") as file:
        file["joint_states/position"] = Q
        file["joint_states/time"] = TIME
        file["images"] = np.zeros((2, 2, 2))
        file["note"] = "an arm"
        file["table"] = np.zeros(5, dtype=[("t", "f8"), ("tau", "f8")])
    assert sorted(READERS[".h5"](path)) == [
        "joint_states/position:1",
        "joint_states/position:2",
        "joint_states/time",
        "table.t",
        "table.tau",
    ]


def as_matlab_73(path: Path, fill: Callable[[Any], None]) -> Path:
    """HDF5 behind MATLAB's own block of 512 bytes; MATLAB writes matrices transposed."""
    with h5py.File(path, "w", userblock_size=512) as file:
        fill(file)
    head = b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM"
    with path.open("r+b") as raw:
        raw.write(head)
    return path


def test_matlab_of_version_7_3(tmp_path: Path) -> None:
    def fill(file: Any) -> None:
        file["rec/pos"] = Q.T
        file["rec/time"] = TIME[np.newaxis]
        file["name"] = np.frombuffer("arm".encode("utf-16-le"), dtype=np.uint16)
        file["name"].attrs["MATLAB_class"] = np.bytes_("char")
        file["#refs#/a"] = TIME

    columns = read_mat(as_matlab_73(tmp_path / "log.mat", fill))
    assert sorted(columns) == ["rec.pos:1", "rec.pos:2", "rec.time"]
    assert columns["rec.pos:1"].tolist() == Q[:, 0].tolist()


def ros1_bag(path: Path) -> Path:
    store = get_typestore(Stores.ROS1_NOETIC)
    kinds = store.types
    header, stamp, state = (
        kinds[name]
        for name in ("std_msgs/msg/Header", "builtin_interfaces/msg/Time", "sensor_msgs/msg/JointState")
    )
    with Writer(path) as writer:
        connection = writer.add_connection("/joint_states", "sensor_msgs/msg/JointState", typestore=store)
        for k, row in enumerate(Q):
            at = 1_000_000_000 + 10_000_000 * k
            message = state(header(k, stamp(1, 10_000_000 * k), "base"), ["a", "b"], row, 0 * row, 2 * row)
            writer.write(connection, at + 5, store.serialize_ros1(message, "sensor_msgs/msg/JointState"))
    return path


def test_a_bag_of_ros_1(tmp_path: Path) -> None:
    columns = READERS[".bag"](ros1_bag(tmp_path / "log.bag"))
    assert columns["/joint_states/stamp"].tolist() == pytest.approx(TIME.tolist())
    assert columns["/joint_states/position/b"].tolist() == Q[:, 1].tolist()
    assert columns["/joint_states/effort/a"].tolist() == (2 * Q[:, 0]).tolist()


@pytest.mark.parametrize("suffix", [".npz", ".npy", ".h5", ".bag"])
def test_what_is_damaged_is_one_line(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"log{suffix}"
    path.write_bytes(b"this is text\n" * 40)
    with pytest.raises(CaptureError, match="is not a") as caught:
        READERS[suffix](path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("suffix", "library", "extra"), [(".h5", "h5py", "hdf5"), (".bag", "rosbags", "ros1")]
)
def test_a_library_that_is_not_there_is_named_with_its_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str, library: str, extra: str
) -> None:
    for name in [name for name in sys.modules if name.split(".")[0] == library]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(CaptureError, match=rf"needs {library}; install it with: .*armhil\[{extra}\]"):
        READERS[suffix](tmp_path / f"log{suffix}")


def test_a_vector_per_place_of_a_cell_or_an_array_of_structs(tmp_path: Path) -> None:
    """As MATLAB users keep joints: lying and standing vectors, whole numbers, structs in structs."""
    counts = (1e4 * Q).astype(np.int32)
    places = np.empty((2, 1), dtype=object)
    joints = np.zeros(2, dtype=[("tau", object), ("name", object)])
    for k in range(2):
        places[k, 0] = counts[:, [k]]
        joints[k] = (3.0 * Q[np.newaxis, :, k], "abc")
    mixed = np.empty((1, 2), dtype=object)
    mixed[0, 0], mixed[0, 1] = TIME, Q
    run = {"q": places, "joint": joints, "time": TIME.astype(np.float32), "all": mixed, "note": "hello"}
    scipy.io.savemat(tmp_path / "log.mat", {"exp": {"run": run}})
    columns = read_mat(tmp_path / "log.mat")
    per_joint = {"exp.run.q:1", "exp.run.q:2", "exp.run.joint.tau:1", "exp.run.joint.tau:2"}
    assert set(columns) == per_joint | {"exp.run.time", "exp.run.all.1", "exp.run.all.2:1", "exp.run.all.2:2"}
    assert columns["exp.run.q:2"].tolist() == counts[:, 1].tolist()
    assert columns["exp.run.joint.tau:1"].tolist() == (3.0 * Q[:, 0]).tolist()


def test_cells_of_version_7_3(tmp_path: Path) -> None:
    def fill(file: Any) -> None:
        kind = h5py.special_dtype(ref=h5py.Reference)
        for k in range(2):
            file[f"#refs#/q{k}"] = Q[np.newaxis, :, k]
        for name, of_matlab in (("q", "cell"), ("joint/pos", "")):
            places = file.create_dataset(name, (2, 1), dtype=kind)
            places.attrs["MATLAB_class"] = np.bytes_(of_matlab)
            for k in range(2):
                places[k, 0] = file[f"#refs#/q{k}"].ref

    columns = read_mat(as_matlab_73(tmp_path / "log.mat", fill))
    assert sorted(columns) == ["joint.pos:1", "joint.pos:2", "q:1", "q:2"]
    assert columns["joint.pos:2"].tolist() == Q[:, 1].tolist()
