"""Moves one joint after the other by a few degrees: right joint, sign and unit of position, velocity and torque."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from tulip_description.robot_io import Sensors
from tulip_driver.check.rig import Rig, smooth, whole_steps
from tulip_driver.check.rows import Row, judged

Array = NDArray[np.float64]
SWAY = 0.05  # [rad] 3 degrees
RAMP, REST = 0.4, 0.2  # [s]
PULSE, PULSE_TIME = 0.08, 0.024  # share of the greatest torque, and how long [s]: no joint gets far in that time


def check_joints(rig: Rig, home: Array) -> Iterator[Row]:
    """Yield a line for each joint.

    Args:
        rig: With a robot that holds `home`.
        home: (n,) posture [rad].
    """
    rig.hold(0.5, lambda _: home)
    middle = rig.robot.position_limits.mean(axis=0)
    for joint, name in enumerate(rig.robot.joint_names):
        way = np.zeros(len(home))
        way[joint] = SWAY if home[joint] < middle[joint] else -SWAY  # away from the nearer end of its range
        yield from rig.undisturbed(partial(_check_joint, rig, name, joint, home, way))


def _check_joint(rig: Rig, name: str, joint: int, home: Array, way: Array) -> Iterator[Row]:
    sign = np.sign(way[joint])
    before = rig.hold(REST, lambda _: home)
    pulse = np.zeros(len(home))
    pulse[joint] = sign * PULSE * rig.robot.effort_limits[joint]
    pushed = rig.hold(PULSE_TIME, lambda _: home, pulse)
    pushed += rig.hold(PULSE_TIME, lambda _: home)  # readings may be late by some periods
    # A light joint, as the ankle's roll, has given way before the reading is over: its mean torque is less.
    calm = np.mean([reading.joint_efforts[joint] for reading in before[-10:]])
    torque = max(sign * (reading.joint_efforts[joint] - calm) for reading in pushed) / abs(pulse[joint])
    start = np.mean([reading.joint_positions for reading in rig.hold(REST, lambda _: home)[-10:]], axis=0)
    out = rig.hold(RAMP, lambda passed: home + way * smooth(passed / RAMP))
    out += rig.hold(REST, lambda _: home + way)
    change = np.mean([reading.joint_positions for reading in out[-10:]], axis=0) - start
    driven = _driven(out, joint)
    rig.hold(RAMP, lambda passed: home + way * (1.0 - smooth(passed / RAMP)))
    most = rig.robot.joint_names[int(np.abs(change).argmax())]
    moved = change[joint] / way[joint]
    words = f"moves {moved:.2f} of {way[joint]:+.2f} rad, velocity x{driven:.2f}, torque x{torque:.2f}"
    if most != name:
        words += f"; {most} moved more"
    well = 0.5 < moved < 1.5 and 0.6 < driven < 1.4 and 0.1 < torque < 2.0 and most == name
    yield judged(name, words, "0.5 to 1.5, x0.6 to 1.4, x0.1 to 2", bool(well))


def _driven(readings: Sequence[Sensors], joint: int) -> float:
    """Return how far a joint went by its velocities, as a share of how far it went; NaN if it did not move.

    Where readings are missing in between, neither counts.
    """
    steps, whole = whole_steps(readings)
    moves = np.diff([reading.joint_positions[joint] for reading in readings])
    speeds = np.array([reading.joint_velocities[joint] for reading in readings[1:]])
    way = float(moves[whole].sum())
    return float(speeds[whole] @ steps[whole]) / way if abs(way) > 0.2 * SWAY else float("nan")
