"""Motion control as a node: sensors, walk commands and kicks in; leg commands, odometry and state out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from rclpy.action import ActionServer, CancelResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.task import Future

from tulip_description.emergency_stop import StopWord
from tulip_description.robot import load_robot
from tulip_motion.footsteps import Footstep
from tulip_motion.interface import KickGoal, KickKind, MotionMode, Side, WalkCommand, WalkMode, Whereabouts
from tulip_motion.messages import (
    body_transforms,
    footsteps_to_message,
    joint_command_to_message,
    motion_state_to_message,
    odometry_to_message,
    sensors_from_messages,
    walk_command_from_message,
)
from tulip_motion.motion import Motion
from tulip_motion.parameters import MotionParameters
from tulip_motion.saturation import Saturation
from tulip_msgs.action import Kick
from tulip_msgs.msg import WalkCommand as WalkCommandMessage
from tulip_ros import topics
from tulip_ros.emergency_stop import StopLink
from tulip_ros.errors import BadInputError
from tulip_ros.finding import Finding, Level
from tulip_ros.matching import SameStamp
from tulip_ros.run import ComponentNode, run
from tulip_ros.time import stamp_of

SLOW_TICKS = 5  # odometry and state go out at every fifth tick: 50 Hz is enough for all that listen
COMMAND_LIFE = 500_000_000  # [ns] a walking robot whose strategy is silent for longer stops


@dataclass
class _RunningKick:
    handle: ServerGoalHandle
    done: Future


class MotionNode(ComponentNode):
    """Turns messages into calls of motion control and its answers into messages."""

    def __init__(self) -> None:
        """Make the core and connect it."""
        super().__init__("motion")
        self._settings = self.load(MotionParameters())
        self._kick: _RunningKick | None = None
        kept = self.keepsake.read()
        self._before = Whereabouts(**kept) if kept else None
        self._emergency_stop = StopLink(self, "motion", self._on_emergency_stop)
        try:
            self._begin()
        except ValueError as error:  # a number that does not fit this robot's legs
            raise BadInputError(f"Parameters of node 'motion': {error}") from error
        self._legs = self.sender(topics.LEG_COMMAND)
        self._odometry = self.sender(topics.ODOMETRY)
        self._state = self.sender(topics.MOTION_STATE)
        self._footsteps = self.sender(topics.FOOTSTEPS)
        self._tf = self.sender(topics.TF)
        self.listen(topics.JOINT_STATES, lambda message: self._on_sensor("joint_states", message))
        self.listen(topics.IMU, lambda message: self._on_sensor("imu", message))
        self.listen(topics.FOOT_FORCES, lambda message: self._on_sensor("foot_forces", message))
        self.listen(topics.WALK_COMMAND, self._on_walk_command)
        self.health.check(self._joint_health)
        self.health.check(self._motion_health)
        self._kicks = ActionServer(
            self,
            topics.KICK.type,
            topics.KICK.name,
            self._execute_kick,
            cancel_callback=self._on_cancel,
        )

    def begin_anew(self) -> None:
        """Make the core; a kick that was under way has failed."""
        self._motion.save_learning()
        self._begin()
        if self._kick is not None:
            self._kick.done.set_result((False, "time began anew during the kick"))
            self._kick = None

    def _begin(self) -> None:
        """Make the core, and forget sensors and commands of before."""
        self._footsteps_told: tuple[Footstep, ...] | None = None
        self._notes: dict[str, str] = {}  # kind and words of the notes in the last report
        self._saturation = Saturation(load_robot())
        self._motion = Motion(self._settings, load_robot())
        self._sensors = SameStamp("joint_states", "imu", "foot_forces")
        self._tick = 0
        self._walking_until = 0
        if self._emergency_stop.engaged:  # that time began anew is no release
            self._on_emergency_stop(self._emergency_stop.word)

    def destroy_node(self) -> None:
        """Keep what was learned, and end."""
        self._motion.save_learning()
        super().destroy_node()

    def _on_sensor(self, name: str, message: Any) -> None:
        """Answer the sensors once all three messages of an instant are here."""
        complete = self._sensors.add(name, stamp_of(message), message)
        if complete is None:
            return
        try:
            sensors = sensors_from_messages(*complete)
        except ValueError as error:
            self.health.count("refused sensors", str(error))
            return
        if self._before is not None:  # motion control has died, and goes on in its odom, unless time began anew
            if sensors.stamp >= self._before.stamp:
                self._motion.continue_from(self._before, sensors.stamp)
            self._before = None
        if self._walking_until and sensors.stamp > self._walking_until:
            self.health.count("walk command too old", "strategy is silent: the robot stops walking")
            self._motion.command(WalkCommand(sensors.stamp, WalkMode.STAND))
            self._walking_until = 0
        self._legs.publish(joint_command_to_message(self._motion.tick(sensors)))
        self._tick += 1
        if self._tick % SLOW_TICKS == 0:
            self._saturation.add(sensors.joint_efforts)
            self._report()

    def _report(self) -> None:
        """Send odometry and state, and count each new kind of note."""
        odometry, state = self._motion.odometry(), self._motion.state()
        self._odometry.publish(odometry_to_message(odometry))
        self._tf.publish(body_transforms(odometry))
        self._state.publish(motion_state_to_message(state, odometry.distance))
        self.keepsake.keep(self._motion.whereabouts()._asdict())
        footsteps = self._motion.footsteps
        if footsteps != self._footsteps_told:
            self._footsteps_told = footsteps
            self._footsteps.publish(footsteps_to_message(footsteps, state.stamp))
        notes = {note.partition(":")[0]: note for note in state.notes}
        for kind in notes.keys() - self._notes.keys():
            self.health.count(kind, notes[kind])  # "walk command clipped", once for as long as it lasts
        self._notes = notes
        if state.mode is MotionMode.STAND:
            self._motion.save_learning()
        progress = self._motion.kick_progress
        if self._kick is None or progress is None:
            return
        if progress.running:
            self._kick.handle.publish_feedback(Kick.Feedback(phase=progress.phase))
        else:
            self._kick.done.set_result((not progress.reason, progress.reason))
            self._kick = None

    def _joint_health(self) -> Finding | None:
        """Tell which joints had no more torque to give in the last second."""
        shares = sorted(self._saturation.take().items(), key=lambda entry: -entry[1])
        if not shares:
            return None
        joints = ", ".join(f"{name} {share:.0%}" for name, share in shares)
        return Finding(
            Level.WARNING,
            f"joints at their torque limit for a share of the last second ({joints}): walk slower, or free the robot",
        )

    def _motion_health(self) -> Finding | None:
        """Tell what motion control notes for as long as it lasts, as a clipped walk command."""
        if self._motion.broken:
            return Finding(Level.ERROR, f"{self._motion.broken}: have it mended, then start this node again")
        return Finding(Level.WARNING, "; ".join(self._notes.values())) if self._notes else None

    def _on_cancel(self, handle: ServerGoalHandle) -> CancelResponse:
        """Give the running kick up; its result comes when the robot stands or walks on."""
        running = self._kick is not None and self._kick.handle.goal_id == handle.goal_id
        refusal = self._motion.cancel_kick() if running else "this kick is not under way"
        if refusal:
            self.health.count("refused cancel", f"cancel refused: {refusal}")
        return CancelResponse.REJECT if refusal else CancelResponse.ACCEPT

    def _on_walk_command(self, message: WalkCommandMessage) -> None:
        try:
            command = walk_command_from_message(message)
            self._motion.command(command)
        except ValueError as error:
            self.health.count("refused walk command", f"walk command refused: {error}")
            return
        self._walking_until = command.stamp + COMMAND_LIFE if command.mode is WalkMode.WALK else 0

    def _on_emergency_stop(self, word: StopWord) -> None:
        if word.engaged:
            self._motion.stop(str(word))
        else:
            self._motion.release()

    async def _execute_kick(self, handle: ServerGoalHandle) -> Kick.Result:
        """Kick, or refuse: a goal is always accepted first, since only a result can carry the reason."""
        wish = handle.request
        if wish.side not in (Kick.Goal.LEFT, Kick.Goal.RIGHT):
            refusal = f"side is {wish.side}; expected 0 (left) or 1 (right)"
        elif wish.kind not in (Kick.Goal.FORWARD, Kick.Goal.SIDE, Kick.Goal.WALKING):
            refusal = f"kind is {wish.kind}; expected 0 (forward), 1 (side) or 2 (walking)"
        else:
            ball = (float(wish.ball[0]), float(wish.ball[1])) if wish.has_ball else None
            goal = KickGoal(Side(wish.side), wish.direction, wish.speed, KickKind(wish.kind), ball)
            refusal = self._motion.start_kick(goal)
        if refusal:
            self.health.count("refused kick", f"kick refused: {refusal}")
            success, reason = False, refusal
        else:
            self._kick = _RunningKick(handle, Future())
            success, reason = await self._kick.done
        if handle.is_cancel_requested:
            success = False
            handle.canceled()
        elif success:
            handle.succeed()
        else:
            handle.abort()
        return Kick.Result(success=success, reason=reason)


def main() -> None:
    """Run the node."""
    run(MotionNode)


if __name__ == "__main__":
    main()
