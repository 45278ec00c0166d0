"""Motion control: from sensors and commands to joint commands, one tick at a time."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tulip_description.body_file import read_body
from tulip_description.model import floating_model
from tulip_description.planar import Pose2D
from tulip_description.robot import HEAD_JOINTS, LEG_JOINTS, Robot
from tulip_description.robot_io import JointCommand, Sensors
from tulip_motion.course import Wish, is_at, middle
from tulip_motion.fall_detection import FallDetector
from tulip_motion.footing import Footing
from tulip_motion.footsteps import Footstep
from tulip_motion.gait import FootMotion, Reference
from tulip_motion.interface import (
    KickGoal,
    KickKind,
    KickProgress,
    MotionMode,
    MotionState,
    Odometry,
    Side,
    Support,
    WalkCommand,
    WalkMode,
    Whereabouts,
)
from tulip_motion.kick import Kick, moved
from tulip_motion.kick_plan import expected_ball, plan_kick, refused_numbers
from tulip_motion.paper_gait import PaperGait
from tulip_motion.parameters import MotionParameters
from tulip_motion.reach import reach
from tulip_motion.sensor_check import SensorCheck
from tulip_motion.stabilizer import Balance, SupportArea, stabilize
from tulip_motion.state_estimator import Estimate, StateEstimator, centre_of_pressure
from tulip_motion.tracking import Order, StepInProgress, Tracking
from tulip_motion.walking import Walking, must_step
from tulip_motion.walking_kick import WalkingKick

Array = NDArray[np.float64]
NOT_KNOWN = 100  # commands that may have been sent since somebody was told the number of one


def with_fixed_head(robot: Robot) -> Robot:
    """Return the robot with its head joints fixed at zero, so that its model moves in the legs alone."""
    fixed = (0.0, 0.0, 0.0)
    joints = (replace(joint, axis=fixed) if joint.name in HEAD_JOINTS else joint for joint in robot.joints)
    return replace(robot, joints=tuple(joints))


class Motion:
    """Stands, walks, kicks, and goes limp when the robot falls."""

    def __init__(self, parameters: MotionParameters, robot: Robot) -> None:
        """Make motion control for a robot. It stands when the first sensors come in.

        Args:
            parameters: Of motion control; with `body_file` the robot has the body that was identified.
            robot: As its file has it.

        Raises:
            ValueError: if a parameter does not fit this robot, or the body file cannot be used.
        """
        p = self._parameters = parameters
        if p.body_file:
            robot = read_body(Path(p.body_file)).on(robot)
        # The head is light and near its axes: the legs are controlled as if it looked straight ahead.
        model = floating_model(with_fixed_head(robot))
        self._estimator = StateEstimator(p, model, np.array([foot.cells for foot in robot.feet]))
        self._tracking = Tracking(p, model, robot)
        self._soles = robot.feet
        self._reach = reach(p, robot)
        self._command = WalkCommand(0, WalkMode.STAND)
        self._stopped = ""  # why an emergency stop holds
        self._mode = MotionMode.STAND
        self._reason = ""
        self._gait: Walking | PaperGait | Kick | None = None
        self._kick: Kick | WalkingKick | None = None
        self._steps_before = 0
        self._started = False
        self._sequence = 0
        self._stamp = 0
        self._left_weight = 0.5
        self._footing = Footing(p, self._estimator, robot.feet)
        self._falls = FallDetector(p)
        self._sensor_check = SensorCheck(p)
        self._broken = ""  # why the sensors cannot be used, in words
        self._area: SupportArea | None = None

    @property
    def mode(self) -> MotionMode:
        """What the legs do at present."""
        return self._mode

    def command(self, command: WalkCommand) -> None:
        """Take a new command; it holds until the next.

        Raises:
            ValueError: if a velocity or goal is not finite, or the gait cannot go to goals.
        """
        if not all(math.isfinite(value) for value in command.velocity):
            raise ValueError(f"walk velocity is {command.velocity}; expected finite numbers")
        if command.mode is WalkMode.GO and self._parameters.gait == "paper":
            raise ValueError("walk mode is GO; the paper's gait takes velocities only: choose gait dcm or mode WALK")
        goal = (command.goal.x, command.goal.y, command.goal.yaw)
        if not all(math.isfinite(value) for value in goal):
            raise ValueError(f"walk goal is {goal}; expected finite numbers")
        if not self._stopped:
            self._command = command

    def stop(self, reason: str) -> None:
        """Be limp from the next tick on, whatever is commanded, until `release`.

        Args:
            reason: In words, not empty.
        """
        self._stopped = reason
        self._command = WalkCommand(self._stamp, WalkMode.LIMP)

    def release(self) -> None:
        """Take commands again; the legs stay limp until one says otherwise."""
        self._stopped = ""

    @property
    def stance(self) -> Side:
        """The foot that all tasks are relative to."""
        return self._reference.stance.side

    @property
    def notes(self) -> tuple[str, ...]:
        """What somebody should know, in words: a command that was clipped, a posture that could not be reached."""
        if self._mode in (MotionMode.LIMP, MotionMode.FALLEN):
            return ()
        gait = self._gait.notes if isinstance(self._gait, Walking | PaperGait) else ()
        dead = self._sensor_check.dead_cells
        cells = (f"force cell dead: {', '.join(dead)}",) if dead else ()
        return (*gait, *self._tracking.notes, *cells)

    @property
    def broken(self) -> str:
        """Why the robot cannot be controlled by its sensors, in words; "" as long as it can."""
        return self._broken

    @property
    def footsteps(self) -> tuple[Footstep, ...]:
        """The next footsteps of the default gait, in odom; none while the robot stands, kicks or lies."""
        return self._gait.footsteps if isinstance(self._gait, Walking) else ()

    def start_kick(self, goal: KickGoal) -> str:
        """Begin a kick; return "" or the reason why not."""
        if self._stopped:
            return self._stopped
        if self._kick is not None and not self._kick.finished:
            return "another kick is under way"
        if goal.kind is KickKind.WALKING:
            return self._start_walking_kick(goal)
        if self._mode is not MotionMode.STAND or not self._started:
            return f"motion is in mode {self._mode.name}; a {goal.kind.name.lower()} kick starts from STAND"
        p, feet, base = self._parameters, self._footing.feet, self._estimate.base_footprint
        plan = plan_kick(p, goal, self._footing.feet_beside(base), self._soles)
        if isinstance(plan, str):
            return plan
        moves = [moved(move, base) for move in plan]
        self._gait = self._kick = Kick(p, moves, feet, feet[goal.side], self._footing.middle)
        self._mode = MotionMode.KICK
        return ""

    def expected_ball(self, kind: KickKind, side: Side) -> tuple[float, float]:
        """Return where a kick from standing expects the ball, as the feet stand: (x, y) in base_footprint [m]."""
        feet = self._footing.feet_beside(self._estimate.base_footprint)
        return expected_ball(self._parameters, kind, side, feet, self._soles)

    def cancel_kick(self) -> str:
        """Give the running kick up as its phase allows; return "" or the reason why not."""
        if self._kick is None or self._kick.finished:
            return "no kick is under way"
        self._kick.cancel("cancelled on request")
        return ""

    @property
    def kick_progress(self) -> KickProgress | None:
        """How far the last kick that was started has come; None before the first."""
        kick = self._kick
        return None if kick is None else KickProgress(not kick.finished, kick.phase, kick.reason)

    def _start_walking_kick(self, goal: KickGoal) -> str:
        """Leave a kick to one of the next steps of the walk; return "" or the reason why not."""
        p = self._parameters
        if self._mode is not MotionMode.WALK or not isinstance(self._gait, Walking):
            return f"motion is in mode {self._mode.name}; a walking kick starts from WALK"
        if goal.ball is None:
            return "no place of the ball is given; a walking kick needs it to find the step that reaches it"
        refusal = refused_numbers(goal, p.max_walking_kick_speed, 0.0, p.max_walking_kick_direction)
        if refusal:
            return refusal
        base = self._estimate.base_footprint
        ball, direction = base.transform(goal.ball), base.yaw + goal.direction
        kick = WalkingKick(p, self._reach, goal.side, ball, direction, goal.speed, self._soles)
        refusal = self._gait.kick_next(kick)
        if not refusal:
            self._kick = kick
        return refusal

    def tick(self, sensors: Sensors) -> JointCommand:
        """Return the command for the legs that answers one reading of the sensors."""
        self._stamp = sensors.stamp
        self._broken = self._sensor_check.update(sensors)
        estimate = self._estimate = self._estimator.update(sensors, self._left_weight, self._tracking.com_acceleration)
        self._follow(estimate, sensors)
        if not self._started:
            self._start(estimate)
        self._change_mode(estimate)
        if self._mode in (MotionMode.LIMP, MotionMode.FALLEN):
            if self._kick is not None:
                self._kick.abandon(self._reason)
            return self._send(self._tracking.limp(estimate))
        reference = self._reference = self._advance_gait(estimate)
        balance = self._balance = self._stabilize(estimate, reference)
        self._left_weight = 1.0 - balance.right_share
        step = None
        if isinstance(self._gait, Walking):
            steady = self._command.mode is WalkMode.WALK
            step = StepInProgress(self._gait.step_count, self._gait.course.velocity if steady else None)
        return self._send(self._tracking.advance(estimate, reference, balance, step))

    def odometry(self) -> Odometry:
        """Return dead reckoning as of the last tick."""
        return self._footing.odometry(self._estimate, self._stamp, self._mode is MotionMode.FALLEN)

    def state(self) -> MotionState:
        """Return the state of the legs as of the last tick."""
        estimate, tracking = self._estimate, self._tracking
        walking = self._mode not in (MotionMode.LIMP, MotionMode.FALLEN)
        reference = self._reference if walking else None
        planned = np.array(reference.dcm) if reference else np.full(2, np.nan)
        return MotionState(
            self._stamp,
            self._mode,
            reference.support if reference else Support.NONE,
            reference.phase if reference else 0.0,
            self._steps_before + self._steps_of_gait,
            estimate.com,
            tracking.com_planned if reference else np.full(3, np.nan),
            estimate.com_velocity,
            tracking.com_velocity_planned if reference else np.full(3, np.nan),
            np.array(estimate.dcm),
            planned,
            centre_of_pressure(estimate, self._parameters.contact_force),
            np.array(self._balance.zmp) if reference else np.full(2, np.nan),
            np.array([sole.transform for sole in estimate.soles]),
            estimate.joint_positions,
            tracking.joint_positions,
            estimate.joint_velocities,
            tracking.joint_velocities,
            tracking.torques[0].copy(),
            tracking.torques[1].copy(),
            tracking.torques[2].copy(),
            reason=self._reason,
            notes=self.notes,
        )

    def whereabouts(self) -> Whereabouts:
        """Return what `continue_from` takes, as of the last tick."""
        return self._footing.whereabouts(self._stamp, self._sequence)

    def continue_from(self, before: Whereabouts, stamp: int) -> None:
        """Go on at a stamp [ns] in the odom of motion control that has died; call before the first tick."""
        self._sequence = before.sequence + NOT_KNOWN  # else the driver would wait until the last command is too old
        self._footing.continue_from(before, stamp)

    def save_learning(self) -> None:
        """Write what was learned since the last time to `learning_file`, if there is one."""
        self._tracking.save_learning()

    @property
    def _steps_of_gait(self) -> int:
        """How many steps the walk that is under way has begun."""
        return self._gait.step_count if isinstance(self._gait, Walking | PaperGait) else 0

    def _follow(self, estimate: Estimate, sensors: Sensors) -> None:
        """Follow feet and body over the ground."""
        upright = self._started and self._mode not in (MotionMode.LIMP, MotionMode.FALLEN)
        acceleration = self._tracking.com_acceleration if upright else None
        self._footing.update(estimate, sensors, self._left_weight, acceleration, isinstance(self._gait, Walking))
        if self._gait is None:
            self._footing.move_feet_along()

    def _start(self, estimate: Estimate) -> None:
        """Begin to stand where the robot is, if it stands: motion control may have been restarted during a fall."""
        self._tracking.reset(estimate)
        self._left_weight = 0.5
        self._footing.begin(self._stamp)
        self._started = True
        p = self._parameters
        if estimate.tilt > p.upright_tilt or _height(estimate) < p.upright_height:
            self._fall(f"was found leaning by {math.degrees(estimate.tilt):.0f} deg, {_height(estimate):.2f} m high")

    def _change_mode(self, estimate: Estimate) -> None:
        """Go over to another mode if command or body ask for it.

        A robot that lies, or is limp, stands again when it is upright, its sensors work and nobody wants it limp. Of
        one that is up, broken sensors and a fall count most, then limpness on request, then the end of a walk or kick,
        then the wish to walk.
        """
        p, wanted = self._parameters, self._command.mode
        if self._mode is MotionMode.FALLEN or self._mode is MotionMode.LIMP:
            if self._mode is MotionMode.LIMP and estimate.tilt > p.fall_tilt:
                self._fall(f"{self._reason}; then it fell")
            elif not self._broken and self._may_stand(estimate) and wanted is not WalkMode.LIMP:
                self._steps_before += self._steps_of_gait
                self._footing.move_feet_along()
                self._estimator.restart()
                self._mode, self._reason, self._gait, self._started = MotionMode.STAND, "", None, False
            return
        left, right = estimate.soles
        places = (left.position, right.position)
        fall = self._falls.is_falling(estimate.base_rotation, estimate.angular_velocity, estimate.dcm, places)
        if self._broken or fall:
            self._fall(self._broken or fall)
        elif wanted is WalkMode.LIMP:
            self._mode, self._reason = MotionMode.LIMP, self._stopped or "limp on request"
        elif self._gait is not None and self._gait.finished:
            self._steps_before += self._steps_of_gait
            if isinstance(self._gait, Walking) and self._gait.kick is not None:
                self._gait.kick.abandon("the walk has ended")
            self._gait = None
            self._mode = MotionMode.STAND
        elif self._mode is MotionMode.STAND and self._wants_to_step(estimate):
            if p.gait == "paper":
                self._gait = PaperGait(p, self._footing.feet, self._footing.middle)
            else:
                self._gait = Walking(p, self._reach, self._soles, self._footing.feet, self._footing.middle)
            self._mode = MotionMode.WALK

    def _wants_to_step(self, estimate: Estimate) -> bool:
        """Return whether a standing robot begins to walk: when told to, or when it would fall otherwise."""
        p, wish = self._parameters, self._wish()
        if isinstance(wish, Pose2D):
            away = not is_at(wish, middle(self._footing.feet, p.stance_width), p.goal_tolerance, p.goal_tolerance_yaw)
        else:
            away = wish is not None
        # One that has just been put down bounces; what it does in the air is no reason.
        stands = sum(estimate.loads) > 2.0 * p.contact_force
        return away or (stands and p.gait == "dcm" and must_step(p, self._footing.feet, estimate.dcm))

    def _wish(self) -> Wish:
        """Return what the present command asks of the walk."""
        command = self._command
        if command.mode is WalkMode.GO:
            # The feet follow the slips that odometry has seen only when one lands.
            goal, (x, y) = command.goal, self._footing.shift
            return Pose2D(goal.x - x, goal.y - y, goal.yaw)
        return command.velocity if command.mode is WalkMode.WALK else None

    def _fall(self, reason: str) -> None:
        """Go limp; how far the body rolls from now on the odometry cannot know."""
        self._mode, self._reason = MotionMode.FALLEN, reason
        self._footing.fall()

    def _may_stand(self, estimate: Estimate) -> bool:
        """Return whether the body is such that stiff legs would hold it; one that fell has to be set upright first."""
        p = self._parameters
        if self._mode is MotionMode.LIMP:
            return estimate.tilt < p.upright_tilt and min(estimate.loads) > p.contact_force
        return self._falls.is_upright(
            estimate.base_rotation, estimate.angular_velocity, _height(estimate), estimate.loads
        )

    def _advance_gait(self, estimate: Estimate) -> Reference:
        """Return what walk or kick want now, or standing where the feet are, and keep the feet that they put down."""
        dt, gait = self._parameters.control_period, self._gait
        if gait is not None:
            before = gait.feet
            if isinstance(gait, Kick):
                reference = gait.tick(dt, estimate.sole_pose, estimate.loads)
            else:
                reference = gait.tick(dt, self._wish(), estimate.dcm, estimate.sole_pose, estimate.loads)
            if isinstance(gait, Walking):
                gait.feet = self._footing.carried(before, gait.feet, estimate)
            self._footing.put(gait.feet, self._stamp)
            return reference
        left, right = self._footing.feet
        middle = self._footing.middle
        return Reference(
            Support.DOUBLE,
            left,
            FootMotion.resting(right.pose),
            middle,
            middle,
            left.pose.yaw + 0.5 * math.remainder(right.pose.yaw - left.pose.yaw, 2.0 * math.pi),
            0.0,
            0.0,
        )

    def _stabilize(self, estimate: Estimate, reference: Reference) -> Balance:
        """Return ZMP and CMP that bring the measured DCM back to the planned one, within what the body can do."""
        # In open loop nothing is corrected: the plan's own DCM leaves the plan's ZMP.
        dcm = estimate.dcm if reference.com is None else reference.dcm
        stance, other = reference.stance, reference.other_standing
        area = self._area
        # A foot that stands alone is the same all through a step.
        if area is None or area.stance is not stance or area.way is not None or other is not None:
            area = self._area = SupportArea.of(self._parameters, stance, other)
        return stabilize(area, reference.zmp, reference.dcm, dcm)

    def _send(self, order: Order) -> JointCommand:
        """Number an order of the joints, and stamp it with the time of the sensors that it answers."""
        self._sequence += 1
        return JointCommand(
            self._sequence, self._stamp, LEG_JOINTS, order.position, order.velocity, order.effort, *order.gains
        )


def _height(estimate: Estimate) -> float:
    """Return the height of base_link above the lower sole [m]."""
    return float(estimate.base_position[2]) - min(sole.position[2] for sole in estimate.soles)
