"""The bodies of the pybullet world: carpet, goals, poles, ball, keeper and robot.

Every coefficient that pybullet would otherwise choose by itself (damping, restitution, friction) is set here.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tulip_description.field import Field, Goal
from tulip_description.keeper import KeeperPart, keeper_parts
from tulip_description.planar import Pose2D
from tulip_description.robot import Box, Robot, realizable_inertia
from tulip_description.urdf import build_urdf
from tulip_sim.parameters import WorldParameters
from tulip_sim.physics import pybullet

Array = NDArray[np.float64]
GRAVITY = 9.81  # [m/s^2] as in the robot's models
NET_THICKNESS = 0.10  # [m] thick enough that a ball of 10 m/s does not pass through it between two steps
BALL_FRICTION = 0.7  # against the feet; against the carpet it is multiplied with the carpet's
HOLLOW_SPHERE = 2.0 / 3.0  # inertia of a thin shell in m r^2

QUIET = {
    "restitution": 0.0,
    "linearDamping": 0.0,
    "angularDamping": 0.0,
    "rollingFriction": 0.0,
    "spinningFriction": 0.0,
}


def connect(parameters: WorldParameters) -> int:
    """Start a physics engine in this process and return its id."""
    client = int(pybullet.connect(pybullet.DIRECT))
    pybullet.resetSimulation(physicsClientId=client)
    pybullet.setGravity(0.0, 0.0, -GRAVITY, physicsClientId=client)
    pybullet.setPhysicsEngineParameter(
        fixedTimeStep=0.001,
        numSubSteps=0,
        numSolverIterations=parameters.solver_iterations,
        deterministicOverlappingPairs=1,
        physicsClientId=client,
    )
    return client


def add_carpet(client: int, friction: float) -> int:
    """Add the ground plane z = 0."""
    shape = pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=client)
    return _static(client, shape, friction)


def add_goal(client: int, goal: Goal, parameters: WorldParameters) -> tuple[int, int]:
    """Add a goal; return the bodies of its frame (posts and bar) and of its net."""
    radius, height = goal.posts[0].radius, goal.posts[0].height
    bar_length = goal.width + 4.0 * radius
    quarter = math.sqrt(0.5)
    frame = pybullet.createCollisionShapeArray(
        shapeTypes=[pybullet.GEOM_CYLINDER] * 3,
        radii=[radius] * 3,
        lengths=[height, height, bar_length],
        collisionFramePositions=[[post.x, post.y, height / 2] for post in goal.posts]
        + [[goal.x, 0.0, goal.height + radius]],
        collisionFrameOrientations=[[0, 0, 0, 1], [0, 0, 0, 1], [quarter, 0, 0, quarter]],
        physicsClientId=client,
    )
    half = NET_THICKNESS / 2
    middle, depth = (goal.x + goal.back) / 2, goal.depth
    side = goal.posts[0].y + radius + half
    walls = [
        Box((NET_THICKNESS, bar_length, height), (goal.back + goal.outward * half, 0.0, height / 2), "", True),
        Box((depth, NET_THICKNESS, height), (middle, side, height / 2), "", True),
        Box((depth, NET_THICKNESS, height), (middle, -side, height / 2), "", True),
        Box((depth, bar_length, NET_THICKNESS), (middle, 0.0, height + half), "", True),
    ]
    net = _static(client, _boxes(client, walls), friction=1.0)
    pybullet.changeDynamics(
        net,
        -1,
        contactStiffness=parameters.net_stiffness,
        contactDamping=parameters.net_damping,
        physicsClientId=client,
    )
    return _static(client, frame, friction=0.5), net


def add_poles(client: int, field: Field) -> tuple[int, ...]:
    """Add the landmark poles."""
    bodies = []
    for pole in field.poles:
        shape = pybullet.createCollisionShape(
            pybullet.GEOM_CYLINDER, radius=pole.radius, height=pole.height, physicsClientId=client
        )
        bodies.append(_static(client, shape, friction=0.5, position=(pole.x, pole.y, pole.height / 2)))
    return tuple(bodies)


def add_ball(client: int, radius: float, carpet_friction: float, parameters: WorldParameters) -> int:
    """Add the ball, a thin shell, at the origin."""
    mass = parameters.ball_mass
    shape = pybullet.createCollisionShape(pybullet.GEOM_SPHERE, radius=radius, physicsClientId=client)
    body = int(
        pybullet.createMultiBody(
            baseMass=mass, baseCollisionShapeIndex=shape, basePosition=[0.0, 0.0, radius], physicsClientId=client
        )
    )
    inertia = HOLLOW_SPHERE * mass * radius**2
    # A rolling resistance torque mu m g slows a rolling ball by mu g / (r (1 + I / m r^2)). pybullet multiplies mu
    # with the other body's friction.
    arm = parameters.ball_rolling_deceleration * radius * (1.0 + HOLLOW_SPHERE) / GRAVITY
    pybullet.changeDynamics(
        body,
        -1,
        **{**QUIET, "rollingFriction": arm / carpet_friction, "spinningFriction": arm / carpet_friction},
        localInertiaDiagonal=[inertia] * 3,
        lateralFriction=BALL_FRICTION,
        contactStiffness=parameters.ball_stiffness,
        contactDamping=parameters.ball_damping,
        physicsClientId=client,
    )
    return body


def add_figure(client: int, pose: Pose2D) -> int:
    """Add a figure like the keeper's. It has no mass, so nothing pushes it away; `move_figure` moves it."""
    shape = _boxes(client, [part for part in keeper_parts() if part.solid])
    body = _static(client, shape, friction=0.5)
    move_figure(client, body, pose)
    return body


