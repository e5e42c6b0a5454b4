"""Slips in a URDF and a robot.toml, by the hundred: refused in one line, or the arm that the file says.

``benchmarks/description_mutations.py`` does the same with a thousand of each.
"""

from __future__ import annotations

import pytest

from tests.robots.conftest import RobotFolder
from tests.robots.mutated_arms import judged_toml, judged_urdf
from tests.robots.mutations import mutated_urdf
from tests.robots.toml_mutations import mutated_toml


@pytest.mark.parametrize("block", range(5))
def test_a_mutated_urdf_is_refused_or_is_what_it_says(
    folder: RobotFolder, block: int, capfd: pytest.CaptureFixture[str]
) -> None:
    original = folder.urdf.read_text("utf-8")
    for seed in range(30 * block, 30 * block + 30):
        judged_urdf(folder.toml, original, mutated_urdf(original, seed))
    assert capfd.readouterr().err == "", "a parser warns, so it reads something else than we do"


@pytest.mark.parametrize("block", range(5))
def test_a_mutated_robot_toml_is_refused_or_has_the_windows_it_says(folder: RobotFolder, block: int) -> None:
    original = folder.toml.read_text("utf-8")
    for seed in range(30 * block, 30 * block + 30):
        judged_toml(folder.toml, original, mutated_toml(original, seed))


def test_some_of_them_are_accepted(folder: RobotFolder) -> None:
    """A loader that refuses everything would pass the tests above."""
    urdf, toml = folder.urdf.read_text("utf-8"), folder.toml.read_text("utf-8")
    refusals = [judged_urdf(folder.toml, urdf, mutated_urdf(urdf, seed)) for seed in range(60)]
    folder.urdf.write_text(urdf, "utf-8")
    refusals += [judged_toml(folder.toml, toml, mutated_toml(toml, seed)) for seed in range(60)]
    accepted = sum(refusal is None for refusal in refusals)
    assert 5 <= accepted <= 60
