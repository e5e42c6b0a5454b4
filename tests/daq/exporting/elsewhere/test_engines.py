"""Each export, loaded by its own engine, has the torques of the model that it was made from."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pinocchio
import pytest

import robots
from daq.exporting.elsewhere.export import export_model
from ident.effects import State
from robots import Robot
from tests.daq.exporting.elsewhere.arms import arm_of, known_model, motion, moving, written_model
from tests.daq.exporting.elsewhere.engines import assert_same, imported, inverse_dynamics, torque_in_drake


class Case:
    """An arm, its exports, and its own torque on a motion."""

    def __init__(self, name: str, folder: Path) -> None:
        self.robot: Robot = robots.load(name)
        model, base = known_model(self.robot)
        self.arm = arm_of(self.robot, model)
        self.files = {
            one.kind: one for one in export_model(written_model(folder, model), self.robot, folder / "out")
        }
        state = motion(self.robot)
        rows = moving(self.robot, state)
        self.state = State(state.position[rows], state.velocity[rows], state.acceleration[rows])
        self.torque = base.columns(self.state) @ model.values
        still = State(state.position, np.zeros_like(state.position), np.zeros_like(state.position))
        self.still, self.holding = still, base.columns(still) @ model.values


@pytest.fixture(scope="module", params=["tx40", "emps"])
def case(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Case:
    return Case(request.param, tmp_path_factory.mktemp(request.param))


def of_couplings(case: Case) -> np.ndarray:
    """Torque of drives that move several joints, beyond the share of each joint alone."""
    v, a = case.state.velocity, case.state.acceleration
    torque = np.zeros_like(v)
    for one in case.arm.couplings:
        between = np.outer(one.row, one.row) - np.diag(one.row**2)
        torque += (one.inertia * a + one.viscous * v) @ between
        torque += np.outer(one.coulomb * np.sign(v @ one.row), one.row)
    return torque


def test_mujoco_has_the_whole_torque_of_the_mjcf(case: Case) -> None:
    assert_same(inverse_dynamics(case.files["mjcf"].path, case.state), case.torque)


def test_pinocchio_has_the_links_damping_and_friction_of_the_urdf(case: Case) -> None:
    model = pinocchio.buildModelFromUrdf(str(case.files["urdf"].path))
    data, s = model.createData(), case.state
    rigid = np.array(
        [
            pinocchio.rnea(model, data, q, v, a)
            for q, v, a in zip(s.position, s.velocity, s.acceleration, strict=True)
        ]
    )
    friction = model.damping * s.velocity + model.upperDryFrictionLimit * np.sign(s.velocity)
    # What the file says that it lacks: rotors, offsets, coupled drives.
    lacking = case.arm.armature * s.acceleration + case.arm.offset + of_couplings(case)
    assert_same(rigid + friction + lacking, case.torque)
    assert any("rotor inertia" in sentence for sentence in case.files["urdf"].lost)
    assert b"rotor inertia" in case.files["urdf"].path.read_bytes()


def test_drake_has_the_links_damping_and_friction_of_the_sdf(case: Case) -> None:
    lacking = case.arm.armature * case.state.acceleration + case.arm.offset + of_couplings(case)
    assert_same(torque_in_drake(case.files["sdf"].path, case.state) + lacking, case.torque, 1e-5)
    assert any("rotor inertia" in sentence for sentence in case.files["sdf"].lost)


def test_the_pinocchio_module_has_the_whole_torque(case: Case) -> None:
    module = imported(case.files["pinocchio"].path)
    made, s = module.model(), case.state
    found = [module.torque(*row, made) for row in zip(s.position, s.velocity, s.acceleration, strict=True)]
    assert_same(np.array(found), case.torque, 1e-6)
    assert list(made.names)[1:] == [joint.name for joint in case.robot.joint]


def test_python_feed_forward(case: Case) -> None:
    module = imported(case.files["python"].path)
    assert_same(np.array([module.gravity(q) for q in case.still.position.tolist()]), case.holding, 1e-6)
    friction = np.array([module.friction(v) for v in case.state.velocity.tolist()])
    assert_same(friction, friction_of(case), 1e-6)


def test_c_feed_forward_compiles_and_says_the_same(case: Case, tmp_path: Path) -> None:
    compiler = shutil.which("cc")
    assert compiler is not None, "a C compiler is part of what the tests need"
    name, n = case.robot.name, case.robot.n
    header = case.files["c"].path
    source = tmp_path / "main.c"
    source.write_text(
        f'#include <stdio.h>\n#include "{header}"\n'
        f"int main(void) {{ double q[{n}], tau[{n}]; int kind;\n"
        '  while (scanf("%d", &kind) == 1) {\n'
        f'    for (int j = 0; j < {n}; ++j) if (scanf("%lf", q + j) != 1) return 1;\n'
        f"    if (kind) {name}_friction(q, tau); else {name}_gravity(q, tau);\n"
        f'    for (int j = 0; j < {n}; ++j) printf("%.17g ", tau[j]);\n'
        '    printf("\\n"); } return 0; }\n'
    )
    program = tmp_path / "feed_forward"
    flags = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-O2"]
    subprocess.run([compiler, *flags, str(source), "-o", str(program), "-lm"], check=True)

    def run(kind: int, values: np.ndarray) -> np.ndarray:
        lines = "".join(f"{kind} {' '.join(map(repr, row))}\n" for row in values.tolist())
        done = subprocess.run([str(program)], input=lines, capture_output=True, text=True, check=True)
        return np.array([[float(x) for x in line.split()] for line in done.stdout.splitlines()])

    assert_same(run(0, case.still.position), case.holding, 1e-6)
    assert_same(run(1, case.state.velocity), friction_of(case), 1e-6)


def friction_of(case: Case) -> np.ndarray:
    """The model's own torque of friction: with speed and without."""
    model, base = known_model(case.robot)
    s = case.state
    zero = np.zeros_like(s.velocity)
    names = [one.symbol for one in base.model.parameters]
    standard = base.standard_from(model.values, base.model.prior())
    kept = np.array([symbol.startswith("F") for symbol in names])
    return np.asarray(base.model.columns(State(s.position, s.velocity, zero)) @ (standard * kept))
