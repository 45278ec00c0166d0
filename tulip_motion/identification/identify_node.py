"""The identification experiment as a node, in place of motion and head: sensors in, commands for all joints out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from std_srvs.srv import Trigger

from tulip_description.emergency_stop import StopWord
from tulip_motion.identification.experiment import Experiment
from tulip_motion.identification.experiment_plan import FootPlan, make_plan
from tulip_motion.identification.experiment_settings import ExperimentSettings
from tulip_motion.messages import joint_command_to_message, progress_to_message, sensors_from_messages
from tulip_msgs.msg import UserCommand
from tulip_ros import topics
from tulip_ros.emergency_stop import StopLink
from tulip_ros.errors import BadInputError
from tulip_ros.matching import SameStamp
from tulip_ros.run import ComponentNode, run
from tulip_ros.time import stamp_of

REPORT_TICKS = 25  # progress goes out at 10 Hz
TOLD_LIMP = "the user wants the robot limp"


class IdentifyNode(ComponentNode):
    """Turns messages into calls of the experiment and its answers into messages."""

    def __init__(self) -> None:
        """Plan, which takes some seconds, and connect."""
        super().__init__("identify")
        p = self._settings = self.load(ExperimentSettings())
        self._told_limp = False
        self._emergency_stop = StopLink(self, "identify", self._on_emergency_stop)
        try:
            self._robot = p.robot
            self._plans = make_plan(self._robot, p.plan, p.posture)
            self.begin_anew()
        except ValueError as error:
            raise BadInputError(f"Parameters of node 'identify': {error}") from error
        self._joints = self.sender(topics.LEG_COMMAND)
        self._progress = self.sender(topics.IDENTIFICATION)
        self.listen(topics.JOINT_STATES, lambda message: self._on_sensor("joint_states", message))
        self.listen(topics.IMU, lambda message: self._on_sensor("imu", message))
        self.listen(topics.FOOT_FORCES, lambda message: self._on_sensor("foot_forces", message))
        self.listen(topics.USER_COMMAND, self._on_user_command)
        for service, answer in (
            (topics.BEGIN_IDENTIFICATION, self._on_begin),
            (topics.ABORT_IDENTIFICATION, self._on_abort),
        ):
            self.create_service(service.type, service.name, answer)

    def begin_anew(self) -> None:
        """Make the core, and forget the sensors of before."""
        self._experiment = self._make_experiment(self._plans if self._settings.at_once else ())
        self._sensors = SameStamp("joint_states", "imu", "foot_forces")
        self._tick = 0

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
        before = self._experiment.reason
        self._joints.publish(joint_command_to_message(self._experiment.tick(sensors)))
        if self._experiment.reason != before:
            self.health.count("aborted", f"experiment aborted: {self._experiment.reason}")
        self._tick += 1
        if self._tick % REPORT_TICKS == 0:
            self._progress.publish(progress_to_message(self._experiment.progress))

    def _on_user_command(self, message: UserCommand) -> None:
        self._told_limp = message.request == UserCommand.LIMP
        if self._told_limp:
            self._experiment.go_limp(TOLD_LIMP)

    def _on_emergency_stop(self, word: StopWord) -> None:
        if word.engaged:
            if self._experiment.reason == TOLD_LIMP:  # at a stop node user_input wishes so, too, and was quicker
                self._experiment.reason = str(word)
            self._experiment.go_limp(str(word))

    def _make_experiment(self, plans: Sequence[FootPlan]) -> Experiment:
        """Return an experiment; without plans, one that only stands."""
        experiment = Experiment(self._robot, plans, self._settings.experiment)
        if self._emergency_stop.engaged:
            experiment.go_limp(str(self._emergency_stop.word))
        if self._told_limp:
            experiment.go_limp(TOLD_LIMP)
        return experiment

    def _on_begin(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        if self._emergency_stop.engaged:
            response.message = f"{self._emergency_stop.word}; release it first"
        elif self._told_limp:
            response.message = "the user's last wish is limp: wish for something else first"
        elif self._experiment.is_limp:
            response.message = "the robot is limp: set it upright, and start node identify again"
        elif self._experiment.progress.postures and not self._experiment.finished:
            response.message = "the experiment is under way"
        else:
            self._experiment = self._make_experiment(self._plans)
            response.success = True
        return response

    def _on_abort(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        experiment = self._experiment
        if experiment.finished or experiment.reason:
            response.message = f"the experiment has ended or ends: {experiment.reason or 'all postures were held'}"
        else:
            experiment.abort("on request")
            response.success = True
        return response


def main() -> None:
    """Run the node."""
    run(IdentifyNode)


if __name__ == "__main__":
    main()
