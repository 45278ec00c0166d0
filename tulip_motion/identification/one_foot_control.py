"""Joint commands that follow a road slowly, on one foot or on two.

Feedforward is eq. (14) with gravity alone, at the joints as measured, and feedback eq. (13) with the gains of the open
loop gait. As the robot's CoM is not known yet, that leaves the CoP off its aim; so the ankle of the stance leg turns,
slowly, until the *measured* CoP is there. The ankle also damps the sway of the CoM, as the encoders show it: unlike
the gyro's, that does not feed the swinging of the trunk against the leg.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tulip_description.model import floating_model
from tulip_description.robot import Robot
from tulip_description.robot_io import JointCommand, Sensors
from tulip_motion.feedforward import feedforward, inverse_dynamics
from tulip_motion.head import HeadParameters
from tulip_motion.identification.static_postures import aim_point
from tulip_motion.interface import Side, Support
from tulip_motion.inverse_kinematics import LEG_COLUMNS, InverseKinematics
from tulip_motion.joint_control import JointGains
from tulip_motion.motion import with_fixed_head
from tulip_motion.parameters import MotionParameters

Array = NDArray[np.float64]
ANKLE_PITCH, ANKLE_ROLL = 4, 5  # in a leg
AT_REST = np.zeros(18)


@dataclass(frozen=True)
class OneFootParameters:
    """Balance while postures are held."""

    control_period: float = 0.004  # [s] one tick of the driver
    cop_gain: float = 0.8  # [1/s] of the CoP's error that the ankle takes away
    cop_smoothing: float = 0.5  # [s] of the CoP before that: the sway of 1 Hz, which moves it most, is not to be fed
    pendulum_height: float = 0.67  # [m] of the CoM above the ankle: 1 mrad there moves the CoP by so many mm
    most_correction: float = 0.12  # [rad] of each ankle axis: a CoM that is off by 80 mm
    sway_damping: float = 70.0  # [N m s/rad] half of critical for 12 kg m^2 on 600 N m/rad
    sway_smoothing: float = 0.05  # [s] of the CoM's velocity; encoders of 1e-4 rad make 1 mm/s then


class BodyOnFeet:
    """How the body stands, by joints, IMU and cells; all in the stance sole's frame.

    Attributes:
        loads: On the left and right foot [N].
        cop: (2,) centre of pressure of both feet together, in the stance sole's frame [m].
        com_velocity: (2,) of the CoM as it is believed to be, by the encoders [m/s].
        up: (3,) the stance sole's normal in base_link, which is up if that sole lies level.
    """

    def __init__(self, robot: Robot, smoothing: float) -> None:
        """Make the model of the legs; the head is light and counts as looking straight ahead.

        Args:
            robot: As it is believed to be.
            smoothing: Share of the newest reading in the CoM's velocity.
        """
        model = floating_model(with_fixed_head(robot))
        p = MotionParameters()
        self.kinematics = InverseKinematics(
            model, p.clik_gain_position, p.clik_gain_orientation, robot.position_limits[:, :12]
        )
        self._cells = np.array([np.hstack([foot.cells, np.zeros((4, 1))]) for foot in robot.feet])
        self.loads = np.zeros(2)
        self.cop = np.zeros(2)
        self.com_velocity = np.zeros(2)
        self._contact_force = p.contact_force
        self._smoothing = smoothing
        self._last: tuple[Side, int, Array] | None = None
        self.up = np.array([0.0, 0.0, 1.0])

    def update(self, sensors: Sensors, stance: Side) -> None:
        """Take a reading."""
        kinematics = self.kinematics
        model, data, q = kinematics.model, kinematics.data, kinematics.configuration
        q[:3], q[3:7], q[7:] = 0.0, (0.0, 0.0, 0.0, 1.0), sensors.joint_positions[:12]
        pin.framesForwardKinematics(model, data, q)
        base = data.oMf[kinematics.sole_frames[stance]].inverse()
        q[:7] = pin.SE3ToXYZQUAT(base)
        kinematics.update_jacobian(stance)
        self.loads = sensors.foot_cells.sum(axis=1)
        soles = [data.oMf[frame] for frame in kinematics.sole_frames]
        places = [cells @ sole.rotation.T + sole.translation for cells, sole in zip(self._cells, soles, strict=True)]
        # The noise of cells in the air would count far away from the stance foot.
        cells = np.where(self.loads > self._contact_force, sensors.foot_cells.T, 0.0).T
        self.cop = np.einsum("sc,scx->x", cells, np.array(places))[:2] / max(float(cells.sum()), 1.0)
        self.up = base.rotation[2]
        com = data.com[0][:2].copy()
        if self._last is None or self._last[0] is not stance:
            self.com_velocity = np.zeros(2)
        elif sensors.stamp > self._last[1]:
            velocity = (com - self._last[2]) / ((sensors.stamp - self._last[1]) * 1e-9)
            self.com_velocity = self.com_velocity + self._smoothing * (velocity - self.com_velocity)
        self._last = (stance, sensors.stamp, com)


class OneFootControl:
    """Turns where the joints shall be into commands, and keeps the CoP at its aim."""

    def __init__(self, robot: Robot, parameters: OneFootParameters | None = None) -> None:
        """Begin without correction.

        Args:
            robot: As it is believed to be.
            parameters: Of balance.
        """
        p = self._parameters = parameters or OneFootParameters()
        self.body = BodyOnFeet(robot, p.control_period / p.sway_smoothing)
        self._names = robot.joint_names
        self.aims = (aim_point(robot, "left"), aim_point(robot, "right"))
        """(2,) where the CoP shall be on the left and the right foot while it stands alone, in its sole frame [m]."""
        self._gains = JointGains(MotionParameters())
        head = HeadParameters()
        self._head_gains = (np.full(2, head.stiffness), np.full(2, head.damping))
        self._limits = robot.effort_limits[:12]
        self._low, self._high = robot.position_limits
        self._sequence = 0
        self._smooth_cop: Array | None = None
        self.correction = np.zeros((2, 2))
        """Of the left and right ankle's pitch and roll while that foot carries all [rad]."""

    def correct(self, stance: Side) -> None:
        """Turn the stance ankle a little so that the CoP comes nearer to its aim."""
        p = self._parameters
        if self._smooth_cop is None:
            self._smooth_cop = self.body.cop
        self._smooth_cop = self._smooth_cop + p.control_period / p.cop_smoothing * (self.body.cop - self._smooth_cop)
        ahead, left = (self.aims[stance] - self._smooth_cop) * p.cop_gain * p.control_period / p.pendulum_height
        # The sole rests: a positive ankle pitch takes the body back, a positive roll takes it to the left.
        turned = self.correction[stance] + (-ahead, left)
        self.correction[stance] = np.clip(turned, -p.most_correction, p.most_correction)

    def rest(self) -> None:
        """Leave the correction as it is; a later one begins with the CoP of then."""
        self._smooth_cop = None

    def command(
        self, sensors: Sensors, stance: Side, share: float, positions: Array, velocities: Array
    ) -> JointCommand:
        """Return the command for all joints.

        Args:
            sensors: What it answers, as `body` has seen it.
            stance: The foot that carries more.
            share: Of the weight that it shall carry, 0.5 to 1.
            positions: (n,) where the joints shall be, without correction [rad].
            velocities: (n,) [rad/s].
        """
        p, body = self._parameters, self.body
        alone = 2.0 * share - 1.0
        wanted = positions.copy()
        ankle = [LEG_COLUMNS[stance].start + ANKLE_PITCH, LEG_COLUMNS[stance].start + ANKLE_ROLL]
        wanted[ankle] += alone * self.correction[stance]
        torques = np.zeros(len(wanted))
        torques[:12] = self._gravity(stance, share)
        if share >= 1.0:  # else the CoM is on its way to that foot
            sway = p.sway_damping / p.pendulum_height * body.com_velocity
            # On a foot that rests, an ankle torque acts on the body the other way round.
            torques[ankle] += (sway[0], -sway[1])
        torques[:12] = np.clip(torques[:12], -self._limits, self._limits)
        support = (Support.LEFT, Support.RIGHT)[stance] if share >= 1.0 else Support.DOUBLE
        reachable = np.clip(wanted, self._low, self._high)
        return self._send(sensors, reachable, velocities, torques, self._gains.of(support, open_loop=True))

    def limp(self, sensors: Sensors) -> JointCommand:
        """Return the command that lets the robot sink."""
        zero = np.zeros(len(self._names))
        return self._send(sensors, sensors.joint_positions, zero, zero, self._gains.limp)

    def _gravity(self, stance: Side, share: float) -> Array:
        """Return the (12,) torques that hold the legs as they are, eqs. (14)-(15) with gravity alone."""
        kinematics = self.body.kinematics
        right_share = share if stance is Side.RIGHT else 1.0 - share
        soles = [kinematics.data.oMf[frame] for frame in kinematics.sole_frames]
        left, right = (sole.act(np.array((*aim, 0.0))) for sole, aim in zip(soles, self.aims, strict=True))
        return feedforward(kinematics, inverse_dynamics(kinematics, AT_REST, AT_REST), right_share, (left, right))

    def _send(
        self, sensors: Sensors, positions: Array, velocities: Array, torques: Array, leg_gains: tuple[Array, Array]
    ) -> JointCommand:
        """Number a command, and add the head's gains to those of the legs."""
        self._sequence += 1
        stiffness, damping = (np.concatenate(pair) for pair in zip(leg_gains, self._head_gains, strict=True))
        return JointCommand(
            self._sequence, sensors.stamp, self._names, positions, velocities, torques, stiffness, damping
        )
