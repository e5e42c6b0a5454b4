"""The two requirements files: every version pinned and hashed, and one a superset of the other."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

PIN = re.compile(
    r"(?P<pin>[a-z0-9.-]+==[0-9][a-z0-9.]*(?: ; [^\\]+?)?)(?P<hashes>(?: --hash=sha256:[0-9a-f]{64})+)"
)


@pytest.fixture(scope="session")
def project(repository: Path) -> dict[str, Any]:
    return tomllib.loads((repository / "pyproject.toml").read_text())


def pins(path: Path) -> dict[str, str]:
    """Version and hashes by package; fails on a line that says anything more."""
    found = {}
    for line in re.sub(r" \\\n +", " ", path.read_text()).splitlines():
        match = PIN.fullmatch(line)
        assert match, f"{path.name}: neither a pinned version nor a hash: {line[:100]!r}"
        found[canonicalize_name(Requirement(match["pin"]).name)] = match["pin"] + match["hashes"]
    return found


@pytest.mark.parametrize("name", ["requirements.txt", "requirements-test.txt"])
def test_only_versions_and_hashes(repository: Path, name: str) -> None:
    assert len(pins(repository / name)) > 30


def test_the_test_set_contains_the_run_set(repository: Path) -> None:
    run, test = pins(repository / "requirements.txt"), pins(repository / "requirements-test.txt")
    assert run.items() < test.items()


def test_every_declared_dependency_is_pinned_within_its_bounds(
    repository: Path, project: dict[str, Any]
) -> None:
    run = [*project["project"]["dependencies"], *project["dependency-groups"]["clone"]]
    declared = {
        "requirements.txt": run,
        "requirements-test.txt": [*run, *project["project"]["optional-dependencies"]["test"]],
    }
    for name, dependencies in declared.items():
        pinned = pins(repository / name)
        for dependency in map(Requirement, dependencies):
            pin = Requirement(pinned[canonicalize_name(dependency.name)].split(" --hash")[0])
            version = str(pin.specifier).removeprefix("==")
            assert dependency.specifier.contains(version), f"{name}: {pin} is outside {dependency}"


def test_the_clone_has_its_build_backend(project: dict[str, Any]) -> None:
    assert sorted(project["build-system"]["requires"]) == sorted(project["dependency-groups"]["clone"])
