"""The world in pybullet."""

from __future__ import annotations

import weakref
from collections.abc import Set as AbstractSet

import numpy as np
from numpy.typing import NDArray

from tulip_description.planar import Pose2D
from tulip_description.quaternion import quaternion_matrix
from tulip_description.robot import Robot
from tulip_sim import bodies
from tulip_sim.engine import BallState, Layout
from tulip_sim.physics import pybullet

Array = NDArray[np.float64]


class BulletRobot:
    """One robot in pybullet.

    Attributes:
        client: Physics engine.
        number: Of its body in the engine.
        index: The engine's number of each link and joint, by name.

    Args:
        client: Physics engine.
        robot: As it really is.
        carpet: The ground's body, which the soles feel.
        ball: The ball's body; None in a world without one.
    """

    def __init__(self, client: int, robot: Robot, carpet: int, ball: int | None = None) -> None:
        self.client, self._robot, self._carpet, self._ball = client, robot, carpet, ball
        self.number, self.index = bodies.add_robot(client, robot)
        self._joints = [self.index[name] for name in robot.joint_names]
        self._feet = tuple(self.index[sole.link] for sole in robot.soles)
        self._links = {self.index[link.name]: link.name for link in robot.links}
        self._com_in_base = np.array(robot.links[0].com)

    def drive(self, torques: Array) -> None:
        """Put torques (n,) [N m] on the joints for the next step."""
        pybullet.setJointMotorControlArray(
            self.number, self._joints, pybullet.TORQUE_CONTROL, forces=torques.tolist(), physicsClientId=self.client
        )

    def push(self, force: Array) -> None:
        """Push the trunk at its CoM with a force (3,) in map [N] during the next step."""
        com, _ = pybullet.getBasePositionAndOrientation(self.number, physicsClientId=self.client)
        pybullet.applyExternalForce(
            self.number, -1, force.tolist(), com, pybullet.WORLD_FRAME, physicsClientId=self.client
        )

    def joint_state(self) -> tuple[Array, Array]:
        """Return (n,) joint positions [rad] and (n,) velocities [rad/s]."""
        states = pybullet.getJointStates(self.number, self._joints, physicsClientId=self.client)
        return np.array([state[0] for state in states]), np.array([state[1] for state in states])

    def base_pose(self) -> tuple[Array, Array, Array]:
        """Return (3,) place [m], (4,) quaternion x, y, z, w and (3, 3) rotation of base_link in map."""
        com, orientation = pybullet.getBasePositionAndOrientation(self.number, physicsClientId=self.client)
        rotation = quaternion_matrix(orientation)
        return np.array(com) - rotation @ self._com_in_base, np.array(orientation), rotation

    def base_velocity(self, rotation: Array) -> tuple[Array, Array]:
        """Return (3,) velocity [m/s] and (3,) angular velocity [rad/s] of base_link in map, given its rotation."""
        linear, angular = pybullet.getBaseVelocity(self.number, physicsClientId=self.client)
        x, y, z = (rotation @ self._com_in_base).tolist()
        wx, wy, wz = angular
        vx, vy, vz = linear
        lever = (vx - wy * z + wz * y, vy - wz * x + wx * z, vz - wx * y + wy * x)
        return np.array(lever), np.array(angular)

    def place(self, position: Array, orientation: Array, joints: Array) -> None:
        """Put base_link at a place (3,) [m] with a quaternion (4,) x, y, z, w and joints (n,) [rad], at rest."""
        client = self.client
        turn = orientation.tolist()
        com = position + quaternion_matrix(turn) @ self._com_in_base  # pybullet places the CoM, not the link's frame
        pybullet.resetBasePositionAndOrientation(self.number, com.tolist(), turn, physicsClientId=client)
        pybullet.resetBaseVelocity(self.number, [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], physicsClientId=client)
        for index, angle in zip(self._joints, joints.tolist(), strict=True):
            pybullet.resetJointState(self.number, index, angle, 0.0, physicsClientId=client)

    def sole_contacts(self, side: int) -> list[tuple[float, float, float]]:
        """Return x, y [m] in the sole frame and normal force [N] of each contact of a foot with the carpet."""
        link = self._feet[side]
        found = pybullet.getContactPoints(self.number, self._carpet, link, physicsClientId=self.client)
        own = [(contact[5], contact[9]) for contact in found if contact[9] > 0.0]
        if not own:
            return []
        state = pybullet.getLinkState(self.number, link, physicsClientId=self.client)
        (ox, oy, oz), (x, y, z, w) = state[4], state[5]
        forward = (1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w))  # the sole's axes in map
        left = (2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w))
        sole_x, sole_y, _ = self._robot.soles[side].origin
        places = []
        for (px, py, pz), force in own:
            dx, dy, dz = px - ox, py - oy, pz - oz
            along = dx * forward[0] + dy * forward[1] + dz * forward[2]
            across = dx * left[0] + dy * left[1] + dz * left[2]
            places.append((along - sole_x, across - sole_y, force))
        return places

    def links_at_ball(self) -> AbstractSet[str]:
        """Return the names of the links that press on the ball."""
        contacts = pybullet.getContactPoints(self.number, self._ball, physicsClientId=self.client)
        return {self._links[contact[3]] for contact in contacts if contact[9] > 0.0}


