"""The contract of a body: start it, exchange a command for sensors, stop it. Whoever has a robot writes this class.

    class MyRobot(Body):
        def __init__(self, robot: Robot, port: str = "/dev/ttyUSB0") -> None: ...
        def start(self) -> None: ...
        def exchange(self, command: JointCommand | None) -> Sensors: ...
        def stop(self) -> None: ...

    python3 scripts/driver_check.py --driver my_package.my_robot:MyRobot
    python3 scripts/launch.py --driver my_package.my_robot:MyRobot

No ROS, no physics, no limits here: `tulip_driver.loop.BodyLoop` owns time, limits, time-out and limp around any body.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

from tulip_description.robot_io import JointCommand, Sensors

PERIOD = 4_000_000
"""[ns] between two exchanges."""
LONGEST_WAIT = 10_000_000
"""[ns] that an exchange may wait for the body's next reading: a request to go limp must not wait longer."""


class BodyError(Exception):
    """The body cannot be started or reached; the message says what is wrong, what was expected, and what to do."""


class Body(ABC):
    """A robot's body, real or not.

    It is made with the robot, then with options that the user gave: `Class(robot, port="/dev/ttyUSB0")`. Making it
    touches no hardware.

    Attributes:
        hardware: Whether something real moves: then people are asked before it does.
        moves: Whether commands move it at all; a recorded body plays on whatever it is told.
        own_clock: Whether `exchange` waits for the body's next reading, which then sets the pace; otherwise an exchange
            returns at once and is made every PERIOD.
        simulated: Whether each exchange advances the body's clock by PERIOD, however long it takes.
    """

    hardware: ClassVar[bool] = True
    moves: ClassVar[bool] = True
    own_clock: ClassVar[bool] = False
    simulated: ClassVar[bool] = False

    @abstractmethod
    def start(self) -> None:
        """Connect. The joints do nothing new until the first command. Called again after `stop`, it starts anew.

        Raises:
            BodyError: if the body cannot be reached or is another one than the robot.
        """

    @abstractmethod
    def exchange(self, command: JointCommand | None) -> Sensors:
        """Give the joints a command and return the newest reading.

        The body evaluates tau = kp (q_d - q) + kd (dq_d - dq) + tau_ff, eqs. (12)-(13), by itself, every millisecond
        if it can, with fresh readings, and saturates it. Should commands stop to come, as when the computer dies, it
        lets its joints only damp.

        Args:
            command: Checked and limited. Joints that it does not name keep their last command. None: no command
                yet; the body stays as it is.

        Returns:
            The newest reading; its stamp is on the body's own clock [ns], of any origin, and grows. With no newer
            reading within LONGEST_WAIT, the one before again.

        Raises:
            BodyError: if the body is lost for good.
        """

    @abstractmethod
    def stop(self) -> None:
        """Leave the joints without torque, and let go of the body. May be called at any time, also twice."""
