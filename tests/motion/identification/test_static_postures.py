"""Postures on one foot: statically stable by an independent model, and within all limits."""

from __future__ import annotations

from itertools import islice

import numpy as np
import pytest
from synthetic import base_rotation, com_by_pinocchio

from tulip_description.model import Side
from tulip_description.robot import load_robot
from tulip_motion.identification.self_collision import SelfCollision
from tulip_motion.identification.static_postures import MIRROR, PostureSolver, StaticPosture, aim_point
from tulip_motion.identification.weight_shift import weight_shift

ROBOT = load_robot()


def drawn(side: Side, number: int) -> list[StaticPosture]:
    solver = PostureSolver(ROBOT, side)
    return list(islice(solver.samples(np.random.default_rng(5), weight_shift(ROBOT, side).lift.points[-1]), number))


@pytest.mark.parametrize("side", ["left", "right"])
def test_com_of_the_whole_robot_stays_over_the_middle_of_the_cells(side: Side):
    for posture in drawn(side, 20):
        com = com_by_pinocchio(ROBOT, side, posture.joint_positions)
        assert com[:2] == pytest.approx(aim_point(ROBOT, side), abs=1e-8)  # the solver's tolerance is 1e-9


def test_trunk_leans_as_the_coordinates_say():
    for posture in drawn("left", 10):
        up = base_rotation(ROBOT, "left", posture.joint_positions).T @ [0.0, 0.0, 1.0]
        assert up == pytest.approx(posture.up, abs=1e-8)
        assert -up[:2] == pytest.approx(posture.coordinates[:2], abs=1e-8)


def test_samples_keep_off_joint_limits_the_other_leg_and_the_ground():
    solver, collision = PostureSolver(ROBOT, "right"), SelfCollision(ROBOT)
    low, high = ROBOT.position_limits
    for posture in drawn("right", 20):
        joints = posture.joint_positions
        assert (joints - low).min() >= 0.08
        assert (high - joints).min() >= 0.08
        assert collision.clearance(joints)[0] >= 0.02
        assert solver.ground_clearance(joints) >= 0.03
        assert (np.abs(solver.torques(joints)) <= 0.7 * ROBOT.effort_limits).all()


def test_mirrored_coordinates_give_the_mirrored_posture():
    left, right = PostureSolver(ROBOT, "left"), PostureSolver(ROBOT, "right")
    for posture in drawn("left", 5):
        other = right.solve(posture.coordinates * MIRROR, weight_shift(ROBOT, "right").lift.points[-1])
        assert other is not None
        joints = posture.joint_positions
        signs = np.array([-1.0, -1.0, 1.0, 1.0, 1.0, -1.0])
        # The trunk's CoM lies 0.9 mm beside its middle plane, so the mirror image is not perfect.
        assert other.joint_positions[6:12] == pytest.approx(joints[:6] * signs, abs=5e-3)
    assert left.aim == pytest.approx(right.aim)


def test_coordinates_of_a_posture_are_found_again():
    solver = PostureSolver(ROBOT, "left")
    for posture in drawn("left", 5):
        assert solver.coordinates_of(posture.joint_positions) == pytest.approx(posture.coordinates, abs=1e-8)


@pytest.mark.parametrize(
    ("coordinate", "value", "reason"),
    [(3, 2.35, "near its limit"), (6, 1.1, "above the ground"), (5, 0.4, "come as near as")],
)
def test_faults_are_told_in_words(coordinate: int, value: float, reason: str):
    solver = PostureSolver(ROBOT, "left")
    lifted = weight_shift(ROBOT, "left").lift.points[-1]
    coordinates = solver.coordinates_of(lifted)
    if coordinate == 6:  # the free leg hangs down straight
        coordinates[6:9] = -0.2, 0.1, 0.1
    else:
        coordinates[coordinate] = value
    posture = solver.solve(coordinates, lifted)
    assert posture is None or reason in solver.fault(posture.joint_positions)
    assert not solver.fault(lifted)
