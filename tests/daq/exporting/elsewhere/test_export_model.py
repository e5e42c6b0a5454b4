"""``armhil export-model``: all or nothing, nothing overwritten, what is lost is said where it is read."""

from __future__ import annotations

import json
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
import yaml

from daq.exporting.elsewhere.export import KINDS, export_model, in_no_file
from daq.exporting.elsewhere.frames import joint_frames
from daq.files.model_file import ModelFile
from daq.files.run_folder import OutputError
from ident.effects.entry import EffectEntry
from robots import Robot
from tests.daq.calls import Call
from tests.daq.exporting.elsewhere.arms import arm_of, found_model, known_model, written_model


@pytest.fixture(scope="module")
def model(tx40: Robot) -> ModelFile:
    return known_model(tx40)[0]


@pytest.fixture
def source(model: ModelFile, tmp_path: Path) -> Path:
    return written_model(tmp_path, model)


def test_the_command_writes_every_format_beside_the_model(source: Path, armhil: Call) -> None:
    code, out, _ = armhil("export-model", source, "--json")
    files = json.loads(out)["files"]
    assert code == 0
    assert [one["format"] for one in files] == list(KINDS)
    assert {Path(one["out"]).parent for one in files} == {source.parent / "elsewhere"}
    assert all(Path(one["out"]).stat().st_size > 100 for one in files)


def test_what_is_lost_stands_in_the_file_itself(source: Path, tx40: Robot, tmp_path: Path) -> None:
    for one in export_model(source, tx40, tmp_path / "out"):
        # Comments of C and XML may be wrapped or hold other dashes; every word is there, in order.
        text = " ".join(one.path.read_text(encoding="utf-8").replace("\n *", " ").split())
        for sentence in one.lost:
            assert " ".join(sentence.split()) in text, one.kind


def test_a_file_that_is_there_is_refused_and_nothing_is_written(
    source: Path, tx40: Robot, tmp_path: Path
) -> None:
    taken = tmp_path / "out" / "tx40.sdf"
    taken.parent.mkdir()
    taken.write_text("mine")
    with pytest.raises(OutputError, match="exists already"):
        export_model(source, tx40, tmp_path / "out")
    assert [path.name for path in taken.parent.iterdir()] == ["tx40.sdf"]
    assert taken.read_text() == "mine"


def test_one_format_at_a_time_goes_into_the_same_folder(source: Path, tx40: Robot, tmp_path: Path) -> None:
    for kind in ("mjcf", "c"):
        export_model(source, tx40, tmp_path / "out", (kind,))
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"tx40.mjcf.xml", "tx40_feed_forward.h"}


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--format", "step"), "allowed: urdf, mjcf"),
        (("--robot", "emps"), "allowed: a model of emps"),
    ],
)
def test_refusals_are_one_line(source: Path, armhil: Call, words: tuple[str, ...], said: str) -> None:
    code, _, err = armhil("export-model", source, *words)
    assert code == 2
    assert said in err
    assert len(err.splitlines()) == 1
    assert not (source.parent / "elsewhere").exists()


def test_a_model_that_must_not_be_trusted_is_written_with_a_warning(
    model: ModelFile, tmp_path: Path, armhil: Call
) -> None:
    estimate = model.estimate.model_copy(update={"verdict": "instruments_invalid"})
    source = written_model(tmp_path, model.model_copy(update={"estimate": estimate}))
    code, out, _ = armhil("export-model", source, "--format", "limits")
    assert code == 1
    assert "Do not trust" in out


def test_joint_limits_are_those_of_the_description(source: Path, tx40: Robot, tmp_path: Path) -> None:
    (written,) = export_model(source, tx40, tmp_path / "out", ("limits",))
    limits = yaml.safe_load(written.path.read_text(encoding="utf-8"))["joint_limits"]
    assert list(limits) == [joint.name for joint in tx40.joint]
    for joint in tx40.joint:
        told = limits[joint.name]
        assert (told["min_position"], told["max_position"]) == joint.position
        shown = [told[f"max_{what}"] for what in ("velocity", "acceleration", "jerk", "effort")]
        assert shown == [joint.velocity, joint.acceleration, joint.jerk, joint.torque]
        assert all(told[f"has_{what}_limits"] for what in ("position", "velocity", "effort"))


def test_asymmetric_friction_is_written_as_its_mean_and_said(tx40: Robot) -> None:
    model, _ = known_model(tx40, friction="asymmetric")
    arm = arm_of(tx40, model)
    values = {p.name.removesuffix("R"): p.value for p in model.parameter}
    assert arm.friction[0] == pytest.approx((values["Fcp1"] + values["Fcn1"]) / 2)
    assert sum("forwards" in sentence for sentence in arm.said) == tx40.n


def test_a_found_effect_is_said_to_be_in_no_file(tx40: Robot, tmp_path: Path) -> None:
    shape = {"stribeck_speed": 0.1, "exponent": 2.0}
    changed, _ = found_model(tx40, (EffectEntry("stribeck_friction", (2,), shape), {"Fs2": 3.0}))
    written = export_model(
        written_model(tmp_path, changed), tx40, tmp_path / "out", ("mjcf", "urdf", "limits")
    )
    assert in_no_file(written) == ("Found effect: stribeck friction at joint 2.",)


def test_the_sdf_says_where_every_link_is(source: Path, tx40: Robot, tmp_path: Path) -> None:
    """Read without any of the code that wrote it, and without an engine."""
    (written,) = export_model(source, tx40, tmp_path / "out", ("sdf",))
    model = ET.parse(written.path).getroot().find("model")
    assert model is not None
    links = {link.get("name"): link for link in model.findall("link")}
    before = "base"
    for frame in joint_frames(tx40):
        pose = links[frame.link].find("pose")
        assert pose is not None
        assert pose.get("relative_to") == before
        assert pose.text is not None
        x, y, z, roll, pitch, yaw = (float(value) for value in pose.text.split())
        np.testing.assert_allclose([x, y, z], frame.position, atol=1e-12)
        np.testing.assert_allclose(_rotation(roll, pitch, yaw), frame.rotation, atol=1e-12)
        before = frame.link


def _rotation(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """Rz(yaw)·Ry(pitch)·Rx(roll), as SDF defines it."""
    (cr, sr), (cp, sp), (cy, sy) = ((np.cos(x), np.sin(x)) for x in (roll, pitch, yaw))
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )
