"""Several simulated arms on buses of their own: the same numbers one at a time, at once, and through dask."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from daq.catalogue.database import Catalogue
from daq.check.analysis import AnalysisOrder, analyse_all
from daq.check.fleet import Fleet, FleetArm
from daq.check.fleet_run import check_fleet
from daq.check.request import CheckResult
from drivers import Channel
from ident.drift import DriftSettings

ARMS = 3


def test_a_fleet_at_once_and_one_at_a_time(
    new_channel: Callable[[], Channel], tmp_path: Path, no_leftovers: None
) -> None:
    channels = [new_channel() for _ in range(ARMS)]
    listed = [
        FleetArm(robot="emps", interface=c.interface, channel=c.name, simulated=True, seed=k)
        for k, c in enumerate(channels)
    ]
    broken = FleetArm(robot="emps", interface="virtual", channel="nowhere", simulated=True)
    fleet = Fleet(format=1, arm=(*listed, broken))
    with Catalogue() as catalogue:
        done = check_fleet(
            fleet,
            catalogue,
            tmp_path,
            DriftSettings(),
            None,
            at_once=1,
            jobs=2,
            backend="loky",
            duration=4.0,
            evaluations=300,
        )
    assert [isinstance(one, CheckResult) for one in done.outcomes] == [True] * ARMS + [False]
    assert done.exit_code == 2 and "lives inside one process" in str(done.outcomes[-1])
    assert len({result.arm for result in done.results}) == ARMS
    orders = [AnalysisOrder("emps", result.capture) for result in done.results]
    alone = analyse_all(orders, "sequential", 1)
    for result, again in zip(done.results, alone, strict=True):
        np.testing.assert_array_equal(result.fitted.least_squares.beta, again.least_squares.beta)
        np.testing.assert_array_equal(result.fitted.least_squares.covariance, again.least_squares.covariance)
    _through_dask(orders, alone)


def _through_dask(orders: list[AnalysisOrder], alone: Sequence[object]) -> None:
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
        distributed.Client(cluster),
    ):
        found = analyse_all(orders, "dask", 2)
    for one, again in zip(found, alone, strict=True):
        np.testing.assert_array_equal(one.least_squares.beta, again.least_squares.beta)  # type: ignore[attr-defined]
