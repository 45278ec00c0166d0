"""One step of the paper's gait, eqs. (3)-(4), in the frame of the stance foot.

The origin is the pivot that the pendulum stands on, a point of the stance sole; x points forward along the foot.
Over a step of duration T the CoM follows eq. (3) and the same point of the swing foot's sole mirrors it, eq. (4): it
is at 2 x_c, 2 y_c, so the CoM is always midway between the feet. When it lands, the CoM is at -c(T) from it, with the
same velocity: the next step is known. With C = cosh(T/Tc), S = sinh(T/Tc), the map of an axis from step to step is

    x_c(0)    [ -C     -Tc S ] x_c(0)
    x_c'(0) = [ S/Tc     C   ] x_c'(0),

whose square is the identity: any state comes back after two steps. It has one eigenvector of walking on,
x_c(T) = -x_c(0) with x_c'(T) = x_c'(0), and one of swaying, y_c(T) = y_c(0) with y_c'(T) = -y_c'(0). A gait of a
given velocity is the sum of both, `periodic_state`. It also means that eqs. (3)-(4) as they are printed go on as they
began for ever: they neither start, stop, turn nor change speed. `step_between` finds the smallest change that does.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tulip_description.planar import Pose2D
from tulip_motion.gait import FootMotion
from tulip_motion.interface import Side
from tulip_motion.lipm import LipmState, advance_lipm, time_constant

Array = NDArray[np.float64]
Axes = tuple[LipmState, LipmState]
"""CoM along x and along y."""


def printed_height(com: float, com_height: float, foot_speed: float, height: float) -> float:
    """Return sat(z_c - |v_f x_c|, h_f) of eq. (4), clipped to [0, h_f] [m].

    Args:
        com: x_c [m].
        com_height: z_c [m].
        foot_speed: v_f, metres up for each metre that the CoM comes nearer to the stance foot.
        height: h_f [m].
    """
    return min(max(com_height - abs(foot_speed * com), 0.0), height)


def quintic(time: float, duration: float) -> tuple[float, float, float]:
    """Return progress from 0 to 1 with its two derivatives, at rest without acceleration at both ends."""
    s = min(max(time / duration, 0.0), 1.0)
    return (
        s**3 * (10.0 - s * (15.0 - 6.0 * s)),
        30.0 * (s * (1.0 - s)) ** 2 / duration,
        60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / duration**2,
    )


def hermite(
    time: float, duration: float, start: tuple[float, float, float], end: tuple[float, float, float]
) -> tuple[float, float, float]:
    """Return position, velocity and acceleration at a time on the quintic that leads from one such triple to another.

    Args:
        time: From 0 to `duration` [s].
        duration: [s].
        start: Position, velocity and acceleration at time 0.
        end: The same at `duration`.
    """
    (p0, v0, a0), (p1, v1, a1), s = start, end, time / duration
    v0, v1, a0, a1 = v0 * duration, v1 * duration, a0 * duration**2, a1 * duration**2
    way, turn = p1 - p0 - v0 - 0.5 * a0, v1 - v0 - a0
    bend = a1 - a0
    c3 = 10.0 * way - 4.0 * turn + 0.5 * bend
    c4 = -15.0 * way + 7.0 * turn - bend
    c5 = 6.0 * way - 3.0 * turn + 0.5 * bend
    return (
        p0 + s * (v0 + s * (0.5 * a0 + s * (c3 + s * (c4 + s * c5)))),
        (v0 + s * (a0 + s * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5)))) / duration,
        (a0 + s * (6.0 * c3 + s * (12.0 * c4 + s * 20.0 * c5))) / duration**2,
    )


@dataclass(frozen=True)
class StepShape:
    """What all steps of a gait share.

    Attributes:
        duration: T, from one switch of the support to the next [s].
        com_height: z_c [m].
        height: h_f [m].
        lift_time: Time that the foot takes up, and down [s]; with "sat", 0 leaves eq. (4) as it is printed.
        profile: "sat", eq. (4), or "smooth": up and down by quintics, without a jump of speed.
        settle_time: Time after the beginning and before the end of a step in which the foot goes between rest on the
            ground and the mirrored motion [s]; 0 leaves eq. (4) as it is printed.
        aim: (forward, inward) place of the pivot in the sole's frame; inward is towards the other foot [m].
    """

    duration: float
    com_height: float
    height: float
    lift_time: float
    profile: str
    settle_time: float
    aim: tuple[float, float]

    @property
    def time_constant(self) -> float:
        """Tc [s], eq. (3)."""
        return time_constant(self.com_height)

    def sole_offset(self, side: Side) -> tuple[float, float]:
        """Return the place of the pivot in a sole's frame [m]."""
        forward, inward = self.aim
        return forward, -inward if side is Side.LEFT else inward

    def vertical(self, time: float) -> tuple[float, float, float]:
        """Return height, speed and acceleration of the swing foot."""
        rising = time < 0.5 * self.duration
        left = time if rising else self.duration - time  # the way down is the way up seen backwards
        if self.profile == "smooth":
            progress, rate, bend = quintic(left, self.lift_time)
        else:
            progress, rate, bend = self._saturated(left)
        return self.height * progress, self.height * (rate if rising else -rate), self.height * bend

    def _saturated(self, left: float) -> tuple[float, float, float]:
        """Return height by h_f, its rate and its bend in the first half of a step.

        With v_f = z_c / |x_c(0)|, by which the foot leaves the ground when the step begins and lands when it ends,
        |v_f x_c(t)| is z_c sinh((T/2 - t)/Tc) / sinh(T/2Tc) for every stride: this form also serves steps in
        place, sideways and between two speeds, where the printed one has no stride to divide by.
        """
        tc = self.time_constant
        angle, scale = (0.5 * self.duration - left) / tc, self.com_height / math.sinh(0.5 * self.duration / tc)
        law = (self.com_height - scale * math.sinh(angle)) / self.height
        limit = left / self.lift_time if self.lift_time > 0.0 else math.inf
        if min(law, limit) >= 1.0:
            return 1.0, 0.0, 0.0
        if limit <= max(law, 0.0):
            return max(limit, 0.0), 1.0 / self.lift_time, 0.0
        rate, bend = scale * math.cosh(angle) / tc / self.height, -scale * math.sinh(angle) / tc**2 / self.height
        return max(law, 0.0), rate, bend


