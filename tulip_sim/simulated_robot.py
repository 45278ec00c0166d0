"""One robot of the simulated world: its body, its joints' driver, its sensors, and whom it touches."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from tulip_description import frames
from tulip_description.model import floating_model
from tulip_description.planar import Pose2D
from tulip_description.quaternion import Quaternion, quaternion_product
from tulip_description.robot import Robot
from tulip_description.robot_io import JointCommand, Sensors
from tulip_sim.driver import MILLISECOND, JointDriver
from tulip_sim.engine import RobotBody
from tulip_sim.faults import SensorFaults
from tulip_sim.parameters import WorldParameters
from tulip_sim.sensors import BodyState, SensorModel, cell_forces
from tulip_sim.touches import TouchCounter

Array = NDArray[np.float64]
UNEVEN = 0.02  # [m] 5 degrees of a sole's length: a robot that stands gives way by less, one foot is lifted by more


class SimulatedRobot:
    """A body in a physics engine, with what is its own: driver, sensor errors and joint friction.

    Attributes:
        robot: What it is like, as motion control knows it.
        body: Where it lives in the physics engine.
        joint_positions, joint_velocities: (n,) after the last step of physics [rad], [rad/s].
        dry_friction: (n,) of each joint, as drawn [N m].
    """

    def __init__(
        self,
        robot: Robot,
        body: RobotBody,
        parameters: WorldParameters,
        start: Array,
        pose: Pose2D,
        rng: tuple[np.random.Generator, np.random.Generator],
        tilt: Quaternion | None = None,
    ) -> None:
        """Put it on the field, at rest, its soles on the ground; it holds its posture until the first commands come.

        Args:
            robot: What it is like, as motion control may know.
            body: In the physics engine.
            parameters: Physics and sensors.
            start: (n,) posture at the start [rad], feet flat.
            pose: Of base_link in map, seen from above.
            rng: Where its own friction comes from, and the errors of its sensors.
            tilt: Of the trunk as measured in that posture, without a heading; None: upright. Then the feet need be no
                flatter than a robot's are that stands: it settles on them.

        Raises:
            ValueError: if start has a wrong shape or the feet of that posture are not level.
        """
        self.robot, self.body, self._parameters = robot, body, parameters
        self._start, self._tilt = start, tilt
        self._start_height = _base_height(robot, start) if tilt is None else _tilted_height(robot, start, tilt)
        p = parameters
        physics_rng, sensor_rng = rng
        n = len(robot.joint_names)
        self.dry_friction = robot.effort_limits * physics_rng.uniform(*p.joint_friction, n)
        self._place(pose)
        self._driver = JointDriver(robot, p.driver, start)
        self._effort_sum, self._effort_count = np.zeros(n), 0
        self.joint_positions, self.joint_velocities = start.copy(), np.zeros(n)
        self._push_force, self._push_end = np.zeros(3), 0
        self._touches = {"left": TouchCounter(), "right": TouchCounter(), "body": TouchCounter()}
        self.faults = SensorFaults(p.faults, robot.joint_names)
        """What is broken about its sensors."""
        self._sensors = SensorModel(robot, p.sensors, sensor_rng, self._body_state(0))
        self._delay = int(physics_rng.integers(p.sensor_delay[0], p.sensor_delay[1] + 1))  # [ms]
        under_way = self._delay // p.sensors.period + 1
        self._readings = deque([self._sensors.measure(self._body_state(0))], maxlen=under_way + 1)

    @property
    def foot_touches(self) -> tuple[int, int]:
        """How often the left and the right foot have met the ball."""
        return self._touches["left"].count, self._touches["right"].count

    @property
    def body_touches(self) -> int:
        """How often any other part has met the ball."""
        return self._touches["body"].count

    def accept(self, command: JointCommand, now: int) -> str:
        """Give a command to the driver at a time [ns]; return "" or the reason why it did not take it."""
        return self._driver.accept(command, now)

    def limp(self, reason: str) -> None:
        """Take all torque from the joints, and refuse commands until `release`."""
        self._driver.limp(reason)

    def release(self) -> None:
        """Take commands again; every joint stays limp until its next one."""
        self._driver.release()

    def silent_joints(self, now: int) -> tuple[str, ...]:
        """Return the joints that are only damped or limp at a time [ns], since nobody commands them any more."""
        return self._driver.silent_joints(now)

    def drive(self, now: int) -> None:
        """Put the torques of the next millisecond on the joints, and a push on the trunk while there is one."""
        effort = self._driver.torques(now, self.faults.felt(self.joint_positions, now), self.joint_velocities)
        self._effort_sum += effort
        self._effort_count += 1
        self.body.drive(effort - self._friction_torque())
        if now < self._push_end:
            self.body.push(self._push_force)

    def read_joints(self) -> None:
        """Take the joints' state after a step of physics."""
        self.joint_positions, self.joint_velocities = self.body.joint_state()

    def measure(self, now: int) -> None:
        """Read the sensors if a reading is due at this millisecond."""
        if (now // MILLISECOND + self._delay) % self._parameters.sensors.period == 0:
            self._readings.append(self.faults.reading(self._sensors.measure(self._body_state(now))))
            self._effort_sum[:], self._effort_count = 0.0, 0

    def sensors(self, now: int) -> Sensors:
        """Return the newest reading that has arrived by now."""
        arrived = now - self._delay * MILLISECOND
        while len(self._readings) > 1 and self._readings[1].stamp <= arrived:
            self._readings.popleft()
        return self._readings[0]

    def count_touches(self, now: int) -> None:
        """Count what part of it has come to touch the ball in this step."""
        left, right = (sole.link for sole in self.robot.soles)
        for part in {{left: "left", right: "right"}.get(link, "body") for link in self.body.links_at_ball()}:
            self._touches[part].touch(now)

    def push(self, force: ArrayLike, milliseconds: int, now: int) -> None:
        """Push the trunk at its centre of mass with a force (3,) in map [N] for some milliseconds from now on.

        Raises:
            ValueError: if force is not three finite numbers or milliseconds is not positive.
        """
        vector = np.array(force, dtype=float)
        if vector.shape != (3,) or not np.isfinite(vector).all() or milliseconds < 1:
            raise ValueError(
                f"force is {force!r} N for {milliseconds} ms; expected three finite numbers for 1 ms or more"
            )
        self._push_force, self._push_end = vector, now + milliseconds * MILLISECOND

    def set_upright(self, pose: Pose2D | None, now: int) -> None:
        """Set it on its feet in its start posture, at rest, and let go.

        Args:
            pose: Where base_link shall stand, in map; None for where it is, with the heading that it has.
            now: The world's time [ns]; a push ends.

        Raises:
            ValueError: if a number is not finite.
        """
        if pose is None:
            position, (_, _, z, w), _ = self.body.base_pose()
            # Of all headings the one that takes the least turning from how the trunk lies.
            pose = Pose2D(float(position[0]), float(position[1]), 2.0 * math.atan2(float(z), float(w)))
        if not all(math.isfinite(value) for value in (pose.x, pose.y, pose.yaw)):
            raise ValueError(f"robot shall stand at {pose}; expected finite numbers")
        self._place(pose)
        self._push_end = now
        self.joint_positions, self.joint_velocities = self._start.copy(), np.zeros(len(self._start))

    def _place(self, pose: Pose2D) -> None:
        turn = (0.0, 0.0, math.sin(pose.yaw / 2), math.cos(pose.yaw / 2))
        if self._tilt is not None:
            turn = quaternion_product(turn, self._tilt)
        self.body.place(np.array([pose.x, pose.y, self._start_height]), np.array(turn), self._start)

    def _friction_torque(self) -> Array:
        torque: Array = self.dry_friction * np.tanh(self.joint_velocities / self._parameters.joint_friction_speed)
        return torque

    def _body_state(self, now: int) -> BodyState:
        position, orientation, rotation = self.body.base_pose()
        linear, angular = self.body.base_velocity(rotation)
        return BodyState(
            stamp=now,
            joint_positions=self.joint_positions,
            joint_velocities=self.joint_velocities,
            joint_efforts=self._effort_sum / max(self._effort_count, 1),
            base_position=position,
            base_orientation=orientation,
            base_rotation=rotation,
            base_linear_velocity=linear,
            base_angular_velocity=angular,
            foot_cells=self._foot_cells(),
        )

    def _foot_cells(self) -> Array:
        """Return (2, 4) forces on the cells [N], from the contacts of the soles with the carpet."""
        return np.array([cell_forces(foot, self.body.sole_contacts(side)) for side, foot in enumerate(self.robot.feet)])


def as_drawn(
    robot: Robot, parameters: WorldParameters, rng: np.random.Generator, true_body: Robot | None = None
) -> Robot:
    """Return what a robot really is like: each link's mass and inertia off by a random share.

    Args:
        robot: What it is like, as motion control may know.
        parameters: Say by how much.
        rng: Of the physics.
        true_body: Whose masses, CoMs and inertias it has before that; None for those of `robot`.

    Raises:
        ValueError: if true_body is of another shape than robot.
    """
    body = true_body or robot
    if body.joints != robot.joints or [link.name for link in body.links] != [link.name for link in robot.links]:
        raise ValueError("true_body has other links or joints than robot; expected other masses alone")
    p = parameters
    scales = p.mass_scale * rng.uniform(1.0 - p.mass_spread, 1.0 + p.mass_spread, len(robot.links))
    links = []
    for link, scale in zip(body.links, scales.tolist(), strict=True):
        x, y, z = link.inertia
        links.append(replace(link, mass=link.mass * scale, inertia=(x * scale, y * scale, z * scale)))
    return replace(body, links=tuple(links))


def _base_height(robot: Robot, joints: Array) -> float:
    """Return the height of base_link with an upright trunk and the soles on the ground."""
    soles = _soles(robot, joints, (0.0, 0.0, 0.0, 1.0))
    heights = [float(sole.translation[2]) for sole in soles]
    if abs(heights[0] - heights[1]) > 1e-3 or any(sole.rotation[2, 2] < math.cos(0.01) for sole in soles):
        raise ValueError(
            f"joint_positions put the soles at {heights} m below base_link, tilts"
            f" {[round(math.acos(min(sole.rotation[2, 2], 1.0)), 3) for sole in soles]} rad;"
            " expected level soles of equal height with an upright trunk"
        )
    return -min(heights)


def _tilted_height(robot: Robot, joints: Array, tilt: Quaternion) -> float:
    """Return the height of base_link with a trunk that is tilted and the lowest corner of the soles on the ground."""
    soles = _soles(robot, joints, tilt)
    placed = zip(robot.feet, soles, strict=True)
    heights = np.array([(foot.corners @ sole.rotation.T + sole.translation)[:, 2] for foot, sole in placed])
    if np.ptp(heights) > UNEVEN:
        raise ValueError(
            f"the corners of the soles are up to {1e3 * np.ptp(heights):.0f} mm higher than the lowest one; expected"
            f" {1e3 * UNEVEN:.0f} mm at most, as of a robot that stands on both feet on level ground"
        )
    return -float(heights.min())


def _soles(robot: Robot, joints: Array, orientation: Quaternion) -> list[pin.SE3]:
    """Return the placements of both soles below a base_link at the origin."""
    if joints.shape != (len(robot.joint_names),):
        raise ValueError(f"joint_positions has shape {joints.shape}; expected ({len(robot.joint_names)},)")
    model = floating_model(robot)
    data = model.createData()
    pin.framesForwardKinematics(model, data, np.concatenate([[0.0, 0.0, 0.0], orientation, joints]))
    return [data.oMf[model.getFrameId(name)] for name in (frames.LEFT_SOLE, frames.RIGHT_SOLE)]
