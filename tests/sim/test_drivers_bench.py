"""The bench `drivers` measures what it says."""

from __future__ import annotations

import pytest

from tulip_driver.guard import GuardParameters
from tulip_sim.bench import drivers
from tulip_sim.bench.drivers_stalls import upright_time


@pytest.mark.ros
@pytest.mark.usefixtures("ros_domain")
def test_times_of_the_echo_driver_are_measured_and_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drivers, "TRIES", 2)
    row = drivers.measure("echo", 1)
    for kind in drivers.KINDS:
        told, seen = (row[f"{kind}, {until} [ms]"] for until in (drivers.TOLD, drivers.SEEN))
        assert len(told) == len(seen) == 2
        if kind == drivers.SILENCE:
            assert min(told) >= GuardParameters().time_to_live
    text = "\n".join(drivers.summarize([row]))
    assert "| echo | - | 2 | told to the body | " in text and "| echo | - | 2 | seen in a reading | " in text


def test_checks_that_fail_and_walks_that_end_are_told() -> None:
    check = {"driver": "sim", "round": drivers.CHECK, "passed": 40, "checks": 41, "failed": ["rate: 200 a second"]}
    times = {f"{kind}, {drivers.SEEN} [ms]": [9.0, 11.0] for kind in drivers.KINDS}
    names = [f"life {life} ms, stalls of {stall} ms" for life in drivers.LIVES for stall in drivers.STALL_TIMES]
    walk = {f"{name}: upright [s]": 12.0 if "100 ms" in name else 3.0 for name in names}
    rows = [check, {"driver": "sim", "round": 1, **times}, {"driver": drivers.STALLS, "round": 0, **walk}]
    text = "\n".join(drivers.summarize(rows))
    assert "| sim | 40 of 41 | 2 | seen in a reading | 10.0 ms, 11.0 at most |" in text
    assert "- sim fails rate: 200 a second" in text
    assert "| 40 ms | 0 | 0 | 0 |" in text and "| 100 ms | 1 | 1 | 1 |" in text


@pytest.mark.sim
def test_a_walk_outlives_stalls_that_are_longer_than_a_command_lives(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tulip_sim.bench.drivers_stalls.TIME", 4000)
    assert upright_time(GuardParameters().time_to_live, stall=60, seed=1) == 4.0
