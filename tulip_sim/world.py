"""The simulated world: pybullet at 1 kHz, the robot's driver and sensors in it, and the truth about it."""

from __future__ import annotations

import math
import weakref
from collections import deque

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from tulip_description import frames
from tulip_description.field import Field, load_field
from tulip_description.model import floating_model
from tulip_description.planar import Pose2D
from tulip_description.posture import standing_posture
from tulip_description.quaternion import quaternion_matrix
from tulip_description.robot import Robot, load_robot
from tulip_description.robot_io import JointCommand, Sensors
from tulip_sim import bodies
from tulip_sim.driver import MILLISECOND, JointDriver
from tulip_sim.parameters import WorldParameters
from tulip_sim.physics import pybullet
from tulip_sim.scenario import Scenario
from tulip_sim.sensors import BodyState, SensorModel, cell_forces
from tulip_sim.truth import Truth

Array = NDArray[np.float64]
TOUCH_GAP = 100 * MILLISECOND  # contacts closer together than this are one touch
CONTACT_PERIOD = 4  # [ms] between looks at who touches the ball; a kick's contact lasts about 17 ms


class World:
    """One robot, a ball and perhaps a keeper on the field.

    The robot starts at rest, its soles on the ground, and holds its posture until the first commands come. Physics and
    joint loop run at 1 kHz. The same scenario, parameters, seed and commands give the same truth, bit for bit, on one
    machine.

    Args:
        scenario: What stands where at the start.
        parameters: Physics and sensors.
        seed: Of everything random: masses, friction, sensor errors.
        field: Geometry of the field; None for the project's own.
        robot: None for the playing robot.
        joint_positions: (n,) posture at the start [rad], feet flat; None for `standing_posture`.

    Raises:
        ValueError: if joint_positions has a wrong shape or the feet of that posture are not level.
    """

    def __init__(
        self,
        scenario: Scenario,
        parameters: WorldParameters | None = None,
        seed: int = 0,
        field: Field | None = None,
        robot: Robot | None = None,
        joint_positions: ArrayLike | None = None,
    ) -> None:
        self.scenario = scenario
        self.parameters = parameters if parameters is not None else WorldParameters()
        self.field = field if field is not None else load_field()
        self.robot = robot if robot is not None else load_robot()
        physics_rng, sensor_rng = np.random.default_rng(seed).spawn(2)
        start = standing_posture(self.robot).joint_positions if joint_positions is None else np.array(joint_positions)
        self._start, self._start_height = start, _base_height(self.robot, start)
        p = self.parameters
        self._now = 0
        self.friction = float(physics_rng.uniform(*p.friction))
        """Of the carpet, as drawn."""
        self._client = bodies.connect(p)
        self._finalizer = weakref.finalize(self, _disconnect, self._client)
        self._carpet = bodies.add_carpet(self._client, self.friction)
        for goal in (self.field.own_goal, self.field.opponent_goal):
            bodies.add_goal(self._client, goal, p)
        if scenario.poles:
            bodies.add_poles(self._client, self.field)
        self._ball = bodies.add_ball(self._client, self.field.ball_radius, self.friction, p)
        self._keeper = None if scenario.keeper is None else bodies.add_keeper(self._client, scenario.keeper)
        spread = physics_rng.uniform(1.0 - p.mass_spread, 1.0 + p.mass_spread, len(self.robot.links))
        scale = p.mass_scale * spread
        self._body, self._index = bodies.add_robot(self._client, self.robot, scale)
        self._joint_indices = [self._index[name] for name in self.robot.joint_names]
        self._foot_links = tuple(self._index[sole.link] for sole in self.robot.soles)
        self._com_in_base = np.array(self.robot.links[0].com)
        n = len(self._joint_indices)
        self._dry_friction = self.robot.effort_limits * physics_rng.uniform(*p.joint_friction, n)
        self._place_robot(scenario.robot)
        self.place_ball(*scenario.ball)
        self._driver = JointDriver(self.robot, p.driver, start)
        self._effort = np.zeros(n)
        self._positions, self._velocities = start.copy(), np.zeros(n)
        self._push_force, self._push_end = np.zeros(3), 0
        self._touches = {
            "left": _TouchCounter(),
            "right": _TouchCounter(),
            "body": _TouchCounter(),
            "keeper": _TouchCounter(),
        }
        self._sensors = SensorModel(self.robot, p.sensors, sensor_rng, self._body_state())
        self._delay = int(physics_rng.integers(p.sensor_delay[0], p.sensor_delay[1] + 1))  # [ms]
        under_way = self._delay // p.sensors.period + 1
        self._readings = deque([self._sensors.measure(self._body_state())], maxlen=under_way + 1)

    @property
    def stamp(self) -> int:
        """Time since the start [ns]."""
        return self._now

    def apply(self, command: JointCommand) -> str:
        """Give a command to the driver; it acts from the next millisecond on.

        Returns:
            "" if the driver took it, else the reason why it did not.
        """
        return self._driver.accept(command, self._now)

    def advance(self, milliseconds: int) -> None:
        """Let time pass.

        Raises:
            ValueError: if milliseconds is negative.
        """
        if milliseconds < 0:
            raise ValueError(f"milliseconds is {milliseconds}; expected >= 0")
        period, client = self.parameters.sensors.period, self._client
        for _ in range(milliseconds):
            self._effort = self._driver.torques(self._now, self._positions, self._velocities)
            pybullet.setJointMotorControlArray(
                self._body,
                self._joint_indices,
                pybullet.TORQUE_CONTROL,
                forces=(self._effort - self._friction_torque()).tolist(),
                physicsClientId=client,
            )
            if self._now < self._push_end:
                self._apply_push()
            if self._keeper is not None and self.scenario.keeper is not None and self.scenario.keeper.path:
                bodies.move_keeper(client, self._keeper, self.scenario.keeper, self._now)
            pybullet.stepSimulation(physicsClientId=client)
            self._now += MILLISECOND
            states = pybullet.getJointStates(self._body, self._joint_indices, physicsClientId=client)
            self._positions = np.array([state[0] for state in states])
            self._velocities = np.array([state[1] for state in states])
            elapsed = self._now // MILLISECOND
            if elapsed % CONTACT_PERIOD == 0:
                self._count_touches()
            if (elapsed + self._delay) % period == 0:
                self._readings.append(self._sensors.measure(self._body_state()))

    def sensors(self) -> Sensors:
        """Return the newest reading that has arrived by now."""
        arrived = self._now - self._delay * MILLISECOND
        while len(self._readings) > 1 and self._readings[1].stamp <= arrived:
            self._readings.popleft()
        return self._readings[0]

    def truth(self) -> Truth:
        """Return what really is."""
        position, orientation, rotation = self._base_pose()
        linear, angular = self._base_velocity(rotation)
        ball_position, ball_orientation = pybullet.getBasePositionAndOrientation(
            self._ball, physicsClientId=self._client
        )
        ball_linear, ball_angular = pybullet.getBaseVelocity(self._ball, physicsClientId=self._client)
        keeper, touches = self.scenario.keeper, self._touches
        return Truth(
            stamp=self._now,
            base_position=position,
            base_orientation=orientation,
            base_linear_velocity=linear,
            base_angular_velocity=angular,
            joint_positions=self._positions,
            joint_velocities=self._velocities,
            ball_position=np.array(ball_position),
            ball_orientation=np.array(ball_orientation),
            ball_linear_velocity=np.array(ball_linear),
            ball_angular_velocity=np.array(ball_angular),
            keeper=None if keeper is None else keeper.pose_at(self._now),
            keeper_path=() if keeper is None or not keeper.path else keeper.points,
            foot_touches=(touches["left"].count, touches["right"].count),
            body_touches=touches["body"].count,
            keeper_touches=touches["keeper"].count,
            poles=self.scenario.poles,
        )

    def push(self, force: ArrayLike, milliseconds: int) -> None:
        """Push the trunk at its centre of mass.

        Args:
            force: (3,) in map [N].
            milliseconds: How long, from now on; a new push ends the last one.

        Raises:
            ValueError: if force is not three finite numbers or milliseconds is not positive.
        """
        vector = np.array(force, dtype=float)
        if vector.shape != (3,) or not np.isfinite(vector).all() or milliseconds < 1:
            raise ValueError(
                f"force is {force!r} N for {milliseconds} ms; expected three finite numbers for 1 ms or more"
            )
        self._push_force, self._push_end = vector, self._now + milliseconds * MILLISECOND

    def place_ball(self, x: float, y: float, vx: float = 0.0, vy: float = 0.0) -> None:
        """Put the ball on the ground, rolling.

        Args:
            x: In map [m].
            y: In map [m].
            vx: Speed along x [m/s].
            vy: Speed along y [m/s].

        Raises:
            ValueError: if a number is not finite.
        """
        if not all(math.isfinite(value) for value in (x, y, vx, vy)):
            raise ValueError(f"ball is at ({x}, {y}) m with ({vx}, {vy}) m/s; expected finite numbers")
        radius = self.field.ball_radius
        pybullet.resetBasePositionAndOrientation(self._ball, [x, y, radius], [0, 0, 0, 1], physicsClientId=self._client)
        pybullet.resetBaseVelocity(
            self._ball, [vx, vy, 0.0], [-vy / radius, vx / radius, 0.0], physicsClientId=self._client
        )

    def set_upright(self, pose: Pose2D | None = None) -> None:
        """Set the robot on its feet in its start posture, at rest, as a referee's hands would, and let go.

        Args:
            pose: Where base_link shall stand, in map; None for where the robot is, with the heading that it has.

        Raises:
            ValueError: if a number is not finite.
        """
        if pose is None:
            position, (_, _, z, w), _ = self._base_pose()
            # Of all headings the one that takes the least turning from how the trunk lies.
            pose = Pose2D(float(position[0]), float(position[1]), 2.0 * math.atan2(float(z), float(w)))
        if not all(math.isfinite(value) for value in (pose.x, pose.y, pose.yaw)):
            raise ValueError(f"robot shall stand at {pose}; expected finite numbers")
        self._place_robot(pose)
        self._push_end = self._now
        self._positions, self._velocities = self._start.copy(), np.zeros(len(self._start))

    def close(self) -> None:
        """Free the physics engine; the world cannot be used afterwards."""
        self._finalizer()

    def _place_robot(self, pose: Pose2D) -> None:
        client = self._client
        turn = np.array([0.0, 0.0, math.sin(pose.yaw / 2), math.cos(pose.yaw / 2)])
        base = np.array([pose.x, pose.y, self._start_height])
        com = (
            base + quaternion_matrix(turn.tolist()) @ self._com_in_base
        )  # pybullet places the CoM, not the link's frame
        pybullet.resetBasePositionAndOrientation(self._body, com.tolist(), turn.tolist(), physicsClientId=client)
        pybullet.resetBaseVelocity(self._body, [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], physicsClientId=client)
        for index, angle in zip(self._joint_indices, self._start, strict=True):
            pybullet.resetJointState(self._body, index, float(angle), 0.0, physicsClientId=client)

    def _friction_torque(self) -> Array:
        torque: Array = self._dry_friction * np.tanh(self._velocities / self.parameters.joint_friction_speed)
        return torque

    def _apply_push(self) -> None:
        com, _ = pybullet.getBasePositionAndOrientation(self._body, physicsClientId=self._client)
        pybullet.applyExternalForce(
            self._body, -1, self._push_force.tolist(), com, pybullet.WORLD_FRAME, physicsClientId=self._client
        )

    def _base_pose(self) -> tuple[Array, Array, Array]:
        com, orientation = pybullet.getBasePositionAndOrientation(self._body, physicsClientId=self._client)
        quaternion = np.array(orientation)
        rotation = quaternion_matrix(orientation)
        return np.array(com) - rotation @ self._com_in_base, quaternion, rotation

    def _base_velocity(self, rotation: Array) -> tuple[Array, Array]:
        linear, angular = pybullet.getBaseVelocity(self._body, physicsClientId=self._client)
        x, y, z = (rotation @ self._com_in_base).tolist()
        wx, wy, wz = angular
        vx, vy, vz = linear
        lever = (vx - wy * z + wz * y, vy - wz * x + wx * z, vz - wx * y + wy * x)
        return np.array(lever), np.array(angular)

    def _body_state(self) -> BodyState:
        position, orientation, rotation = self._base_pose()
        linear, angular = self._base_velocity(rotation)
        return BodyState(
            stamp=self._now,
            joint_positions=self._positions,
            joint_velocities=self._velocities,
            joint_efforts=self._effort,
            base_position=position,
            base_orientation=orientation,
            base_rotation=rotation,
            base_linear_velocity=linear,
            base_angular_velocity=angular,
            foot_cells=self._foot_cells(),
        )

    def _foot_cells(self) -> Array:
        """Return (2, 4) forces on the cells [N], from the contacts of the soles with the carpet."""
        contacts = pybullet.getContactPoints(self._body, self._carpet, physicsClientId=self._client)
        cells = np.zeros((2, 4))
        for side, link in enumerate(self._foot_links):
            own = [(contact[5], contact[9]) for contact in contacts if contact[3] == link and contact[9] > 0.0]
            if not own:
                continue
            state = pybullet.getLinkState(self._body, link, physicsClientId=self._client)
            (ox, oy, oz), (x, y, z, w) = state[4], state[5]
            forward = (1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w))  # the sole's axes in map
            left = (2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w))
            sole_x, sole_y, _ = self.robot.soles[side].origin
            places = []
            for (px, py, pz), force in own:
                dx, dy, dz = px - ox, py - oy, pz - oz
                along = dx * forward[0] + dy * forward[1] + dz * forward[2]
                across = dx * left[0] + dy * left[1] + dz * left[2]
                places.append((along - sole_x, across - sole_y, force))
            cells[side] = cell_forces(self.robot.feet[side], places)
        return cells

    def _count_touches(self) -> None:
        """Count who has come to touch the ball in this step."""
        touched = set()
        for contact in pybullet.getContactPoints(self._body, self._ball, physicsClientId=self._client):
            if contact[9] > 0.0:
                touched.add({self._foot_links[0]: "left", self._foot_links[1]: "right"}.get(contact[3], "body"))
        if self._keeper is not None and any(
            contact[9] > 0.0
            for contact in pybullet.getContactPoints(self._keeper, self._ball, physicsClientId=self._client)
        ):
            touched.add("keeper")
        for who in touched:
            self._touches[who].touch(self._now)


class _TouchCounter:
    """Counts touches; contacts that follow each other closely are one."""

    def __init__(self) -> None:
        self.count = 0
        self._last = -TOUCH_GAP

    def touch(self, now: int) -> None:
        if now - self._last >= TOUCH_GAP:
            self.count += 1
        self._last = now


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


def _disconnect(client: int) -> None:
    if pybullet.isConnected(client):
        pybullet.disconnect(client)
