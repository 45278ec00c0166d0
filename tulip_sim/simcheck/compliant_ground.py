"""The ground as springs and dampers under the corners of the soles, with dry friction.

pybullet's carpet is rigid: it solves for impulses that stop the corners. An ordinary differential equation needs a
force as a function of the state; this one comes near to rigid ground as its stiffness grows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tulip_description import frames
from tulip_description.robot import Robot

Array = NDArray[np.float64]


@dataclass(frozen=True)
class GroundParameters:
    """Of one corner of a sole; there are four a foot.

    Attributes:
        stiffness: [N/m].
        damping: [N s/m].
        friction: Coefficient; that of `WorldParameters.exact`.
    """

    stiffness: float
    damping: float
    friction: float = 0.8


STIFF = GroundParameters(8.0e5, 1200.0)
"""0.035 mm under the standing robot; much damping for the foot alone, about critical for a leg's share of the robot."""
SOFT = GroundParameters(2.0e5, 600.0)
"""Four times softer, with the same share of damping: what changes between the two is due to the ground's giving way."""


class CompliantGround:
    """Forces on the corners of both soles.

    Normal: f_n = max(0, k d + b d'), d the depth of a corner under z = 0.
    Tangential: f_t = -k (x - a) - b x', at most mu f_n; the anchor a follows when it slides (Cundall and Strack 1979).

    Args:
        model: `floating_model` of the robot.
        robot: Gives the soles' corners.
        parameters: Of the ground.
    """

    def __init__(self, model: pin.Model, robot: Robot, parameters: GroundParameters) -> None:
        self._p = parameters
        self.joints = []
        """The model's joints that carry the soles."""
        self._corners = []
        for name, foot in zip((frames.LEFT_SOLE, frames.RIGHT_SOLE), robot.feet, strict=True):
            frame = model.frames[model.getFrameId(name)]
            corners = np.array([[x, y, 0.0] for x in foot.x for y in foot.y])
            self.joints.append(frame.parentJoint)
            self._corners.append(corners @ frame.placement.rotation.T + frame.placement.translation)
        self._anchors = np.full((8, 2), np.nan)

    def release(self) -> None:
        """Forget where the corners stick."""
        self._anchors[:] = np.nan

    def forces(self, data: pin.Data) -> tuple[Array, Array]:
        """Return (8, 3) places of the corners [m] and (8, 3) forces on them [N], in map.

        Args:
            data: After forward kinematics of position and velocity.
        """
        places, velocities = self._kinematics(data)
        normal = self._normal(places, velocities)
        tangential = self._sticking(places, velocities)
        allowed = self._p.friction * normal
        wanted = np.hypot(tangential[:, 0], tangential[:, 1])
        tangential *= np.where(wanted > allowed, allowed / np.maximum(wanted, 1e-12), 1.0)[:, None]
        return places, np.column_stack([tangential, normal])

    def slide(self, data: pin.Data) -> None:
        """Let the anchors follow the corners that slide, lift or touch; once after each step of integration."""
        places, velocities = self._kinematics(data)
        normal = self._normal(places, velocities)
        fresh = np.isnan(self._anchors[:, 0])
        self._anchors[fresh] = places[fresh, :2]
        tangential = self._sticking(places, velocities)
        wanted, allowed = np.hypot(tangential[:, 0], tangential[:, 1]), self._p.friction * normal
        slides = wanted > allowed
        kept = tangential[slides] * (allowed[slides] / wanted[slides])[:, None]
        self._anchors[slides] = (
            places[slides, :2] + (kept + self._p.damping * velocities[slides, :2]) / self._p.stiffness
        )
        self._anchors[normal <= 0.0] = np.nan

    def depth(self, data: pin.Data) -> float:
        """Return how deep the lowest corner is [m]."""
        return -float(self._kinematics(data)[0][:, 2].min())

    def _kinematics(self, data: pin.Data) -> tuple[Array, Array]:
        places, velocities = [], []
        for joint, corners in zip(self.joints, self._corners, strict=True):
            placement, motion = data.oMi[joint], data.v[joint]
            places.append(corners @ placement.rotation.T + placement.translation)
            velocities.append((motion.linear + corners @ pin.skew(motion.angular).T) @ placement.rotation.T)
        return np.concatenate(places), np.concatenate(velocities)

    def _normal(self, places: Array, velocities: Array) -> Array:
        depth = -places[:, 2]
        pressing = self._p.stiffness * depth - self._p.damping * velocities[:, 2]
        normal: Array = np.where(depth > 0.0, np.maximum(pressing, 0.0), 0.0)
        return normal

    def _sticking(self, places: Array, velocities: Array) -> Array:
        stretch = np.nan_to_num(places[:, :2] - self._anchors)  # none before the first contact
        sticking: Array = -self._p.stiffness * stretch - self._p.damping * velocities[:, :2]
        return sticking
