"""The plan of the experiment: which postures in which order, and all roads, computed before the robot moves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from tulip_description.model import Side
from tulip_description.robot import SIDES, Robot
from tulip_motion.identification.posture_choice import choose
from tulip_motion.identification.posture_roads import Road, RoadMap
from tulip_motion.identification.static_postures import PostureParameters, PostureSolver, StaticPosture
from tulip_motion.identification.weight_shift import WeightShift, weight_shift

Array = NDArray[np.float64]
Rows = Callable[[Sequence[StaticPosture]], Array]
"""Gives (m, 2, n), the rows W of eq. (2) of m postures on one foot."""


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
    rows: Rows,
    parameters: PlanParameters | None = None,
    postures: PostureParameters | None = None,
    advance: Callable[[], None] = lambda: None,
) -> tuple[FootPlan, ...]:
    """Return the plan, the left foot first.

    Args:
        robot: As it is believed to be.
        rows: The regressor that the choice is made for.
        parameters: How much is planned.
        postures: What postures have to keep to.
        advance: Told after each of the two feet.

    Raises:
        ValueError: if the robot cannot stand on a foot, or a posture cannot be reached.
    """
    p = parameters or PlanParameters()
    seeds = np.random.default_rng(p.seed).spawn(len(SIDES))
    plans = []
    for name, rng in zip(SIDES, seeds, strict=True):
        side: Side = "left" if name == "left" else "right"
        plans.append(_plan_foot(PostureSolver(robot, side, postures), rows, p, rng))
        advance()
    return tuple(plans)


def _plan_foot(solver: PostureSolver, rows: Rows, p: PlanParameters, rng: np.random.Generator) -> FootPlan:
    shift = weight_shift(solver.robot, solver.side)
    lifted = shift.lift.points[-1]
    home = StaticPosture(solver.side, solver.coordinates_of(lifted), lifted)
    fault = solver.fault(lifted)
    if fault:
        raise ValueError(f"on the {solver.side} foot with the other lifted, {fault}")
    reachable = _reachable(solver, [home, *islice(solver.samples(rng, lifted), p.candidates)])
    chosen = [index + 1 for index in choose(rows(reachable.postures[1:]), p.postures, rng)]
    visits, before = [], 0
    for stop in reachable.tour(chosen, 0):
        roads, back = reachable.way(before, stop), reachable.way(stop, 0)
        if roads is None or back is None:
            raise ValueError(f"posture {stop} on the {solver.side} foot cannot be reached; expected an open way")
        visits.append(Visit(reachable.postures[stop], tuple(roads), tuple(back)))
        before = stop
    return FootPlan(solver.side, shift, tuple(visits))


def _reachable(solver: PostureSolver, postures: list[StaticPosture]) -> RoadMap:
    """Return the road map of the postures that can be reached from the first over the others."""
    roads = RoadMap(solver, postures)
    found = [posture for index, posture in enumerate(postures) if roads.way(index, 0) is not None]
    return RoadMap(solver, found)
