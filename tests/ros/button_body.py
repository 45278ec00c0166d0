"""A body with a stop button: it is pressed while a file exists."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from tulip_description.robot import Robot
from tulip_description.robot_io import JointCommand, Sensors
from tulip_driver.echo import EchoBody


class ButtonBody(EchoBody):
    def __init__(self, robot: Robot, file: str) -> None:
        super().__init__(robot)
        self._button = Path(file)

    def exchange(self, command: JointCommand | None) -> Sensors:
        pressed = self._button.exists()
        return replace(super().exchange(command), emergency="its stop button is pressed" if pressed else "")