def move_figure(client: int, body: int, pose: Pose2D) -> None:
    """Put a figure at a pose in map."""
    turn = [0.0, 0.0, math.sin(pose.yaw / 2), math.cos(pose.yaw / 2)]
    pybullet.resetBasePositionAndOrientation(body, [pose.x, pose.y, 0.0], turn, physicsClientId=client)


def add_robot(client: int, robot: Robot, scale: Array) -> tuple[int, dict[str, int]]:
    """Load the robot, floating, all joints without motors.

    Args:
        client: Physics engine.
        robot: What to load.
        scale: (links,) factors on each link's mass and inertia, order of `robot.links`.

    Returns:
        The body, and the pybullet index of each link and joint by name (base_link: -1; a joint: that of its child).
    """
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "robot.urdf"
        valid = tuple(replace(link, inertia=realizable_inertia(link.inertia)) for link in robot.links)
        file.write_text(build_urdf(replace(robot, links=valid), mount_frames=False), encoding="utf-8")
        body = int(
            pybullet.loadURDF(
                str(file),
                useFixedBase=False,
                flags=pybullet.URDF_USE_INERTIA_FROM_FILE,  # else links without contacts get no inertia
                physicsClientId=client,
            )
        )
    index = {robot.links[0].name: -1}
    for number in range(pybullet.getNumJoints(body, physicsClientId=client)):
        info = pybullet.getJointInfo(body, number, physicsClientId=client)
        index[info[1].decode()] = index[info[12].decode()] = number
    for link, factor in zip(robot.links, scale, strict=True):
        # Loading zeroes inertias that no body can have, as some of the table; changeDynamics takes them as they are.
        pybullet.changeDynamics(
            body,
            index[link.name],
            mass=link.mass * float(factor),
            localInertiaDiagonal=[moment * float(factor) for moment in link.inertia],
            lateralFriction=1.0,
            jointDamping=0.0,
            **QUIET,
            physicsClientId=client,
        )
    for name in robot.joint_names:
        pybullet.setJointMotorControl2(
            body, index[name], pybullet.VELOCITY_CONTROL, force=0.0, physicsClientId=client
        )  # every joint starts with a motor that brakes it
    return body, index


def _boxes(client: int, boxes: Iterable[Box | KeeperPart]) -> int:
    found = list(boxes)
    return int(
        pybullet.createCollisionShapeArray(
            shapeTypes=[pybullet.GEOM_BOX] * len(found),
            halfExtents=[[size / 2 for size in box.size] for box in found],
            collisionFramePositions=[list(box.centre) for box in found],
            physicsClientId=client,
        )
    )


def _static(client: int, shape: int, friction: float, position: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> int:
    body = int(
        pybullet.createMultiBody(
            baseMass=0.0, baseCollisionShapeIndex=shape, basePosition=list(position), physicsClientId=client
        )
    )
    pybullet.changeDynamics(body, -1, **QUIET, lateralFriction=friction, physicsClientId=client)
    return body
