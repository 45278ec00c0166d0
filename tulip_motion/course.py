"""Where the walk goes: footsteps for a velocity command or to a goal pose, with limited speed and a held heading."""

from __future__ import annotations

import math

from tulip_description.planar import Pose2D, wrap_angle
from tulip_motion.footsteps import Footstep, centre_beside, foot_beside, plan_footsteps
from tulip_motion.parameters import MotionParameters
from tulip_motion.reach import Reach, Velocity, stance_width, step_time

Wish = Velocity | Pose2D | None
"""A velocity (forward [m/s], left [m/s], turning [rad/s]), a goal for the middle between the feet in odom, or stop."""

PREVIEW_STEPS = 3  # what lies further ahead moves the DCM by less than exp(-3 T / Tc) = 0.7 %
STILL: Velocity = (0.0, 0.0, 0.0)


class Course:
    """Plans the next footsteps when a step begins."""

    def __init__(self, parameters: MotionParameters, reach: Reach) -> None:
        """Begin from rest."""
        self._parameters = parameters
        self._reach = reach
        self._planned: Pose2D | None = None
        self.velocity: Velocity = STILL
        """Of the step that was planned last: what all limits have left of the command."""
        self.step_time = parameters.step_time
        """Duration of the next step, double support included [s]."""
        self.note = ""
        """What was taken off the last command, in words, or ""."""

    def next_steps(self, stance: Footstep, wish: Wish) -> list[Footstep]:
        """Return the next footsteps, the last of which closes up so that the robot could stop there.

        Args:
            stance: The foot that stands, in odom.
            wish: What is commanded.
        """
        p = self._parameters
        straight = self._on_course(stance)
        wanted = self._velocity_to(wish, straight) if isinstance(wish, Pose2D) else wish or STILL
        possible, self.note = self._reach.limited(wanted)
        if isinstance(wish, Pose2D):
            self.note = ""  # a far goal is meant to be walked to as fast as the robot can
        self.velocity = self._smoothed(possible)
        self.step_time = step_time(p, self.velocity[0])
        steps = plan_footsteps(
            straight, self.velocity, self.step_time, stance_width(p, self.velocity[0]), PREVIEW_STEPS
        )
        if isinstance(wish, Pose2D) and self._is_near(wish, straight):
            steps = self._last_steps(wish, straight)
        steps[0] = self._reach.within(stance, steps[0])
        self._planned = centre_beside(steps[0], p.stance_width)
        return steps

    def reached(self, wish: Wish, feet: tuple[Footstep, Footstep]) -> bool:
        """Return whether the feet stand side by side, and on the goal if there is one, so that the walk may end."""
        p = self._parameters
        left, right = (centre_beside(foot, p.stance_width) for foot in feet)
        if isinstance(wish, Pose2D):
            there = is_at(wish, middle(feet, p.stance_width), p.goal_tolerance, p.goal_tolerance_yaw)
        else:
            there = wish is None and self.velocity == STILL
        return there and is_at(left, right, p.closing_tolerance, p.closing_tolerance_yaw)

    def _on_course(self, stance: Footstep) -> Footstep:
        """Return the stance foot with the heading, and on the line, that it was meant to have.

        Feet land turned by some hundredths of a radian and some millimetres aside; planned from where they look and
        stand, the robot would wander off. A robot that was pushed far off its line takes a new one.
        """
        p = self._parameters
        if self._planned is None:
            return stance
        centre = centre_beside(stance, p.stance_width)
        off = self._planned.inverse() @ centre
        most = p.max_heading_correction
        turned = Pose2D(centre.x, centre.y, centre.yaw + min(max(-off.yaw, -most), most))
        aside = min(max(-off.y, -p.max_course_correction), p.max_course_correction)
        if abs(off.y) > p.course_give_way:
            aside = 0.0
        return foot_beside(turned @ Pose2D(0.0, aside, 0.0), stance.side, p.stance_width)

    def _smoothed(self, wanted: Velocity) -> Velocity:
        """Return the speed for the next step: not far from the present one."""
        p, now = self._parameters, self.velocity
        change = (p.max_speed_change, p.max_speed_change, p.max_turn_change)
        forward, left, turn = (
            min(max(value, old - most), old + most) for value, old, most in zip(wanted, now, change, strict=True)
        )
        return forward, left, turn

    def _velocity_to(self, goal: Pose2D, stance: Footstep) -> Velocity:
        """Return the velocity towards a goal: far away facing where it goes, near by in all directions at once."""
        p, limits = self._parameters, self._reach
        way = centre_beside(stance, p.stance_width).inverse() @ goal
        distance = math.hypot(way.x, way.y)
        turn = math.atan2(way.y, way.x) if distance > p.goal_holonomic_distance else way.yaw
        # From this speed the robot comes to rest on the way that is left, slowing down by the permitted change a step;
        # 0.7 leaves room, since it can slow down only once a step.
        brake = math.sqrt(2.0 * p.max_speed_change / self.step_time * distance) * 0.7
        fastest = min(limits.forward, brake)
        if distance > p.goal_holonomic_distance:
            return fastest * max(math.cos(turn), 0.0), 0.0, turn / (2.0 * self.step_time)
        scale = min(fastest / distance, 1.0 / self.step_time) if distance > 0.0 else 0.0
        return scale * way.x, scale * way.y, turn / (2.0 * self.step_time)

    def _is_near(self, goal: Pose2D, stance: Footstep) -> bool:
        """Return whether the other foot can be put on its place at the goal with the next step, slowly enough."""
        p = self._parameters
        to_goal = centre_beside(stance, p.stance_width).inverse() @ goal
        foot = stance.pose.inverse() @ foot_beside(goal, stance.side.other, p.stance_width).pose
        outward = abs(foot.y)
        # The last line: the foot's place lies on its own side of the stance foot, so that the legs do not cross.
        return (
            abs(to_goal.x) <= (abs(self.velocity[0]) + p.max_speed_change) * self.step_time
            and abs(to_goal.y) <= 2.0 * (abs(self.velocity[1]) + p.max_speed_change) * self.step_time
            and abs(to_goal.yaw) <= p.max_turn_change * self.step_time
            and self._reach.nearest <= outward <= self._reach.farthest
            and (foot.y > 0.0) is (stance.side.other.value == 0)
        )

    def _last_steps(self, goal: Pose2D, stance: Footstep) -> list[Footstep]:
        """Return the steps that put both feet on the goal, and then two in place there to fill the plan."""
        first, second = (
            foot_beside(goal, side, self._parameters.stance_width) for side in (stance.side.other, stance.side)
        )
        self.velocity = STILL
        return [first, second, first, second]


def is_at(goal: Pose2D, pose: Pose2D, tolerance: float, tolerance_yaw: float) -> bool:
    """Return whether a pose lies within tolerances [m], [rad] of a goal."""
    away = goal.inverse() @ pose
    return math.hypot(away.x, away.y) <= tolerance and abs(away.yaw) <= tolerance_yaw


def middle(feet: tuple[Footstep, Footstep], width: float) -> Pose2D:
    """Return the pose midway between the left and the right foot, in odom."""
    left, right = (centre_beside(foot, width) for foot in feet)
    return Pose2D(0.5 * (left.x + right.x), 0.5 * (left.y + right.y), left.yaw + 0.5 * wrap_angle(right.yaw - left.yaw))
