"""Balance: the ZMP that brings the DCM back to its reference, inside the feet, and the CMP, a little beyond them."""

from __future__ import annotations

import math
from typing import NamedTuple

from tulip_motion.footsteps import Footstep
from tulip_motion.gait import sole_point
from tulip_motion.interface import Side
from tulip_motion.parameters import MotionParameters

Point = tuple[float, float]


class SupportArea(NamedTuple):
    """Where the ZMP can be: on one sole, or between both; laid out once for all questions of a tick.

    Both soles are the same rectangle, so their hull is that rectangle moved along the line between their aim points.

    Attributes:
        parameters: Of motion control.
        aim: Where the ZMP on the stance foot is aimed at, in odom [m].
        way: From there to the other foot's aim point [m]; None while that foot swings.
        forward: Direction that the stance sole points to, a unit vector in odom.
        stance: The foot that stands.
    """

    parameters: MotionParameters
    aim: Point
    way: Point | None
    forward: Point
    stance: Footstep

    @classmethod
    def of(cls, parameters: MotionParameters, stance: Footstep, other: Footstep | None) -> SupportArea:
        """Lay out the area.

        Args:
            parameters: Of motion control.
            stance: The foot that stands.
            other: The other foot if it stands as well, else None.
        """
        p, way = parameters, None
        aim = sole_point(stance, p.zmp_forward, p.zmp_inward)
        if other is not None:
            x, y = sole_point(other, p.zmp_forward, p.zmp_inward)
            way = (x - aim[0], y - aim[1])
        return cls(p, aim, way, (math.cos(stance.pose.yaw), math.sin(stance.pose.yaw)), stance)

    @property
    def aims(self) -> tuple[Point, Point]:
        """The aim points on the left and the right sole, in odom [m]; the same twice while one foot swings."""
        way = self.way or (0.0, 0.0)
        other = (self.aim[0] + way[0], self.aim[1] + way[1])
        return (self.aim, other) if self.stance.side is Side.LEFT else (other, self.aim)

    def nearest(self, point: Point, beyond: float = 0.0) -> tuple[Point, float]:
        """Return the point moved into the area, and the other foot's share of the weight with the ZMP there.

        Args:
            point: In odom [m].
            beyond: Way beyond the limits of the ZMP that still counts as inside [m].
        """
        p, (x, y), share = self.parameters, self.aim, 0.0
        if self.way is not None:
            dx, dy = self.way
            share = ((point[0] - x) * dx + (point[1] - y) * dy) / (dx * dx + dy * dy)
            share = min(max(share, 0.0), 1.0)
            x, y = x + share * dx, y + share * dy
        (c, s), dx, dy = self.forward, point[0] - x, point[1] - y
        forward = min(max(c * dx + s * dy, -p.zmp_limit_heel - beyond), p.zmp_limit_toe + beyond)
        side = p.zmp_limit_side + beyond
        left = min(max(c * dy - s * dx, -side), side)
        return (x + c * forward - s * left, y + s * forward + c * left), share


class Balance(NamedTuple):
    """The commanded ZMP and CMP.

    Attributes:
        area: Where the ZMP can be.
        zmp: (x, y) in odom [m], inside the soles.
        cmp: Centroidal moment pivot, (x, y) in odom [m]: the CoM is pushed away from it. Where it lies beyond the
            soles, the hip strategy turns the torso.
        right_share: Share of the weight on the right foot, 0 to 1: the ZMP projected onto the line
            between the feet, which eq. (15) uses as alpha.
    """

    area: SupportArea
    zmp: Point
    cmp: Point
    right_share: float


def stabilize(area: SupportArea, zmp: Point, dcm_planned: Point, dcm: Point) -> Balance:
    """Return zmp = ref + (1 + k) (dcm - dcm_ref), moved to the nearest point in reach of the ankles, and of the hips.

    Args:
        area: Where the ZMP can be.
        zmp: Reference in odom [m].
        dcm_planned: Reference in odom [m].
        dcm: Measured in odom [m].
    """
    p = area.parameters
    gain = 1.0 + p.dcm_gain
    wanted = (zmp[0] + gain * (dcm[0] - dcm_planned[0]), zmp[1] + gain * (dcm[1] - dcm_planned[1]))
    zmp, share = area.nearest(wanted)
    cmp = zmp if zmp == wanted else area.nearest(wanted, p.cmp_beyond_sole)[0]
    return Balance(area, zmp, cmp, share if area.stance.side is Side.LEFT else 1.0 - share)
