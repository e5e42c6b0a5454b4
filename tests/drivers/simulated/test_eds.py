"""The drive's EDS: complete, consistent, and accepted by an independent checker."""

from __future__ import annotations

import configparser
import importlib.util
import subprocess
import sys

import pytest

from drivers.simulated.object_dictionary import EDS_PATH, ObjectDictionary

CHECKER = "from dcf.cli import main; raise SystemExit(main())"


@pytest.mark.skipif(
    importlib.util.find_spec("dcf") is None, reason="dcfchk is not installed (pip install dcf-tools)"
)
def test_dcfchk_accepts_it() -> None:
    checked = subprocess.run(
        [sys.executable, "-c", CHECKER, "-n", "3", str(EDS_PATH)], capture_output=True, text=True, check=False
    )
    assert (checked.returncode, checked.stdout + checked.stderr) == (0, "")


def test_every_listed_object_is_there_and_every_section_is_listed() -> None:
    eds = configparser.ConfigParser()
    eds.read(EDS_PATH)
    listed: set[int] = set()
    for group in ("MandatoryObjects", "OptionalObjects", "ManufacturerObjects"):
        count = int(eds[group]["SupportedObjects"])
        indices = [int(eds[group][str(k)], 16) for k in range(1, count + 1)]
        assert indices == sorted(indices)
        listed |= set(indices)
    sections = {int(name, 16) for name in eds.sections() if len(name) == 4}
    assert sections == listed


def test_defaults_of_the_node_id_are_the_predefined_connection_set() -> None:
    dictionary = ObjectDictionary(0x2A)
    for index, base in ((0x1014, 0x080), (0x1200, 0x600), (0x1400, 0x200), (0x1800, 0x180)):
        subindex = 0 if index == 0x1014 else 1
        assert dictionary.integer(index, subindex) == base + 0x2A
