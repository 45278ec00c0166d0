"""Head movement: sharing the gaze between ball and landmarks, finding the ball, following one that rolls."""

from __future__ import annotations

from collections.abc import Callable

from tulip_sim.bench.head_picture import draw
from tulip_sim.bench.head_tables import summarize
from tulip_sim.bench.head_trials import GAZES, SPEEDS, covered, roll, search, share
from tulip_sim.bench.runner import Bench, Row

SHARE_SEEDS, SEARCH_SEEDS, ROLL_SEEDS = 12, 60, 6


def measure(what: str, *arguments: object) -> Row:
    """Run one trial."""
    trials: dict[str, Callable[..., Row]] = {"share": share, "search": search, "roll": roll, "coverage": covered}
    return trials[what](*arguments)


TRIALS: list[tuple[object, ...]] = [
    *(("coverage", turning) for turning in (False, True)),
    *(("share", gaze, seed) for seed in range(SHARE_SEEDS) for gaze in GAZES),
    *(("search", seed) for seed in range(SEARCH_SEEDS)),
    *(("roll", gaze, speed, seed) for gaze in GAZES for speed in SPEEDS for seed in range(ROLL_SEEDS)),
]
BENCH = Bench("head", "Head movement", TRIALS, measure, summarize, draw)