@dataclass(frozen=True)
class MirroredStep:
    """One step.

    Attributes:
        shape: What all steps share.
        side: The stance foot.
        start: CoM when the step begins.
        pivot: Place of the ZMP [m]; (0, 0) is eq. (3) as printed.
        before, after: Pivot of the swing foot when the step begins and ends; at 2 c(0) and 2 c(T) the foot
            follows eq. (4) as printed, otherwise it is led from one to the other by a quintic on top.
    """

    shape: StepShape
    side: Side
    start: Axes
    pivot: tuple[float, float]
    before: Pose2D
    after: Pose2D

    @cached_property
    def end(self) -> Axes:
        """CoM when the step ends."""
        return self.com(self.shape.duration)

    def com(self, time: float) -> Axes:
        """Return the CoM at a time since the step began, eq. (3)."""
        tc = self.shape.time_constant
        x, y = (advance_lipm(state, zmp, tc, time) for state, zmp in zip(self.start, self.pivot, strict=True))
        return x, y

    def com_acceleration(self, com: Axes) -> tuple[float, float]:
        """Return c'' = (c - p) / Tc^2 [m/s^2]."""
        squared = self.shape.time_constant**2
        return (com[0].position - self.pivot[0]) / squared, (com[1].position - self.pivot[1]) / squared

    def foot(self, time: float) -> FootMotion:
        """Return the sole of the swing foot, eq. (4)."""
        progress, rate, bend = quintic(time, self.shape.duration)
        turn = self.after.yaw - self.before.yaw
        yaw, yaw_rate, yaw_bend = self.before.yaw + progress * turn, rate * turn, bend * turn
        forward, left = self.shape.sole_offset(self.side.other)
        c, s = math.cos(yaw), math.sin(yaw)
        arm = (c * forward - s * left, s * forward + c * left)  # from the sole's frame to its pivot
        turned = (-arm[1], arm[0])
        places = ((self.before.x, self.after.x), (self.before.y, self.after.y))
        motions = []
        for i, (mirrored, (before, after)) in enumerate(zip(self._mirrored(time), places, strict=True)):
            beside = before - 2.0 * self.start[i].position
            led = after - 2.0 * self.end[i].position - beside
            motions.append(
                (
                    mirrored[0] + beside + progress * led - arm[i],
                    mirrored[1] + rate * led - yaw_rate * turned[i],
                    mirrored[2] + bend * led - yaw_bend * turned[i] + yaw_rate**2 * arm[i],
                )
            )
        (x, vx, ax), (y, vy, ay), (z, vz, az) = *motions, self.shape.vertical(time)
        return FootMotion((x, y, z), (vx, vy, vz), (ax, ay, az), yaw, yaw_rate, yaw_bend)

    def _mirrored(self, time: float) -> list[tuple[float, float, float]]:
        """Return 2 c(t) with its derivatives along x and y, led from rest and to rest in the settling time."""
        settling, end = self.shape.settle_time, self.shape.duration
        if settling <= time <= end - settling:
            return self._twice(time)
        if time < settling:
            resting, moving = (2.0 * state.position for state in self.start), self._twice(settling)
            return [hermite(time, settling, (p, 0.0, 0.0), joined) for p, joined in zip(resting, moving, strict=True)]
        resting, moving = (2.0 * state.position for state in self.end), self._twice(end - settling)
        late = min(time - end, 0.0) + settling
        return [hermite(late, settling, joined, (p, 0.0, 0.0)) for p, joined in zip(resting, moving, strict=True)]

    def _twice(self, time: float) -> list[tuple[float, float, float]]:
        """Return twice the CoM at a time along both axes, with its derivatives: where the foot mirrors it."""
        com = self.com(time)
        accelerations = self.com_acceleration(com)
        return [
            (2.0 * state.position, 2.0 * state.velocity, 2.0 * bend)
            for state, bend in zip(com, accelerations, strict=True)
        ]

    def next_start(self) -> Axes:
        """Return the CoM when the step ends, in the frame of the foot that has landed."""
        return seen_from(self.after, self.end)


