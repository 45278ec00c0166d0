"""The driver node: anybody's body on topics, with the guard around it.

python3 scripts/launch.py --driver my_package.my_robot:MyRobot
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NoReturn

import numpy as np
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import BatteryState
from std_msgs.msg import String

from tulip_description.emergency_stop import StopWord
from tulip_description.robot import load_robot
from tulip_description.robot_io import Battery, Sensors
from tulip_description.urdf import build_urdf
from tulip_driver.body_clock import host_clock
from tulip_driver.contract import PERIOD, BodyError
from tulip_driver.findings import condition, silent_joints
from tulip_driver.guard import GuardParameters
from tulip_driver.loading import flag, make_body, read_options
from tulip_driver.loop import BodyLoop
from tulip_motion.messages import joint_command_from_message, sensors_to_messages
from tulip_msgs.msg import JointCommand as JointCommandMessage
from tulip_ros import topics
from tulip_ros.emergency_stop import StopLink
from tulip_ros.errors import BadInputError
from tulip_ros.finding import Finding, Level
from tulip_ros.run import ComponentNode, run
from tulip_ros.time import header, to_message

CLOCKS = ("host", "body")
SILENCE = 0.1  # [s] of wall-clock time without a new reading after which somebody is told
SLOW_TICKS, SECOND_TICKS = 5, 250  # readings between two messages of /clock, and of the battery
TOLD = 0.2  # [s] at most until everybody knows of a body that is lost
SHARE = 0.75  # of PERIOD that a body with a clock of its own waits for the answer to its last reading
AT_ONCE = 4  # messages that are handled in a tick though the answer is in: no sender shall wait for long
LISTENING = 1.0  # [s] at the start without commands, in which an emergency stop that holds gets known: 0.8 s measured

Spin = Callable[[float], None]
"""Waits up to so many seconds [s] for messages and handles them."""


@dataclass(frozen=True)
class BodyNodeParameters:
    """Which body, and what guards it."""

    body: str = "tulip_driver.echo:EchoBody"  # package.module:Class
    options: tuple[str, ...] = ()  # for the class, each name=value
    # "host": readings are stamped with this computer's time, as on a robot. "body": the body's own clock is that of the
    # whole graph, sent as /clock; for emulated bodies, which may be slower than the wall clock.
    clock: str = "host"
    rate: float = 1.0  # share of the joints' greatest speeds that wanted positions move with; 0.03 for a first stand
    hot: float = 80.0  # [deg C] of a motor, above which somebody is warned; assumed, from windings of class B
    low_voltage: float = 0.0  # [V] of the battery, below which somebody is warned
    guard: GuardParameters = field(default_factory=GuardParameters)

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if one is not usable.
        """
        if self.clock not in CLOCKS:
            raise ValueError(f"clock is {self.clock!r}; expected one of {', '.join(CLOCKS)}")
        if not 0.0 < self.rate <= 1.0:
            raise ValueError(f"rate is {self.rate}; expected more than 0 and at most 1")
        for name in ("hot", "low_voltage"):
            if not math.isfinite(getattr(self, name)):
                raise ValueError(f"{name} is {getattr(self, name)}; expected a finite number")


