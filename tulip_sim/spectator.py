"""A spectator's camera: the whole robot, ball, goals and keeper from anywhere, through a lens without faults."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from tulip_description.field import Field, Goal
from tulip_description.planar import Pose2D
from tulip_description.robot import Robot
from tulip_sim.camera import CameraParameters, CameraRenderer
from tulip_sim.scene import HIDDEN, Body, scene_of
from tulip_sim.truth import Truth
from tulip_vision.lens import Lens

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]

SAMPLES = 2  # per pixel, across and down: smooths what the renderer's own anti-aliasing leaves
EXPOSURE = 1.2  # the head camera's pictures are a little dark for the page of a document

VIEW_ANGLE = math.radians(60.0)
# Where a photographer would stand for robot, ball and goal in one picture.
DISTANCE = 2.9  # [m] from the robot: it fills two thirds of the picture's height
ASIDE = math.radians(35.0)  # from straight behind, to the right: ball and goal are not hidden by the robot
EYE_HEIGHT = 1.15  # [m] the robot's own
AIM_HEIGHT = 0.72  # [m] of the point in the middle of the picture
AIM_ASIDE = math.radians(11.0)  # the robot stands left of the middle, towards the ball's way


class Spectator:
    """Renders what somebody beside the field sees."""

    def __init__(
        self,
        field: Field,
        robot: Robot,
        width: int = 1280,
        height: int = 640,
        view_angle: float = VIEW_ANGLE,
        parameters: CameraParameters | None = None,
    ) -> None:
        """Paint ground and wall once; takes some seconds.

        Args:
            field: Lines, goals, poles and ball.
            robot: A robot with a head.
            width: Of the picture [px].
            height: Of the picture [px].
            view_angle: Between the picture's left and right edge [rad].
            parameters: Colours, shadows and the hall; the camera's faults do not count.

        Raises:
            ValueError: if the size or the angle makes no picture.
        """
        self._parameters = parameters or CameraParameters()
        self._size = (width, height)
        self._body = Body(robot, self._parameters.team_colour, HIDDEN)
        lens = pinhole(SAMPLES * width, SAMPLES * height, view_angle)
        self._renderer = CameraRenderer(self._parameters, field, robot, lens)

    def render(self, truth: Truth, camera_in_map: Array) -> Picture:
        """Return the (height, width, 3) BGR picture of the world.

        Args:
            truth: The world.
            camera_in_map: (4, 4) transform of the camera's optical frame in map, as from `look_at`.
        """
        scene, _ = scene_of(truth, self._body, self._parameters.keeper_colour)
        fine = self._renderer.render_scene(camera_in_map, scene)
        picture = cv2.resize(fine, self._size, interpolation=cv2.INTER_AREA)
        return np.asarray(cv2.convertScaleAbs(picture, alpha=EXPOSURE), np.uint8)


def pinhole(width: int, height: int, view_angle: float) -> Lens:
    """Return a lens without distortion.

    Args:
        width: Of the picture [px].
        height: Of the picture [px].
        view_angle: Between the picture's left and right edge [rad].

    Raises:
        ValueError: if the angle is not between 0 and pi, or the picture has no pixel.
    """
    if not 0.0 < view_angle < math.pi:
        raise ValueError(f"view_angle is {view_angle} rad; expected more than 0 and less than pi")
    focal = width / 2.0 / math.tan(view_angle / 2.0)
    matrix = [[focal, 0.0, (width - 1) / 2.0], [0.0, focal, (height - 1) / 2.0], [0.0, 0.0, 1.0]]
    return Lens(width, height, matrix, np.zeros(5))


def look_at(eye: ArrayLike, target: ArrayLike) -> Array:
    """Return the (4, 4) transform in map of a camera's optical frame (z ahead, x right, y down), level sideways.

    Args:
        eye: (3,) where the camera is [m].
        target: (3,) the point in the middle of its picture [m].

    Raises:
        ValueError: if the target lies straight above or below the eye, or in it.
    """
    place, aim = np.asarray(eye, float), np.asarray(target, float)
    forward = aim - place
    right = np.array([forward[1], -forward[0], 0.0])
    if not np.linalg.norm(right) > 1e-9:
        raise ValueError(f"eye is {place.tolist()} m and target {aim.tolist()} m; expected them apart in x or y")
    forward /= np.linalg.norm(forward)
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([right, np.cross(forward, right), forward])
    pose[:3, 3] = place
    return pose


def behind(robot: Pose2D, goal: Goal) -> Array:
    """Return the (4, 4) pose in map of a camera behind the robot, to its right, with the goal in the background.

    Args:
        robot: Pose of base_footprint in map.
        goal: What the robot attacks.
    """
    back = math.atan2(robot.y, robot.x - goal.x) + ASIDE  # direction from the goal's middle to the robot, and on
    eye = np.array([robot.x + DISTANCE * math.cos(back), robot.y + DISTANCE * math.sin(back), EYE_HEIGHT])
    ahead = back + math.pi - AIM_ASIDE
    return look_at(eye, [eye[0] + DISTANCE * math.cos(ahead), eye[1] + DISTANCE * math.sin(ahead), AIM_HEIGHT])
