"""Where and when the swing foot lands after a disturbance: place and time of the step, solved together.

Under a constant ZMP p the DCM at the end of the step, a time r from now, is p + (xi - p) exp(r / Tc). A step is good if
it lands such that the DCM then lies at its planned offset from the new foot. Three things can bring that about: the ZMP
within the stance foot, the place of the landing foot within its reach, and the time of landing. For a given time the
first two have a closed form, so that one search over the time that remains solves the whole
(the problem of Khadiv et al., "Step timing adjustment", Humanoids 2016, with the ankles' share added).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from tulip_motion.parameters import MotionParameters
from tulip_motion.reach import Reach

Point = tuple[float, float]


class Landing(NamedTuple):
    """A landing.

    Attributes:
        remaining: Time until then [s].
        place: (x, y) of the landing foot's sole, in axes of the stance foot [m].
        excess: DCM error at landing that neither ankle nor place take up [m].
    """

    remaining: float
    place: Point
    excess: float


class StepAdjustment:
    """Finds the best landing for one stance foot; all points are in the axes of the stance sole."""

    def __init__(self, parameters: MotionParameters, reach: Reach, time_constant: float, inward: float) -> None:
        """Lay out the candidates.

        Args:
            parameters: Of motion control.
            reach: Of the robot.
            time_constant: Tc [s].
            inward: +1 if the other foot is on the left of the stance foot, -1 if on the right.
        """
        p = self._parameters = parameters
        self._time_constant = time_constant
        self._inward = inward
        near, far = inward * reach.nearest, inward * reach.farthest
        self._lowest = (-reach.stride, min(near, far))
        self._highest = (reach.stride, max(near, far))
        self._ankle_lowest = (-p.zmp_limit_heel, -p.zmp_limit_side)
        self._ankle_highest = (p.zmp_limit_toe, p.zmp_limit_side)
        shift = p.double_support_time / time_constant
        # A ZMP that moves over during the double support, instead of at once, lets the error grow further.
        self._placement = p.placement_gain * shift / (1.0 - math.exp(-shift))

    def solve(
        self,
        dcm: Point,
        planned_at_landing: Point,
        nominal: Point,
        foot: Point,
        remaining: float,
        latest: float,
        fixed_time: bool = False,
    ) -> Landing:
        """Return the best landing.

        Args:
            dcm: Measured DCM from the aim point of the ZMP on the stance foot [m].
            planned_at_landing: Planned DCM at landing, from the same point [m].
            nominal: Planned place of the landing foot [m].
            foot: Where the swing foot is now [m].
            remaining: Planned time until landing [s].
            latest: Latest possible time until landing [s].
            fixed_time: Keep the planned time.
        """
        p = self._parameters
        best, rest = self._landing(dcm, planned_at_landing, nominal, remaining)
        # What place and ankles can do at the planned time needs no other time.
        if best.excess == 0.0 or fixed_time:
            return best
        least = math.inf
        count = max(int((latest - p.placement_freeze_time) / (2.0 * p.control_period) + 1e-9), 0) + 1
        for k in range(count):
            time = p.placement_freeze_time + 2.0 * k * p.control_period
            landing, rest = self._landing(dcm, planned_at_landing, nominal, time)
            x, y = landing.place
            outer = max(self._inward * rest[1], 0.0)  # beyond the foot that lands, away from the stance foot
            # A move of minimum jerk is 1.9 times as fast in its middle as on average.
            too_far = max(1.9 * math.hypot(x - foot[0], y - foot[1]) - p.max_swing_speed * time, 0.0)
            cost = (
                landing.excess**2
                + (p.outer_excess_weight - 1.0) * outer**2
                + p.step_time_weight * (time - remaining) ** 2
                + p.step_place_weight * ((x - nominal[0]) ** 2 + (y - nominal[1]) ** 2)
                + too_far
            )
            if cost < least:
                least, best = cost, landing
        return best

    def _landing(self, dcm: Point, planned: Point, nominal: Point, remaining: float) -> tuple[Landing, Point]:
        """Return the best landing at a time, and the DCM error [m] that is left. Plain numbers: arrays take longer."""
        growth = math.exp(remaining / self._time_constant)
        ankle = self._parameters.ankle_share * (growth - 1.0)  # a ZMP moved by 1 m moves the DCM by growth - 1
        place, rest = [0.0, 0.0], [0.0, 0.0]
        for i in (0, 1):
            error = dcm[i] * growth - planned[i]  # of the DCM at landing, if nothing is done
            place[i] = min(max(nominal[i] + self._placement * error, self._lowest[i]), self._highest[i])
            left = error - (place[i] - nominal[i])
            rest[i] = left - min(max(left, self._ankle_lowest[i] * ankle), self._ankle_highest[i] * ankle)
        return Landing(remaining, (place[0], place[1]), math.hypot(rest[0], rest[1])), (rest[0], rest[1])
