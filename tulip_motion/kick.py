"""A kick from standing: shift the weight, swing through the ball, stand again; or give it up on the way."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from tulip_description.planar import Pose2D, wrap_angle
from tulip_motion.footsteps import Footstep
from tulip_motion.gait import FootMotion, Reference, between_soles, sole_point, support_on
from tulip_motion.interface import Side, Support
from tulip_motion.kick_path import FootPath, Move, brake
from tulip_motion.lipm import DcmPlan, time_constant
from tulip_motion.parameters import MotionParameters


class Kick:
    """Shifts onto the other foot, swings the kicking foot back and through the ball, and stands again.

    Two things keep the swing on its line although the carpet holds the stance foot only by friction. The torso turns
    against the swinging leg, so that less of the leg's angular momentum has to come from the ground; and what the
    stance foot turns nevertheless is measured by the IMU, and taken out of the swing.
    """

    def __init__(
        self,
        parameters: MotionParameters,
        moves: Sequence[Move],
        feet: tuple[Footstep, Footstep],
        kicking: Footstep,
        zmp: tuple[float, float],
    ) -> None:
        """Begin from double support.

        Args:
            parameters: Of motion control.
            moves: Of the kicking foot, in odom: lift, run-up, follow-through, return, lowering.
            feet: Left and right foot as they stand.
            kicking: The foot that kicks, one of them.
            zmp: Where the ZMP is now, in odom [m].
        """
        p = self._parameters = parameters
        self._time_constant = time_constant(p.com_height)
        self.side = kicking.side
        self._feet = [feet[0], feet[1]]
        self._stance = feet[self.side.other]
        self._start = kicking.pose
        self._moves = tuple(moves)
        self._path = FootPath(moves, p.landing_speed)
        self.finished = False
        self.reason = ""
        """Why the kick was given up, or ""."""
        self._time = 0.0
        self._air_time = 0.0
        """[s] on the present path."""
        self._down_at: float | None = None
        self._heading = self._stance.pose.yaw
        self._torso_yaw = self._heading + 0.5 * wrap_angle(self._start.yaw - self._heading)
        self._measured_yaw = self._heading
        aim = sole_point(self._stance, p.zmp_forward, p.kick_zmp_inward)
        # The DCM has to be over the foot, at rest, when the foot lifts: end the plan there.
        self._plan = DcmPlan([0.0, p.kick_shift_time], [zmp, aim], self._time_constant)
        self._total = p.kick_shift_time + self._path.duration + p.stop_shift_time

    @property
    def feet(self) -> tuple[Footstep, Footstep]:
        """Left and right foot as they stand now."""
        return self._feet[0], self._feet[1]

    @property
    def _in_air(self) -> bool:
        return self._time >= self._parameters.kick_shift_time and self._down_at is None

    def cancel(self, reason: str) -> None:
        """Give the kick up: stand at once if the foot is down still, else brake it, take it back and put it down.

        A foot that has met the ball goes on as planned: it slows down and comes back.
        """
        if self.finished or self.reason:
            return
        self.reason = reason
        if self._down_at is not None:
            return
        if not self._in_air:
            self._begin_to_stand()
            return
        lift, run_up, follow, back, lower = self._moves
        if self._air_time >= lift.duration + run_up.duration:
            return
        p = self._parameters
        foot, time = self._path.evaluate(self._air_time), p.kick_brake_time
        if self._air_time > lift.duration:
            # No farther than the follow-through would lead: beyond it the leg is too long and the robot falls.
            left = float(np.linalg.norm(follow.end[:3] - foot.position))
            time = min(time, 2.0 * left / max(float(np.linalg.norm(foot.velocity)), 1e-6))
        stop = brake(foot, time)
        self._path = FootPath((stop, replace(back, start=stop.end), lower), p.landing_speed)
        self._air_time = 0.0

    def abandon(self, reason: str) -> None:
        """End the kick because the robot has fallen or has gone limp."""
        if not self.finished:
            self.finished, self.reason = True, self.reason or reason

    @property
    def phase(self) -> float:
        """Progress, 0 to 1."""
        return 1.0 if self.finished else min(self._time / self._total, 1.0)

    def tick(self, dt: float, sole: Callable[[Side], Pose2D], loads: tuple[float, float]) -> Reference:
        """Advance by one tick.

        Args:
            dt: [s].
            sole: Says where a sole is now, as measured, in odom.
            loads: Vertical force on the left and right sole [N].
        """
        p = self._parameters
        self._time += dt
        if self._in_air:
            self._air_time += dt
            left = self._path.duration - self._air_time
            lowering = left < p.kick_lower_time * (1.0 - p.contact_phase)
            late = left < -2.0 * p.late_contact_time
            if lowering and (loads[self.side] > p.contact_force or late):
                self._feet = [Footstep(foot.side, sole(foot.side)) for foot in self._feet]
                self._stance = self._feet[self.side.other]
                self._begin_to_stand()
        elapsed = self._time - (self._down_at or 0.0)
        zmp, dcm = self._plan.evaluate(elapsed)
        if self._down_at is not None:
            self.finished = elapsed > p.stop_shift_time
        if not self._in_air:
            foot = FootMotion.resting(self._feet[self.side].pose)
            yaw = self._stance.pose.yaw + 0.5 * wrap_angle(foot.yaw - self._stance.pose.yaw)
            return Reference(Support.DOUBLE, self._stance, foot, zmp, dcm, yaw, 0.0, self.phase, torso_held=True)
        foot = self._path.evaluate(self._air_time)
        stance = self._turned_stance(sole(self._stance.side).yaw, dt)
        rate, acceleration = self._turn_torso(foot, dt)
        return Reference(
            support_on(stance.side),
            stance,
            foot,
            zmp,
            dcm,
            self._torso_yaw,
            rate,
            self.phase,
            torso_yaw_acceleration=acceleration,
            torso_held=True,
        )

    def _turned_stance(self, measured_yaw: float, dt: float) -> Footstep:
        """Return the stance foot with the yaw that it has slipped to, smoothed."""
        share = min(dt / self._parameters.kick_slip_time, 1.0)
        self._measured_yaw += share * wrap_angle(measured_yaw - self._measured_yaw)
        pose = self._stance.pose
        return Footstep(self._stance.side, Pose2D(pose.x, pose.y, self._measured_yaw))

    def _turn_torso(self, foot: FootMotion, dt: float) -> tuple[float, float]:
        """Turn the torso against the foot's motion about the stance foot; return its rate and acceleration."""
        gain = -self._parameters.kick_torso_turn
        x, y = foot.position[0] - self._stance.pose.x, foot.position[1] - self._stance.pose.y
        rate = gain * (x * foot.velocity[1] - y * foot.velocity[0])
        self._torso_yaw += dt * rate
        return rate, gain * (x * foot.acceleration[1] - y * foot.acceleration[0])

    def _begin_to_stand(self) -> None:
        """Bring the ZMP from where it is now back between the feet."""
        p = self._parameters
        zmp, _ = self._plan.evaluate(self._time)
        self._down_at = self._time
        middle = between_soles(self.feet, p.zmp_forward, p.zmp_inward)
        self._plan = DcmPlan([0.0, p.stop_shift_time], [zmp, middle], self._time_constant)


def moved(move: Move, base: Pose2D) -> Move:
    """Return a move given in base_footprint as one in odom, where base_footprint is at `base`."""

    def four(
        point: np.ndarray[tuple[int, ...], np.dtype[np.float64]],
    ) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
        x, y = base.transform(point[:2])
        return np.array([x, y, point[2], point[3] + base.yaw])

    return replace(move, start=four(move.start), end=four(move.end))
