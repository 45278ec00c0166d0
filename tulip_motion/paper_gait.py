"""The paper's gait, section 3.1: steps of eqs. (3)-(4) stitched together, in open loop.

The support changes at fixed times; nothing that is measured changes the plan. From standing, the CoM is rocked
towards one foot and back, so that it comes through the middle with the speed that the first step begins with; when it
stands again, the same happens in reverse.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from tulip_description.planar import Pose2D
from tulip_motion.course import Wish
from tulip_motion.footsteps import Footstep
from tulip_motion.gait import ComMotion, FootMotion, Reference, sole_point, support_on
from tulip_motion.interface import Side, Support
from tulip_motion.lipm import LipmState, advance_lipm
from tulip_motion.mirrored_step import (
    Axes,
    MirroredStep,
    StepShape,
    periodic_state,
    rocking_zmps,
    step_between,
)
from tulip_motion.parameters import MotionParameters
from tulip_motion.reach import Velocity

AXES = ("speed forward", "speed sideways", "turning rate")
UNITS = ("m/s", "m/s", "rad/s")
"""The components of a velocity, in the words of notes."""


class Rocking:
    """The CoM between two feet that stand, from one state to another by two places of the ZMP."""

    def __init__(self, start: Axes, end: Axes, time_constant: float, duration: float, other: Pose2D) -> None:
        """Plan in the frame of the stance foot.

        Args:
            start: CoM now.
            end: CoM at the end.
            time_constant: Tc [s].
            duration: Of each of the two halves [s].
            other: Pivot of the other foot.
        """
        pairs = [rocking_zmps(a, b, time_constant, duration) for a, b in zip(start, end, strict=True)]
        self._zmps = [(pairs[0][half], pairs[1][half]) for half in (0, 1)]
        self._time_constant = time_constant
        self._half = duration
        self._starts = [start, self._advanced(start, self._zmps[0], duration)]
        self.end = end
        self.other = other
        self.duration = 2.0 * duration

    def evaluate(self, time: float) -> tuple[Axes, tuple[float, float]]:
        """Return CoM and ZMP at a time since the start."""
        half = 0 if time < self._half else 1
        zmp = self._zmps[half]
        return self._advanced(self._starts[half], zmp, time - half * self._half), zmp

    def _advanced(self, com: Axes, zmp: tuple[float, float], time: float) -> Axes:
        x, y = (advance_lipm(state, place, self._time_constant, time) for state, place in zip(com, zmp, strict=True))
        return x, y


class PaperGait:
    """Walks from standing to standing; takes the place of `Walking`."""

    def __init__(self, parameters: MotionParameters, feet: tuple[Footstep, Footstep], zmp: tuple[float, float]) -> None:
        """Begin from double support.

        Args:
            parameters: Of motion control.
            feet: Left and right foot as they stand.
            zmp: Where the ZMP and the CoM are now, in odom [m].
        """
        p = self._parameters = parameters
        self.feet = feet
        self.velocity: Velocity = (0.0, 0.0, 0.0)
        self.step_count = 0
        self.finished = False
        self.notes: tuple[str, ...] = ()
        self._zmp = zmp
        self._shape = StepShape(
            p.paper_step_time,
            p.com_height,
            p.swing_height,
            p.paper_lift_time,
            p.paper_swing,
            p.paper_settle_time,
            (p.zmp_forward, p.paper_zmp_inward),
        )
        self._width = p.stance_width - 2.0 * p.paper_zmp_inward
        self._most_sideways = sideways_limit(self._shape, self._width, p.min_foot_distance - 2.0 * p.paper_zmp_inward)
        self._stance: Footstep | None = None
        self._part: Rocking | MirroredStep | None = None
        self._time = 0.0

    def tick(
        self,
        dt: float,
        wish: Wish,
        dcm: tuple[float, float],
        sole: Callable[[Side], Pose2D],
        loads: tuple[float, float],
    ) -> Reference:
        """Advance by one tick.

        Args:
            dt: [s].
            wish: Velocity to walk with, or None to stop; this gait does not go to goals.
            dcm: Not used: the gait is open loop.
            sole: Says where a sole is now, as measured, in odom. A stance foot is where it landed;
                CoM and swing foot are planned relative to it, so the joint angles do not depend on that.
            loads: Not used: the support changes at fixed times.
        """
        wanted = None if isinstance(wish, Pose2D) else wish
        if self._part is None:
            self._begin_start(wanted or (0.0, 0.0, 0.0))
        else:
            self._time += dt
        part = self._part
        if isinstance(part, Rocking) and self.step_count == 0 and self._time >= part.duration:
            self._begin_step(part.end, part.other, wanted, part.duration)
        elif isinstance(part, MirroredStep) and self._time >= part.shape.duration:
            self._land(part, wanted, sole)
        return self._reference()

    def _begin_start(self, wanted: Velocity) -> None:
        """Rock the CoM so that it comes through the middle with the speed that the first step begins with."""
        leading = Side.LEFT if wanted[1] + wanted[2] >= 0.0 else Side.RIGHT
        stance = self._stance = self.feet[leading.other]
        trailing = self.feet[leading]
        frame = self._frame(stance)
        other = frame.inverse() @ self._frame(trailing)
        x, y = frame.inverse().transform(self._zmp)
        swaying = periodic_state(self._shape, stance.side, self._width, (0.0, 0.0))
        end = LipmState(0.5 * other.x, 0.0), LipmState(0.5 * other.y, swaying[1].velocity)
        p = self._parameters
        start = LipmState(x, 0.0), LipmState(y, 0.0)
        self._part = Rocking(start, end, self._shape.time_constant, p.first_shift_time, other)

    def _begin_step(self, start: Axes, other: Pose2D, wanted: Velocity | None, passed: float) -> None:
        """Begin a step.

        Args:
            start: CoM, from the stance foot.
            other: Pivot of the swing foot, from the stance foot's.
            wanted: Velocity to walk with, or None to stop.
            passed: Duration of what came before [s]; the rest of the tick belongs to this step.
        """
        assert self._stance is not None
        p, side = self._parameters, self._stance.side
        self._time -= passed
        self.velocity = self._limited(wanted or (0.0, 0.0, 0.0))
        self.step_count += 1
        forward, left, turn = (value * p.paper_step_time for value in self.velocity)
        # The velocity is that of the ankles; the pivots, ahead of them, move sideways when the robot turns.
        way = forward, left + turn * p.zmp_forward
        target = periodic_state(self._shape, side.other, self._width, way)
        limits = (p.zmp_limit_heel, p.zmp_limit_toe, p.zmp_limit_side - abs(p.paper_zmp_inward))
        self._part = step_between(self._shape, side, start, other, turn, target, limits)

    def _land(self, step: MirroredStep, wanted: Velocity | None, sole: Callable[[Side], Pose2D]) -> None:
        """Take the swing foot as the stance foot, and begin the next step, or to stand."""
        side = step.side.other
        stance = self._stance = Footstep(side, sole(side))
        self.feet = (stance, self.feet[1]) if side is Side.LEFT else (self.feet[0], stance)
        start, other = step.next_start(), step.after.inverse()
        if wanted is not None or self.velocity != (0.0, 0.0, 0.0):
            self._begin_step(start, other, wanted, step.shape.duration)
            return
        self._time -= step.shape.duration
        rest = LipmState(0.5 * other.x, 0.0), LipmState(0.5 * other.y, 0.0)
        shift = self._parameters.first_shift_time
        self._part = Rocking(start, rest, self._shape.time_constant, shift, other)

    def _limited(self, wanted: Velocity) -> Velocity:
        """Return the speed for this step: within the law's limits and not far from the present one."""
        p = self._parameters
        most = (p.paper_max_speed, self._most_sideways, p.paper_max_turn_rate)
        self.notes = tuple(
            f"{name} of {value:.2f} {unit} is more than the paper's gait can: {limit:.2f} {unit}"
            for name, unit, value, limit in zip(AXES, UNITS, wanted, most, strict=True)
            if abs(value) > limit
        )
        change = (p.max_speed_change, p.max_speed_change, p.max_turn_change)
        forward, left, turn = (
            min(max(value, -limit, now - step), limit, now + step)
            for value, limit, now, step in zip(wanted, most, self.velocity, change, strict=True)
        )
        return forward, left, turn

    def _frame(self, foot: Footstep) -> Pose2D:
        """Return the pivot of a foot, with its yaw."""
        p = self._parameters
        x, y = sole_point(foot, p.zmp_forward, p.paper_zmp_inward)
        return Pose2D(x, y, foot.pose.yaw)

    def _reference(self) -> Reference:
        assert self._stance is not None and self._part is not None
        stance, part = self._stance, self._part
        frame = self._frame(stance)
        if isinstance(part, Rocking):
            com, zmp = part.evaluate(min(self._time, part.duration))
            self.finished = self.step_count > 0 and self._time >= part.duration
            forward, left = self._shape.sole_offset(stance.side.other)
            foot = FootMotion.resting(frame @ part.other @ Pose2D(-forward, -left))
            support, phase = Support.DOUBLE, self._time / part.duration
        else:
            com, zmp = part.com(self._time), part.pivot
            foot = moved(part.foot(self._time), frame)
            support, phase = support_on(stance.side), self._time / self._shape.duration
        return self._assembled(frame, com, zmp, foot, support, phase)

    def _assembled(
        self, frame: Pose2D, com: Axes, zmp: tuple[float, float], foot: FootMotion, support: Support, phase: float
    ) -> Reference:
        """Return the reference from what is planned in the stance foot's frame."""
        assert self._stance is not None
        tc, rotation = self._shape.time_constant, frame.rotation()
        position = np.array(frame.transform((com[0].position, com[1].position)))
        velocity = rotation @ (com[0].velocity, com[1].velocity)
        self._zmp = frame.transform(zmp)
        motion = ComMotion(position, velocity, (position - self._zmp) / tc**2)
        dcm = position + tc * velocity
        yaw = frame.yaw + 0.5 * math.remainder(foot.yaw - frame.yaw, 2.0 * math.pi)
        return Reference(
            support,
            self._stance,
            foot,
            self._zmp,
            (float(dcm[0]), float(dcm[1])),
            yaw,
            0.5 * foot.yaw_rate,
            min(phase, 1.0),
            motion,
        )


