"""Where a picture shows the robot's own trunk and arms, so that nothing is looked for there.

The head's angles follow from the camera's pose if the trunk stands upright, and the boxes of the robot file say the
rest: a line of sight that meets one of them, in the box's own axes, within all three pairs of faces, is hidden.
"""

from __future__ import annotations

import math

import numpy as np

from tulip_description.camera_pose import camera_in_footprint
from tulip_description.robot import Robot
from tulip_vision.view import Array, Mask, View

STEP = 16  # [px] between the rays that are followed; the edges lie within the margin
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
        middles, halves = (
            np.array(each) for each in zip(*((m, size / 2.0 + MARGIN) for m, size in boxes), strict=True)
        )
        self._lower, self._upper = middles - halves, middles + halves  # (boxes, 3) in base_link [m]
        signs = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
        self._corners = (middles[:, None] + signs * halves[:, None]).reshape(-1, 3)

    def mask(self, view: View) -> Mask:
        """Return (height, width) 255 where the picture may show the own trunk or arms, else 0."""
        ahead = view.rotation[:, 2]
        pan = math.atan2(float(ahead[1]), float(ahead[0]))
        tilt = -math.asin(float(np.clip(ahead[2], -1.0, 1.0)))
        eye = camera_in_footprint(self._robot, 0.0, (0.0, 0.0, 0.0, 1.0), pan, tilt)[:3, 3]  # in base_link
        whole: Mask = np.zeros((view.lens.height, view.lens.width), dtype=np.uint8)
        # All boxes are below the eye, so that none is seen higher than the corner that is.
        way = self._corners - eye
        highest = float((way[:, 2] / np.linalg.norm(way, axis=1)).max())
        rows = np.flatnonzero(np.fmin.reduce(view.coarse_sines(STEP), axis=1) < highest)
        if not len(rows):
            return whole
        table = view.lens.coarse_ray_table(STEP)[rows[0] : rows[-1] + 1]
        rays = view.rotation.astype(np.float32) @ table.reshape(-1, 3).T
        met = np.zeros(rays.shape[1], dtype=np.bool_)
        lower, upper = ((corners - eye).astype(np.float32)[..., None] for corners in (self._lower, self._upper))
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = np.float32(1.0) / rays  # (3, rays); corners of a fisheye's picture are NaN, and stay so
            for low, high in zip(lower, upper, strict=True):
                one, other = low * inverse, high * inverse
                (x0, y0, z0), (x1, y1, z1) = np.minimum(one, other), np.maximum(one, other)
                enter, leave = np.maximum(np.maximum(x0, y0), z0), np.minimum(np.minimum(x1, y1), z1)
                met |= (enter < leave) & (leave > 0.0)
        blocks = met.reshape(table.shape[:2])
        first, count = STEP * int(rows[0]), view.lens.coarse_ray_table(STEP).shape[0]
        end = view.lens.height if rows[-1] == count - 1 else STEP * (int(rows[-1]) + 1)
        # Pixels beyond the last whole block are like that block: one more is put there, and cut to fit.
        wider = np.concatenate([blocks, blocks[:, -1:]], axis=1).astype(np.uint8) * np.uint8(255)
        higher = np.concatenate([wider, wider[-1:]])
        whole[first:end] = np.repeat(np.repeat(higher, STEP, axis=1)[:, : whole.shape[1]], STEP, axis=0)[: end - first]
        return whole
