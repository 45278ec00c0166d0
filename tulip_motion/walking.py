"""The default gait: footsteps, DCM plan, landings that give way to pushes.

A step begins when a foot lands. Its plan runs over the next footsteps at the present speed and ends
standing still, so that the robot could stop after it: the DCM reference follows backwards from there.
While the foot swings, place and time of its landing are solved together for the measured DCM
(step_adjustment.py), and the step ends when the foot meets the ground.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from tulip_description.planar import Pose2D
from tulip_description.robot import Foot
from tulip_motion.course import Course, Wish
from tulip_motion.footsteps import Footstep
from tulip_motion.gait import FootMotion, Reference, SwingFoot, between_soles, sole_point, support_on
from tulip_motion.interface import Side, Support
from tulip_motion.lipm import DcmPlan, time_constant
from tulip_motion.parameters import MotionParameters
from tulip_motion.reach import Reach
from tulip_motion.stabilizer import SupportArea
from tulip_motion.step_adjustment import StepAdjustment
from tulip_motion.swing_detour import Detour, detour
from tulip_motion.walking_kick import KickSwing, WalkingKick


class Walking:
    """Walks from standing to standing."""

    def __init__(
        self,
        parameters: MotionParameters,
        reach: Reach,
        soles: tuple[Foot, Foot],
        feet: tuple[Footstep, Footstep],
        zmp: tuple[float, float],
    ) -> None:
        """Begin from double support.

        Args:
            parameters: Of motion control.
            reach: Of the robot.
            soles: Left and right sole of the robot.
            feet: Left and right foot as they stand.
            zmp: Where the ZMP is now, in odom [m].
        """
        self._parameters = parameters
        self._soles = soles
        self._time_constant = time_constant(parameters.com_height)
        self.feet = feet
        self.course = Course(parameters, reach)
        """Where the walk goes."""
        self.step_count = 0
        self.finished = False
        self._zmp = zmp
        self._stance: Footstep | None = None
        self._swing: SwingFoot | KickSwing | None = None
        self._detour: Detour | None = None
        self.kick: WalkingKick | None = None
        """A kick to be done by one of the steps."""
        self._adjustments = [
            StepAdjustment(parameters, reach, self._time_constant, -1.0 if side is Side.LEFT else 1.0) for side in Side
        ]

    @property
    def notes(self) -> tuple[str, ...]:
        """What was taken off the command, in words."""
        return (self.course.note,) if self.course.note else ()

    @property
    def footsteps(self) -> tuple[Footstep, ...]:
        """The next footsteps: the one under way, where it is to land now, and those planned after it."""
        if self._stance is None or self._swing_over:
            return ()
        return (Footstep(self._stance.side.other, self._target), *self._following)

    def kick_next(self, kick: WalkingKick) -> str:
        """Take a kick for one of the steps after the present one; return "" or the reason why not."""
        if self._stance is None or self._swing_over:
            return "the robot is stopping; a walking kick needs a walk that goes on"
        coming = Footstep(self._stance.side.other, self._target)
        refusal = kick.refusal(coming, self._stance.pose, self.course.velocity)
        if not refusal:
            self.kick = kick
        return refusal

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
            wish: Velocity or goal to walk with or to, or None to stop.
            dcm: Measured DCM in odom [m].
            sole: Says where a sole is now, as measured, in odom; asked for when one touches down.
            loads: Vertical force on the left and right sole [N].
        """
        if self._stance is None:
            self._begin_first_step(wish)
        else:
            self._time += dt
            if self._shift_time > self._parameters.double_support_time and self._must_step(dcm):
                self._begin_step(self._far_foot(dcm), wish, self._parameters.double_support_time)
            if self._swing is not None and self._has_landed(loads):
                side = self._stance.side.other
                landed = Footstep(side, sole(side))
                self.feet = (self.feet[0], landed) if side is Side.RIGHT else (landed, self.feet[1])
                if self.course.reached(wish, self.feet):
                    self._begin_stop(self.feet[side])
                else:
                    self._begin_step(self.feet[side], wish, self._parameters.double_support_time)
        return self._reference(dt, dcm)

    def _begin_first_step(self, wish: Wish) -> None:
        """Begin to walk with the foot on the side that the robot is to go or turn to."""
        if isinstance(wish, Pose2D):
            to_goal = self.feet[Side.LEFT].pose.inverse() @ wish
            sideways = to_goal.y + to_goal.yaw
        else:
            sideways = wish[1] + wish[2] if wish else 0.0
        leading = Side.LEFT if sideways >= 0.0 else Side.RIGHT
        self._begin_step(self.feet[leading.other], wish, self._parameters.first_shift_time)

    def _must_step(self, dcm: tuple[float, float]) -> bool:
        """Return whether the DCM has left what both feet can hold, while the ZMP shifts slowly."""
        return self._time < self._shift_time and must_step(self._parameters, self.feet, dcm)

    def _far_foot(self, dcm: tuple[float, float]) -> Footstep:
        """Return the foot that can stand while the other one steps to where the robot falls."""
        left, right = (foot.pose.inverse().transform(dcm)[1] for foot in self.feet)
        return self.feet[Side.LEFT] if abs(left) > abs(right) else self.feet[Side.RIGHT]

    def _begin_step(self, stance: Footstep, wish: Wish, shift_time: float) -> None:
        """Plan footsteps and DCM from a stance foot; once the ZMP has shifted to it, the other swings."""
        p = self._parameters
        self._stance = stance
        self._time = 0.0
        self._shift_time = shift_time
        self._swing = None
        self._swing_over = False
        self.step_count += 1
        aim = sole_point(stance, p.zmp_forward, p.zmp_inward)
        steps = self.course.next_steps(stance, wish)
        step_time = self.course.step_time
        if self.kick is not None:
            trailing = self.feet[stance.side.other].pose
            steps = self.kick.adapt(stance, trailing, steps, self.course.velocity, not isinstance(wish, tuple))
            step_time = self.kick.step_time or step_time
        self._target = self._nominal = steps[0].pose
        self._following = tuple(steps[1:])
        swing_time = step_time - p.double_support_time
        self._landing_time = self._planned_landing_time = shift_time + swing_time
        self._aim = aim
        times, zmps = [0.0, shift_time, self._landing_time], [self._zmp, aim, aim]
        for step in steps:
            aim = sole_point(step, p.zmp_forward, p.zmp_inward)
            times += [times[-1] + p.double_support_time, times[-1] + self.course.step_time]
            zmps += [aim, aim]
        middle = ((zmps[-1][0] + zmps[-3][0]) / 2.0, (zmps[-1][1] + zmps[-3][1]) / 2.0)
        self._plan = DcmPlan([*times, times[-1] + p.stop_shift_time], [*zmps, middle], self._time_constant)
        _, landing_dcm = self._plan.evaluate(self._landing_time)
        # The DCM that is wanted at landing, from the aim point.
        self._landing_dcm = (landing_dcm[0] - self._aim[0], landing_dcm[1] - self._aim[1])
        # The adjustment reckons in the axes of the stance foot.
        self._axes = (math.cos(stance.pose.yaw), math.sin(stance.pose.yaw))
        self._landing_dcm_beside = self._beside(landing_dcm, self._aim)
        self._nominal_beside = self._beside((self._nominal.x, self._nominal.y), (stance.pose.x, stance.pose.y))
        self._adjustment = self._adjustments[stance.side]

    def _begin_stop(self, stance: Footstep) -> None:
        """Bring the ZMP between the feet, which stand side by side."""
        p = self._parameters
        self._stance = stance
        self._time = 0.0
        self._swing = None
        middle = between_soles(self.feet, p.zmp_forward, p.zmp_inward)
        self._shift_time = self._landing_time = p.stop_shift_time
        self._swing_over = True
        self._plan = DcmPlan([0.0, p.stop_shift_time], [self._zmp, middle], self._time_constant)

    def _has_landed(self, loads: tuple[float, float]) -> bool:
        """Return whether the swing foot carries weight late enough in its swing, or is overdue."""
        assert self._stance is not None
        p = self._parameters
        progress = (self._time - self._shift_time) / (self._landing_time - self._shift_time)
        touching = loads[self._stance.side.other] > p.contact_force
        return (touching and progress > p.contact_phase) or self._time > self._landing_time + p.late_contact_time

    def _reference(self, dt: float, dcm: tuple[float, float]) -> Reference:
        assert self._stance is not None
        p = self._parameters
        zmp, planned = self._planned()
        self._zmp = zmp
        stance = self._stance
        trailing = self.feet[stance.side.other]
        if self._time < self._shift_time or self._swing_over:
            foot = FootMotion.resting(trailing.pose)
            support = Support.DOUBLE
            self.finished = self._swing_over and self._time > self._shift_time
        else:
            if self._swing is None:
                duration = self._landing_time - self._time
                self._swing = self.kick.swing(trailing.pose, duration) if self.kick is not None else None
                self._detour = None
                if self._swing is None:
                    self._swing = SwingFoot(trailing.pose, duration, p.swing_height, p.landing_speed)
                    gap = p.min_foot_distance - self._soles[0].width  # as near as it may land
                    self._detour = detour(self._soles, stance, trailing.pose, self._target, gap)
            if self._landing_time - self._time > p.placement_freeze_time:
                self._adjust(dcm)
                zmp, planned = self._planned()
            foot = self._swing.advance(self._target, self._landing_time - self._time, dt)
            if self._detour is not None:
                rate = 1.0 / (self._landing_time - self._shift_time)
                foot = self._detour.added_to(foot, (self._time - self._shift_time) * rate, rate)
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

    def _planned(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return planned ZMP and DCM at this time of the step, for the landing time that holds now."""
        if self._swing_over or self._time < self._shift_time:
            return self._plan.evaluate(self._time)
        decay = math.exp(min(self._time - self._landing_time, 0.0) / self._time_constant)
        aim, offset = self._aim, self._landing_dcm
        return aim, (aim[0] + decay * offset[0], aim[1] + decay * offset[1])

    def _beside(self, point: tuple[float, float], origin: tuple[float, float]) -> tuple[float, float]:
        """Return the way from an origin to a point [m] in the axes of the stance foot."""
        (c, s), x, y = self._axes, point[0] - origin[0], point[1] - origin[1]
        return c * x + s * y, c * y - s * x

    def _adjust(self, dcm: tuple[float, float]) -> None:
        """Move landing place and time to what the measured DCM asks for."""
        assert self._stance is not None and self._swing is not None
        p, pose = self._parameters, self._stance.pose
        remaining = self._planned_landing_time - self._time
        landing = self._adjustment.solve(
            self._beside(dcm, self._aim),
            self._landing_dcm_beside,
            self._nominal_beside,
            self._beside(self._swing.place, (pose.x, pose.y)),
            remaining,
            remaining + p.max_step_extension,
            # A kick's foot is to be at the ball in time.
            fixed_time=isinstance(self._swing, KickSwing),
        )
        # Estimates overshoot while the robot is being pushed: let the time follow over some ticks.
        most = p.max_step_time_rate * p.control_period
        change = self._time + landing.remaining - self._landing_time
        self._landing_time += min(max(change, -most), most)
        (x, y), (c, s) = landing.place, self._axes
        self._target = Pose2D(pose.x + c * x - s * y, pose.y + s * x + c * y, self._nominal.yaw)


def must_step(parameters: MotionParameters, feet: tuple[Footstep, Footstep], dcm: tuple[float, float]) -> bool:
    """Return whether the DCM is so far from the middle between the feet that standing ankles cannot bring it back."""
    p = parameters
    middle = between_soles(feet, p.zmp_forward, p.zmp_inward)
    stretched = tuple(m + (d - m) / p.ankle_share for d, m in zip(dcm, middle, strict=True))
    nearest, _ = SupportArea.of(p, feet[0], feet[1]).nearest((stretched[0], stretched[1]))
    return math.hypot(stretched[0] - nearest[0], stretched[1] - nearest[1]) > 1e-9
