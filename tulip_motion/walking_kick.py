"""A kick by one step of a walk that goes on: which step reaches the ball, and how its foot swings through it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tulip_description.planar import Pose2D, wrap_angle
from tulip_description.robot import Foot
from tulip_motion.footsteps import Footstep, plan_footsteps
from tulip_motion.gait import FootMotion, SwingTrack
from tulip_motion.interface import KickKind, Side
from tulip_motion.kick_geometry import gap_between, striking_face
from tulip_motion.kick_path import Quintic
from tulip_motion.parameters import MotionParameters
from tulip_motion.reach import Reach, Velocity, stance_width, step_time

# Shares of the walk's forward speed at which the steps before the kick are tried, the least change first: a fast walk
# makes longer strides than what one foot can reach.
PACES = (1.0, 0.9, 1.1, 0.8, 0.7, 0.6, 0.5)

Point = tuple[float, float]


class WalkingKick:
    """Waits for the step whose foot can reach the ball, and turns it into a kick.

    The kicking step is chosen among the footsteps that lie ahead, so that the plan of the DCM knows its landing place
    from the step before.
    """

    def __init__(
        self,
        parameters: MotionParameters,
        reach: Reach,
        side: Side,
        ball: Point,
        direction: float,
        speed: float,
        soles: tuple[Foot, Foot],
    ) -> None:
        """Prepare a kick.

        Args:
            parameters: Of motion control.
            reach: Of the robot.
            side: The foot that kicks.
            ball: (x, y) of the ball's centre in odom [m].
            direction: Where it shall go, in odom [rad].
            speed: Of the ball [m/s].
            soles: Rectangles of the left and right sole.
        """
        p = self._parameters = parameters
        self.side = side
        self._reach = reach
        self._soles = soles
        self._foot_speed = speed / p.walking_kick_speed_ratio
        self._direction = direction
        self._contact = striking_face(KickKind.WALKING, side, soles[side]).sole_at_contact(
            ball, direction, p.ball_radius
        )
        swing = p.walking_kick_step_time - p.double_support_time
        self._contact_time = p.walking_kick_contact * swing
        # The foot lands where it would come to if it slowed down evenly from the contact to the end of the swing.
        way = 0.5 * self._foot_speed * (swing - self._contact_time)
        self._landing = self._contact @ Pose2D(way, 0.0, 0.0)
        self._steps_left = p.walking_kick_steps
        self._swing: KickSwing | None = None
        self._kicks_now = False
        self.finished = False
        self.reason = ""
        """Why the ball was not kicked, or ""."""

    @property
    def phase(self) -> float:
        """Progress of the kicking step, 0 to 1; 0 before it."""
        return 1.0 if self.finished else 0.0 if self._swing is None else self._swing.phase

    @property
    def step_time(self) -> float | None:
        """Duration of the step that begins now if it kicks [s], else None."""
        return self._parameters.walking_kick_step_time if self._kicks_now and not self.finished else None

    def cancel(self, reason: str) -> None:
        """Give the kick up: an ordinary step takes the foot from where it is to where it was to land."""
        if self.finished or self.reason:
            return
        self.reason = reason
        if self._swing is None:
            self.finished = True
        else:
            self._swing.give_up()

    def abandon(self, reason: str) -> None:
        """End the kick because the walk has ended."""
        if not self.finished:
            self.finished, self.reason = True, self.reason or reason

    def refusal(self, stance: Footstep, trailing: Pose2D, velocity: Velocity) -> str:
        """Return "" if one of the next steps reaches the ball, else why none does.

        Args:
            stance: The foot that will stand when the next step begins.
            trailing: Where the other foot will be then.
            velocity: Of the walk.
        """
        p = self._parameters
        for pace in PACES:
            steps = self._steps(stance, velocity, pace, self._steps_left)[:-1]
            if self._find(stance, trailing, steps) is not None:
                return ""
        steps = self._steps(stance, velocity, 1.0, self._steps_left)[:-1]
        places = [
            before.pose.inverse() @ self._contact
            for before, step in zip([stance, *steps[:-1]], steps, strict=True)
            if step.side is self.side
        ]
        nearest = min(places, key=lambda place: abs(place.x) + abs(place.y))
        low, high = p.walking_kick_reach_back, p.walking_kick_reach_ahead
        return (
            f"no {self.side.name.lower()} step of the next {self._steps_left} reaches the ball: the foot would have to"
            f" be ({nearest.x:.2f}, {nearest.y:.2f}) m from the standing one to touch it; expected"
            f" {low} to {high} m ahead, {p.min_foot_distance} to {p.walking_kick_reach_side} m beside it,"
            f" turned by at most {p.max_walking_kick_direction} rad"
        )

    def adapt(
        self, stance: Footstep, trailing: Pose2D, steps: list[Footstep], velocity: Velocity, stopping: bool
    ) -> list[Footstep]:
        """Return the footsteps with the kicking one among them moved to where it lands; called as each step begins.

        Args:
            stance: The foot that stands.
            trailing: Where the other foot is.
            steps: The plan; the first is the step that begins now.
            velocity: Of the walk.
            stopping: The robot has been told to stop walking.
        """
        if self._kicks_now:
            self.finished = True  # that foot has landed: this is the step after
        elif stopping:
            self.abandon("the robot was told to stop walking")
        if self.finished:
            return steps
        self._steps_left -= 1
        for pace in PACES:
            tried = steps if pace == 1.0 else self._steps(stance, velocity, pace, len(steps) - 1)
            index = self._find(stance, trailing, tried[:-1])
            if index is not None:
                self._kicks_now = index == 0
                kicking = Footstep(self.side, self._landing)
                rest = self._steps(kicking, velocity, 1.0, len(steps) - index - 2)
                return [*tried[:index], kicking, *rest]
        if self._steps_left <= 0 or self.refusal(stance, trailing, velocity):
            self.abandon("the ball came out of reach of the steps that were left")
        return steps

    def swing(self, start: Pose2D, duration: float) -> KickSwing | None:
        """Return the path of the foot if the step that swings now is the kick."""
        if not self._kicks_now or self.finished:
            return None
        p = self._parameters
        self._swing = KickSwing(
            start,
            self._contact,
            self._foot_speed,
            self._contact_time,
            duration,
            p.swing_height,
            p.landing_speed,
        )
        return self._swing

    def _steps(self, stance: Footstep, velocity: Velocity, pace: float, count: int) -> list[Footstep]:
        """Return footsteps at a share of the forward speed, with the times and the width of that speed."""
        p = self._parameters
        forward = pace * velocity[0]
        return plan_footsteps(
            stance, (forward, velocity[1], velocity[2]), step_time(p, forward), stance_width(p, forward), count
        )

    def _find(self, stance: Footstep, trailing: Pose2D, steps: Sequence[Footstep]) -> int | None:
        """Return the first step whose foot can swing through the ball."""
        starts = [trailing, stance.pose, *(step.pose for step in steps)]
        for index, step in enumerate(steps):
            if step.side is self.side and self._reaches(starts[index + 1], starts[index]):
                return index
        return None

    def _reaches(self, stance: Pose2D, start: Pose2D) -> bool:
        """Return whether the foot can swing through the ball and land, beside a stance foot and from a start."""
        p = self._parameters
        outward = 1.0 if self.side is Side.LEFT else -1.0
        contact, landing = stance.inverse() @ self._contact, stance.inverse() @ self._landing
        low, high = p.walking_kick_reach_back, p.walking_kick_reach_ahead
        run_up = (start.inverse() @ self._contact).x
        return (
            low <= contact.x <= high
            and landing.x <= self._reach.stride
            and p.min_foot_distance <= outward * contact.y <= p.walking_kick_reach_side
            and p.min_foot_distance <= outward * landing.y <= self._reach.farthest
            and abs(contact.yaw) <= p.max_walking_kick_direction
            and run_up >= p.walking_kick_run_up
            and all(
                gap_between(place, self._soles[self.side], stance, self._soles[self.side.other]) >= 0.0
                for place in (self._contact, self._landing)
            )
        )


class KickSwing:
    """Path of a swing foot that meets the ball at full speed on its way, then goes to its landing place."""

    def __init__(
        self,
        start: Pose2D,
        contact: Pose2D,
        speed: float,
        contact_time: float,
        duration: float,
        height: float,
        landing_speed: float,
    ) -> None:
        """Begin a swing.

        Args:
            start: Where the foot stands.
            contact: Its sole when it touches the ball; its yaw is the direction.
            speed: Of the foot at the contact [m/s].
            contact_time: From the beginning of the swing to the contact [s].
            duration: Time until it lands [s].
            height: Greatest height of the sole [m].
            landing_speed: Speed downwards when the ground has not come at the end [m/s].
        """
        yaw = start.yaw + wrap_angle(contact.yaw - start.yaw)
        velocity = np.array([speed * math.cos(yaw), speed * math.sin(yaw), 0.0, 0.0])
        end = np.array([contact.x, contact.y, 0.0, yaw])
        self._way_to_ball: Quintic | None = Quintic(FootMotion.resting(start), end, velocity, contact_time)
        self._track = SwingTrack(start)
        self._contact_time = contact_time
        self._duration = duration
        self._height = height
        self._landing_speed = landing_speed
        self._time = 0.0

    @property
    def place(self) -> tuple[float, float]:
        """(x, y) of the sole now, in odom [m]."""
        return self._track.place

    @property
    def phase(self) -> float:
        """Progress, 0 to 1."""
        return min(self._time / self._duration, 1.0)

    def give_up(self) -> None:
        """Go to the landing place from here, without regard to the ball."""
        self._way_to_ball = None

    def advance(self, target: Pose2D, remaining: float, dt: float) -> FootMotion:
        """Advance by dt [s] and return the foot's reference; the target counts from the contact on.

        Args:
            target: Where it lands.
            remaining: Time until then [s].
            dt: [s].
        """
        if self._way_to_ball is not None and self._time + dt <= self._contact_time:
            self._track.follow(self._way_to_ball.evaluate(self._time + dt))
        else:
            self._track.advance(target, remaining, dt)
        self._time += dt
        return self._track.at_height(*self._vertical())

    def _vertical(self) -> tuple[float, float, float]:
        """Return the sole's height now [m], its derivative and the second one."""
        late = self._time - self._duration
        if late > 0.0:
            return -self._landing_speed * late, -self._landing_speed, 0.0
        rate = 2.0 * math.pi / self._duration
        angle = rate * self._time
        half = 0.5 * self._height
        return half * (1.0 - math.cos(angle)), half * rate * math.sin(angle), half * rate**2 * math.cos(angle)
