"""Balance: the ZMP that brings the DCM back to its reference, kept inside the feet."""

from __future__ import annotations

import math
from dataclasses import dataclass

from tulip_motion.footsteps import Footstep
from tulip_motion.gait import sole_point
from tulip_motion.interface import Side
from tulip_motion.parameters import MotionParameters


@dataclass(frozen=True)
class Balance:
    """The commanded ZMP.

    Attributes:
        zmp: (x, y) in odom [m].
        right_share: Share of the weight on the right foot, 0 to 1: the ZMP projected onto the line
            between the feet, which eq. (15) uses as alpha.
    """

    zmp: tuple[float, float]
    right_share: float


def stabilize(
    parameters: MotionParameters,
    zmp: tuple[float, float],
    dcm_planned: tuple[float, float],
    dcm: tuple[float, float],
    stance: Footstep,
    other: Footstep | None,
) -> Balance:
    """Return zmp = ref + (1 + k) (dcm - dcm_ref), moved to the nearest point inside the support.

    Args:
        parameters: Of motion control.
        zmp: Reference in odom [m].
        dcm_planned: Reference in odom [m].
        dcm: Measured in odom [m].
        stance: The foot that stands.
        other: The other foot if it stands as well, else None.
    """
    p = parameters
    gain = 1.0 + p.dcm_gain
    wanted = (zmp[0] + gain * (dcm[0] - dcm_planned[0]), zmp[1] + gain * (dcm[1] - dcm_planned[1]))
    point, share = nearest_in_support(p, wanted, stance, other)
    return Balance(point, share if stance.side is Side.LEFT else 1.0 - share)


def nearest_in_support(
    parameters: MotionParameters, point: tuple[float, float], stance: Footstep, other: Footstep | None
) -> tuple[tuple[float, float], float]:
    """Return the point moved into the support, and the other foot's share of the weight with the ZMP there.

    Args:
        parameters: Of motion control.
        point: In odom [m].
        stance: The foot that stands.
        other: The other foot if it stands as well, else None.
    """
    p = parameters
    aim = sole_point(stance, p.zmp_forward, p.zmp_inward)
    share = 0.0
    if other is not None:
        aim_other = sole_point(other, p.zmp_forward, p.zmp_inward)
        dx, dy = aim_other[0] - aim[0], aim_other[1] - aim[1]
        share = ((point[0] - aim[0]) * dx + (point[1] - aim[1]) * dy) / (dx * dx + dy * dy)
        share = min(max(share, 0.0), 1.0)
        aim = (aim[0] + share * dx, aim[1] + share * dy)
    # Both soles are the same rectangle, so their hull is that rectangle moved along the line between them.
    c, s = math.cos(stance.pose.yaw), math.sin(stance.pose.yaw)
    dx, dy = point[0] - aim[0], point[1] - aim[1]
    forward = min(max(c * dx + s * dy, -p.zmp_limit_heel), p.zmp_limit_toe)
    left = min(max(c * dy - s * dx, -p.zmp_limit_side), p.zmp_limit_side)
    return (aim[0] + c * forward - s * left, aim[1] + s * forward + c * left), share
