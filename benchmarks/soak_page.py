"""What a soak came to, as Markdown, from its ``events.jsonl`` and ``memory.csv``."""

from __future__ import annotations

import csv
import json
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

WARM = 900
"""s after which everything has been loaded once: growth is counted from there."""


def page(folder: Path) -> str:
    """Tables of motions, checks, memory and the browser."""
    lines = (folder / "events.jsonl").read_text(encoding="utf-8").splitlines()
    events = [json.loads(line) for line in lines]
    with (folder / "memory.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    reached = max(float(row["second"]) for row in rows)
    parts = [f"Reached: {reached / 60:.0f} minutes.", "", *_memory(rows), "", *_motions(events), ""]
    return "\n".join([*parts, *_others(events)])


def _of(events: list[dict[str, Any]], kind: str) -> list[dict[str, Any]]:
    return [one for one in events if one["kind"] == kind]


def _memory(rows: list[dict[str, str]]) -> list[str]:
    said = [
        "| part | processes | memory after a quarter of an hour, MB | at the end, MB | growth, MB an hour"
        " | open files, most | processor, % of a core |",
        "|---|---|---|---|---|---|---|",
    ]
    for part in dict.fromkeys(row["part"] for row in rows):
        own = [row for row in rows if row["part"] == part and int(row["processes"])]
        late = [row for row in own if float(row["second"]) >= WARM]
        if len(late) < 3 or part == "checks":  # a check lives for a minute
            continue
        time = np.array([float(row["second"]) for row in late])
        memory = np.array([float(row["megabytes"]) for row in late])
        slope = 3600 * np.polyfit(time, memory, 1)[0]
        spent = float(late[-1]["cpu_seconds"]) - float(late[0]["cpu_seconds"])
        files = max(int(row["files"]) for row in own)
        share = 100 * spent / (time[-1] - time[0])
        said.append(
            f"| {part} | {late[-1]['processes']} | {np.median(memory[:5]):.0f} | {np.median(memory[-5:]):.0f}"
            f" | {slope:+.1f} | {files} | {share:.0f} |"
        )
    return said


def _motions(events: list[dict[str, Any]]) -> list[str]:
    said = [
        "| motion | outcome | cycles | missed | late | incomplete | late, ms: 50, 99, 99.9, 100 % | MB |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for number, one in enumerate(_of(events, "motion"), start=1):
        lateness = ", ".join(f"{value:g}" for value in one["lateness_ms"])
        said.append(
            f"| {number} | {one['outcome']} | {one['cycles']} | {one['missed']} | {one['late']}"
            f" | {one['incomplete']} | {lateness} | {one['megabytes']} |"
        )
    return said


def _others(events: list[dict[str, Any]]) -> list[str]:
    checks, heap = _of(events, "check"), _of(events, "heap")
    said = Counter(f"{one['verdict']} ({one['code']})" for one in checks)
    seconds = [one["seconds"] for one in checks]
    megabytes, nodes = [one["megabytes"] for one in heap], [one["nodes"] for one in heap]
    looked = _of(events, "looked on")
    others = [one for one in events if one["kind"] in ("refused", "browser", "live view stood still")]
    return [
        f"Checks: {len(checks)}, "
        + ", ".join(f"{count} {verdict}" for verdict, count in said.items())
        + f"; {min(seconds):.0f} to {max(seconds):.0f} s each.",
        f"Page: heap {min(megabytes):.2f} to {max(megabytes):.2f} MB after a collection (the last five"
        f" {np.median(megabytes[-5:]):.2f}), {min(nodes)} to {max(nodes)} nodes; {len(looked)} runs looked on"
        f" to their end, {sum(one['problems'] for one in looked)} errors, warnings or requests to elsewhere.",
        *(f"- {one['second']:.0f} s: {json.dumps(one, ensure_ascii=False)}" for one in others),
    ]
