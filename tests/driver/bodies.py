"""Bodies for tests: one that writes down what it is told, on a clock that the test moves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tulip_description.robot import LEG_JOINTS, Robot, load_robot
from tulip_description.robot_io import JointCommand, Sensors
from tulip_driver.contract import PERIOD
from tulip_driver.echo import EchoBody

ROBOT = load_robot()


class Clock:
    """Time that goes on by one period with each look at it."""

    def __init__(self, period: int = PERIOD) -> None:
        self.now, self.period = 0, period

    def __call__(self) -> int:
        self.now += self.period
        return self.now


class NotedBody(EchoBody):
    """Keeps the commands that it was given."""

    def __init__(self, robot: Robot = ROBOT) -> None:
        self.time = Clock()
        super().__init__(robot, self.time)
        self.told: list[JointCommand | None] = []
        self.stopped = 0
        self.emergency = ""

    def exchange(self, command: JointCommand | None) -> Sensors:
        self.told.append(command)
        return replace(super().exchange(command), emergency=self.emergency)

    def stop(self) -> None:
        self.stopped += 1


def command(
    stamp: int = 0, sequence: int = 1, names: tuple[str, ...] = LEG_JOINTS, **values: float | np.ndarray
) -> JointCommand:
    fields = {"position": 0.0, "velocity": 0.0, "effort": 0.0, "stiffness": 0.0, "damping": 0.0, **values}
    full = {name: np.broadcast_to(np.asarray(value, dtype=float), len(names)) for name, value in fields.items()}
    return JointCommand(sequence, stamp, names, **full)


class VirtualBody(EchoBody):
    """The echo body in simulated time: as fast as the computer can."""

    simulated = True

    def __init__(self, robot: Robot = ROBOT) -> None:
        super().__init__(robot, Clock())
