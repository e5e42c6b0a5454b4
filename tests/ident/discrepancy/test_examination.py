"""The fit of the present model, on rows that are too few for it."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ident import IdentificationError
from ident.discrepancy.examination import Examination


@pytest.mark.parametrize("share", [2.0, 0.0])
def test_rows_that_do_not_determine_the_parameters_are_refused(share: float) -> None:
    """A motion of seconds, cut in two, may move nothing enough; a covariance of it would be none."""
    column = np.ones((16, 1))
    rows = SimpleNamespace(
        residual=np.zeros(16), beta=np.zeros(2), instruments=np.hstack([column, share * column])
    )
    with pytest.raises(IdentificationError, match="do not determine every parameter; allowed: longer"):
        Examination.covariance.func(rows)  # type: ignore[attr-defined]