def seen_from(frame: Pose2D, com: Axes) -> Axes:
    """Return a CoM's motion in another frame at rest."""
    x, y = com
    position = frame.inverse().transform((x.position, y.position))
    velocity = frame.rotation().T @ (x.velocity, y.velocity)
    return LipmState(position[0], float(velocity[0])), LipmState(position[1], float(velocity[1]))


def periodic_state(shape: StepShape, side: Side, width: float, way: tuple[float, float]) -> Axes:
    """Return the CoM when a step begins, of the gait that advances by the same way in each step.

    Args:
        shape: Of the steps.
        side: The stance foot.
        width: Distance between the pivots of the feet [m].
        way: (forward, left) of each step [m].
    """
    tc = shape.time_constant
    half = math.tanh(0.5 * shape.duration / tc)
    other = -0.5 * width if side is Side.LEFT else 0.5 * width  # the middle between the feet, sideways
    forward, left = way
    return (
        LipmState(-0.5 * forward, 0.5 * forward / (half * tc)),
        LipmState(other - 0.5 * left, 0.5 * left / (half * tc) - other * half / tc),
    )


def step_between(
    shape: StepShape,
    side: Side,
    start: Axes,
    before: Pose2D,
    turn: float,
    target: Axes,
    pivot_limits: tuple[float, float, float],
) -> MirroredStep:
    """Return the step from one state to another.

    The next step begins with velocity R^T c'(T), which the pivot alone decides, and with position
    R^T (c(T) - landing), R being the landing foot's rotation. To change the speed of walking on by a way dL a step,
    the pivot has to stand at -dL / (4 sinh^2(T/2Tc)), some millimetres, and the foot then lands at 2 c(T) as in
    eq. (4). When the robot turns, the foot has to land some millimetres beside it, too.

    Args:
        shape: Of the steps.
        side: The stance foot.
        start: CoM when the step begins, from the stance foot.
        before: Where the swing foot's pivot is, from the stance foot's.
        turn: Yaw of the swing foot from the stance foot when it lands [rad].
        target: CoM when the step ends, from the foot that lands.
        pivot_limits: How far the pivot may stand behind, ahead and beside its place in the sole [m].
    """
    tc = shape.time_constant
    c, s = math.cosh(shape.duration / tc), math.sinh(shape.duration / tc)
    rotation = Pose2D(yaw=turn).rotation()
    wanted_velocity = rotation @ [state.velocity for state in target]
    wanted_place = rotation @ [state.position for state in target]
    pivot = [
        state.position + tc * (state.velocity * c - float(wanted)) / s
        for state, wanted in zip(start, wanted_velocity, strict=True)
    ]
    behind, ahead, beside = pivot_limits
    inside = min(max(pivot[0], -behind), ahead), min(max(pivot[1], -beside), beside)
    end = [advance_lipm(state, zmp, tc, shape.duration) for state, zmp in zip(start, inside, strict=True)]
    landing = [state.position - float(wanted) for state, wanted in zip(end, wanted_place, strict=True)]
    return MirroredStep(shape, side, start, inside, before, Pose2D(landing[0], landing[1], turn))


def rocking_zmps(start: LipmState, end: LipmState, time_constant: float, duration: float) -> tuple[float, float]:
    """Return two places of the ZMP, one after the other for a time [s] each, that lead from one state to another [m].

    Both follow from the two linear equations that eq. (3) gives for position and velocity at the end.
    """

    def after(first: float, second: float) -> Array:
        middle = advance_lipm(start, first, time_constant, duration)
        return np.array(advance_lipm(middle, second, time_constant, duration))

    without = after(0.0, 0.0)
    effect = np.column_stack([after(1.0, 0.0) - without, after(0.0, 1.0) - without])
    first, second = np.linalg.solve(effect, np.array(end) - without)
    return float(first), float(second)
