"""Balance: the ZMP that brings the DCM back to its reference, inside the feet, and the CMP, a little beyond them."""

from __future__ import annotations

import math
from typing import NamedTuple

from tulip_motion.footsteps import Footstep
from tulip_motion.gait import sole_point
from tulip_motion.interface import Side
from tulip_motion.parameters import MotionParameters


class Balance(NamedTuple):
    """The commanded ZMP and CMP.

    Attributes:
        zmp: (x, y) in odom [m], inside the soles.
        cmp: Centroidal moment pivot, (x, y) in odom [m]: the CoM is pushed away from it. Where it lies beyond the
            soles, the hip strategy turns the torso.
        right_share: Share of the weight on the right foot, 0 to 1: the ZMP projected onto the line
            between the feet, which eq. (15) uses as alpha.
    """

    zmp: tuple[float, float]
    cmp: tuple[float, float]
    right_share: float


def stabilize(
    parameters: MotionParameters,
    zmp: tuple[float, float],
    dcm_planned: tuple[float, float],
    dcm: tuple[float, float],
    stance: Footstep,
    other: Footstep | None,
) -> Balance:
    """Return zmp = ref + (1 + k) (dcm - dcm_ref), moved to the nearest point in reach of the ankles, and of the hips.

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
    zmp, share = nearest_in_support(p, wanted, stance, other)
    cmp = zmp if zmp == wanted else nearest_in_support(p, wanted, stance, other, p.cmp_beyond_sole)[0]
    return Balance(zmp, cmp, share if stance.side is Side.LEFT else 1.0 - share)


def nearest_in_support(
    parameters: MotionParameters,
    point: tuple[float, float],
    stance: Footstep,
    other: Footstep | None,
    beyond: float = 0.0,
) -> tuple[tuple[float, float], float]:
    """Return the point moved into the support, and the other foot's share of the weight with the ZMP there.

    Args:
        parameters: Of motion control.
        point: In odom [m].
        stance: The foot that stands.
        other: The other foot if it stands as well, else None.
        beyond: Way beyond the limits of the ZMP that still counts as inside [m].
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
    forward = min(max(c * dx + s * dy, -p.zmp_limit_heel - beyond), p.zmp_limit_toe + beyond)
    side = p.zmp_limit_side + beyond
    left = min(max(c * dy - s * dx, -side), side)
    return (aim[0] + c * forward - s * left, aim[1] + s * forward + c * left), share
