"""Ways from posture to posture on one foot: roads along which the robot stays statically stable.

A road is straight in the coordinates of `static_postures`: the lean, the knee, the free leg go over evenly, and hip and
ankle of the stance leg follow so that the CoM stays over the aim point. Where a straight road is blocked, because the
legs would meet or the foot would touch the ground, the way leads over other postures: a probabilistic road map (Kavraki
et al. 1996) whose roads are looked at only when a way wants to use them (lazy: Bohlin and Kavraki 2000).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.sparse.csgraph import csgraph_from_dense, dijkstra

from tulip_motion.identification.static_postures import PostureSolver, StaticPosture

Array = NDArray[np.float64]
SPACING = 0.04  # [rad] of the fastest joint between two looks at a road


class Road:
    """Joint positions as a smooth function of the share of the way, 0 to 1."""

    def __init__(self, points: Array) -> None:
        """Lay a curve through points.

        Args:
            points: (m, n) joint positions [rad], m > 1, evenly spaced in the share of the way.
        """
        self.points = points
        self._curve = CubicSpline(np.linspace(0.0, 1.0, len(points)), points)
        self._rate = self._curve.derivative()
        self.length = float(np.abs(self._rate(np.linspace(0.0, 1.0, 2 * len(points)))).max())
        """[rad] What the fastest joint would cover at its greatest rate."""

    def position(self, share: float) -> Array:
        """Return (n,) joint positions [rad]."""
        position: Array = self._curve(share)
        return position

    def rate(self, share: float) -> Array:
        """Return (n,) their derivative by the share [rad]."""
        rate: Array = self._rate(share)
        return rate

    def reversed(self) -> Road:
        """Return the way back."""
        return Road(self.points[::-1])


class RoadMap:
    """Postures on one foot and the roads between them."""

    def __init__(self, solver: PostureSolver, postures: Sequence[StaticPosture]) -> None:
        """Begin with all roads unlooked at.

        Args:
            solver: Of that foot.
            postures: All that a way may lead over.
        """
        self._solver, self.postures = solver, tuple(postures)
        places = np.array([posture.joint_positions for posture in postures])
        self.distances: Array = np.abs(places[:, None] - places[None]).max(axis=2)
        """(m, m) of the joint that moves farthest [rad]; infinite where a road turned out to be blocked."""
        self._roads: dict[tuple[int, int], Road] = {}

    def way(self, start: int, end: int) -> list[Road] | None:
        """Return the roads of the shortest way from a posture to another, or None if none is open."""
        while True:
            graph = csgraph_from_dense(self.distances, null_value=np.inf)
            _, before = dijkstra(graph, directed=True, indices=np.array(start), return_predecessors=True)
            if end != start and before[end] < 0:
                return None
            stops = [end]
            while stops[-1] != start:
                stops.append(int(before[stops[-1]]))
            stops.reverse()
            roads = [self._road(a, b) for a, b in pairwise(stops)]
            found = [road for road in roads if road is not None]
            if len(found) == len(roads):
                return found

    def tour(self, stops: Sequence[int], home: int) -> list[int]:
        """Return the stops in an order that makes the way from home over all of them and back short."""
        left, order = set(stops), [home]
        while left:
            order.append(min(left, key=lambda stop: (self.distances[order[-1], stop], stop)))
            left.remove(order[-1])
        order.append(home)
        improved = True
        while improved:  # 2-opt: turn a part of the tour round while that makes it shorter
            improved = False
            for i in range(1, len(order) - 2):
                for j in range(i + 1, len(order) - 1):
                    a, b, c, d = order[i - 1], order[i], order[j], order[j + 1]
                    # Compared as sums: where roads are blocked, distances are infinite, and have no difference.
                    if self.distances[a, c] + self.distances[b, d] + 1e-9 < self.distances[a, b] + self.distances[c, d]:
                        order[i : j + 1] = order[i : j + 1][::-1]
                        improved = True
        return order[1:-1]

    def _road(self, start: int, end: int) -> Road | None:
        """Return the straight road between two postures, or None, and block it, if the robot cannot take it."""
        known = self._roads.get((start, end))
        if known is None:
            known = straight_road(self._solver, self.postures[start], self.postures[end])
            if known is None:
                self.distances[start, end] = self.distances[end, start] = np.inf
                return None
            self._roads[start, end], self._roads[end, start] = known, known.reversed()
        return known


def straight_road(solver: PostureSolver, start: StaticPosture, end: StaticPosture) -> Road | None:
    """Return the road that is straight in the coordinates, or None if the robot cannot go along it.

    Args:
        solver: Of the foot that both postures stand on.
        start: Where it begins.
        end: Where it ends.
    """
    farthest = float(np.abs(end.joint_positions - start.joint_positions).max())
    number = max(int(np.ceil(farthest / SPACING)), 4)
    points = [start.joint_positions]
    for share in np.linspace(0.0, 1.0, number + 1)[1:]:
        coordinates = start.coordinates + share * (end.coordinates - start.coordinates)
        posture = solver.solve(coordinates, points[-1])
        if posture is None or np.abs(posture.joint_positions - points[-1]).max() > 3.0 * SPACING:
            return None  # no posture there, or one of another branch of solutions
        if solver.fault(posture.joint_positions):
            return None
        points.append(posture.joint_positions)
    return Road(np.array(points))
