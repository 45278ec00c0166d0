"""What goes into and comes out of the robot's body: the contract of every driver.

The body, simulated or real, delivers `Sensors` at the control rate and accepts `JointCommand`. The
joint loop tau = kp (q_d - q) + kd (dq_d - dq) + tau_ff, eqs. (12)-(13), runs inside the driver every
millisecond with fresh joint readings, and the driver saturates it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Battery:
    """What is left to drive the motors; NaN where it is not known.

    Attributes:
        voltage: [V].
        current: Drawn from it, positive [A].
        charge: Share left, 0 to 1.
    """

    voltage: float
    current: float = math.nan
    charge: float = math.nan


@dataclass(frozen=True)
class Sensors:
    """One reading of the whole body.

    Attributes:
        stamp: When it was measured [ns].
        joint_positions: (14,) [rad], order of `tulip_description.robot.JOINTS`.
        joint_velocities: (14,) [rad/s].
        joint_efforts: (14,) torque of the motors, before the joints' friction: the mean since the last reading [N m].
            A sample would come at the same instant of every command, whose torque falls while the joint follows it.
        imu_orientation: (4,) quaternion x, y, z, w of imu_link in a level frame; yaw drifts.
        imu_angular_velocity: (3,) of imu_link in imu_link [rad/s].
        imu_linear_acceleration: (3,) specific force in imu_link [m/s^2]; +g upwards at rest.
        foot_cells: (2, 4) vertical force of each cell [N]; rows left, right; columns heel inner,
            heel outer, toe inner, toe outer.
        joint_temperatures: (14,) of the motors [deg C], NaN where unknown; None: the body measures none.
        battery: None: the body does not tell.
        emergency: Why the body asks for an emergency stop, as in "its stop button is pressed"; "" if it does not.
    """

    stamp: int
    joint_positions: Array
    joint_velocities: Array
    joint_efforts: Array
    imu_orientation: Array
    imu_angular_velocity: Array
    imu_linear_acceleration: Array
    foot_cells: Array
    joint_temperatures: Array | None = None
    battery: Battery | None = None
    emergency: str = ""


@dataclass(frozen=True)
class JointCommand:
    """What a group of joints shall do until the next command.

    Attributes:
        sequence: Grows by one with each command of one sender.
        stamp: Stamp of the `Sensors` that this command answers [ns].
        names: Joint names, n of them; joints not named keep their last command.
        position: (n,) desired position [rad].
        velocity: (n,) desired velocity [rad/s].
        effort: (n,) feedforward torque [N m].
        stiffness: (n,) kp >= 0 [N m/rad].
        damping: (n,) kd >= 0 [N m s/rad].
    """

    sequence: int
    stamp: int
    names: tuple[str, ...]
    position: Array
    velocity: Array
    effort: Array
    stiffness: Array
    damping: Array
