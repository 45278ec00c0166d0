"""Follows base_link over the ground by the points of the soles that stay where they are.

Soles hardly slide as a whole, but one that carries alone often twists on the ground, there and back within a step. IMU
and joints show how far it turns; how far it shifts by that depends on where its pivot is, the one point that stays.
Each part of the sole, at r_i, is held by dry friction of mu times the force F_i that presses it, against its motion.
When the sole turns about a pivot p, with sense s = +-1, these forces bear what the leg pushes along the ground with, T:

    sum_i mu F_i s J (r_i - p) / |r_i - p| = T,    J the quarter turn.

Without T, this p is the geometric median of the pressing forces, nearer to the corner that carries most than their
centre of pressure is; T moves it sideways. Weiszfeld's iteration finds it, starting at the centre of pressure.

In double support the foot that carries little is the one that slides. A foot that lands while the body turns goes on
turning and slides by up to 10 mm before it carries, so a foot counts only as far as it carries.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tulip_description.planar import Pose2D
from tulip_motion.footsteps import Footstep
from tulip_motion.parameters import MotionParameters
from tulip_motion.state_estimator import Estimate

GRAVITY = 9.81  # [m/s^2]
COUNTED_SHARE = 0.3  # of the weight: a foot with less does not count, one with all but that decides alone
TWIST_RATE = 0.1  # [rad/s] four times the noise of a sole's rate; soles that slip turn with 0.5 to 3 rad/s
FRICTION = 0.7  # of soles that slip: few do on better ground. 0.6 to 0.9 make little difference
ITERATIONS = 4  # from the centre of pressure on; ten more change no walk's error by more than 2 mm in two minutes
BLUNTNESS = 0.02  # [m] a cell stands for an area: the friction under it fades as the pivot comes near
LONGEST_LEVER = 0.3  # [m] from the sole's origin to the pivot: beyond, the sole slides rather than turns

Array = NDArray[np.float64]
Point = tuple[float, float]


@dataclass(frozen=True)
class SlipSigns:
    """What the robot knows of its slips, from the start on.

    Attributes:
        twist: How far the soles that carried have turned on the ground, to and fro added up [rad].
        flight: How long the feet have carried next to nothing [s].
    """

    twist: float
    flight: float


class GroundTrack:
    """Where base_link is, seen from above.

    Attributes:
        position: (x, y) in odom [m].
        pivots: The point of the left and the right sole that stays when the sole twists, in its axes [m].
    """

    def __init__(self, parameters: MotionParameters, cells: Sequence[Sequence[Point]]) -> None:
        """Make a track; `begin` comes before the first `update`.

        Args:
            parameters: Of motion control.
            cells: Places of the four cells in the left and in the right sole [m].
        """
        self._dt = parameters.control_period
        self._contact_force = parameters.contact_force
        self._cells = cells
        self.position: Point = (0.0, 0.0)
        self._twist = 0.0
        self._flight = 0.0

    @property
    def signs(self) -> SlipSigns:
        """Signs of slip, from the start until now."""
        return SlipSigns(self._twist, self._flight)

    def begin(self, estimate: Estimate, position: Point) -> None:
        """Take base_link to be at a place in odom [m], with the feet as they are."""
        self.position = position
        self._note(estimate)
        self._shares = self._counted(estimate.loads) or (0.5, 0.5)
        self.pivots = [(0.0, 0.0), (0.0, 0.0)]

    def update(self, estimate: Estimate, cells: Array, acceleration: Point) -> None:
        """Advance by one tick.

        Args:
            estimate: The body; only differences of places in it count.
            cells: (2, 4) forces on the left and the right foot [N].
            acceleration: Of the CoM along the ground, in odom [m/s^2].
        """
        loads, before = estimate.loads, self._shares
        soles, last_soles, (last_base_x, last_base_y) = estimate.soles, self._soles, self._base
        self._note(estimate)
        base_way_x, base_way_y = self._base[0] - last_base_x, self._base[1] - last_base_y
        counted = self._counted(loads)
        if counted is None:
            self._flight += self._dt
        else:
            self._shares = counted
        x, y = self.position
        for side in (0, 1):
            share = 0.5 * (before[side] + self._shares[side])
            if share == 0.0:
                self.pivots[side] = (0.0, 0.0)
                continue
            # The pivot stays, so that base_link goes against the way that the joints show of it. The sole's axes are
            # taken as they are: to first order in their turn, the IMU's noise would add up to millimetres a minute.
            along, across = self.pivots[side]
            (place_x, place_y, _), ((forward_x, left_x, _), (forward_y, left_y, _), _) = soles[side]
            (last_x, last_y, _), axes = last_soles[side]
            (last_forward_x, last_left_x, _), (last_forward_y, last_left_y, _), _ = axes
            way_x = place_x - last_x + (forward_x - last_forward_x) * along + (left_x - last_left_x) * across
            way_y = place_y - last_y + (forward_y - last_forward_y) * along + (left_y - last_left_y) * across
            x -= share * (way_x - base_way_x)
            y -= share * (way_y - base_way_y)
            rate = estimate.sole_yaw_rates[side]
            if abs(rate) > TWIST_RATE:
                self._twist += share * abs(rate) * self._dt
            # How the sole is pressed now says how it moves until the next tick.
            self.pivots[side] = (0.0, 0.0)
            if loads[side] <= self._contact_force:
                continue
            if abs(rate) < TWIST_RATE:
                load, forward, left = estimate.pressures[side]
                self.pivots[side] = (forward / load, left / load)  # the centre of pressure: a sole at rest has no pivot
            else:
                ax, ay = acceleration
                pushed = (-forward_x * ax - forward_y * ay, -left_x * ax - left_y * ay)
                self.pivots[side] = pivot(self._cells[side], cells[side].tolist(), pushed, rate)
        self.position = (x, y)

    def _note(self, estimate: Estimate) -> None:
        """Keep where soles and base are, seen from above, to tell how they have moved by the next tick."""
        x, y, _ = estimate.base_position.tolist()
        self._soles, self._base = estimate.soles, (x, y)

    def _counted(self, loads: tuple[float, float]) -> tuple[float, float] | None:
        """Return how much the left and the right foot count by their loads [N]; None if they carry nothing."""
        total = loads[0] + loads[1]
        if total <= self._contact_force:
            return None
        left = (loads[0] / total - COUNTED_SHARE) / (1.0 - 2.0 * COUNTED_SHARE)
        left = min(max(left, 0.0), 1.0)
        return left, 1.0 - left


def pivot(
    cells: Sequence[Point], forces: Sequence[float], pushed: Point, rate: float, iterations: int = ITERATIONS
) -> Point:
    """Return the point of a sole that stays where it is while the sole twists, in its axes [m].

    Args:
        cells: Places of the cells in the sole [m].
        forces: On the cells [N]; not all zero.
        pushed: Force along the ground that the leg pushes the sole with, in the sole's axes, by the mass that the sole
            bears [m/s^2].
        rate: Of the twist [rad/s].
        iterations: Of Weiszfeld's; more than by default are for tests.
    """
    load = sum(forces)
    x = y = 0.0
    for force, (cell_x, cell_y) in zip(forces, cells, strict=True):
        x += force * cell_x / load
        y += force * cell_y / load
    # The equation above, turned back by J; friction bears no more than mu F
    bearable = max(GRAVITY * FRICTION, math.hypot(*pushed))
    sense = math.copysign(1.0, rate)
    aside_x, aside_y = sense * pushed[1] / bearable, -sense * pushed[0] / bearable
    for _ in range(iterations):
        weight, sum_x, sum_y = 0.0, -aside_x, -aside_y
        for force, (cell_x, cell_y) in zip(forces, cells, strict=True):
            dx, dy = cell_x - x, cell_y - y
            w = force / (load * math.sqrt(dx * dx + dy * dy + BLUNTNESS * BLUNTNESS))
            weight += w
            sum_x += w * cell_x
            sum_y += w * cell_y
        x, y = sum_x / weight, sum_y / weight
        excess = max(math.hypot(x, y) / LONGEST_LEVER, 1.0)
        x, y = x / excess, y / excess
    return x, y


def carried(
    before: tuple[Footstep, Footstep], after: tuple[Footstep, Footstep], shift: Point, estimate: Estimate
) -> tuple[Footstep, Footstep]:
    """Return the feet after a landing, with the foot that stood where and as it has been moved by slipping.

    Both feet move by the same, so that they stand to each other as the joints say.

    Args:
        before: Left and right foot before the landing.
        after: The same with the one that landed at its place, shift included.
        shift: Of the body, and so of the foot that stood, by slipping [m].
        estimate: Says how the foot that stood is turned.
    """
    if before == after:
        return after
    left, right = (
        Footstep(new.side, Pose2D(new.pose.x + shift[0], new.pose.y + shift[1], estimate.sole_pose(new.side).yaw))
        if new == old
        else new
        for old, new in zip(before, after, strict=True)
    )
    return left, right
