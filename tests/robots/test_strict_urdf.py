"""A URDF is read to the letter: nothing that a body, a mass or a motion hangs on is left to a default."""

from __future__ import annotations

import struct
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

import robots
from robots import RobotFileError
from robots.rigid_body import collision_bodies
from robots.urdf import read_urdf
from robots.urdf_text import quoted, urdf_text
from tests.robots.conftest import RobotFolder

SPHERE = '<sphere radius="0.065"/>'
MASS = '<mass value="4.85"/>'


def built(folder: RobotFolder) -> None:
    arm = robots.load(folder.path)
    collision_bodies(arm, robots.rigid_body_model(arm))


def refusal(folder: RobotFolder) -> str:
    with pytest.raises(RobotFileError) as caught:
        built(folder)
    assert len(str(caught.value).splitlines()) == 1
    return str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "key", "problem", "allowed"),
    [
        (SPHERE, '<sphere radius="0,028"/>', "<sphere radius>", '"0,028" is not a number', "0.001 to 20"),
        (SPHERE, '<sphere radius="nan"/>', "<sphere radius>", '"nan" is not a number', "a number from"),
        (SPHERE, '<sphere radius="inf"/>', "<sphere radius>", '"inf" is not a number', "a number from"),
        (SPHERE, '<sphere radius="-1"/>', "<sphere radius>", '"-1" is out of range', "0.001 to 20"),
        (SPHERE, '<sphere radius="65"/>', "<sphere radius>", '"65" is out of range', "0.001 to 20"),
        (SPHERE, '<sphere radius="AAAA"/>', "<sphere radius>", '"AAAA" is not a number', "0.001 to 20"),
        (SPHERE, '<sphere raduis="0.065"/>', "<sphere raduis>", 'did you mean "radius"', "radius"),
        (SPHERE, "<sphere/>", "", '<sphere> has no radius="…"', "0.001 to 20"),
        (SPHERE, SPHERE + SPHERE, "", "<geometry> holds 2 shapes", "one of <box>"),
        (SPHERE, "", "", "<geometry> holds 0 shapes", "one of <box>"),
        (SPHERE, SPHERE + "0.065", "", '"0.065" stands in <geometry> as text', "values in attributes"),
        (f"<geometry>{SPHERE}</geometry>", "", "", "<collision> has no <geometry>", "one <geometry>"),
        (MASS, "", "", "<inertial> has no <mass>", "one <mass>"),
        (MASS, '<mass value="4,85"/>', "<mass value>", '"4,85" is not a number', "1e-06 to 10000"),
        (MASS, '<mass value="0"/>', "<mass value>", '"0" is out of range', "1e-06 to 10000"),
        (MASS, '<mass value="4.85" unit="g"/>', "<mass unit>", "an attribute that does not exist", "value"),
        (MASS, '<mass value="1e-5"/>', 'link "link_2" <inertia>', "a radius of gyration of ", "0.0001 m to"),
        ('ixx="0.0159"', 'ixx="0.159"', 'link "link_2" <inertia>', "no body has the principal", "sum of"),
        ('iyy="0.0715"', 'iyy="-0.0715"', 'link "link_2" <inertia>', "no body has the principal", "above 0"),
        ('<axis xyz="0 0 1"/>', '<axis xyz="0 0 0"/>', 'joint "joint_1" <axis>', "is not of length 1", "1"),
        ('<axis xyz="0 0 1"/>', "", 'joint "joint_1" <axis>', "has no <axis>", "of length 1"),
        ('lower="-3.14', 'lower="3.15" x="-3.14', "<limit x>", "does not exist", "lower, upper"),
        ('lower="-3.141592653589793"', 'lower="3.2"', 'joint "joint_1" <limit>', "is not below", "lower <"),
        (' velocity="5.009094953223726"', "", 'joint "joint_1"', '<limit> has no velocity="…"', "effort"),
        ('rpy="-1.5707963267948966 ', 'rpy="-90 ', "<origin rpy>", "is out of range", "-6.28319 to"),
        ("<inertial>", "<inertail>", "", "not XML: mismatched tag", "a URDF file"),
        ('<link name="link_2">', '<link name="link_1">', 'link "link_1"', "appears twice", "its own"),
        ("<robot ", '<!DOCTYPE r [<!ENTITY a "0">]><robot ', "", "<!DOCTYPE …> is not part of", "elements"),
        ("<axis", '<mimic joint="joint_2"/><axis', "", "<mimic> makes a joint follow another", "its own"),
        ("<link ", '<xacro:include filename="a"/><link ', "", "this is xacro, not yet a URDF", "the output"),
    ],
)  # fmt: skip
def test_a_slip_is_refused_with_its_line(
    folder: RobotFolder, old: str, new: str, key: str, problem: str, allowed: str
) -> None:
    line = folder.edit(folder.urdf, old, new)
    message = refusal(folder)
    place, _, rest = message.partition(": ")
    found = int(place.removeprefix(f"{folder.urdf}:"))
    assert abs(found - line) <= 9  # an element as a whole is reported where it begins
    said, _, means = rest.partition("; allowed: ")
    assert said.startswith(key)
    assert problem in said
    assert allowed in means


