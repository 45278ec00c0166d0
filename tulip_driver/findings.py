"""What drivers find wrong with commands and bodies, in words for the diagnostics."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tulip_description.robot import HEAD_JOINTS, LEG_JOINTS
from tulip_description.robot_io import Sensors
from tulip_ros.finding import Finding, Level

PARTS = (("legs", LEG_JOINTS, "motion"), ("head", HEAD_JOINTS, "head"))
"""Parts of the robot, and the node that commands each."""


def silent_joints(silent: Sequence[str], robot: str = "") -> Finding | None:
    """Return what is to be said of joints whose commands outlived their time-to-live.

    Args:
        silent: Names of these joints.
        robot: Whose they are, before the words, as in "striker: ".
    """
    found = [(part, node) for part, joints, node in PARTS if not set(silent).isdisjoint(joints)]
    if not found:
        return None
    parts, nodes = (" and ".join(each) for each in zip(*found, strict=True))
    return Finding(
        Level.ERROR,
        f"{robot}commands of the {parts} outlived their time-to-live, the joints are only"
        f" damped or limp: look after {nodes}",
    )


def condition(sensors: Sensors, names: Sequence[str], hot: float, low_voltage: float) -> Finding | None:
    """Return how the motors and the battery are, if the body tells.

    Args:
        sensors: A reading.
        names: Of the joints.
        hot: Temperature above which somebody is warned [deg C].
        low_voltage: Voltage of the battery below which somebody is warned [V].
    """
    words, level = [], Level.OK
    temperatures = sensors.joint_temperatures
    if temperatures is not None and np.isfinite(temperatures).any():
        hottest = int(np.nanargmax(temperatures))
        words.append(f"hottest motor {names[hottest]} {temperatures[hottest]:.0f} deg C")
        if temperatures[hottest] > hot:
            level = Level.WARNING
            words[-1] += f", above {hot:.0f}: let it rest"
    battery = sensors.battery
    if battery is not None:
        words.append(f"battery {battery.voltage:.1f} V")
        if battery.voltage < low_voltage:
            level = Level.WARNING
            words[-1] += f", below {low_voltage:.1f}: change it"
    return Finding(level, ", ".join(words)) if words else None
