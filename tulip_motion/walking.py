"""The default gait: footsteps, DCM plan, foot placement.

A step begins when a foot lands. Its plan runs over the next footsteps at the present speed and ends
standing still, so that the robot could stop after it: the DCM reference follows backwards from there.
While the foot swings, its landing place is moved by the error that the DCM will have grown to at
touchdown, and the step ends when the foot meets the ground.
"""

from __future__ import annotations

import math

from tulip_description.planar import Pose2D, wrap_angle
from tulip_motion.footsteps import Footstep, plan_footsteps
from tulip_motion.gait import FootMotion, Reference, SwingFoot, sole_point, support_on
from tulip_motion.interface import Side, Support
from tulip_motion.lipm import DcmPlan, time_constant
from tulip_motion.parameters import MotionParameters
from tulip_motion.walking_kick import KickSwing, WalkingKick

PREVIEW_STEPS = 3  # what lies further ahead moves the DCM by less than exp(-3 T / Tc) = 0.7 %

Velocity = tuple[float, float, float]


class Walking:
    """Walks from standing to standing."""

    def __init__(self, parameters: MotionParameters, feet: tuple[Footstep, Footstep], zmp: tuple[float, float]) -> None:
        """Begin from double support.

        Args:
            parameters: Of motion control.
            feet: Left and right foot as they stand.
            zmp: Where the ZMP is now, in odom [m].
        """
        self._parameters = parameters
        self._time_constant = time_constant(parameters.com_height)
        self.feet = feet
        self.velocity: Velocity = (0.0, 0.0, 0.0)
        self.step_count = 0
        self.finished = False
        self._zmp = zmp
        self._stance: Footstep | None = None
        self._closing = False
        self._heading: float | None = None
        self._swing: SwingFoot | KickSwing | None = None
        self.kick: WalkingKick | None = None
        """A kick to be done by one of the steps."""

    def kick_next(self, kick: WalkingKick) -> str:
        """Take a kick for one of the steps after the present one; return "" or the reason why not."""
        if self._stance is None or self._swing_over or self._closing:
            return "the robot is stopping; a walking kick needs a walk that goes on"
        coming = Footstep(self._stance.side.other, self._target)
        refusal = kick.refusal(coming, self._stance.pose, self.velocity)
        if not refusal:
            self.kick = kick
        return refusal

    def tick(
        self,
        dt: float,
        wanted: Velocity | None,
        dcm: tuple[float, float],
        landed: list[Pose2D],
        loads: tuple[float, float],
    ) -> Reference:
        """Advance by one tick.

        Args:
            dt: [s].
            wanted: Velocity to walk with, or None to stop.
            dcm: Measured DCM in odom [m].
            landed: Where the left and right sole are now, as measured, in odom; used when one touches down.
            loads: Vertical force on the left and right sole [N].
        """
        if self._stance is None:
            self._begin_first_step(wanted or (0.0, 0.0, 0.0))
        else:
            self._time += dt
            if self._swing is not None and self._has_landed(loads):
                side = self._stance.side.other
                self.feet = (
                    (self.feet[0], Footstep(side, landed[side]))
                    if side is Side.RIGHT
                    else (Footstep(side, landed[side]), self.feet[1])
                )
                self._begin_step(self.feet[side], wanted, self._parameters.double_support_time)
        return self._reference(dt, dcm)

    def _begin_first_step(self, wanted: Velocity) -> None:
        leading = Side.LEFT if wanted[1] + wanted[2] >= 0.0 else Side.RIGHT
        self._begin_step(self.feet[leading.other], wanted, self._parameters.first_shift_time)

    def _begin_step(self, stance: Footstep, wanted: Velocity | None, shift_time: float) -> None:
        p = self._parameters
        self._stance = stance
        self._time = 0.0
        self._shift_time = shift_time
        self._swing = None
        self._swing_over = False
        self.step_count += 1
        was_closing = self._closing
        self.velocity = self._limited(wanted or (0.0, 0.0, 0.0))
        self._closing = wanted is None and self.velocity == (0.0, 0.0, 0.0)
        aim = sole_point(stance, p.zmp_forward, p.zmp_inward)
        if was_closing and self._closing:
            self._begin_stop()
            return
        steps = plan_footsteps(self._straightened(stance), self.velocity, p.step_time, p.stance_width, PREVIEW_STEPS)
        if self.kick is not None:
            steps = self.kick.adapt(stance, self.feet[stance.side.other].pose, steps, self.velocity, wanted is None)
        self._heading = steps[0].pose.yaw
        self._target = self._nominal = steps[0].pose
        swing_time = p.step_time - p.double_support_time
        self._landing_time = shift_time + swing_time
        times, zmps = [0.0, shift_time, self._landing_time], [self._zmp, aim, aim]
        for step in steps:
            aim = sole_point(step, p.zmp_forward, p.zmp_inward)
            times += [times[-1] + p.double_support_time, times[-1] + p.step_time]
            zmps += [aim, aim]
        middle = ((zmps[-1][0] + zmps[-3][0]) / 2.0, (zmps[-1][1] + zmps[-3][1]) / 2.0)
        self._plan = DcmPlan([*times, times[-1] + p.stop_shift_time], [*zmps, middle], self._time_constant)

    def _straightened(self, stance: Footstep) -> Footstep:
        """Return the stance foot with the heading that it was meant to have.

        Feet land turned by some hundredths of a radian; planned from where they look, the robot would wander off.
        """
        pose, most = stance.pose, self._parameters.max_heading_correction
        if self._heading is None:
            return stance
        correction = min(max(wrap_angle(self._heading - pose.yaw), -most), most)
        return Footstep(stance.side, Pose2D(pose.x, pose.y, pose.yaw + correction))

    def _begin_stop(self) -> None:
        p = self._parameters
        left, right = (sole_point(foot, p.zmp_forward, p.zmp_inward) for foot in self.feet)
        middle = ((left[0] + right[0]) / 2.0, (left[1] + right[1]) / 2.0)
        self._shift_time = self._landing_time = p.stop_shift_time
        self._swing_over = True
        self._plan = DcmPlan([0.0, p.stop_shift_time], [self._zmp, middle], self._time_constant)

    def _limited(self, wanted: Velocity) -> Velocity:
        """Return the speed for the next step: within the robot's limits and not far from the present one."""
        p = self._parameters
        forward = min(max(wanted[0], -p.max_speed_backward), p.max_speed_forward)
        left = min(max(wanted[1], -p.max_speed_sideways), p.max_speed_sideways)
        turn = min(max(wanted[2], -p.max_turn_rate), p.max_turn_rate)
        change, turn_change = p.max_speed_change, p.max_turn_change
        now = self.velocity
        return (
            min(max(forward, now[0] - change), now[0] + change),
            min(max(left, now[1] - change), now[1] + change),
            min(max(turn, now[2] - turn_change), now[2] + turn_change),
        )

    def _has_landed(self, loads: tuple[float, float]) -> bool:
        assert self._stance is not None
        p = self._parameters
        progress = (self._time - self._shift_time) / (self._landing_time - self._shift_time)
        touching = loads[self._stance.side.other] > p.contact_force
        return (touching and progress > p.contact_phase) or self._time > self._landing_time + p.late_contact_time

    def _reference(self, dt: float, dcm: tuple[float, float]) -> Reference:
        assert self._stance is not None
        p = self._parameters
        zmp, planned = self._plan.evaluate(min(self._time, self._landing_time))
        self._zmp = zmp
        stance = self._stance
        trailing = self.feet[stance.side.other]
        if self._time < self._shift_time or self._swing_over:
            foot = FootMotion.resting(trailing.pose)
            support = Support.DOUBLE
            self.finished = self._swing_over and self._time > self._shift_time
        else:
            if self._swing is None:
                duration = self._landing_time - self._shift_time
                self._swing = self.kick.swing(trailing.pose, duration) if self.kick is not None else None
                self._swing = self._swing or SwingFoot(trailing.pose, duration, p.swing_height, p.landing_speed)
            remaining = self._landing_time - self._time
            if remaining > p.placement_freeze_time:
                error = (dcm[0] - planned[0], dcm[1] - planned[1])
                self._target = self._placed(error, remaining)
            foot = self._swing.advance(self._target, dt)
            support = support_on(stance.side)
        yaw_difference = math.remainder(foot.yaw - stance.pose.yaw, 2.0 * math.pi)
        return Reference(
            support,
            stance,
            foot,
            zmp,
            planned,
            stance.pose.yaw + 0.5 * yaw_difference,
            0.5 * foot.yaw_rate,
            min(self._time / self._landing_time, 1.0),
        )

    def _placed(self, error: tuple[float, float], remaining: float) -> Pose2D:
        """Return the landing place that takes up the DCM error expected at touchdown, within reach."""
        assert self._stance is not None
        p = self._parameters
        shift = p.double_support_time / self._time_constant
        # A ZMP that moves over during the double support, instead of at once, lets the error grow further.
        gain = p.placement_gain * shift / (1.0 - math.exp(-shift)) * math.exp(remaining / self._time_constant)
        nominal = self._nominal
        moved = Pose2D(nominal.x + gain * error[0], nominal.y + gain * error[1], nominal.yaw)
        beside = self._stance.pose.inverse() @ moved
        sign = 1.0 if self._stance.side is Side.RIGHT else -1.0
        forward = min(max(beside.x, -p.max_stride), p.max_stride)
        left = sign * min(max(sign * beside.y, p.min_foot_distance), p.max_foot_distance)
        return self._stance.pose @ Pose2D(forward, left, beside.yaw)
