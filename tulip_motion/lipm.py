"""The linear inverted pendulum: eq. (3), its divergent component, and plans with a piecewise linear ZMP.

With the CoM at constant height z_c, each horizontal axis obeys c'' = (c - p) / Tc^2 with the ZMP p and
Tc = sqrt(z_c / g). Eq. (3) is its solution about p = 0. The divergent component of motion (DCM)
xi = c + Tc c' grows away from the ZMP, xi' = (xi - p) / Tc: keeping it bounded is what balance means
(Takenaka 2009, Englsberger 2013).
"""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

GRAVITY = 9.81  # [m/s^2]


class LipmState(NamedTuple):
    """CoM of one axis (floats) or of several (arrays): position [m] and velocity [m/s]."""

    position: float
    velocity: float


def time_constant(com_height: float) -> float:
    """Return Tc = sqrt(z_c / g) [s], eq. (3).

    Raises:
        ValueError: if the height is not positive.
    """
    if not com_height > 0.0:
        raise ValueError(f"com_height is {com_height} m; expected > 0")
    return math.sqrt(com_height / GRAVITY)


def advance_lipm(state: LipmState, zmp: float, time_constant: float, dt: float) -> LipmState:
    """Advance one horizontal axis of the CoM exactly, under a constant ZMP, eq. (3).

    Args:
        state: CoM position [m] and velocity [m/s] along the axis.
        zmp: ZMP along the axis, in the same frame [m]; eq. (3) is the case zmp = 0.
        time_constant: Tc = sqrt(z_c / g) [s].
        dt: Time to advance [s], >= 0.

    Raises:
        ValueError: if dt is negative or time_constant is not positive.
    """
    if dt < 0.0:
        raise ValueError(f"dt is {dt} s; expected >= 0")
    if not time_constant > 0.0:
        raise ValueError(f"time_constant is {time_constant} s; expected > 0")
    c, s = math.cosh(dt / time_constant), math.sinh(dt / time_constant)
    offset = state.position - zmp
    return LipmState(
        zmp + offset * c + time_constant * state.velocity * s,
        offset * s / time_constant + state.velocity * c,
    )


def orbital_energy(state: LipmState, zmp: float, time_constant: float) -> float:
    """Return the conserved quantity c'^2 / 2 - (c - p)^2 / (2 Tc^2) [m^2/s^2] (Kajita)."""
    return 0.5 * state.velocity**2 - 0.5 * ((state.position - zmp) / time_constant) ** 2


@dataclass(frozen=True)
class _Segment:
    """A piece of a plan with ZMP p(t) = end_zmp + rate (t - end_time)."""

    end_time: float
    end_zmp: tuple[float, float]
    rate: tuple[float, float]
    end_offset: tuple[float, float]
    """DCM minus its particular solution p + Tc p' at the end: the part that grows exponentially."""


class DcmPlan:
    """DCM that belongs to a piecewise linear ZMP and ends at a given point.

    Seen backwards in time the DCM converges to the ZMP, so the recursion from the end is well
    conditioned and what stands far ahead hardly matters now.
    """

    def __init__(self, times: list[float], zmps: list[tuple[float, float]], time_constant: float) -> None:
        """Plan from knots; the DCM ends on the last of them, at rest.

        Args:
            times: n + 1 increasing times, the first is the plan's start [s].
            zmps: ZMP (x, y) at each time [m]; linear in between.
            time_constant: Tc [s].

        Raises:
            ValueError: if fewer than two knots are given or the times do not increase.
        """
        if len(times) < 2 or len(times) != len(zmps):
            raise ValueError(f"{len(times)} times and {len(zmps)} ZMPs; expected the same number, at least 2")
        self.time_constant = time_constant
        self._starts = times[:-1]
        segments: list[_Segment] = []
        dcm_x, dcm_y = zmps[-1]
        for i in range(len(times) - 2, -1, -1):
            duration = times[i + 1] - times[i]
            if not duration > 0.0:
                raise ValueError(f"times {times} do not increase at index {i}")
            (x0, y0), (x1, y1) = zmps[i], zmps[i + 1]
            rate_x, rate_y = (x1 - x0) / duration, (y1 - y0) / duration
            offset_x = dcm_x - x1 - time_constant * rate_x
            offset_y = dcm_y - y1 - time_constant * rate_y
            segments.append(_Segment(times[i + 1], (x1, y1), (rate_x, rate_y), (offset_x, offset_y)))
            decay = math.exp(-duration / time_constant)
            dcm_x = x0 + time_constant * rate_x + decay * offset_x
            dcm_y = y0 + time_constant * rate_y + decay * offset_y
        self._segments = segments[::-1]

    @property
    def end_time(self) -> float:
        """Time of the last knot [s]."""
        return self._segments[-1].end_time

    def evaluate(self, time: float) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return ZMP and DCM [m] at a time; past the end both rest on the last knot."""
        segment = self._segments[max(bisect_right(self._starts, time) - 1, 0)]
        before_end = time - segment.end_time
        if before_end >= 0.0 and segment is self._segments[-1]:
            return segment.end_zmp, segment.end_zmp
        growth = math.exp(before_end / self.time_constant)
        zmp_x = segment.end_zmp[0] + segment.rate[0] * before_end
        zmp_y = segment.end_zmp[1] + segment.rate[1] * before_end
        return (zmp_x, zmp_y), (
            zmp_x + self.time_constant * segment.rate[0] + growth * segment.end_offset[0],
            zmp_y + self.time_constant * segment.rate[1] + growth * segment.end_offset[1],
        )
