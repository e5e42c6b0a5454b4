"""The bus budget against published frame lengths and figures."""

from __future__ import annotations

import pytest

from drivers import Budgets, DriveError
from drivers.bus.budget import BusBudget, frame_bits, nominal_links
from drivers.frames.layout import DriveLink
from robots import Robot


@pytest.mark.parametrize(("size", "bits"), [(0, 55), (1, 65), (6, 115), (8, 135)])
def test_worst_case_frame_lengths_of_davis_et_al(size: int, bits: int) -> None:
    assert frame_bits(size) == bits


def of(robot: Robot, bits: int = 16, **bus: float) -> BusBudget:
    changed = robot.model_copy(update={"bus": robot.bus.model_copy(update=bus)})
    links = tuple(DriveLink(link.node, link.name, bits, heartbeat=0.1) for link in nominal_links(robot))
    return BusBudget.of(changed, links, Budgets())


def test_six_axes_per_cycle(tx40: Robot) -> None:
    budget = of(tx40)
    assert budget.bits_per_cycle == 1555, "SYNC + 6 RPDO(6) + 6 TPDO(8)"
    assert budget.bits_per_cycle / 0.004 / 1e6 == pytest.approx(0.38875)
    assert 0.02 < budget.bits_per_second / 1e6 < 0.04, "heartbeats and a slow SDO add about 3 %"
    assert budget.load == pytest.approx(budget.bits_per_cycle / 4000 + budget.bits_per_second / 1e6)
    budget.check()


def test_a_second_tpdo_costs_its_frames(tx40: Robot) -> None:
    wide = of(tx40, bits=32)
    assert wide.bits_per_cycle == 55 + 6 * 115 + 6 * (115 + 95)


def test_a_full_bus_is_refused_with_the_fastest_safe_cycle(tx40: Robot) -> None:
    with pytest.raises(DriveError) as refusal:
        of(tx40, cycle_time=0.002).check()
    assert str(refusal.value) == (
        "bus.cycle_time 2 ms loads a bus of 1000 kbit/s with 81 % at worst; allowed: 70 % (bus.load_limit); "
        "the fastest safe cycle is 3 ms"
    )
    slow = of(tx40, bitrate=125_000)
    fastest = slow.fastest_cycle()
    assert fastest is not None
    assert slow.load_at(fastest) <= 0.7 < slow.load_at(fastest - tx40.controller.sample_time)
    with pytest.raises(DriveError, match="no cycle is safe"):
        of(tx40, bitrate=20_000).check()


def test_the_proposal_can_be_given_to_the_drives(tx40: Robot) -> None:
    fine = tx40.model_copy(update={"controller": tx40.controller.model_copy(update={"sample_time": 0.00033})})
    budget = of(fine)
    fastest = budget.fastest_cycle()
    assert fastest is not None
    steps = fastest / 0.00033
    assert abs(steps - round(steps)) < 1e-6
    assert round(fastest * 1e6) % 10 == 0
