"""Two that make the same arm, or two arms of one new description, known at the same moment."""

from __future__ import annotations

import threading
import time
from dataclasses import replace

import pytest
from sqlalchemy import text

from daq.catalogue import arms
from daq.catalogue.database import Catalogue
from daq.catalogue.descriptions import find_in
from daq.catalogue.values import Arm
from tests.daq.catalogue.entries import SHA, identity

PARTS = {"robot.toml": "c3" * 32}


@pytest.mark.parametrize("same", [True, False], ids=["one arm", "two arms"])
@pytest.mark.parametrize("parts", [PARTS, {}], ids=["a new description", "a label"])
def test_whoever_comes_second_waits_and_finds_what_the_first_has_kept(
    catalogue: Catalogue, same: bool, parts: dict[str, str]
) -> None:
    """In a fleet of equal arms that is checked for the first time, all of them are."""
    mine = replace(identity(simulated=True), parts=parts)
    others = mine if same else replace(mine, serials=(7,) * 6)
    found: list[Arm | Exception] = []

    def register() -> None:
        try:
            found.append(arms.register(catalogue, others))
        except Exception as error:  # noqa: BLE001 (told by the assertion below)
            found.append(error)

    second = threading.Thread(target=register)
    with catalogue.writing() as connection:
        first = arms.register_in(connection, mine)
        second.start()
        while catalogue.url.drivername != "sqlite" and not _somebody_waits(catalogue):
            time.sleep(0.01)
    second.join()
    assert [arm.label for arm in found if isinstance(arm, Arm)] == ["tx40-sim" if same else "tx40-sim-2"], (
        found
    )
    assert arms.every(catalogue) == ((first,) if same else (first, *found))
    with catalogue.reading() as connection:
        assert find_in(connection, SHA) == (parts or None)


def _somebody_waits(catalogue: Catalogue) -> bool:
    with catalogue.reading() as connection:
        waiting = text("SELECT count(*) FROM pg_locks WHERE NOT granted")
        return bool(connection.execute(waiting).scalar_one())
