"""The project's own simulated robot on the project's own carpet, as an `Engine`."""

from __future__ import annotations

import weakref
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tulip_description.planar import Pose2D
from tulip_description.quaternion import quaternion_matrix
from tulip_description.robot import Robot
from tulip_description.robot_io import JointCommand
from tulip_sim import bodies
from tulip_sim.bullet_physics import BulletRobot
from tulip_sim.driver import MILLISECOND
from tulip_sim.parameters import STEP, WorldParameters
from tulip_sim.physics import pybullet
from tulip_sim.simcheck.engine import Millisecond, State
from tulip_sim.simulated_robot import SimulatedRobot, as_drawn

Array = NDArray[np.float64]


class BulletEngine:
    """`SimulatedRobot` alone on the carpet, without randomness.

    Args:
        robot: What to load.
        start: (n,) posture that it holds until the first command [rad], feet flat.
        substeps: Steps of physics a millisecond; the simulator plays with 1. The driver acts once a millisecond.
    """

    def __init__(self, robot: Robot, start: Array, substeps: int = 1) -> None:
        exact = WorldParameters.exact()
        parameters = replace(exact, sensors=replace(exact.sensors, period=1))
        self.robot, self._substeps, self._now = robot, substeps, 0
        self._client = bodies.connect(parameters)
        self._finalizer = weakref.finalize(self, pybullet.disconnect, self._client)
        pybullet.setPhysicsEngineParameter(fixedTimeStep=STEP / substeps, physicsClientId=self._client)
        self._carpet = bodies.add_carpet(self._client, parameters.friction[0])
        unused = np.random.default_rng(0)
        really = as_drawn(robot, parameters, unused)
        self._body = BulletRobot(self._client, really, self._carpet)
        self._simulated = SimulatedRobot(robot, self._body, parameters, start, Pose2D(), (unused, unused))
        self._com = np.array(robot.links[0].com)
        self._push, self._push_end = np.zeros(3), 0

    @property
    def state(self) -> State:
        """The state now."""
        own = self._simulated
        position, quaternion, rotation = own.body.base_pose()
        linear, angular = own.body.base_velocity(rotation)
        return State(
            np.concatenate([position, quaternion, own.joint_positions]),
            np.concatenate([rotation.T @ linear, rotation.T @ angular, own.joint_velocities]),
        )

    def set_state(self, state: State) -> None:
        """Put the robot into a state."""
        client, own = self._client, self._simulated
        rotation = quaternion_matrix(state.q[3:7].tolist())
        com = state.q[:3] + rotation @ self._com
        # pybullet wants place and velocity of the trunk's CoM.
        linear = rotation @ (state.v[:3] + np.cross(state.v[3:6], self._com))
        angular = rotation @ state.v[3:6]
        pybullet.resetBasePositionAndOrientation(
            self._body.number, com.tolist(), state.q[3:7].tolist(), physicsClientId=client
        )
        pybullet.resetBaseVelocity(self._body.number, linear.tolist(), angular.tolist(), physicsClientId=client)
        for name, angle, speed in zip(self.robot.joint_names, state.q[7:], state.v[6:], strict=True):
            pybullet.resetJointState(
                self._body.number, self._body.index[name], float(angle), float(speed), physicsClientId=client
            )
        own.read_joints()

    def apply(self, command: JointCommand) -> str:
        """Give a command to the joint driver; return "" or why it is not taken."""
        return self._simulated.accept(command, self._now)

    def push(self, force: ArrayLike, milliseconds: int) -> None:
        """Push the trunk at its CoM with a force (3,) in map [N] from now on."""
        self._simulated.push(force, milliseconds, self._now)
        self._push, self._push_end = np.array(force, dtype=float), self._now + milliseconds * MILLISECOND

    def advance(self) -> Millisecond:
        """Let a millisecond pass."""
        own, contact = self._simulated, np.zeros(6)
        push = self._push if self._now < self._push_end else np.zeros(3)
        for _ in range(self._substeps):
            own.drive(self._now)  # the same torques in each substep: it reads no new joint angles
            pybullet.stepSimulation(physicsClientId=self._client)
            contact += self._contact_impulse()
        self._now += MILLISECOND
        own.read_joints()
        own.measure(self._now)
        return Millisecond(own.sensors(self._now).joint_efforts, push, contact, self._depth())

    def close(self) -> None:
        """Free the physics engine; this one cannot be used afterwards."""
        self._finalizer()

    def _contact_impulse(self) -> Array:
        """Return (6,) the ground's impulse in the last step of physics and its moment about the origin."""
        impulse = np.zeros(6)
        for point in pybullet.getContactPoints(self._body.number, self._carpet, physicsClientId=self._client):
            axes, sizes = np.array([point[7], point[11], point[13]]), np.array([point[9], point[10], point[12]])
            force = sizes @ axes  # pressing, and friction both ways
            impulse[:3] += force
            impulse[3:] += np.cross(point[6], force)
        return impulse * 1e-3 / self._substeps

    def _depth(self) -> float:
        points = pybullet.getClosestPoints(self._body.number, self._carpet, 1.0, physicsClientId=self._client)
        return -min((point[8] for point in points), default=1.0)
