"""The page of the Python API says what the packages export, as they are now."""

from __future__ import annotations

import inspect

import pytest

from tests.python_api_page import PACKAGES, PAGE, ROOMS, exported, page


def test_the_page_is_that_of_today() -> None:
    """Else: ``python -m tests.python_api_page``."""
    assert page() == PAGE.read_text(encoding="utf-8")


@pytest.mark.parametrize("package", [*PACKAGES, *ROOMS])
def test_every_exported_class_and_function_says_what_it_is(package: str) -> None:
    silent = [
        name
        for name, value in exported(package)
        if (inspect.isclass(value) or inspect.isfunction(value)) and not inspect.getdoc(value)
    ]
    assert not silent


def test_no_place_in_memory_is_printed() -> None:
    assert " at 0x" not in page()
