"""The bodies of the pybullet world: carpet, goals, poles, ball, keeper and robot.

Every coefficient that pybullet would otherwise choose by itself (damping, restitution, friction) is set here.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from tulip_description.field import Field, Goal
from tulip_description.field_solids import goal_frame, net_walls
from tulip_description.keeper import KeeperPart, keeper_parts
from tulip_description.materials import BALL_FRICTION, GRAVITY, NET_FRICTION, POST_FRICTION, SOLE_FRICTION
from tulip_description.planar import Pose2D
from tulip_description.robot import Box, Robot, realizable_inertia
from tulip_description.urdf import build_urdf
from tulip_sim.parameters import STEP, WorldParameters, materials_of
from tulip_sim.physics import pybullet

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
        fixedTimeStep=STEP,
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
    quarter = math.sqrt(0.5)
    pipes = goal_frame(goal)
    frame = pybullet.createCollisionShapeArray(
        shapeTypes=[pybullet.GEOM_CYLINDER] * len(pipes),
        radii=[pipe.radius for pipe in pipes],
        lengths=[pipe.length for pipe in pipes],
        collisionFramePositions=[list(pipe.centre) for pipe in pipes],
        collisionFrameOrientations=[[0, 0, 0, 1] if pipe.upright else [quarter, 0, 0, quarter] for pipe in pipes],
        physicsClientId=client,
    )
    net = _static(client, _boxes(client, net_walls(goal)), friction=NET_FRICTION)
    pybullet.changeDynamics(
        net,
        -1,
        contactStiffness=parameters.net_stiffness,
        contactDamping=parameters.net_damping,
        physicsClientId=client,
    )
    return _static(client, frame, friction=POST_FRICTION), net


def add_poles(client: int, field: Field) -> tuple[int, ...]:
    """Add the landmark poles."""
    bodies = []
    for pole in field.poles:
        shape = pybullet.createCollisionShape(
            pybullet.GEOM_CYLINDER, radius=pole.radius, height=pole.height, physicsClientId=client
        )
        bodies.append(_static(client, shape, friction=POST_FRICTION, position=(pole.x, pole.y, pole.height / 2)))
    return tuple(bodies)


def add_ball(client: int, radius: float, carpet_friction: float, parameters: WorldParameters) -> int:
    """Add the ball, a thin shell, at the origin."""
    materials = materials_of(parameters, carpet_friction)
    mass = materials.ball_mass
    shape = pybullet.createCollisionShape(pybullet.GEOM_SPHERE, radius=radius, physicsClientId=client)
    body = int(
        pybullet.createMultiBody(
            baseMass=mass, baseCollisionShapeIndex=shape, basePosition=[0.0, 0.0, radius], physicsClientId=client
        )
    )
    arm = materials.rolling_arm(radius)  # pybullet multiplies it with the other body's friction
    pybullet.changeDynamics(
        body,
        -1,
        **{**QUIET, "rollingFriction": arm / carpet_friction, "spinningFriction": arm / carpet_friction},
        localInertiaDiagonal=[materials.ball_inertia(radius)] * 3,
        lateralFriction=BALL_FRICTION,
        contactStiffness=parameters.ball_stiffness,
        contactDamping=parameters.ball_damping,
        physicsClientId=client,
    )
    return body


def add_figure(client: int, pose: Pose2D) -> int:
    """Add a figure like the keeper's. It has no mass, so nothing pushes it away; `move_figure` moves it."""
    shape = _boxes(client, [part for part in keeper_parts() if part.solid])
    body = _static(client, shape, friction=POST_FRICTION)
    move_figure(client, body, pose)
    return body


def move_figure(client: int, body: int, pose: Pose2D) -> None:
    """Put a figure at a pose in map."""
    turn = [0.0, 0.0, math.sin(pose.yaw / 2), math.cos(pose.yaw / 2)]
    pybullet.resetBasePositionAndOrientation(body, [pose.x, pose.y, 0.0], turn, physicsClientId=client)


def add_robot(client: int, robot: Robot) -> tuple[int, dict[str, int]]:
    """Load the robot, floating, all joints without motors.

    Args:
        client: Physics engine.
        robot: What to load.

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
    for link in robot.links:
        # Loading zeroes inertias that no body can have, as some of the table; changeDynamics takes them as they are.
        pybullet.changeDynamics(
            body,
            index[link.name],
            mass=link.mass,
            localInertiaDiagonal=list(link.inertia),
            lateralFriction=SOLE_FRICTION,
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
