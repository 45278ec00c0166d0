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
from tulip_description.robot import Robot
from tulip_description.robot_io import JointCommand, Sensors
from tulip_sim.driver import MILLISECOND, JointDriver
from tulip_sim.engine import RobotBody
from tulip_sim.faults import SensorFaults
from tulip_sim.parameters import WorldParameters
from tulip_sim.sensors import BodyState, SensorModel, cell_forces
from tulip_sim.touches import TouchCounter

Array = NDArray[np.float64]


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
    ) -> None:
        """Put it on the field, at rest, its soles on the ground; it holds its posture until the first commands come.

        Args:
            robot: What it is like, as motion control may know.
            body: In the physics engine.
            parameters: Physics and sensors.
            start: (n,) posture at the start [rad], feet flat.
            pose: Of base_link in map, seen from above.
            rng: Where its own friction comes from, and the errors of its sensors.

        Raises:
            ValueError: if start has a wrong shape or the feet of that posture are not level.
        """
        self.robot, self.body, self._parameters = robot, body, parameters
        self._start, self._start_height = start, _base_height(robot, start)
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
        turn = np.array([0.0, 0.0, math.sin(pose.yaw / 2), math.cos(pose.yaw / 2)])
        self.body.place(np.array([pose.x, pose.y, self._start_height]), turn, self._start)

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
    if joints.shape != (len(robot.joint_names),):
        raise ValueError(f"joint_positions has shape {joints.shape}; expected ({len(robot.joint_names)},)")
    model = floating_model(robot)
    data = model.createData()
    pin.framesForwardKinematics(model, data, np.concatenate([[0, 0, 0, 0, 0, 0, 1], joints]))
    soles = [data.oMf[model.getFrameId(name)] for name in (frames.LEFT_SOLE, frames.RIGHT_SOLE)]
    heights = [float(sole.translation[2]) for sole in soles]
    if abs(heights[0] - heights[1]) > 1e-3 or any(sole.rotation[2, 2] < math.cos(0.01) for sole in soles):
        raise ValueError(
            f"joint_positions put the soles at {heights} m below base_link, tilts"
            f" {[round(math.acos(min(sole.rotation[2, 2], 1.0)), 3) for sole in soles]} rad;"
            " expected level soles of equal height with an upright trunk"
        )
    return -min(heights)
