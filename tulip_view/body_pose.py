"""Where the robot's links are: from the pose of base_link and the joint angles, for pictures of the robot."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tulip_description.model import floating_model
from tulip_description.robot import Box, Robot

Array = NDArray[np.float64]

COLOURS = {"grey": "#9aa3ad", "black": "#33373d", "marker": "#17becf", "cyan": "#17becf", "magenta": "#d62ad6"}
"""Of boxes, by the names that the robot and the goalkeeper figure have for them."""
OTHER_TEAM = "magenta"
"""Colour of the other team's marks: the own robot is drawn with cyan ones."""


class BodyPose:
    """Places the links of a robot that have boxes.

    Attributes:
        names: Of these links.
        boxes: Each box, with the index of its link in `names`.
    """

    def __init__(self, robot: Robot) -> None:
        """Make the model.

        Args:
            robot: The robot.
        """
        self.names = [link.name for link in robot.links if link.boxes]
        self.boxes: list[tuple[int, Box]] = [
            (index, box) for index, name in enumerate(self.names) for box in robot.link(name).boxes
        ]
        self._model = floating_model(robot)
        self._data = self._model.createData()
        self._frames = [self._model.getFrameId(name) for name in self.names]

    def links(self, base: Array, angles: Array) -> NDArray[np.float32]:
        """Return (links, 7) position [m] and quaternion x, y, z, w of each link; NaN where something is not known.

        Args:
            base: (7,) base_link in the frame that is wanted: position [m] and quaternion x, y, z, w.
            angles: (n,) of all joints, in the robot's order [rad].
        """
        found = np.full((len(self._frames), 7), np.nan, dtype=np.float32)
        configuration = np.concatenate([base, angles])
        if np.isfinite(configuration).all():
            pin.framesForwardKinematics(self._model, self._data, configuration)
            for index, frame in enumerate(self._frames):
                found[index] = pin.SE3ToXYZQUAT(self._data.oMf[frame])
        return found


def turned(poses: Array, yaw: Array) -> Array:
    """Return (n, 4) quaternions x, y, z, w of poses after a turn about the vertical axis.

    Args:
        poses: (n, 7) positions and quaternions.
        yaw: (n,) by how much they are turned [rad].
    """
    x, y, z, w = poses[:, 3:].T
    c, s = np.cos(yaw / 2.0), np.sin(yaw / 2.0)
    return np.column_stack([c * x - s * y, c * y + s * x, c * z + s * w, c * w - s * z])


def pose_row(pose: object) -> tuple[float, ...]:
    """Return position and quaternion x, y, z, w of a geometry_msgs/Pose."""
    p, q = pose.position, pose.orientation  # type: ignore[attr-defined]
    return (p.x, p.y, p.z, q.x, q.y, q.z, q.w)