def sideways_limit(shape: StepShape, width: float, least: float) -> float:
    """Return the greatest speed sideways [m/s] at which the mirrored feet stay far enough apart.

    On the step that closes up, their distance 2 |y_c(t)| is W cosh(u)/C - L sinh(u)/S with u = (t - T/2)/Tc,
    C = cosh(T/2Tc), S = sinh(T/2Tc) and the way L; its least value is sqrt((W/C)^2 - (L/S)^2).

    Args:
        shape: Of the steps.
        width: W [m].
        least: Distance that the feet may come to [m].
    """
    half = 0.5 * shape.duration / shape.time_constant
    room = (width / math.cosh(half)) ** 2 - least**2
    return math.sinh(half) * math.sqrt(max(room, 0.0)) / shape.duration


def moved(foot: FootMotion, frame: Pose2D) -> FootMotion:
    """Return a foot's motion, given in a frame at rest, in the frame's parent."""
    c, s = math.cos(frame.yaw), math.sin(frame.yaw)
    (x, y, z), (vx, vy, vz), (ax, ay, az) = foot.position, foot.velocity, foot.acceleration
    return FootMotion(
        (frame.x + c * x - s * y, frame.y + s * x + c * y, z),
        (c * vx - s * vy, s * vx + c * vy, vz),
        (c * ax - s * ay, s * ax + c * ay, az),
        frame.yaw + foot.yaw,
        foot.yaw_rate,
        foot.yaw_acceleration,
    )
