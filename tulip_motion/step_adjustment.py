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

import numpy as np
from numpy.typing import NDArray

from tulip_motion.parameters import MotionParameters
from tulip_motion.reach import Reach

Array = NDArray[np.float64]
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
        near, far = inward * reach.nearest, inward * reach.farthest
        self._lowest = np.array([[-reach.stride], [min(near, far)]])
        self._highest = np.array([[reach.stride], [max(near, far)]])
        self._ankle_lowest = np.array([[-p.zmp_limit_heel], [-p.zmp_limit_side]])
        self._ankle_highest = np.array([[p.zmp_limit_toe], [p.zmp_limit_side]])
        shift = p.double_support_time / time_constant
        # A ZMP that moves over during the double support, instead of at once, lets the error grow further.
        self._inward = inward
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
        now = np.array([[dcm[0]], [dcm[1]]])
        then = np.array([[planned_at_landing[0]], [planned_at_landing[1]]])
        place = np.array([[nominal[0]], [nominal[1]]])
        times = np.array([remaining])
        cost, places, excess = self._cost(now, then, place, times, remaining)
        # What place and ankles can do at the planned time needs no other time.
        if excess[0] > 0.0 and not fixed_time:
            times = np.arange(
                p.placement_freeze_time, max(latest, p.placement_freeze_time) + 1e-9, 2.0 * p.control_period
            )
            cost, places, excess = self._cost(now, then, place, times, remaining)
            way = np.hypot(places[0] - foot[0], places[1] - foot[1])
            # A move of minimum jerk is 1.9 times as fast in its middle as on average.
            cost = cost + np.maximum(1.9 * way - p.max_swing_speed * times, 0.0)
        best = int(np.argmin(cost))
        return Landing(float(times[best]), (float(places[0, best]), float(places[1, best])), float(excess[best]))

    def _cost(
        self, now: Array, then: Array, nominal: Array, times: Array, remaining: float
    ) -> tuple[Array, Array, Array]:
        """Return cost, best place (2, n) [m] and excess [m] of each time until landing (n,)."""
        p = self._parameters
        growth = np.exp(times / self._time_constant)
        error = now * growth - then  # of the DCM at landing, if nothing is done
        place = np.minimum(np.maximum(nominal + self._placement * error, self._lowest), self._highest)
        ankle = p.ankle_share * (growth - 1.0)  # a ZMP moved by 1 m until then moves the DCM by growth - 1
        rest = error - (place - nominal)
        rest = rest - np.minimum(np.maximum(rest, self._ankle_lowest * ankle), self._ankle_highest * ankle)
        excess = np.hypot(rest[0], rest[1])
        outer = np.maximum(self._inward * rest[1], 0.0)  # beyond the foot that lands, away from the stance foot
        moved = place - nominal
        cost = (
            excess**2
            + (p.outer_excess_weight - 1.0) * outer**2
            + p.step_time_weight * (times - remaining) ** 2
            + p.step_place_weight * (moved**2).sum(axis=0)
        )
        return cost, place, excess
