"""The plan of the experiment: which postures in which order, and all roads, computed before the robot moves."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from tulip_description.model import Side
from tulip_description.robot import SIDES, Robot
from tulip_motion.identification.posture_choice import choose, rows_of
from tulip_motion.identification.posture_roads import Road, RoadMap
from tulip_motion.identification.static_postures import PostureParameters, PostureSolver, StaticPosture
from tulip_motion.identification.weight_shift import WeightShift, weight_shift

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PlanParameters:
    """How much is planned."""

    postures: int = 20  # a foot
    candidates: int = 250  # that they are chosen from, a foot; ways may lead over the others
    seed: int = 1  # of the candidates


@dataclass(frozen=True)
class Visit:
    """A posture to hold and how to come to it.

    Attributes:
        posture: To hold.
        roads: From the posture before, or from the lifted foot.
        home: Back to the lifted foot.
    """

    posture: StaticPosture
    roads: tuple[Road, ...]
    home: tuple[Road, ...]


@dataclass(frozen=True)
class FootPlan:
    """All on one foot.

    Attributes:
        side: The stance foot.
        weight_shift: Onto it.
        visits: Postures in their order.
    """

    side: Side
    weight_shift: WeightShift
    visits: tuple[Visit, ...]


def make_plan(
    robot: Robot,
    parameters: PlanParameters | None = None,
    postures: PostureParameters | None = None,
    advance: Callable[[], None] = lambda: None,
) -> tuple[FootPlan, ...]:
    """Return the plan, the left foot first.

    Args:
        robot: As it is believed to be.
        parameters: How much is planned.
        postures: What postures have to keep to.
        advance: Told after each of the two feet.

    Raises:
        ValueError: if the robot cannot stand on a foot, or a posture cannot be reached.
    """
    p = parameters or PlanParameters()
    rng = np.random.default_rng(p.seed)
    shifts, maps = [], []
    for name in SIDES:
        side: Side = "left" if name == "left" else "right"
        shift = weight_shift(robot, side)
        shifts.append(shift)
        maps.append(_road_map(PostureSolver(robot, side, postures), shift.lift.points[-1], p.candidates, rng))
        advance()
    candidates = [
        (side, stop) for side, roads in zip(SIDES, maps, strict=True) for stop in range(1, len(roads.postures))
    ]
    of_candidates = [maps[SIDES.index(side)].postures[stop] for side, stop in candidates]
    chosen = choose(rows_of(robot, of_candidates), [side for side, _ in candidates], p.postures, rng)
    plans = []
    for name, shift, roads in zip(SIDES, shifts, maps, strict=True):
        stops = [stop for of_side, stop in (candidates[index] for index in chosen) if of_side == name]
        plans.append(FootPlan(roads.postures[0].side, shift, tuple(_visits(roads, stops))))
    return tuple(plans)


def _road_map(solver: PostureSolver, lifted: Array, candidates: int, rng: np.random.Generator) -> RoadMap:
    """Return the road map of random postures that can be reached from the lifted foot, which is the first.

    Args:
        solver: Of the stance foot.
        lifted: (n,) joints with the other foot lifted [rad].
        candidates: How many postures are drawn.
        rng: Draws them.
    """
    fault = solver.fault(lifted)
    if fault:
        raise ValueError(f"on the {solver.side} foot with the other lifted, {fault}; expected a posture to begin with")
    home = StaticPosture(solver.side, solver.coordinates_of(lifted), lifted)
    postures = [home, *islice(solver.samples(rng, lifted), candidates)]
    roads = RoadMap(solver, postures)
    return RoadMap(solver, [each for index, each in enumerate(postures) if roads.way(index, 0) is not None])


def _visits(roads: RoadMap, stops: list[int]) -> Iterator[Visit]:
    """Yield the stops in a short order, with the ways to them and home."""
    before = 0
    for stop in roads.tour(stops, 0):
        there, back = roads.way(before, stop), roads.way(stop, 0)
        assert there is not None and back is not None  # all of this map can be reached
        yield Visit(roads.postures[stop], tuple(there), tuple(back))
        before = stop
