"""Plays a motion several times, with other masses, friction and sensor errors each, on all cores."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed

from tulip_sim.interrupts import left_to_this_process
from tulip_sim.rehearsal.watch import Course

SEEDS = 3
Play = Callable[[int], Course]
"""Plays a motion once, given a seed; a function of a module, with arguments bound to it, for other processes."""


def rehearse(play: Play, seeds: Sequence[int], done: Callable[[], None] | None = None) -> list[Course]:
    """Play a motion once with each seed.

    Args:
        play: Plays it.
        seeds: Of masses, friction and sensor errors.
        done: Told after each play.

    Raises:
        ValueError: as `play`.
    """
    courses: dict[int, Course] = {}
    context = multiprocessing.get_context("spawn")  # a forked child would inherit the threads of a ROS that runs here
    with ProcessPoolExecutor(min(len(seeds), os.cpu_count() or 1), context) as pool:
        with left_to_this_process():
            futures = {pool.submit(play, seed): seed for seed in seeds}
        try:
            for future in as_completed(futures):
                courses[futures[future]] = future.result()
                if done is not None:
                    done()
        except KeyboardInterrupt:
            for child in multiprocessing.active_children():
                child.terminate()  # the pool would wait until they have played
            raise
    return [courses[seed] for seed in seeds]
