"""Entries for the tests: identities and models with numbers of their own."""

from __future__ import annotations

import numpy as np

from daq.catalogue import runs
from daq.catalogue.database import Catalogue
from daq.catalogue.values import ArmIdentity, CatalogueParameter, NewModel, Run, Source

SHA = "a1" * 32
OTHER_SHA = "b2" * 32


def identity(
    name: str = "tx40", first: int = 100, sha256: str = SHA, *, simulated: bool = False
) -> ArmIdentity:
    return ArmIdentity(name, tuple(range(first, first + 6)), sha256, simulated)


def finished_run(catalogue: Catalogue, name: str = "tx40", capture_sha256: str | None = None) -> Run:
    run = runs.begin(catalogue, identity(name), "run", capture=f"/data/{name}.mcap")
    return runs.finish(catalogue, run.id, "completed", capture_sha256=capture_sha256)


def model(seed: int = 0, size: int = 5, capture_sha256: str = SHA) -> NewModel:
    generator = np.random.default_rng(seed)
    root = generator.normal(size=(size, size))
    covariance = root @ root.T
    covariance = (covariance + covariance.T) / 2
    sigma = np.sqrt(np.diag(covariance)).tolist()
    return NewModel(
        method="iv",
        verdict="endogenous",
        recommendation="Use the instrumental variables.",
        gates={"verdict": "endogenous", "gates": [{"name": "rank", "passed": None}]},
        rows=1234,
        relative_error_percent=3.75,
        torque_rms=tuple(generator.uniform(size=6).tolist()),
        effects=("rigid_body", "viscous_friction"),
        parameters=tuple(
            CatalogueParameter(f"Fv{k + 1}", float(generator.normal()), sigma[k], "N·m·s")
            for k in range(size)
        ),
        covariance_kind="ar",
        covariance=covariance,
        settings={"method": "auto", "cutoff_hz": None},
        sources=(Source("/data/tx40.mcap", capture_sha256),),
        description_sha256=SHA,
        armhil="0.1.0",
    )
