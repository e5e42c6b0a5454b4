"""Tables for people who have pandas."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import Any

from robots.errors import UserError


class NoPandas(UserError):
    """A table was asked for and pandas is not installed; one line."""


def frame(columns: Mapping[str, Any], index: str | None = None) -> Any:
    """A pandas table.

    Args:
        columns: name → values, all of one length.
        index: the column that names the rows.

    Raises:
        NoPandas: pandas is not installed.
    """
    try:
        import pandas as pd
    except ImportError:
        raise NoPandas(f"to_frame() needs pandas; {sys.executable} -m pip install pandas") from None
    made = pd.DataFrame(dict(columns))
    return made if index is None else made.set_index(index)
