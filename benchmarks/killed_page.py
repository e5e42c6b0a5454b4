"""The page of the checks that were killed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

HEADS = (
    "killed at",
    "check",
    "left in the catalogue",
    "at rest after, s",
    "processes gone after, s",
    "lease",
    "next check",
    "problem",
)


@dataclass
class After:
    """What was seen after one kill; ``problems`` is empty where all is well."""

    stage: str
    setting: str
    left: str = ""
    rest: float | None = None
    gone: float = 0.0
    lease: str = ""
    verdict: str = ""
    problems: list[str] = field(default_factory=list)

    def row(self) -> str:
        """Of the page's table."""
        rest = "–" if self.rest is None else f"{self.rest:.2f}"
        cells = (self.stage, self.setting, self.left, rest, f"{self.gone:.1f}", self.lease, self.verdict)
        return f"| {' | '.join(cells)} | {'; '.join(self.problems) or 'none'} |"


def page_of(found: Sequence[After], seed: int) -> str:
    """Markdown.

    Args:
        found: what was seen after each kill; those at random times have the setting ``random``.
        seed: of the random times.
    """
    staged = [one for one in found if one.setting != "random"]
    rest = [one.rest for one in found if one.rest is not None]
    counts = {
        "stages": len(staged),
        "times": len(found) - len(staged),
        "count": len(found),
        "wrong": sum(bool(one.problems) for one in found),
        "slowest": f"{max(rest):.2f} s" if rest else "–",
        "seed": seed,
    }
    table = [f"| {' | '.join(HEADS)} |", f"|{'---|' * len(HEADS)}", *(one.row() for one in found)]
    return PAGE.format(**counts, table="\n".join(table))


PAGE = """# Checks that are killed

    PYTHONPATH=. python benchmarks/killed_checks.py --random {times} --seed {seed} --page killed_checks.md

`armhil check` of the one-axis rig (EMPS) gets SIGKILL: {stages} times at a stage, one after the other
on its way, and {times} times at a random moment of a whole check (seed {seed}; where it had ended by then,
that is said). {wrong} of {count} left something wrong.

What is looked at after each kill:

- **At rest.** Checks called `accepted`, `away` and `random` drive an arm that was commissioned and
  whose drives live in another process, as real drives do. Their statuswords and positions are read by
  SDO until no drive carries torque and none moves, two looks 0.05 s apart: after {slowest} at the
  latest. Checks called `first` and `changed` start simulated drives of their own, which have to be
  gone.
- **Processes.** Nothing that the check has started lives on; the cyclic process stops the arm first.
- **Lease.** Free, or held by the dead process and freed by the next check on this machine.
- **Catalogue.** `nothing`: no run of it. `abandoned`: a run without outcome, model or verdict.
  `unjudged`: a recording that is whole, marked as a check that ended before its verdict. `judged`: the
  verdict, as it was made. A transaction that was killed before its commit has left nothing.
- **Next check.** Has the arm at once, drives it and finds that nothing has moved (`no baseline` without
  one).

`accepted`: with a baseline, from where its trajectory begins. `away`: from where a killed check has
left the arm, so that it approaches first. `first`: without a baseline, so that a trajectory is planned.
`changed`: with an effect that is searched for and told to a webhook.

{table}
"""
