"""The world in MuJoCo, from the project's own MJCF: a second opinion, so that nothing is tuned to one engine."""

from __future__ import annotations

import math
from collections.abc import Set as AbstractSet
from dataclasses import replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from tulip_description.export.mjcf import MjcfWorld, build_mjcf
from tulip_description.export.mjcf_field import BALL_NAME, CARPET, figure_name
from tulip_description.export.mjcf_robot import Placement
from tulip_description.planar import Pose2D
from tulip_description.quaternion import quaternion_matrix
from tulip_description.robot import Robot, realizable_inertia
from tulip_sim.engine import BallState, Layout
from tulip_sim.parameters import materials_of

Array = NDArray[np.float64]
XYZW = [1, 2, 3, 0]
"""Order in which MuJoCo's quaternions w, x, y, z are read to give x, y, z, w."""
WXYZ = [3, 0, 1, 2]


class MujocoPhysics:
    """Carpet, goals, poles, ball, figures and robots in a MuJoCo of their own.

    Args:
        layout: What to build.
    """

    def __init__(self, layout: Layout) -> None:
        placements = []
        for number, robot in enumerate(layout.robots):
            links = tuple(replace(link, inertia=realizable_inertia(link.inertia)) for link in robot.links)
            # The simulator computes the joints' dry friction itself, for all engines alike.
            placements.append(Placement(replace(robot, links=links), f"robot_{number}_", joint_friction=False))
        world = MjcfWorld(
            layout.field,
            materials_of(layout.parameters, layout.friction),
            placements,
            figures=len(layout.figures),
            poles=layout.poles,
        )
        model = self.model = mujoco.MjModel.from_xml_string(build_mjcf(world))
        data = self.data = mujoco.MjData(model)
        self._ball_geom, ball = model.geom(BALL_NAME).id, model.joint(BALL_NAME)
        self._ball_q, self._ball_v = int(ball.qposadr[0]), int(ball.dofadr[0])
        self._figures = [model.body(figure_name(number)).id for number in range(len(layout.figures))]
        self.robots = tuple(
            MujocoRobot(model, data, robot, placement.prefix, self._ball_geom)
            for robot, placement in zip(layout.robots, placements, strict=True)
        )
        mujoco.mj_setConst(model, data)  # after the robots have set their inertias
        for number, pose in enumerate(layout.figures):
            self.move_figure(number, pose)

    def step(self) -> None:
        """Let a millisecond pass."""
        mujoco.mj_step(self.model, self.data)
        for robot in self.robots:
            robot.release()

    def ball(self) -> BallState:
        """Return the ball's state."""
        q = self.data.qpos[self._ball_q : self._ball_q + 7]
        v = self.data.qvel[self._ball_v : self._ball_v + 6]
        orientation = q[3:][XYZW]
        return BallState(q[:3].copy(), orientation, v[:3].copy(), quaternion_matrix(orientation.tolist()) @ v[3:])

    def place_ball(self, position: Array, linear_velocity: Array, angular_velocity: Array) -> None:
        """Put the ball at a place (3,) [m] with velocities (3,) [m/s] and (3,) [rad/s]."""
        self.data.qpos[self._ball_q : self._ball_q + 7] = [*position, 1.0, 0.0, 0.0, 0.0]
        self.data.qvel[self._ball_v : self._ball_v + 6] = [*linear_velocity, *angular_velocity]

    def move_figure(self, number: int, pose: Pose2D) -> None:
        """Put a figure at a pose in map."""
        mocap = self.model.body_mocapid[self._figures[number]]
        self.data.mocap_pos[mocap] = [pose.x, pose.y, 0.0]
        self.data.mocap_quat[mocap] = [math.cos(pose.yaw / 2), 0.0, 0.0, math.sin(pose.yaw / 2)]

    def figure_at_ball(self, number: int) -> bool:
        """Return whether a figure presses on the ball."""
        return self._figures[number] in bodies_at(self.model, self.data, self._ball_geom)

    def close(self) -> None:
        """Free the engine: nothing to do, its memory goes with this object."""


