"""A standing robot that looks round, for calibrating how its camera sits: pictures with what the robot measured."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from tulip_description.field import load_field
from tulip_description.planar import Pose2D
from tulip_motion.head import HeadMovement, HeadParameters
from tulip_motion.interface import HeadCommand, HeadMode, WalkCommand, WalkMode
from tulip_motion.motion import Motion
from tulip_motion.parameters import MotionParameters
from tulip_sim.camera import CameraParameters, CameraRenderer
from tulip_sim.parameters import WorldParameters
from tulip_sim.scenario import Scenario
from tulip_sim.timing import SLOW_TICKS, TICK
from tulip_sim.world import World
from tulip_vision.calibration.recording import Shot
from tulip_vision.lens import Lens

DISTANCES = (0.9, 1.6, 3.5)  # [m] on the ground, so that the head is tilted differently
PANS = tuple(math.radians(angle) for angle in (-100.0, -60.0, -20.0, 20.0, 60.0, 100.0))  # [rad]
SETTLING = 1.0  # [s] after the start, until the robot stands still
LOOKING = 0.6  # [s] for a turn of the head, and until it rests
BALL_AWAY = (-4.0, -2.8)  # [m] x, y: nothing hides the lines


def look_round(
    seed: int, place: Pose2D, lens: Lens, camera: CameraParameters
) -> Iterator[tuple[NDArray[np.uint8], Shot]]:
    """Let a robot stand and look round; yield each picture, (height, width, 3) BGR, with what the robot measured.

    World, motion control and head movement run in lockstep.

    Args:
        seed: Of masses, friction, sensor errors and picture noise.
        place: Where the robot is put.
        lens: Of its camera.
        camera: How it sees, and by how much its mount errs.
    """
    world = World(Scenario(place, BALL_AWAY, poles=False), WorldParameters(), seed)
    try:
        motion, head = Motion(MotionParameters(), world.robot), HeadMovement(HeadParameters(), world.robot)
        renderer = CameraRenderer(camera, load_field(), world.robot, lens)
        rng = np.random.default_rng([seed, 1])
        targets = [(distance * math.cos(pan), distance * math.sin(pan), 0.0) for distance in DISTANCES for pan in PANS]
        tick = 0
        for index, target in enumerate([targets[0], *targets]):
            command = HeadCommand(0, HeadMode.LOOK_AT, target)
            for _ in range(round((SETTLING if index == 0 else LOOKING) * 1000 / TICK)):
                sensors = world.sensors()
                motion.command(WalkCommand(0, WalkMode.STAND))
                world.apply(motion.tick(sensors))
                if tick % SLOW_TICKS == 0:
                    world.apply(head.update(sensors.stamp, command, sensors.joint_positions[12:]))
                world.advance(TICK)
                tick += 1
            if index == 0:
                continue
            sensors, odometry = world.sensors(), motion.odometry()
            pan, tilt = sensors.joint_positions[12:].tolist()
            x, y, z, w = odometry.orientation.tolist()
            shot = Shot(f"look{index - 1:03d}.png", pan, tilt, float(odometry.position[2]), (x, y, z, w))
            yield renderer.render(world.truth(), rng), shot
    finally:
        world.close()
