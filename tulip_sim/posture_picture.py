"""A picture of static postures side by side, as somebody beside the field sees them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tulip_description.field import load_field
from tulip_description.frames import LEFT_SOLE, RIGHT_SOLE
from tulip_description.model import floating_model
from tulip_description.planar import Pose2D
from tulip_description.robot import Robot
from tulip_motion.identification.static_postures import StaticPosture
from tulip_sim.scenario import Scenario
from tulip_sim.spectator import Spectator, look_at
from tulip_sim.world import World

Picture = NDArray[np.uint8]
SIZE = (300, 460)  # [px] of each posture
EYE = (2.4, -1.8, 1.05)  # [m] from the stance foot: from ahead and from the right
AIM = (0.05, 0.0, 0.62)  # [m] the middle of the picture
VIEW_ANGLE = math.radians(24.0)


def posture_picture(robot: Robot, postures: Sequence[StaticPosture]) -> Picture:
    """Return the BGR picture of some postures, from left to right.

    Args:
        robot: The playing robot.
        postures: On one foot each, which lies level.
    """
    world = World(Scenario(robot=Pose2D(), ball=(0.0, -2.5), poles=False), robot=robot)
    blank = world.truth()
    world.close()
    spectator = Spectator(load_field(), robot, *SIZE, VIEW_ANGLE)
    model = floating_model(robot)
    data = model.createData()
    pictures = []
    for posture in postures:
        q = pin.neutral(model)
        q[7:] = posture.joint_positions
        pin.framesForwardKinematics(model, data, q)
        base = data.oMf[model.getFrameId(LEFT_SOLE if posture.side == "left" else RIGHT_SOLE)].inverse()
        place = pin.SE3ToXYZQUAT(base)
        truth = replace(
            blank, base_position=place[:3], base_orientation=place[3:], joint_positions=posture.joint_positions
        )
        pictures.append(spectator.render(truth, look_at(EYE, AIM)))
    return np.hstack(pictures)
