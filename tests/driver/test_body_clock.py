"""Two clocks that drift apart, messages that take a while."""

from __future__ import annotations

import numpy as np

from tulip_driver.body_clock import BodyClock

MILLISECOND = 1_000_000


def test_a_drifting_clock_with_late_messages_is_followed_within_the_shortest_delay_and_never_goes_back() -> None:
    rng = np.random.default_rng(1)
    clock, errors, last = BodyClock(), [], 0
    for tick in range(5000):
        true = tick * 4 * MILLISECOND + 10**15
        stamp = int(tick * 4 * MILLISECOND * (1 + 1e-4))  # 100 ppm fast
        arrival = true + int(0.2 * MILLISECOND + rng.exponential(2 * MILLISECOND))
        host = clock.to_host(stamp, arrival)
        assert last < host <= arrival
        last = host
        errors.append(host - true)
    late = np.array(errors[500:])
    assert late.min() > -0.3 * MILLISECOND  # drift in two windows: 0.2 ms
    assert late.max() < 0.7 * MILLISECOND


def test_a_clock_that_falls_behind_is_followed_within_two_windows() -> None:
    clock = BodyClock()
    for tick in range(250):
        clock.to_host(tick * 4 * MILLISECOND, tick * 4 * MILLISECOND)
    gap = 500 * MILLISECOND  # an emulator that was stopped for a while
    for tick in range(250, 1000):
        arrival = tick * 4 * MILLISECOND + gap
        host = clock.to_host(tick * 4 * MILLISECOND, arrival)
    assert host == arrival
