"""A recorded body: plays the sensors of a recording, whatever it is told."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from tulip_description.robot import Robot
from tulip_description.robot_io import JointCommand, Sensors
from tulip_driver.contract import Body, BodyError
from tulip_motion.messages import sensors_from_messages
from tulip_ros import topics
from tulip_ros.errors import BadInputError
from tulip_ros.log_file import Log
from tulip_ros.matching import SameStamp

SENSORS = (topics.JOINT_STATES.name, topics.IMU.name, topics.FOOT_FORCES.name)


class LogBody(Body):
    """Returns one recorded reading after the other, the last one again at the end.

    Args:
        robot: Not used: the recording says what its joints did.
        file: An MCAP file, or the folder of a recording.
        namespace: Of the robot in the recording, as in striker; "" for one that is alone.
    """

    hardware = False
    moves = False
    simulated = True

    def __init__(self, robot: Robot, file: str, namespace: str = "") -> None:
        self._file = Path(file)
        space = f"/{namespace.strip('/')}" if namespace.strip("/") else ""
        self._names = {f"{space}/{name}": name for name in SENSORS}
        self._log: Log | None = None

    def start(self) -> None:
        """Open the recording.

        Raises:
            BodyError: if it cannot be read or holds no sensors.
        """
        self.stop()
        try:
            self._log = Log(self._file)
        except BadInputError as error:
            raise BodyError(str(error)) from error
        missing = [name for name in self._names if name not in self._log.topics]
        if missing:
            raise BodyError(
                f"Recording {self._file} lacks {', '.join(missing)}; expected the sensors of a whole robot. Topics: "
                f"{', '.join(self._log.topics) or 'none'}."
            )
        self._readings = self._read(self._log)
        self._newest: Sensors | None = None

    def exchange(self, command: JointCommand | None) -> Sensors:
        """Return the next reading.

        Raises:
            BodyError: if the recording holds no whole reading, or one of another robot.
        """
        try:
            self._newest = next(self._readings, self._newest)
        except (ValueError, BadInputError) as error:
            raise BodyError(f"Recording {self._file}: {error}") from error
        if self._newest is None:
            raise BodyError(f"Recording {self._file} holds no reading of joints, IMU and feet of one instant.")
        return self._newest

    def stop(self) -> None:
        """Close the recording."""
        if self._log is not None:
            self._log.close()
            self._log = None

    def _read(self, log: Log) -> Iterator[Sensors]:
        together = SameStamp(*SENSORS)
        for record in log.records(list(self._names)):
            message = log.decode(record)
            stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
            complete = together.add(self._names[record.topic.name], stamp, message)
            if complete is not None:
                yield sensors_from_messages(*complete)
