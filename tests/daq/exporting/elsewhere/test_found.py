"""Found effects in each export: its own engine has the torque that the model has with the effect on."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pinocchio
import pytest

import robots
from daq.exporting.elsewhere.export import ExportedModel, export_model
from ident.effects import State
from ident.effects.entry import EffectEntry
from tests.daq.exporting.elsewhere.arms import arm_of, found_model, motion, moving, written_model
from tests.daq.exporting.elsewhere.engines import (
    assert_same,
    imported,
    inverse_dynamics,
    mujoco,
    torque_in_drake,
)

TX40 = robots.load("tx40")
PAYLOAD = {
    "M_payload": 1.5,
    "MX_payload": 0.02,
    "MY_payload": -0.03,
    "MZ_payload": 0.12,
    "XX_payload": 0.02,
    "XY_payload": 0.0,
    "YY_payload": 0.02,
    "XZ_payload": 0.0,
    "YZ_payload": 0.0,
    "ZZ_payload": 0.01,
}
Effect = tuple[EffectEntry, Mapping[str, float]]


def effect(name: str, joints: tuple[int, ...], shape: Mapping[str, float], **values: float) -> Effect:
    return EffectEntry(name, joints, shape), values


BODIES: tuple[Effect, ...] = (
    effect("payload", (), {}, **PAYLOAD),
    effect("base_tilt", (), {}, tilt_x=0.03, tilt_y=-0.02),
    effect("rotor_inertia", (4,), {}, dIa4=0.02),
    effect("viscous_friction", (2,), {}, Fv2_2=3.0),
    effect("coulomb_friction", (6,), {}, Fc6_2=1.0),
    effect("current_offset", (3,), {}, doff3=2.0),
    effect("wrist_coupling", (3, 4), {"ratio": -0.5}, Iam4=0.02, Fvm4=0.3, Fcm4=0.5),
)
SPRINGS: tuple[Effect, ...] = (
    effect("gravity_spring", (2,), {}, stiffness2=12.0, preload2=5.0),
    effect("cable_spring", (2,), {"rest_angle": 0.3}, cable2=-1.5, stiffening2=2.0),
    effect("contact", (1,), {"contact_angle": 0.2, "side": 1.0}, contact1=15.0),
    effect("contact", (5,), {"contact_angle": -0.1, "side": -1.0}, contact5=8.0),
    effect(
        "gravity_spring",
        (3,),
        {"anchor_angle": 0.7, "moving_radius": 0.4, "free_length": 0.5},
        spring3=10.0,
    ),
)
LAWS: tuple[Effect, ...] = (
    effect("asymmetric_friction", (1,), {}, dFc1=1.0, dFv1=0.5),
    effect("stribeck_friction", (2,), {"stribeck_speed": 0.3, "exponent": 2.0}, Fs2=4.0),
    effect("nonlinear_viscous_friction", (3,), {"power": 0.5}, Fn3=3.0, Fn_linear3=-0.5),
    effect("load_dependent_friction", (2,), {"offset_at_link": 1.0}, mu2=0.1),
    effect("load_dependent_friction", (3,), {"motor_share": 0.2, "offset_at_link": 1.0}, load_friction3=0.9),
    effect("load_quadratic_friction", (3,), {"offset_at_link": 0.0}, mu_square3=0.004),
    effect("directional_efficiency", (5,), {"offset_at_link": 0.0}, mu_mean5=0.1, dmu5=0.05),
    effect("position_dependent_friction", (4,), {"waves": 2.0}, Fq_cos4=0.6, Fq_sin4=-0.4),
    effect("position_dependent_friction", (6,), {"spot_centre": 0.4, "spot_width": 0.5}, Fq_spot6=0.8),
    effect("drive_gain_error", (5,), {}, gain_error5=0.06),
)


class Case:
    """An arm with effects, its exports, and its torque on a motion."""

    def __init__(self, folder: Path, *effects: Effect) -> None:
        model, base = found_model(TX40, *effects)
        self.arm = arm_of(TX40, model)
        written = export_model(written_model(folder, model), TX40, folder / "out")
        self.files: dict[str, ExportedModel] = {one.kind: one for one in written}
        state = motion(TX40)
        rows = moving(TX40, state)
        self.state = State(state.position[rows], state.velocity[rows], state.acceleration[rows])
        values = {one.name: one.value for one in model.parameter}
        self.torque = base.columns(self.state) @ np.array([values[name] for name in base.names])
        usual = len(base.names) - sum(len(own) for _, own in effects)
        order = np.array([values[name] for name in base.names[:usual]])
        self.plain = base.columns(self.state)[:, :, :usual] @ order

    def sentences(self, kind: str) -> list[str]:
        return [one for one in self.files[kind].lost if one.startswith("Found effect")]


def assert_it_shows(case: Case) -> None:
    """Without the effects the torque differs by more than what is tested to."""
    away = np.linalg.norm(case.torque - case.plain, axis=0) / np.linalg.norm(case.torque, axis=0)
    assert (away > 0.03).any()


@pytest.mark.parametrize("effects", [BODIES, SPRINGS], ids=["bodies", "springs"])
def test_mujoco_has_bodies_shafts_and_springs(tmp_path: Path, effects: tuple[Effect, ...]) -> None:
    case = Case(tmp_path, *effects)
    assert_same(inverse_dynamics(case.files["mjcf"].path, case.state), case.torque)
    assert case.sentences("mjcf") == []
    assert_it_shows(case)


@pytest.mark.parametrize("effects", [BODIES, SPRINGS, LAWS], ids=["bodies", "springs", "laws"])
def test_the_pinocchio_module_has_the_whole_torque(tmp_path: Path, effects: tuple[Effect, ...]) -> None:
    case = Case(tmp_path, *effects)
    module = imported(case.files["pinocchio"].path)
    made, s = module.model(), case.state
    theirs = [module.torque(*row, made) for row in zip(s.position, s.velocity, s.acceleration, strict=True)]
    assert_same(np.array(theirs), case.torque, 0.002)
    assert case.sentences("pinocchio") == []
    assert_it_shows(case)


def test_what_needs_a_past_is_listed_as_missing(tmp_path: Path) -> None:
    """The module takes position, speed and acceleration of one instant."""
    case = Case(
        tmp_path,
        effect("load_dependent_friction", (2,), {"offset_at_link": 1.0, "load_memory": 0.005}, mu2=0.1),
    )
    late = "Found effect: load dependent friction at joint 2"
    assert case.sentences("pinocchio") == [
        f"{late} is there without its memory: it follows its load 5 ms late."
    ]
    assert case.sentences("mjcf") == case.sentences("sdf") == [f"{late}."]


def test_a_urdf_has_the_bodies_and_says_what_it_lacks(tmp_path: Path) -> None:
    case = Case(tmp_path, *BODIES[:1], *SPRINGS[:1], *LAWS[:1])
    with_payload = pinocchio.buildModelFromUrdf(str(case.files["urdf"].path))
    assert with_payload.inertias[6].mass == pytest.approx(case.arm.links[-1, 0])
    assert case.sentences("urdf") == [
        "Found effect: gravity spring at joint 2.",
        "Found effect: asymmetric friction at joint 1.",
    ]
    assert case.sentences("mjcf") == ["Found effect: asymmetric friction at joint 1."]
    assert case.sentences("c") == case.sentences("urdf")


def test_drives_of_mujoco_have_lag_gain_and_limit(tmp_path: Path) -> None:
    case = Case(
        tmp_path,
        effect("drive_gain_error", (1,), {}, gain_error1=0.1),
        effect("current_loop_lag", (2,), {}, lag2=0.004),
        effect("saturation", (3,), {"torque_limit": 20.0}, excess3=1.0),
        effect("command_dead_zone", (4,), {}, dead_zone4=0.2),
    )
    assert case.sentences("mjcf") == ["Found effect: command dead zone at joint 4."]
    model = mujoco.MjModel.from_xml_path(str(case.files["mjcf"].path))
    data = mujoco.MjData(model)
    control, offset, step = np.full(6, 30.0), case.arm.offset, model.opt.timestep
    data.ctrl[:] = control
    mujoco.mj_forward(model, data)
    force = data.actuator_force.copy() + offset
    assert force[0] == pytest.approx(30.0 / 0.9)
    assert force[1] == pytest.approx(0.0)
    assert force[2] == pytest.approx(20.0)
    assert force[3:] == pytest.approx(control[3:])
    for _ in range(round(0.004 / step)):
        data.ctrl[:] = control
        mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)
    assert data.actuator_force[1] + offset[1] == pytest.approx(30.0 * (1.0 - np.exp(-1.0)), rel=1e-6)


def test_drake_has_bodies_tilt_and_spring_of_the_sdf(tmp_path: Path) -> None:
    """All that the file has a place for; its own sentences name the rest."""
    case = Case(tmp_path, *BODIES[:2], *BODIES[3:5], SPRINGS[0])
    arm, v, a = case.arm, case.state.velocity, case.state.acceleration
    lacking = arm.armature * a + arm.offset
    for one in arm.couplings:
        between = np.outer(one.row, one.row) - np.diag(one.row**2)
        lacking += (one.inertia * a + one.viscous * v) @ between
        lacking += np.outer(one.coulomb * np.sign(v @ one.row), one.row)
    assert_same(torque_in_drake(case.files["sdf"].path, case.state) + lacking, case.torque)
    assert case.sentences("sdf") == []
    assert_it_shows(case)


def test_an_sdf_names_the_spring_that_it_has_no_place_for(tmp_path: Path) -> None:
    case = Case(tmp_path, *SPRINGS[:2])
    dynamics = ET.parse(case.files["sdf"].path).findall(".//joint/axis/dynamics")[1]
    read = {one.tag: float(one.text or "nan") for one in dynamics}
    assert read["spring_stiffness"] == 12.0
    assert read["spring_reference"] == pytest.approx(-5.0 / 12.0)
    assert case.sentences("sdf") == ["Found effect: cable spring at joint 2."]
