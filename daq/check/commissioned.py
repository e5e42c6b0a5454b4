"""A check drives a real arm only as it was commissioned: same drives, description, trajectory and cell."""

from __future__ import annotations

from daq.catalogue import runs
from daq.catalogue.database import Catalogue
from daq.catalogue.values import Arm, ArmIdentity
from daq.check.errors import CheckError
from daq.session.stages import changed_since, status

_LAST = "full run"


def require_commissioned(
    catalogue: Catalogue, arm: Arm, identity: ArmIdentity, sha256: str | None, cell_sha256: str = ""
) -> None:
    """Has this trajectory been driven as planned on this arm in this cell, after every stage before that?

    Args:
        catalogue: where passes are kept.
        arm: in it.
        identity: of the arm with its description as it is now.
        sha256: of the trajectory's file; None where there is no trajectory yet.
        cell_sha256: of the cell file; empty where there is none.

    Raises:
        CheckError: it has not; says what to do.
    """
    if sha256 is None:
        raise CheckError(
            f"arm {arm.label}: no trajectory has been accepted for it; go through `armhil commission`, then"
            " check with the --trajectory that it has passed with"
        )
    of_arm = runs.every(catalogue, arm=arm.label, kind="commission")
    cells = {str(run.facts.get("cell_sha256", "")) for run in of_arm}
    passed = {cell for cell in cells if _has_passed(catalogue, identity, sha256, cell)}
    if cell_sha256 in passed:
        return
    if passed:
        given = "with another cell.toml or none" if cell_sha256 else "with a cell.toml"
        raise CheckError(
            f"arm {arm.label}: this trajectory has passed `armhil commission` {given}; give --cell as it was"
            " given there, or go through that again as the cell is now"
        )
    raise CheckError(
        f"arm {arm.label}: this trajectory has not passed `armhil commission` on it, up to its {_LAST}, with"
        f" these drives and this description; {changed_since(catalogue, identity) or 'go through that first'}"
    )


def _has_passed(catalogue: Catalogue, identity: ArmIdentity, sha256: str, cell_sha256: str) -> bool:
    stages = status(catalogue, identity, sha256, cell_sha256)
    return any(stage.name == _LAST and stage.state == "passed" for stage in stages)
