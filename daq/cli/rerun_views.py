"""What ``armhil rerun`` says of a diagnosis or a check that was made again, on the terminal and as JSON."""

from __future__ import annotations

from importlib.metadata import version
from typing import Any

from rich.console import Console
from rich.markup import escape

from daq.check.judged import comparison_json
from daq.check.recheck import Recheck
from daq.cli.catalogue_json import rerun_json
from daq.cli.catalogue_terminal import print_rerun, print_sameness
from daq.keeping.diagnosed_again import DiagnosedAgain
from daq.text.numbers import json_number


def diagnosed_again_json(again: DiagnosedAgain) -> dict[str, Any]:
    """Of a diagnosis that was made again."""
    diagnosis = again.result.diagnosis
    return {
        "armhil": version("armhil"),
        "analysis": "diagnosis",
        "run": again.run.id,
        "model": again.earlier.id,
        "sameness": again.sameness,
        "largest_difference": json_number(again.largest),
        "largest_parameter": again.largest_name or None,
        "remarks": list(again.remarks),
        "verdict": diagnosis.verdict,
        "findings": [
            {"effect": found.effect, "joints": list(found.joints), "sentence": found.words()}
            for found in diagnosis.findings
        ],
        "report": None if again.result.folder is None else str(again.result.folder / "diagnosis.html"),
    }


def print_diagnosed_again(console: Console, again: DiagnosedAgain) -> None:
    """What is found now, and whether it is what was found then."""
    diagnosis = again.result.diagnosis
    console.print(f"Run {again.run.id}: {diagnosis.verdict}", highlight=False)
    for found in diagnosis.findings:
        console.print(f"  {escape(found.words())}", highlight=False)
    print_sameness(console, again.sameness, again.largest, again.largest_name, again.remarks)
    if again.result.folder is not None:
        page = again.result.folder / "diagnosis.html"
        console.print(f"Page: [bold]{escape(str(page))}[/]", soft_wrap=True, highlight=False)


def recheck_json(again: Recheck) -> dict[str, Any]:
    """Of a check that was judged again: what the identification says, and the comparison."""
    compared = again.comparison
    return {
        **rerun_json(again.again),
        "analysis": "check",
        "check": again.record.id,
        "check_verdict": again.record.verdict,
        "comparison": None if compared is None else comparison_json(compared),
        "differs": list(again.differs),
    }


def print_recheck(console: Console, again: Recheck) -> None:
    """The identification, then the comparison with the baseline of then."""
    print_rerun(console, again.again)
    record = again.record
    console.print(f"Check {record.id} said {record.verdict}: {escape(record.sentence)}", highlight=False)
    if again.comparison is None:
        console.print("There was no baseline to compare with", highlight=False)
    elif not again.differs:
        console.print("[bold][green]IDENTICAL[/]: the comparison with the baseline says the same[/]")
    for sentence in again.differs:
        console.print(f"[yellow]DIFFERENT[/]: {escape(sentence)}", highlight=False)
