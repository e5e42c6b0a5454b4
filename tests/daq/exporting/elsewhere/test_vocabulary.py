"""Whatever a search can find: each export says in its file that it lacks it, or its engine is asked."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

import robots
from daq.exporting.elsewhere.export import ExportedModel, export_model
from ident.effects.entry import EffectEntry
from ident.effects.found import Found
from ident.effects.placed import Family
from ident.effects.vocabulary import VOCABULARY, entry_of
from ident.parameters.present import Present
from ident.parameters.regressor import RegressorModel
from tests.daq.exporting.elsewhere.arms import found_model, written_model
from tests.daq.exporting.elsewhere.test_found import BODIES, LAWS, PAYLOAD, SPRINGS, Effect

TX40 = robots.load("tx40")


def names(*effects: Effect) -> set[str]:
    return {entry.name for entry, _ in effects}


DRIVES = {"drive_gain_error", "current_loop_lag", "saturation"}
SLOW = names(*BODIES)
"""Feed-forward of gravity and friction, and a URDF, hold bodies; a tilt of the base is none in a URDF."""
COMPARED = {
    "urdf": SLOW - {"base_tilt"},
    "mjcf": names(*BODIES, *SPRINGS) | DRIVES,
    "sdf": names(*BODIES, SPRINGS[0]),
    "pinocchio": names(*BODIES, *SPRINGS, *LAWS),
    "c": SLOW,
    "python": SLOW,
}
"""What ``test_found`` asks each file's own engine for."""


def effect_of(family: Family) -> tuple[EffectEntry, Mapping[str, float]]:
    """The effect at the first place of the arm, of a size that the search expects."""
    model = RegressorModel.of(TX40)
    place = family.places(TX40)[0]
    shape = tuple(one.grid[len(one.grid) // 2] for one in family.shapes(TX40, place))
    placed = family.effect(TX40, place, shape, Present(model, model.prior()))
    found = Found.of(placed, model.names)
    sizes = np.clip(0.3 * np.array(placed.scale), *np.transpose(placed.bounds))
    values = {one.name: float(size) for one, size in zip(found.parameters, sizes, strict=True)}
    return entry_of(TX40, found), PAYLOAD if family.name == "payload" else values


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, ExportedModel]:
    """Each format of an arm that has every effect of the vocabulary."""
    folder = tmp_path_factory.mktemp("everything")
    model, _ = found_model(TX40, *(effect_of(family) for family in VOCABULARY))
    written = export_model(written_model(folder, model), TX40, folder / "out")
    return {one.kind: one for one in written}


@pytest.mark.parametrize("kind", COMPARED)
def test_what_an_engine_was_not_asked_for_is_named_in_the_file(
    files: dict[str, ExportedModel], kind: str
) -> None:
    text = " ".join(files[kind].path.read_text(encoding="utf-8").replace("\n *", "\n").split())
    named = {one.name for one in VOCABULARY if f"- Found effect: {one.name.replace('_', ' ')}" in text}
    assert named == {family.name for family in VOCABULARY} - COMPARED[kind]