class MujocoRobot:
    """One robot in MuJoCo.

    Args:
        model, data: Of the world.
        robot: As it really is.
        prefix: Of its names in the model.
        ball_geom: The ball's number in the engine.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, robot: Robot, prefix: str, ball_geom: int) -> None:
        self._model, self._data, self._robot, self._ball_geom = model, data, robot, ball_geom
        self._carpet = model.geom(CARPET).id
        root = model.joint(f"{prefix}root")
        self._q, self._v = int(root.qposadr[0]), int(root.dofadr[0])
        joints = [model.joint(prefix + name) for name in robot.joint_names]
        self._joint_q = np.array([int(joint.qposadr[0]) for joint in joints])
        self._joint_v = np.array([int(joint.dofadr[0]) for joint in joints])
        self._links = {model.body(prefix + link.name).id: link.name for link in robot.links}
        self._trunk = model.body(prefix + robot.links[0].name).id
        self._feet = [model.body(prefix + sole.link).id for sole in robot.soles]
        for link in robot.links:  # as they are, even those that the compiler would refuse
            model.body_inertia[model.body(prefix + link.name).id] = link.inertia

    def drive(self, torques: Array) -> None:
        """Put torques (n,) [N m] on the joints for the next step."""
        self._data.qfrc_applied[self._joint_v] = torques

    def push(self, force: Array) -> None:
        """Push the trunk at its CoM with a force (3,) in map [N] during the next step."""
        self._data.xfrc_applied[self._trunk, :3] = force

    def release(self) -> None:
        """End a push."""
        self._data.xfrc_applied[self._trunk, :3] = 0.0

    def joint_state(self) -> tuple[Array, Array]:
        """Return (n,) joint positions [rad] and (n,) velocities [rad/s]."""
        return self._data.qpos[self._joint_q], self._data.qvel[self._joint_v]

    def base_pose(self) -> tuple[Array, Array, Array]:
        """Return (3,) place [m], (4,) quaternion x, y, z, w and (3, 3) rotation of base_link in map."""
        q = self._data.qpos[self._q : self._q + 7]
        orientation = q[3:][XYZW]
        return q[:3].copy(), orientation, quaternion_matrix(orientation.tolist())

    def base_velocity(self, rotation: Array) -> tuple[Array, Array]:
        """Return (3,) velocity [m/s] and (3,) angular velocity [rad/s] of base_link in map, given its rotation."""
        v = self._data.qvel[self._v : self._v + 6]
        return v[:3].copy(), rotation @ v[3:]

    def place(self, position: Array, orientation: Array, joints: Array) -> None:
        """Put base_link at a place (3,) [m] with a quaternion (4,) x, y, z, w and joints (n,) [rad], at rest."""
        data = self._data
        data.qpos[self._q : self._q + 7] = [*position, *orientation[WXYZ]]
        data.qpos[self._joint_q] = joints
        data.qvel[self._v : self._v + 6] = 0.0
        data.qvel[self._joint_v] = 0.0
        data.qacc_warmstart[:] = 0.0  # the solver's first guess belongs to where it was

    def sole_contacts(self, side: int) -> list[tuple[float, float, float]]:
        """Return x, y [m] in the sole frame and normal force [N] of each contact of a foot with the carpet."""
        data, foot = self._data, self._feet[side]
        contacts = data.contact
        bodies = self._model.geom_bodyid[contacts.geom]
        own = (contacts.geom == self._carpet).any(axis=1) & (bodies == foot).any(axis=1) & (contacts.efc_address >= 0)
        if not own.any():
            return []
        # Of a contact's rows the first is normal; places belong to the same instant as the forces.
        forces = data.efc_force[contacts.efc_address[own]]
        places = (contacts.pos[own] - data.xpos[foot]) @ data.xmat[foot].reshape(3, 3) - self._robot.soles[side].origin
        return [(x, y, force) for (x, y, _), force in zip(places.tolist(), forces.tolist(), strict=True) if force > 0.0]

    def links_at_ball(self) -> AbstractSet[str]:
        """Return the names of the links that press on the ball."""
        found = bodies_at(self._model, self._data, self._ball_geom)
        return {self._links[body] for body in found if body in self._links}


def bodies_at(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> set[int]:
    """Return the bodies that press on a geom."""
    contacts = data.contact
    own = (contacts.geom == geom).any(axis=1) & (contacts.efc_address >= 0)
    pairs, rows = contacts.geom[own], contacts.efc_address[own]
    pressing = data.efc_force[rows] > 0.0
    return set(model.geom_bodyid[pairs[pressing]].ravel().tolist()) - {int(model.geom_bodyid[geom])}
