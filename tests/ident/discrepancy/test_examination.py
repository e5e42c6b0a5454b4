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


def test_noise_is_what_does_not_repeat_beside_this_model() -> None:
    """The search's own rows go by that beside the model without any effect; where nothing repeats all do."""
    random = np.random.default_rng(0)
    noise, used = random.normal(0.0, 0.2, (400, 1)), np.ones((400, 1), dtype=np.bool_)
    segment = np.zeros(400, dtype=np.int64)
    rows = SimpleNamespace(repeats=True, whitening="first", noise=noise, segment=segment, used=used)
    rows.by = lambda noise: Examination.by(rows, noise)  # type: ignore[arg-type]
    of_noise = Examination.of_noise.func  # type: ignore[attr-defined]
    assert of_noise(rows).sigma == pytest.approx([0.2], rel=0.1)
    rows.repeats = False
    assert of_noise(rows) == "first"