class BodyNode(ComponentNode):
    """Turns joint commands into exchanges with a body, and its readings into messages."""

    def __init__(self) -> None:
        """Find the body, connect it to topics, and start it."""
        super().__init__("driver")
        p = self._settings = self.load(BodyNodeParameters())
        self._robot = load_robot()
        self._cells = np.array([foot.cells for foot in self._robot.feet])
        try:
            body = make_body(p.body, self._robot, read_options(p.options))
            self.loop = BodyLoop(body, self._robot, p.guard, host_clock if p.clock == "host" else None, p.rate)
            self._own_clock = flag(body, "own_clock")
            outputs = (topics.JOINT_STATES, topics.IMU, topics.FOOT_FORCES, topics.BATTERY, topics.ROBOT_DESCRIPTION)
            self._joints, self._imu, self._forces, self._battery, description = map(self.sender, outputs)
            self._clock_sender = self.sender(topics.CLOCK) if p.clock == "body" else None
            description.publish(String(data=build_urdf(self._robot)))
            self.listen(topics.LEG_COMMAND, self._on_command)
            self.listen(topics.HEAD_JOINT_COMMAND, self._on_command)
            self.emergency_stop = StopLink(self, "driver", self._on_emergency_stop)
            self.health.check(self.emergency_stop.finding)
            self.health.check(lambda: silent_joints(self.loop.silent_joints))
            self.health.check(self._body_health)
            self.health.check(self._condition)
            self.loop.start()
        except BodyError as error:
            raise BadInputError(str(error)) from error
        self._readings = 0
        self._heard = self._due = time.monotonic()
        self._obeys_from = self._due + LISTENING

    def advance(self, spin: Spin) -> None:
        """Exchange once, when it is time."""
        self._wait(spin)
        try:
            reading = self.loop.tick()
        except BodyError as error:
            self.get_logger().fatal(f"the body is lost: {error}")
            self.emergency_stop.engage(f"the body is lost: {error}")
            self.emergency_stop.wait_until_told(TOLD)
            raise SystemExit(1) from error  # whoever launched it starts it again
        if reading is not None:
            self._heard = time.monotonic()
            self._tell(reading)
            if reading.emergency and not self.emergency_stop.engaged:
                self.emergency_stop.engage(reading.emergency)
        elif self.loop.faults:
            self.health.count("refused readings", self.loop.fault, self.loop.faults)
            self.loop.faults = 0

    def destroy_node(self) -> None:
        """Leave the body without torque, and end."""
        self.loop.stop()
        super().destroy_node()

    def _wait(self, spin: Spin) -> None:
        """Handle messages until the next exchange is due."""
        period = PERIOD * 1e-9
        if self._own_clock:
            due = self._heard + SHARE * period
            while not self.loop.answered and (ahead := due - time.monotonic()) > 0.0:
                spin(ahead)
            for _ in range(AT_ONCE):
                spin(0.0)
            return
        spin(0.0)
        while (ahead := self._due - time.monotonic()) > 0.0:
            spin(ahead)
        self._due = max(self._due, time.monotonic() - period) + period  # time that was lost is not made up for

    def _tell(self, reading: Sensors) -> None:
        joints, imu, forces = sensors_to_messages(reading, self._cells)
        self._joints.publish(joints)
        self._imu.publish(imu)
        self._forces.publish(forces)
        if self._clock_sender is not None and self._readings % SLOW_TICKS == 0:
            self._clock_sender.publish(Clock(clock=to_message(reading.stamp)))
        if reading.battery is not None and self._readings % SECOND_TICKS == 0:
            self._battery.publish(battery_to_message(reading.battery, reading.stamp))
        self._readings += 1

    def _on_command(self, message: JointCommandMessage) -> None:
        if time.monotonic() < self._obeys_from:
            return
        reason = self.loop.accept(joint_command_from_message(message))
        if reason and not self.emergency_stop.engaged:
            self.health.count("refused joint commands", f"joint command refused: {reason}")

    def _body_health(self) -> Finding | None:
        """Tell whether the body is silent."""
        silence = time.monotonic() - self._heard
        if silence > SILENCE:
            words = f"the body has sent no reading for {silence:.1f} s: is it switched on and connected?"
            return Finding(Level.ERROR, words)
        return None

    def _on_emergency_stop(self, word: StopWord) -> None:
        if word.engaged:
            self.loop.limp(str(word))
        else:
            self.loop.release()

    def _condition(self) -> Finding | None:
        """Tell how hot the motors are and how full the battery is."""
        p, sensors = self._settings, self.loop.sensors
        return None if sensors is None else condition(sensors, self._robot.joint_names, p.hot, p.low_voltage)


def battery_to_message(battery: Battery, stamp: int) -> BatteryState:
    """Return the state of a battery as a message; ROS counts a current that is drawn as negative."""
    return BatteryState(
        header=header(stamp),
        voltage=battery.voltage,
        current=-battery.current,
        percentage=battery.charge,
        present=True,
    )


def main() -> NoReturn:
    """Run the driver until SIGINT or SIGTERM."""
    run(BodyNode, BodyNode.advance)


if __name__ == "__main__":
    main()
