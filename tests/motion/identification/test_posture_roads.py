"""Roads between postures, and ways over several of them."""

from __future__ import annotations

from itertools import islice, pairwise

import numpy as np
import pytest
from synthetic import com_by_pinocchio

from tulip_description.robot import load_robot
from tulip_motion.identification.posture_roads import Road, RoadMap, straight_road
from tulip_motion.identification.self_collision import SelfCollision
from tulip_motion.identification.static_postures import PostureSolver, StaticPosture, aim_point
from tulip_motion.identification.weight_shift import weight_shift

ROBOT = load_robot()


@pytest.fixture(scope="module")
def solver() -> PostureSolver:
    return PostureSolver(ROBOT, "left")


@pytest.fixture(scope="module")
def roads(solver: PostureSolver) -> RoadMap:
    lifted = weight_shift(ROBOT, "left").lift.points[-1]
    home = StaticPosture("left", solver.coordinates_of(lifted), lifted)
    return RoadMap(solver, [home, *islice(solver.samples(np.random.default_rng(1), lifted), 60)])


def test_com_stays_over_the_aim_point_all_along_the_ways(roads: RoadMap):
    for end in range(1, 6):
        for road in roads.way(0, end) or []:
            for share in np.linspace(0.0, 1.0, 37):
                com = com_by_pinocchio(ROBOT, "left", road.position(share))
                # Between its points a road is a spline: it leaves the exact solution by fractions of a millimetre.
                assert com[:2] == pytest.approx(aim_point(ROBOT, "left"), abs=5e-4)


def test_nothing_comes_near_and_the_foot_stays_in_the_air_all_along(roads: RoadMap, solver: PostureSolver):
    collision = SelfCollision(ROBOT)
    for end in range(1, 6):
        for road in roads.way(0, end) or []:
            for share in np.linspace(0.0, 1.0, 37):
                joints = road.position(share)
                assert collision.clearance(joints)[0] > 0.015
                assert solver.ground_clearance(joints) > 0.025


def test_ways_begin_and_end_at_their_postures_without_gaps(roads: RoadMap):
    way = roads.way(3, 7)
    assert way is not None
    assert way[0].position(0.0) == pytest.approx(roads.postures[3].joint_positions)
    assert way[-1].position(1.0) == pytest.approx(roads.postures[7].joint_positions)
    for one, next_one in pairwise(way):
        assert one.position(1.0) == pytest.approx(next_one.position(0.0))


def test_a_blocked_straight_road_is_gone_round(roads: RoadMap, solver: PostureSolver):
    blocked = [
        (a, b)
        for a in range(1, 25)
        for b in range(1, a)
        if straight_road(solver, roads.postures[a], roads.postures[b]) is None
    ]
    assert blocked  # else this tests nothing
    ways = [roads.way(a, b) for a, b in blocked]
    found = [way for way in ways if way is not None]
    assert len(found) > 0.5 * len(blocked)
    assert all(len(way) > 1 for way in found)


def test_a_tour_is_no_longer_than_that_of_the_nearest_neighbour_and_visits_all(roads: RoadMap):
    stops = list(range(1, 21))
    tour = roads.tour(stops, 0)
    assert sorted(tour) == stops

    def length(order: list[int]) -> float:
        return sum(roads.distances[a, b] for a, b in zip([0, *order], [*order, 0], strict=True))

    left, greedy = set(stops), [0]
    while left:
        greedy.append(min(left, key=lambda stop: roads.distances[greedy[-1], stop]))
        left.remove(greedy[-1])
    assert length(tour) <= length(greedy[1:])


def test_rate_of_a_road_is_its_derivative_and_the_way_back_its_mirror_in_time():
    road = Road(np.array([[0.0, 1.0], [0.2, 0.9], [0.5, 0.4], [0.6, 0.1], [0.7, 0.0]]))
    for share in (0.1, 0.45, 0.8):
        numeric = (road.position(share + 1e-6) - road.position(share - 1e-6)) / 2e-6
        assert road.rate(share) == pytest.approx(numeric, abs=1e-6)
        assert road.reversed().position(1.0 - share) == pytest.approx(road.position(share))
    assert road.length >= 1.0  # the second joint covers 1 rad, at no even rate
