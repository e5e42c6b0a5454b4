from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest

from drivers import Budgets, Channel, Samples


def some(first: int, n: int) -> Samples:
    cycle = np.arange(first, first + n)
    table = np.outer(cycle, [1.0, -1.0])
    return Samples(
        cycle=cycle,
        time=cycle * 0.004,
        reference=table,
        position=table + 1,
        control_signal=table * 2,
        statusword=np.full((n, 2), 0x27, dtype=np.uint16),
        complete=np.ones((n, 2), dtype=np.bool_),
        lateness=np.zeros(n),
    )


def test_batches_join_in_order_and_keep_their_types() -> None:
    joined = Samples.concatenate([Samples.empty(2), some(0, 3), some(3, 4)])
    whole = some(0, 7)
    assert len(joined) == 7
    for f in fields(Samples):
        np.testing.assert_array_equal(getattr(joined, f.name), getattr(whole, f.name))
        assert getattr(joined, f.name).dtype == getattr(whole, f.name).dtype


def test_nothing_cannot_be_joined() -> None:
    with pytest.raises(ValueError, match="at least one"):
        Samples.concatenate([])


@pytest.mark.parametrize(
    ("channel", "waits"),
    [
        (Channel("udp_multicast", "239.1.2.3"), True),
        (Channel("socketcan", "vcan0"), True),
        (Channel("socketcan", "can0"), False),
        (Channel("virtual", "vcan0"), False),
    ],
)
def test_only_simulated_drives_are_waited_for(channel: Channel, waits: bool) -> None:
    assert (Budgets.on(channel, 0.004).receive_seconds > 0) is waits
