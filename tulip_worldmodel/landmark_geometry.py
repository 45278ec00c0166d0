"""Where landmarks appear from a state, and how a seen piece of line lies to lines of the field: loops, compiled.

A filter asks this some twenty times a picture, for a few landmarks each: of numpy's time most would be its calls.

State, (7,): x, y [m], yaw [rad] of base_footprint in map; the small rotation w about the x, y and z axes of
base_footprint [rad] by which the camera's pose errs (camera_error.py); the heading drift [rad/s] of dead reckoning.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

STATES = 7
ERROR = slice(3, 6)  # of the state: the camera pose's error w
NEAREST = 1e-6  # [m] from the optical centre across the ground: nearer than that an azimuth has no meaning


@njit(cache=True)
def point_directions(state: Array, points: Array, camera_position: Array) -> tuple[Array, Array]:
    """Return under which angles places on the ground appear.

    Args:
        state: (7,) see the module.
        points: (n, 2) in map [m].
        camera_position: (3,) optical centre in base_footprint [m].

    Returns:
        (n, 2) azimuth and elevation [rad], and (n, 2, 7) their derivatives by the state.
    """
    count = len(points)
    angles = np.empty((count, 2))
    by_state = np.zeros((count, 2, STATES))
    c, s = math.cos(state[2]), math.sin(state[2])
    roll, pitch, turn = state[3], state[4], state[5]
    z = -camera_position[2]
    for i in range(count):
        ahead = c * (points[i, 0] - state[0]) + s * (points[i, 1] - state[1])  # in base_footprint
        left = c * (points[i, 1] - state[1]) - s * (points[i, 0] - state[0])
        x, y = ahead - camera_position[0], left - camera_position[1]
        seen_x, seen_y, seen_z = (
            x - turn * y + pitch * z,
            y + turn * x - roll * z,
            z - pitch * x + roll * y,
        )  # o + w x o
        ground = max(math.hypot(seen_x, seen_y), NEAREST)
        whole = ground**2 + seen_z**2
        angles[i, 0], angles[i, 1] = math.atan2(seen_y, seen_x), math.atan2(seen_z, ground)
        sink = -seen_z / (ground * whole)
        for k in range(2):
            if k == 0:
                by_x, by_y, by_z = -seen_y / ground**2, seen_x / ground**2, 0.0
            else:
                by_x, by_y, by_z = seen_x * sink, seen_y * sink, ground / whole
            by_ahead = by_x + turn * by_y - pitch * by_z
            by_left = by_y - turn * by_x + roll * by_z
            by_state[i, k, 0] = s * by_left - c * by_ahead
            by_state[i, k, 1] = -s * by_ahead - c * by_left
            by_state[i, k, 2] = by_ahead * left - by_left * ahead
            by_state[i, k, 3] = by_z * y - by_y * z
            by_state[i, k, 4] = by_x * z - by_z * x
            by_state[i, k, 5] = by_y * x - by_x * y
    return angles, by_state


@njit(cache=True)
def piece_on_ground(state: Array, ends: Array, camera_position: Array) -> tuple[Array, Array, Array]:
    """Return where a piece of line lies on the ground.

    Args:
        state: (7,) see the module.
        ends: (2, 2) azimuth and elevation of both ends [rad], below the horizon.
        camera_position: (3,) optical centre in base_footprint [m].

    Returns:
        (2, 2) both ends in base_footprint [m]; for each its derivatives (2, 2, 3) by w and (2, 2, 2) by its angles.
    """
    points, by_error, by_angles = np.empty((2, 2)), np.empty((2, 2, 3)), np.empty((2, 2, 2))
    roll, pitch, turn = state[3], state[4], state[5]
    for end in range(2):
        ca, sa = math.cos(ends[end, 0]), math.sin(ends[end, 0])
        ce, se = math.cos(ends[end, 1]), math.sin(ends[end, 1])
        rx, ry, rz = ce * ca, ce * sa, se
        x, y, z = rx + turn * ry - pitch * rz, ry - turn * rx + roll * rz, rz + pitch * rx - roll * ry  # r - w x r
        reach = -camera_position[2] / z
        points[end, 0], points[end, 1] = camera_position[0] + reach * x, camera_position[1] + reach * y
        for k in range(2):
            by_z = -reach * (x if k == 0 else y) / z  # of place k; by x or y of the ray it is `reach`
            by_x, by_y = (reach, 0.0) if k == 0 else (0.0, reach)
            by_error[end, k, 0] = by_y * rz - by_z * ry
            by_error[end, k, 1] = by_z * rx - by_x * rz
            by_error[end, k, 2] = by_x * ry - by_y * rx
            for angle in range(2):
                ax, ay, az = (-ry, rx, 0.0) if angle == 0 else (-se * ca, -se * sa, ce)
                by_angles[end, k, angle] = (
                    by_x * (ax + turn * ay - pitch * az)
                    + by_y * (ay - turn * ax + roll * az)
                    + by_z * (az + pitch * ax - roll * ay)
                )
    return points, by_error, by_angles


@njit(cache=True)
def line_misfits(
    state: Array, ends: Array, camera_position: Array, directions: Array, starts: Array
) -> tuple[Array, Array, Array, Array]:
    """Return how a seen piece of line lies relative to n lines of the field.

    Args:
        state: (7,) see the module.
        ends: (2, 2) azimuth and elevation of the piece's ends [rad], below the horizon.
        camera_position: (3,) optical centre in base_footprint [m].
        directions: (n,) of the lines in map [rad].
        starts: (n, 2) where the lines start, each along and across itself [m].

    Returns:
        (n, 2) angle between piece and line [rad, in [-pi/2, pi/2)] and distance of the piece's middle from the
        line [m]; their derivatives (n, 2, 7) by the state and (n, 2, 4) by azimuth and elevation of both ends;
        (n, 2) where both ends lie along the line, from its start [m].
    """
    points, by_error, by_end = piece_on_ground(state, ends, camera_position)
    count = len(directions)
    misfits, along = np.empty((count, 2)), np.empty((count, 2))
    by_state, by_angles = np.zeros((count, 2, STATES)), np.empty((count, 2, 4))
    c, s = math.cos(state[2]), math.sin(state[2])
    middle_x, middle_y = 0.5 * (points[0, 0] + points[1, 0]), 0.5 * (points[0, 1] + points[1, 1])
    piece_x, piece_y = points[1, 0] - points[0, 0], points[1, 1] - points[0, 1]
    heading = math.atan2(piece_y, piece_x) + state[2]
    length = max(piece_x**2 + piece_y**2, 1e-6)
    turn_x, turn_y = -piece_y / length, piece_x / length  # of the angle, by the second end
    for i in range(count):
        along_x, along_y = math.cos(directions[i]), math.sin(directions[i])
        across_x, across_y = c * -along_y + s * along_x, s * along_y + c * along_x  # in base_footprint
        misfits[i, 0] = (heading - directions[i] + 0.5 * math.pi) % math.pi - 0.5 * math.pi
        by_state[i, 0, 2] = 1.0
        by_state[i, 1, 0], by_state[i, 1, 1] = -along_y, along_x
        by_state[i, 1, 2] = across_y * middle_x - across_x * middle_y
        for k in range(3):
            by_state[i, 0, 3 + k] = turn_x * (by_error[1, 0, k] - by_error[0, 0, k]) + turn_y * (
                by_error[1, 1, k] - by_error[0, 1, k]
            )
            by_state[i, 1, 3 + k] = 0.5 * (
                across_x * (by_error[0, 0, k] + by_error[1, 0, k]) + across_y * (by_error[0, 1, k] + by_error[1, 1, k])
            )
        misfits[i, 1] = -starts[i, 1]
        for end in range(2):
            place_x = state[0] + c * points[end, 0] - s * points[end, 1]
            place_y = state[1] + s * points[end, 0] + c * points[end, 1]
            along[i, end] = along_x * place_x + along_y * place_y - starts[i, 0]
            misfits[i, 1] += 0.5 * (along_x * place_y - along_y * place_x)
            sign = 1.0 if end == 1 else -1.0
            for k in range(2):
                by_angles[i, 0, 2 * end + k] = sign * (turn_x * by_end[end, 0, k] + turn_y * by_end[end, 1, k])
                by_angles[i, 1, 2 * end + k] = 0.5 * (across_x * by_end[end, 0, k] + across_y * by_end[end, 1, k])
    return misfits, by_state, by_angles, along


def rehearse() -> None:
    """Compile, or load what was compiled: the first picture would wait some seconds for it."""
    state, ends, camera_position = np.zeros(STATES), np.full((2, 2), -0.5), np.array([0.0, 0.0, 1.0])
    point_directions(state, ends, camera_position)
    line_misfits(state, ends, camera_position, np.zeros(1), np.zeros((1, 2)))
