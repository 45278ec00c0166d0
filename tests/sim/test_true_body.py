"""A robot that is not what motion control believes: the physics has its true body, all others the believed one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tulip_description.materials import GRAVITY
from tulip_description.planar import Pose2D
from tulip_description.robot import Robot, load_robot
from tulip_sim.bench.body import Body
from tulip_sim.parameters import WorldParameters
from tulip_sim.scenario import Scenario
from tulip_sim.secret_body import secret_body, table_robot
from tulip_sim.world import World

ROBOT = load_robot()
SCENARIO = Scenario(Pose2D(), (3.0, 0.0), poles=False)

pytestmark = pytest.mark.sim


@pytest.mark.parametrize(
    ("believed", "truth"),
    [(ROBOT, secret_body(ROBOT, np.random.default_rng(4))), (table_robot(), ROBOT)],
    ids=["secret", "table"],
)
def test_cells_weigh_the_true_body_and_the_world_shows_the_believed_one(believed: Robot, truth: Robot) -> None:
    world = World(SCENARIO, WorldParameters.exact(), robot=believed, true_body=truth)
    forces = []
    for _ in range(100):
        world.advance(4)
        forces.append(world.sensors().foot_cells.sum())
    assert world.robot == believed
    assert np.mean(forces[50:]) == pytest.approx(truth.mass * GRAVITY, rel=0.01)
    assert abs(truth.mass - believed.mass) > 0.02 * truth.mass


def test_another_trunk_stands_where_the_believed_one_would() -> None:
    truth = secret_body(ROBOT, np.random.default_rng(4))
    poses = [World(SCENARIO, WorldParameters.exact(), true_body=body).truth().base_position for body in (None, truth)]
    assert poses[1] == pytest.approx(poses[0], abs=1e-12)


def test_a_true_body_with_other_joints_is_refused() -> None:
    longer = replace(ROBOT.joints[3], origin=(0.0, 0.0, -0.3))
    truth = replace(ROBOT, joints=(*ROBOT.joints[:3], longer, *ROBOT.joints[4:]))
    with pytest.raises(ValueError, match="true_body has other links or joints than robot; expected other masses alone"):
        World(SCENARIO, WorldParameters.exact(), true_body=truth)


def test_bench_body_stands_with_a_secret_body_while_motion_control_believes_the_file() -> None:
    truth = secret_body(ROBOT, np.random.default_rng(4))
    body = Body(1, Pose2D(), world=WorldParameters.exact(), true_body=truth)
    body.go(1.0)
    assert not body.fallen and body.world.robot == ROBOT
