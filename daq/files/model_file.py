"""``*.model.toml``: an identified model as a file; docs/reference/model-file.md documents it.

The same identification gives the same bytes: there is no time of writing in it.
"""

from __future__ import annotations

from collections.abc import Sequence
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, model_validator

from daq.files.checksum import source_sha256
from daq.files.model_found import ModelFound, ModelTerm, check_terms, model_found
from daq.files.toml_file import read_toml, validation_line
from daq.files.toml_text import TomlTextError, toml_text
from ident import Fitted
from ident.estimators import ESTIMATORS
from ident.results import Parameter
from ident.verdicts import Verdict
from robots import Identification, Robot
from robots.arrays import FloatArray
from robots.errors import UserError, ValueNotAllowed

SUFFIX = ".model.toml"

Finite = Annotated[float, Field(allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Correlation = Annotated[float, Field(ge=-1, le=1, allow_inf_nan=False)]
Sha256 = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]


class ModelFileError(UserError, ValueError):
    """A model file that cannot be read or written; the text is one line for the user."""


class _Frozen(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


def _known_estimator(name: str) -> str:
    if name not in ESTIMATORS:
        raise ValueNotAllowed((), "is no estimator", ", ".join(f'"{known}"' for known in ESTIMATORS))
    return name


class ModelRobot(_Frozen):
    """The arm that the model is of."""

    name: Annotated[str, Field(min_length=1)]
    sha256: Sha256 = Field(description="of robot.toml")


class ModelSource(_Frozen):
    """One recording that the model was made from."""

    name: Annotated[str, Field(min_length=1)] = Field(description="file name, without its folder")
    sha256: Sha256


class ModelEstimate(_Frozen):
    """Which estimator made the parameters, and how far they can be trusted."""

    estimator: Annotated[str, AfterValidator(_known_estimator)]
    verdict: Verdict
    recommendation: str
    covariance: Annotated[str, Field(min_length=1)] = Field(description="what the standard deviations assume")
    rows: Annotated[int, Field(ge=1)]
    relative_error_percent: NonNegative
    torque_noise: tuple[NonNegative, ...] = Field(
        default=(), description="rms per joint of what does not repeat from period to period, N·m or N"
    )
    impossible: tuple[str, ...] = Field(
        default=(), description="what no arm can have and the estimate has: then it must not be trusted"
    )

    @property
    def trusted(self) -> bool:
        """Whether nothing speaks against the model."""
        return self.verdict != "instruments_invalid" and not self.impossible


class ModelParameter(_Frozen):
    """One base parameter, SI."""

    name: Annotated[str, Field(min_length=1)]
    value: Finite
    sigma: NonNegative = Field(description="standard deviation")
    unit: str
    expression: str = Field(description="regrouping of standard parameters")
    correlation: tuple[Correlation, ...] = Field(
        default=(), description="with the parameters before this one, in their order"
    )


class ModelFile(_Frozen):
    """An identified model."""

    format: Literal[1]
    armhil: Annotated[str, Field(min_length=1)] = Field(description="version that wrote the file")
    effects: Annotated[tuple[str, ...], Field(min_length=1)]
    robot: ModelRobot
    estimate: ModelEstimate
    identification: Identification = Field(description="settings that made rows of samples")
    capture: Annotated[tuple[ModelSource, ...], Field(min_length=1)]
    found: tuple[ModelFound, ...] = ()
    term: tuple[ModelTerm, ...] = ()
    parameter: Annotated[tuple[ModelParameter, ...], Field(min_length=1)]

    @property
    def values(self) -> FloatArray:
        """β̂, shape (b,)."""
        return np.array([parameter.value for parameter in self.parameter])

    @property
    def covariance(self) -> FloatArray | None:
        """Of β̂, (b, b); None where the file has no correlations."""
        sizes = [len(parameter.correlation) for parameter in self.parameter]
        if len(sizes) > 1 and not any(sizes):
            return None
        sigma = np.array([parameter.sigma for parameter in self.parameter])
        lower = np.zeros((sigma.size, sigma.size))
        for row, parameter in enumerate(self.parameter):
            lower[row, :row] = parameter.correlation
        return np.asarray((lower + lower.T + np.eye(sigma.size)) * np.outer(sigma, sigma))

    @model_validator(mode="after")
    def _correlations_are_whole(self) -> Self:
        sizes = [len(parameter.correlation) for parameter in self.parameter]
        if any(sizes) and sizes != list(range(len(sizes))):
            row = next(row for row, size in enumerate(sizes) if size != row)
            raise ValueError(
                f"parameter {self.parameter[row].name} has {sizes[row]} correlations; allowed: {row},"
                " one with each parameter before it, or none in the whole file"
            )
        return self

    @model_validator(mode="after")
    def _terms_are_of_the_model(self) -> Self:
        parameters = {one.name: (one.value, one.sigma, one.unit) for one in self.parameter}
        check_terms(self.effects, [one.effect for one in self.found], self.term, parameters)
        return self

    @model_validator(mode="after")
    def _names_are_unique(self) -> Self:
        names = [parameter.name for parameter in self.parameter]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ValueError(f"parameter {twice[0]} is given twice")
        return self


def model_of(
    fitted: Fitted, captures: Sequence[Path], robot: Robot, torque_noise: Sequence[float] = ()
) -> ModelFile:
    """The model that the verdict recommends, with where it came from.

    Args:
        fitted: the identification.
        captures: files or folders that it was made from; their checksums are computed here.
        robot: the arm, with the settings that were used.
        torque_noise: (n,) rms of what did not repeat in them, N·m (or N); empty where nothing repeated.

    Raises:
        ModelFileError: a recording is gone, or the estimate has values that are not finite.
    """
    result = fitted.result
    estimate = fitted.result.recommended
    values = {
        "format": 1,
        "armhil": version("armhil"),
        "effects": tuple(effect.name for effect in fitted.base.model.effects),
        "robot": {"name": robot.name, "sha256": sha256(robot.source_text.encode()).hexdigest()},
        "estimate": {
            "estimator": estimate.method,
            "verdict": result.test.verdict,
            "recommendation": "; ".join(result.impossible) or result.test.recommendation,
            "impossible": result.impossible,
            "covariance": estimate.covariance_kind,
            "rows": result.rows,
            "relative_error_percent": estimate.relative_error_percent,
            "torque_noise": tuple(torque_noise),
        },
        "identification": robot.identification,
        "capture": tuple({"name": path.resolve().name, "sha256": source_sha256(path)} for path in captures),
        "parameter": model_parameters(estimate.parameters, estimate.covariance),
    }
    values |= model_found(robot, result.found, estimate.parameters)
    try:
        return ModelFile.model_validate(values)
    except ValidationError as error:
        raise ModelFileError(validation_line(robot.name, error, ModelFile)) from None


def model_parameters(parameters: Sequence[Parameter], covariance: FloatArray) -> tuple[dict[str, Any], ...]:
    """Entries of ``[[parameter]]``: values, deviations and the lower triangle of their correlations."""
    sigma = np.sqrt(np.diag(covariance))
    unit = np.where(sigma > 0, sigma, 1.0)
    correlation = np.clip(covariance / np.outer(unit, unit), -1.0, 1.0)
    return tuple(
        {
            "name": parameter.name,
            "value": parameter.value,
            "sigma": parameter.sigma,
            "unit": parameter.unit,
            "expression": parameter.expression,
            "correlation": tuple(correlation[row, :row].tolist()),
        }
        for row, parameter in enumerate(parameters)
    )


def write_model(
    path: Path, fitted: Fitted, captures: Sequence[Path], robot: Robot, torque_noise: Sequence[float] = ()
) -> ModelFile:
    """Write the model that the verdict recommends.

    Raises:
        ModelFileError: it cannot be written, or is not a model; see :func:`model_of`.
    """
    model = model_of(fitted, captures, robot, torque_noise)
    write_model_file(path, model)
    return model


def write_model_file(path: Path, model: ModelFile) -> None:
    """Write a model.

    Raises:
        ModelFileError: it cannot be written.
    """
    heading = (
        f"# Model of {model.robot.name}, identified by armhil {model.armhil}. Values are SI;"
        " sigma is one standard deviation.\n"
    )
    try:
        path.write_text(heading + toml_text(model.model_dump()), encoding="utf-8")
    except TomlTextError as error:
        raise ModelFileError(f"{path}: {error}") from error
    except OSError as error:
        raise ModelFileError(f"{path}: cannot be written: {error.strerror}") from error


def read_model(path: Path) -> ModelFile:
    """Read a model file.

    Raises:
        ModelFileError: one line with file, line, key and what is allowed.
    """
    return read_toml(path, ModelFile, ModelFileError, kind="a model file (*.model.toml)")
