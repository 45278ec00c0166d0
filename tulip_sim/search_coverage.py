"""Which part of the field a search sees: proof for the pattern of the head's sweeps.

The head's own trajectory is run, pictures are taken at the camera's rate, and each place on the ground round the robot
is asked in how many of them a ball there would be whole in the picture and big enough, through the real lens.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tulip_description.camera_pose import camera_in_footprint
from tulip_description.posture import standing_posture
from tulip_description.robot import Robot
from tulip_motion.head import HeadMovement, HeadParameters
from tulip_motion.interface import HeadCommand, HeadMode
from tulip_sim.timing import CAMERA_TICKS, SLOW_TICKS, TICK
from tulip_vision.lens import Lens

Array = NDArray[np.float64]


@dataclass(frozen=True)
class CoverageParameters:
    """What counts as seen.

    Attributes:
        ball_radius: [m].
        least_diameter: Of the ball in the picture [px].
        least_pictures: In so many pictures: the world model takes a ball for real with the third sighting.
        sharp_speed: Pictures taken while the head turns faster than this do not count [rad/s].
        lowered: How much lower than in the standing posture a walking robot carries its head [m].
        lean: How far its trunk leans forward [rad].
    """

    ball_radius: float
    least_diameter: float = 4.0
    least_pictures: int = 3
    sharp_speed: float = 1.6
    lowered: float = 0.0
    lean: float = 0.0


@dataclass(frozen=True)
class Coverage:
    """How often each place was seen.

    Attributes:
        directions: (d,) in the robot's axes at the start, left positive [rad].
        ranges: (r,) from the middle between the feet along the ground [m].
        pictures: (d, r) number of pictures that show a ball there.
        first: (d, r) when the place counts as seen [s], NaN for never.
        seen: (d, r) whether it counts as seen.
    """

    directions: Array
    ranges: Array
    pictures: NDArray[np.intp]
    first: Array
    seen: NDArray[np.bool_]


def search_coverage(
    head: HeadParameters,
    robot: Robot,
    lens: Lens,
    directions: Array,
    ranges: Array,
    duration: float,
    parameters: CoverageParameters,
    turning: float = 0.0,
    start: tuple[float, float] = (0.0, 0.4),
) -> Coverage:
    """Return what a search sees.

    Args:
        head: Of head movement, whose search pattern is run.
        robot: A robot with a head; its head is as high as in its standing posture, less `lowered`.
        lens: Of the head camera.
        directions: (d,) of places to ask for [rad].
        ranges: (r,) of these [m].
        duration: Of the search [s].
        parameters: What counts as seen.
        turning: Rate at which the body turns meanwhile [rad/s].
        start: Pan and tilt at the start [rad].
    """
    places = np.stack(
        [
            np.outer(np.cos(directions), ranges),
            np.outer(np.sin(directions), ranges),
            np.full((len(directions), len(ranges)), parameters.ball_radius),
        ],
        axis=-1,
    ).reshape(-1, 3)
    height = standing_posture(robot).base_height - parameters.lowered
    attitude = (0.0, math.sin(parameters.lean / 2.0), 0.0, math.cos(parameters.lean / 2.0))
    movement = HeadMovement(head, robot)
    command = HeadCommand(0, HeadMode.SEARCH)
    angles, velocity = np.array(start), np.zeros(2)
    pictures = np.zeros(len(places), dtype=np.intp)
    first = np.full(len(places), math.nan)
    for tick in range(round(duration * 1000 / TICK)):
        seconds = tick * TICK * 1e-3
        if tick % SLOW_TICKS == 0:
            answer = movement.update(tick * TICK * 1_000_000, command, angles)
            angles, velocity = answer.position, answer.velocity
        if tick % CAMERA_TICKS or float(np.abs(velocity).max()) > parameters.sharp_speed:
            continue
        pan, tilt = (angles + velocity * (tick % SLOW_TICKS) * TICK * 1e-3).tolist()
        camera = camera_in_footprint(robot, height, attitude, pan, tilt)
        turned = turning * seconds
        c, s = math.cos(turned), math.sin(turned)
        inside = _shown(places @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]), camera, lens, parameters)
        pictures[inside] += 1
        first[inside & (pictures == parameters.least_pictures)] = seconds
    shape = (len(directions), len(ranges))
    seen = pictures >= parameters.least_pictures
    return Coverage(directions, ranges, pictures.reshape(shape), first.reshape(shape), seen.reshape(shape))


def _shown(places: Array, camera: Array, lens: Lens, parameters: CoverageParameters) -> NDArray[np.bool_]:
    """Tell at which places (n, 3) of base_footprint a ball is whole in the picture and big enough."""
    offsets = places - camera[:3, 3]
    distances = np.linalg.norm(offsets, axis=1)
    pixels = lens.project(offsets @ camera[:3, :3])
    angle = 2.0 * np.arcsin(np.minimum(1.0, parameters.ball_radius / distances))
    cosines = offsets @ camera[:3, 2] / distances
    diameters = angle / np.array([lens.angle_per_pixel(float(cosine)) for cosine in cosines])
    edge = 0.5 * diameters
    with np.errstate(invalid="ignore"):
        u, v = pixels.T
        inside = (u >= edge) & (u <= lens.width - 1 - edge) & (v >= edge) & (v <= lens.height - 1 - edge)
    shown: NDArray[np.bool_] = inside & (diameters >= parameters.least_diameter)
    return shown
