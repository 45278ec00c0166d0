"""Which joints give all the torque they have: such a joint does not follow, and the robot leaves its planned motion."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tulip_description.robot import Robot

Array = NDArray[np.float64]

AT_LIMIT = 0.98  # of the torque limit: leaves room for the steps of a current sensor
OFTEN = 0.1  # share of readings at the limit above which a joint is worth a word; single peaks of a step are not


class Saturation:
    """Counts how often each joint's torque is at its limit.

    A motor near its top speed has less torque than its limit (`DriverParameters.full_torque_speed`); that does not show
    here.
    """

    def __init__(self, robot: Robot) -> None:
        """Begin with the limits of a robot."""
        self._names = robot.joint_names
        self._limits = AT_LIMIT * robot.effort_limits
        self._clear()

    def add(self, efforts: Array) -> None:
        """Take one reading of all joints' torques (n,) [N m], in the robot's order."""
        self._at_limit += np.abs(efforts) >= self._limits
        self._readings += 1

    def take(self) -> dict[str, float]:
        """Return the share of readings at the limit since the last call, by joint, where it is above OFTEN."""
        shares = self._at_limit / max(self._readings, 1)
        self._clear()
        return {name: float(share) for name, share in zip(self._names, shares, strict=True) if share > OFTEN}

    def _clear(self) -> None:
        self._at_limit = np.zeros(len(self._names), dtype=np.int64)
        self._readings = 0