@pytest.mark.parametrize("tag", ["collision", "inertial", "geometry", "origin"])
def test_a_misspelt_element_is_refused_and_the_right_one_is_named(folder: RobotFolder, tag: str) -> None:
    text = folder.urdf.read_text("utf-8")
    wrong = tag[:-2] + tag[-1]
    folder.urdf.write_text(text.replace(f"<{tag}", f"<{wrong}").replace(f"</{tag}", f"</{wrong}"), "utf-8")
    message = refusal(folder)
    assert f"<{wrong}> is not part of <" in message
    assert f'(did you mean "{tag}"?)' in message


def test_a_link_that_moves_has_a_mass_and_a_body(folder: RobotFolder) -> None:
    text = folder.urdf.read_text("utf-8")
    begin = text.index('<link name="link_6">')
    inside = text[begin : text.index("</link>", begin)]
    folder.urdf.write_text(text.replace(inside, '<link name="link_6">'), "utf-8")
    assert "moves with joint_6 and has no <inertial>" in refusal(folder)
    inertial = inside[: inside.index("<collision>")]
    folder.urdf.write_text(text.replace(inside, inertial), "utf-8")
    assert "moves with joint_6 and has no <collision>" in refusal(folder)


def test_what_says_nothing_of_bodies_and_motion_is_not_read(folder: RobotFolder) -> None:
    before = urdf_text(read_urdf(folder.urdf), lambda body: body.mesh)
    folder.edit(folder.urdf, "</link>", '<visual><geometry><mesh filename="x"/></geometry></visual></link>')
    folder.edit(folder.urdf, "</robot>", "<gazebo><any>1,5</any></gazebo><transmission/></robot>")
    robots.load(folder.path)
    assert urdf_text(read_urdf(folder.urdf), lambda body: body.mesh) == before


def stl(path: Path, edge: float) -> None:
    """A tetrahedron as a binary STL file."""
    a, b, c, d = (0, 0, 0), (edge, 0, 0), (0, edge, 0), (0, 0, edge)
    facets = ((a, b, c), (a, d, b), (a, c, d), (b, d, c))
    words = [struct.pack("<12fH", 0, 0, 0, *sum(facet, ()), 0) for facet in facets]
    path.write_bytes(b"tetrahedron".ljust(80) + struct.pack("<I", 4) + b"".join(words))


def obj(path: Path, edge: float) -> None:
    """The same as an OBJ file."""
    corners = [(0, 0, 0), (edge, 0, 0), (0, edge, 0), (0, 0, edge)]
    rows = [f"v {x} {y} {z}" for x, y, z in corners] + ["f 1 3 2", "f 1 2 4", "f 1 4 3", "f 2 3 4"]
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")


