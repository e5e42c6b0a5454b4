"""What a person reads at 80 columns: no word, path or number is cut, and nothing stands beyond the edge."""

from __future__ import annotations

import io

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.cells import cell_len
from rich.console import Console

from daq.text.terminal_steps import TerminalSteps
from daq.text.wrapped import Column, WordConsole, wrapped, write, write_table

WIDTH = 80
PATH = "/somewhere/" + "a-long-folder-name/" * 6 + "tx40.model.toml"


def at_80(*, terminal: bool = True) -> WordConsole:
    return WordConsole(file=io.StringIO(), width=WIDTH, force_terminal=terminal, color_system=None)


def printed(console: WordConsole) -> str:
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def test_a_path_longer_than_the_line_stays_whole_and_words_around_it_are_not_cut() -> None:
    console = at_80()
    write(console, f"Model good to 0.19 % of torque; use {PATH}; ten parameters are not seen by this motion.")
    assert PATH in printed(console)
    assert all(cell_len(line) <= WIDTH or len(line.split()) == 1 for line in printed(console).splitlines())


@pytest.mark.parametrize("soft_wrap", [True, False])
def test_a_text_with_markup_is_wrapped_the_same(soft_wrap: bool) -> None:
    console = at_80()
    console.print(f"Report: [bold]{PATH}[/] " + "words of one sentence " * 8, soft_wrap=soft_wrap)
    assert PATH in printed(console)
    assert "[bold]" not in printed(console)
    assert all(cell_len(line) <= WIDTH or len(line.split()) == 1 for line in printed(console).splitlines())


def test_a_pipe_gets_one_line() -> None:
    console = at_80(terminal=False)
    write(console, "word " * 40)
    assert len(printed(console).splitlines()) == 1


@given(st.lists(st.text("abcdefgh/.-_%σ", min_size=1, max_size=100), min_size=1, max_size=30))
def test_wrapping_loses_and_cuts_nothing(words: list[str]) -> None:
    lines = wrapped(" ".join(words), WIDTH)
    assert " ".join(lines).split() == words
    assert all(len(line) <= WIDTH or " " not in line.strip() for line in lines)


def test_a_table_leaves_columns_out_before_it_cuts_a_cell() -> None:
    columns = [Column("parameter", right=False), Column("value"), Column("t", spare=2)]
    columns += [Column("truth", spare=1), Column("note", right=False, wraps=True)]
    row = ["ZZ1R" * 5, "−0.000123456", "1234567890" * 3, "0.0000123456789", "several words that may wrap"]
    console = at_80()
    write_table(console, "Base parameters", columns, [row])
    text = printed(console)
    assert "…" not in text
    assert row[0] in text
    assert row[1] in text
    assert row[3] in text
    assert row[2] not in text
    assert "Left out at 80 columns: t." in text
    assert all(cell_len(line) <= WIDTH for line in text.splitlines())


def test_a_step_whose_share_nobody_knows_shows_no_percentage() -> None:
    """Before, a start that takes a minute stood at 0 % all the while."""
    console = at_80()
    with TerminalSteps(console).step("Start simulated drives") as update:
        update(0.0, "compiled once on this machine")
    assert " 0 %" not in printed(console)
    assert "100 %" in printed(console)


@pytest.mark.parametrize(
    ("shares", "told"),
    [
        ([(1.0, 0.5), (2.9, 0.6)], ""),  # too early to tell
        ([(4.0, 0.01), (10.0, 0.02), (300.0, 0.5)], "  about 8 min more\n"),  # once
        ([(5.0, 0.1), (6.0, 0.2)], "  about 45 s more\n"),
        ([(9.0, 0.5), (10.0, 0.1)], ""),  # soon done: said nothing, and nothing later
        ([(60.0, 1.0)], ""),
    ],
)
def test_a_pipe_is_told_once_about_how_long_a_step_takes(
    shares: list[tuple[float, float]], told: str
) -> None:
    now = [100.0]
    out = io.StringIO()
    with TerminalSteps(Console(file=out), lambda: now[0]).step("Search") as update:
        for passed, share in shares:
            now[0] = 100.0 + passed
            update(share, "score 1")
    assert out.getvalue() == f"Search …\n{told}"
