"""The model file of a diagnosis: the base parameters with the effects that were found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from daq.diagnosis.diagnosis_words import headline
from daq.files.checksum import source_sha256
from daq.files.model_file import ModelFile, ModelFileError, model_parameters, write_model_file
from daq.files.model_found import model_found
from daq.files.toml_file import validation_line
from ident import BaseParameters, Parameter
from ident.discrepancy import Diagnosis
from ident.discrepancy.gap import torque_floor
from ident.discrepancy.unrepeated import noise_level
from ident.effects.entry import EffectEntry
from ident.effects.found import unused
from ident.effects.placed import Placed
from ident.effects.term_family import is_term
from ident.effects.vocabulary import entry_of
from robots import Robot


def write_diagnosed_model(
    path: Path, diagnosis: Diagnosis, captures: Sequence[Path], robot: Robot
) -> ModelFile:
    """Write the model that the diagnosis ends with.

    Args:
        path: the file.
        diagnosis: of the search.
        captures: what it was fitted to.
        robot: the arm, with the settings that were used.

    Raises:
        ModelFileError: a recording is gone, a value is not finite, or the file cannot be written.
    """
    try:
        model = ModelFile.model_validate(_values(diagnosis, captures, robot))
    except ValidationError as error:
        raise ModelFileError(validation_line(robot.name, error, ModelFile)) from None
    write_model_file(path, model)
    return model


def _values(diagnosis: Diagnosis, captures: Sequence[Path], robot: Robot) -> dict[str, object]:
    base, examination = diagnosis.base, diagnosis.examinations[-1]
    sigma = np.sqrt(np.diag(diagnosis.covariance))
    names, expressions = _own_names(base)
    named = zip(names, diagnosis.beta, sigma, expressions, base.leading, strict=True)
    parameters = tuple(Parameter(n, float(v), float(s), p.unit, e, p) for n, v, s, e, p in named)
    made_from = f"armhil diagnose of {', '.join(path.resolve().name for path in captures)}"
    entries = [
        _with_source(entry_of(robot, effect), made_from)
        for effect in base.model.effects
        if isinstance(effect, Placed)
    ]
    return {
        "format": 1,
        "armhil": version("armhil"),
        "effects": tuple(effect.name for effect in base.model.effects),
        "robot": {"name": robot.name, "sha256": sha256(robot.source_text.encode()).hexdigest()},
        "estimate": {
            "estimator": "iv" if examination.repeats else "ls",
            "verdict": "not_testable",
            "recommendation": f"diagnosis {diagnosis.verdict}: {headline(diagnosis)}",
            "covariance": "rows whitened with the noise between periods"
            if examination.repeats
            else "rows weighted by what is left of the residual",
            "rows": int(examination.used.sum()),
            "relative_error_percent": _relative_error(diagnosis),
            "torque_noise": _torque_noise(diagnosis),
        },
        "identification": robot.identification,
        "capture": tuple({"name": path.resolve().name, "sha256": source_sha256(path)} for path in captures),
        "parameter": model_parameters(parameters, diagnosis.covariance),
        **model_found(robot, entries, parameters),
    }


def _with_source(entry: EffectEntry, source: str) -> EffectEntry:
    """A term says where it came from, one of an earlier model what it said."""
    return replace(entry, source=entry.source or source) if is_term(entry.name) else entry


def _own_names(base: BaseParameters) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names and expressions of the base parameters, each once.

    A change of friction that was found beside the usual friction has the name of that; the file tells them
    apart as a model does that is made of it.
    """
    found = [effect for effect in base.model.effects if isinstance(effect, Placed)]
    standard = [*base.model.names[: len(base.model.names) - sum(len(e.parameters) for e in found)]]
    usual = int(np.count_nonzero(base.independent < len(standard)))
    for effect in found:
        standard += [parameter.name for parameter in unused(effect.parameters, standard)]
    own = tuple(standard[column] for column in base.independent[usual:])
    return (*base.names[:usual], *own), (*base.expressions[:usual], *own)


def _torque_noise(diagnosis: Diagnosis) -> tuple[float, ...]:
    """Per joint, rms of what does not repeat beside the model with what was found; none where nothing does.

    An effect with a history repeats from the second period on: without it in the model that would be noise.
    """
    first, prepared = diagnosis.examinations[0], diagnosis.examinations[-1].prepared
    if not first.repeats:
        return ()
    if not diagnosis.findings:
        return tuple(noise_level(first).tolist())
    return tuple(torque_floor(diagnosis.base, diagnosis.beta, prepared).tolist())


def _relative_error(diagnosis: Diagnosis) -> float:
    """100·‖ε‖/‖y‖ on the fitted rows."""
    prepared = diagnosis.examinations[-1].prepared
    torque = np.concatenate([piece.torque for piece in prepared])
    left = np.concatenate([piece.residual(diagnosis.base, diagnosis.beta) for piece in prepared])
    used = np.concatenate([piece.moving for piece in prepared])  # those of an examined loop are others
    return float(100.0 * np.linalg.norm(left[used]) / np.linalg.norm(torque[used]))
