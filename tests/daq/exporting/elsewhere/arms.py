"""Model files of arms whose parameters are known, for the engines that load them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from daq.exporting.elsewhere.arm import IdentifiedArm, identified_arm
from daq.files.model_file import ModelFile, write_model_file
from ident import BaseParameters, RegressorModel, base_parameters
from ident.effects import State
from ident.effects.entry import EffectEntry
from ident.identification.found_effects import FoundModel, extended_model
from robots import Robot


def known_model(robot: Robot, seed: int = 1, **settings: object) -> tuple[ModelFile, BaseParameters]:
    """A model whose bodies, rotors, friction and offsets differ from the description's by some 20 %."""
    settings_of = robot.identification.model_copy(update=settings)
    robot = robot.model_copy(update={"identification": settings_of})
    base = base_parameters(RegressorModel.of(robot))
    generator = np.random.default_rng(seed)
    prior = base.model.prior()
    # One factor per link keeps each a body; offsets, which the prior lacks, get a value of their own.
    factors = 1.0 + 0.2 * generator.uniform(-1, 1, prior.size)
    for link in range(robot.n):
        factors[10 * link : 10 * link + 10] = factors[10 * link]
    standard = prior * factors
    offsets = [k for k, one in enumerate(base.model.parameters) if one.symbol == "off"]
    standard[offsets] = generator.uniform(-2, 2, len(offsets))
    values = base.regroup(standard)
    parameters = tuple(
        {
            "name": name,
            "value": float(value),
            "sigma": 1e-3 * max(abs(value), 1e-3),
            "unit": unit,
            "expression": "",
        }
        for name, value, unit in zip(base.names, values, base.units, strict=True)
    )
    content = {
        "format": 1,
        "armhil": "0.1.0",
        "effects": tuple(effect.name for effect in base.model.effects),
        "robot": {"name": robot.name, "sha256": "0" * 64},
        "estimate": {
            "estimator": "ls",
            "verdict": "exogenous",
            "recommendation": "Use least squares.",
            "covariance": "known",
            "rows": 1000,
            "relative_error_percent": 1.0,
        },
        "identification": settings_of,
        "capture": ({"name": "known.mcap", "sha256": "0" * 64},),
        "parameter": parameters,
    }
    return ModelFile.model_validate(content), base


def written_model(folder: Path, model: ModelFile) -> Path:
    path = folder / f"{model.robot.name}.model.toml"
    write_model_file(path, model)
    return path


def arm_of(robot: Robot, model: ModelFile) -> IdentifiedArm:
    return identified_arm(robot, model)


def motion(robot: Robot, seed: int = 3, samples: int = 1500) -> State:
    """Sums of sines that use the joints' ranges, samples × joints."""
    generator = np.random.default_rng(seed)
    time = np.linspace(0.0, 6.0, samples)[:, np.newaxis]
    middle, half = (robot.upper + robot.lower) / 2, (robot.upper - robot.lower) / 2
    q, v, a = (np.zeros((samples, robot.n)) for _ in range(3))
    for harmonic in range(1, 5):
        size = 0.15 * half * generator.uniform(0.3, 1.0, robot.n)
        rate = 2 * np.pi * harmonic / 6.0
        phase = rate * time + generator.uniform(0, 2 * np.pi, robot.n)
        q += size * np.sin(phase)
        v += size * rate * np.cos(phase)
        a -= size * rate**2 * np.sin(phase)
    return State(q + middle, v, a)


def moving(robot: Robot, state: State) -> np.ndarray:
    """Rows (samples,) on which every joint and drive moves: at rest each engine has its own friction."""
    drives = state.velocity @ robot.transmission_matrix.T
    slow = max(5 * robot.identification.friction_width, 0.02)
    return np.asarray((np.abs(state.velocity) > slow).all(axis=1) & (np.abs(drives) > slow).all(axis=1))


def found_model(
    robot: Robot, *found: tuple[EffectEntry, Mapping[str, float]]
) -> tuple[ModelFile, BaseParameters]:
    """The known model with effects that a search has found, each with its parameters by name."""
    model, _ = known_model(robot)
    robot = robot.model_copy(update={"identification": model.identification})
    values = {one.name: one.value for one in model.parameter}
    content = model.model_dump()
    for entry, own in found:
        values |= own
        content["parameter"] += tuple(
            {"name": name, "value": value, "sigma": 1e-3, "unit": "1", "expression": ""}
            for name, value in own.items()
        )
        content["found"] += ({"effect": entry.name, "joints": entry.joints, "shape": dict(entry.shape)},)
    effects = (*content["effects"], *(entry.name for entry, _ in found))
    entries = tuple(entry for entry, _ in found)
    extended = extended_model(robot, FoundModel.of("known", effects, entries, values))
    file = ModelFile.model_validate(content | {"effects": effects})
    return file, base_parameters(extended)