class BulletPhysics:
    """Carpet, goals, poles, ball, figures and robots in a pybullet of their own.

    Args:
        layout: What to build.
    """

    def __init__(self, layout: Layout) -> None:
        p = layout.parameters
        client = self._client = bodies.connect(p)
        self._finalizer = weakref.finalize(self, _disconnect, client)
        carpet = bodies.add_carpet(client, layout.friction)
        for goal in (layout.field.own_goal, layout.field.opponent_goal):
            bodies.add_goal(client, goal, p)
        if layout.poles:
            bodies.add_poles(client, layout.field)
        self._ball = bodies.add_ball(client, layout.field.ball_radius, layout.friction, p)
        self._figures = [bodies.add_figure(client, pose) for pose in layout.figures]
        self.robots = tuple(BulletRobot(client, robot, carpet, self._ball) for robot in layout.robots)

    def step(self) -> None:
        """Let a millisecond pass."""
        pybullet.stepSimulation(physicsClientId=self._client)

    def ball(self) -> BallState:
        """Return the ball's state."""
        position, orientation = pybullet.getBasePositionAndOrientation(self._ball, physicsClientId=self._client)
        linear, angular = pybullet.getBaseVelocity(self._ball, physicsClientId=self._client)
        return BallState(np.array(position), np.array(orientation), np.array(linear), np.array(angular))

    def place_ball(self, position: Array, linear_velocity: Array, angular_velocity: Array) -> None:
        """Put the ball at a place (3,) [m] with velocities (3,) [m/s] and (3,) [rad/s]."""
        pybullet.resetBasePositionAndOrientation(
            self._ball, position.tolist(), [0, 0, 0, 1], physicsClientId=self._client
        )
        pybullet.resetBaseVelocity(
            self._ball, linear_velocity.tolist(), angular_velocity.tolist(), physicsClientId=self._client
        )

    def move_figure(self, number: int, pose: Pose2D) -> None:
        """Put a figure at a pose in map."""
        bodies.move_figure(self._client, self._figures[number], pose)

    def figure_at_ball(self, number: int) -> bool:
        """Return whether a figure presses on the ball."""
        contacts = pybullet.getContactPoints(self._figures[number], self._ball, physicsClientId=self._client)
        return any(contact[9] > 0.0 for contact in contacts)

    def close(self) -> None:
        """Free the engine; this one cannot be used afterwards."""
        self._finalizer()


def _disconnect(client: int) -> None:
    if pybullet.isConnected(client):
        pybullet.disconnect(client)
