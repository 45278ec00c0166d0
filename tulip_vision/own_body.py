"""Where a picture shows the robot's own trunk and arms, so that nothing is looked for there.

The head's angles follow from the camera's pose if the trunk stands upright, and the boxes of the robot file say the
rest: a line of sight that meets one of them, in the box's own axes, within all three pairs of faces, is hidden.
"""

from __future__ import annotations

import math

import cv2
import numpy as np

from tulip_description.camera_pose import camera_in_footprint
from tulip_description.robot import Robot
from tulip_vision.view import Array, Mask, View

STEP = 8  # [px] between the rays that are followed; the edges lie within the margin
MARGIN = 0.012  # [m] round each box: how far a trunk that leans by 3 deg moves an arm 0.2 m from the camera
UNSEEN = ("neck", "head")  # carry the camera; it does not see them


class OwnBody:
    """The trunk and what is fixed to it. Legs move, and have a zone of their own in the search for lines."""

    def __init__(self, robot: Robot) -> None:
        """Collect the boxes.

        Args:
            robot: With a camera.
        """
        self._robot = robot
        moving = {joint.name for joint in robot.moving}
        places: dict[str, Array] = {robot.links[0].name: np.zeros(3)}
        for joint in robot.joints:
            if joint.parent in places and joint.name not in moving:
                places[joint.child] = places[joint.parent] + np.array(joint.origin)
        boxes = [
            (places[link.name] + np.array(box.centre), np.array(box.size))
            for link in robot.links
            for box in link.boxes
            if link.name in places and link.name not in UNSEEN
        ]
        self._lower = np.array([middle - size / 2.0 - MARGIN for middle, size in boxes])  # (boxes, 3) in base_link [m]
        self._upper = np.array([middle + size / 2.0 + MARGIN for middle, size in boxes])

    def mask(self, view: View) -> Mask:
        """Return (height, width) 255 where the picture may show the own trunk or arms, else 0."""
        ahead = view.rotation[:, 2]
        pan = math.atan2(float(ahead[1]), float(ahead[0]))
        tilt = -math.asin(float(np.clip(ahead[2], -1.0, 1.0)))
        eye = camera_in_footprint(self._robot, 0.0, (0.0, 0.0, 0.0, 1.0), pan, tilt)[:3, 3]  # in base_link
        table = view.lens.coarse_ray_table(STEP)
        rays = view.rotation.astype(np.float32) @ table.reshape(-1, 3).T
        with np.errstate(divide="ignore"):
            inverse = 1.0 / rays  # (3, rays); corners of a fisheye's picture are NaN, and stay so
        met = np.zeros(rays.shape[1], dtype=np.bool_)
        lower, upper = (self._lower - eye).astype(np.float32), (self._upper - eye).astype(np.float32)
        for low, high in zip(lower[..., None], upper[..., None], strict=True):
            with np.errstate(invalid="ignore"):
                one, other = low * inverse, high * inverse
                (x0, y0, z0), (x1, y1, z1) = np.minimum(one, other), np.maximum(one, other)
                enter, leave = np.maximum(np.maximum(x0, y0), z0), np.minimum(np.minimum(x1, y1), z1)
                met |= (enter < leave) & (leave > 0.0)
        blocks = met.reshape(table.shape[:2]).astype(np.uint8) * np.uint8(255)
        rows, columns = view.lens.height, view.lens.width
        if not met.any():
            return np.zeros((rows, columns), dtype=np.uint8)
        size = (blocks.shape[1] * STEP, blocks.shape[0] * STEP)
        fine = cv2.resize(blocks, size, interpolation=cv2.INTER_NEAREST)
        missing = (max(rows - size[1], 0), max(columns - size[0], 0))
        fine = cv2.copyMakeBorder(fine, 0, missing[0], 0, missing[1], cv2.BORDER_REPLICATE)[:rows, :columns]
        return np.asarray(fine, dtype=np.uint8)