@pytest.mark.parametrize(("name", "write"), [("a.stl", stl), ("a.obj", obj)])
def test_a_mesh_is_a_body_like_any_other(folder: RobotFolder, name: str, write: object) -> None:
    assert callable(write)
    write(folder.path / name, 0.2)
    folder.edit(folder.urdf, SPHERE, f'<mesh filename="package://arm/{name}" scale="1 1 0.5"/>')
    arm = robots.load(folder.path)
    bodies = collision_bodies(arm, robots.rigid_body_model(arm)).geometryObjects
    mesh = next(body.geometry for body in bodies if str(body.name) == "link_2_1")
    mesh.computeLocalAABB()
    np.testing.assert_allclose(mesh.aabb_local.max_, [0.2, 0.2, 0.1], rtol=1e-6)


def test_a_mesh_that_is_not_there_is_damaged_or_in_millimetres_is_refused(folder: RobotFolder) -> None:
    line = folder.edit(folder.urdf, SPHERE, '<mesh filename="meshes/a.stl"/>')
    assert f":{line - 2}: <mesh filename>: " in refusal(folder)
    assert '"meshes/a.stl" is not a file beside ' in refusal(folder)
    mesh = folder.path / "meshes" / "a.stl"
    mesh.parent.mkdir()
    stl(mesh, 200.0)
    assert "a.stl is 200 m large with its scale; allowed: 0.001 m to 20 m (a mesh in mm" in refusal(folder)
    stl(mesh, 0.2)
    whole = mesh.read_bytes()
    mesh.write_bytes(whole[:-30])
    assert "a.stl is damaged or has no vertices; allowed: a whole STL or OBJ file" in refusal(folder)
    mesh.write_bytes(whole[:84] + struct.pack("<4f", 0, 0, 0, float("nan")) + whole[100:])
    assert "a.stl is damaged" in refusal(folder)


def test_a_model_with_another_body_than_the_file_is_refused(
    folder: RobotFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever Pinocchio leaves out or reads otherwise: the bodies are counted and compared."""
    arm = robots.load(folder.path)
    model = robots.rigid_body_model(arm)
    for change, problem in (
        (
            lambda text: text.replace("<collision>", "<!--", 1).replace("</collision>", "-->", 1),
            "missing from",
        ),
        (lambda text: text.replace('radius="0.065"', 'radius="0.064"', 1), "not the same in"),
        (lambda text: text.replace('xyz="0.0 0.0 0.09"', 'xyz="0.0 0.0 0.08"', 1), "not the same in"),
    ):
        monkeypatch.setattr("robots.rigid_body.urdf_text", lambda *a, c=change, **k: c(urdf_text(*a, **k)))
        with pytest.raises(RobotFileError, match=problem):
            collision_bodies(arm, model)


@pytest.mark.parametrize("old", ['<mass value="4.85"/>', 'rpy="-1.5707963267948966 ', 'xyz="0 0 0.32"'])
def test_a_model_with_another_mass_or_place_than_the_file_is_refused(
    folder: RobotFolder, monkeypatch: pytest.MonkeyPatch, old: str
) -> None:
    changed = {"4.85": "4.86", "-1.57": "-1.58", "0 0 0.32": "0.0 0.0 0.33"}
    part = next(key for key in changed if key in old)
    written = part if part != "0 0 0.32" else "0.0 0.0 0.32"

    def other(*given: object, **more: object) -> str:
        return urdf_text(*given, **more).replace(written, changed[part], 1)  # type: ignore[arg-type]

    monkeypatch.setattr("robots.rigid_body.urdf_text", other)
    with pytest.raises(RobotFileError, match=r"in Pinocchio's model; allowed: a URDF that Pinocchio reads"):
        robots.load(folder.path)


def test_a_value_reads_back_as_it_was_written() -> None:
    text = "a&b <c> \"d\" 'e' é\n\tf\r"
    assert ET.fromstring(f"<mesh filename={quoted(text)}/>").get("filename") == text
