"""The way to a place behind the ball that never touches the ball."""

from __future__ import annotations

import math

from tulip_description.planar import wrap_angle

Point = tuple[float, float]
ARC_STEP = 0.2  # [rad] between places on a circle


def distance_to_way(point: Point, start: Point, end: Point) -> float:
    """Return the distance [m] of a point from the straight way between two places."""
    way = (end[0] - start[0], end[1] - start[1])
    length = way[0] ** 2 + way[1] ** 2
    if length == 0.0:
        return math.dist(point, start)
    along = ((point[0] - start[0]) * way[0] + (point[1] - start[1]) * way[1]) / length
    along = min(1.0, max(0.0, along))
    return math.dist(point, (start[0] + along * way[0], start[1] + along * way[1]))


def side_round(target: Point, obstacle: Point, previous: int) -> int:
    """Return which way round an obstacle is shorter: +1 with it on the left (anticlockwise), -1 clockwise.

    Args:
        target: Where to go [m], seen from the robot.
        obstacle: What to go round [m], seen from the robot.
        previous: The side taken before, or 0; it is kept where both ways are about equally long.
    """
    robot_angle = math.atan2(-obstacle[1], -obstacle[0])
    target_angle = math.atan2(target[1] - obstacle[1], target[0] - obstacle[0])
    difference = wrap_angle(target_angle - robot_angle)
    if previous != 0 and abs(difference) > math.radians(140.0):
        return previous
    return 1 if difference >= 0.0 else -1


def arc_round(target: Point, obstacle: Point, clearance: float, side: int) -> list[Point]:
    """Return places on the circle round an obstacle, from the robot's side to the target's, seen from the robot.

    Args:
        target: Where to go [m].
        obstacle: What to go round [m].
        clearance: Radius of the circle [m].
        side: +1 anticlockwise round the obstacle, -1 clockwise.
    """
    start = math.atan2(-obstacle[1], -obstacle[0])
    end = math.atan2(target[1] - obstacle[1], target[0] - obstacle[0])
    way = (side * (end - start)) % (2.0 * math.pi)
    count = math.ceil(way / ARC_STEP)
    angles = (start + side * way * number / max(count, 1) for number in range(count + 1))
    return [(obstacle[0] + clearance * math.cos(each), obstacle[1] + clearance * math.sin(each)) for each in angles]


def next_waypoint(target: Point, obstacle: Point, clearance: float, side: int, arc_ahead: float) -> Point:
    """Return the next place to walk to, seen from the robot at the origin.

    The way is straight where it stays clear, else it runs along the tangent of the circle with the
    clearance's radius round the obstacle, then along the circle. A robot inside the circle leaves it first.

    Args:
        target: Where to go [m], outside the circle.
        obstacle: What to go round [m].
        clearance: Radius of the circle [m].
        side: +1 anticlockwise round the obstacle, -1 clockwise.
        arc_ahead: How far beyond the tangent's point the waypoint lies [rad], less than pi / 2.
    """
    distance = math.hypot(*obstacle)
    inside = distance < 0.97 * clearance  # a little slack: the tangent itself touches the circle
    if not inside and distance_to_way(obstacle, (0.0, 0.0), target) >= 0.97 * clearance:
        return target
    robot_angle = math.atan2(-obstacle[1], -obstacle[0])
    target_angle = math.atan2(target[1] - obstacle[1], target[0] - obstacle[0])
    left_to_go = (side * (target_angle - robot_angle)) % (2.0 * math.pi)
    tangent = math.acos(min(1.0, clearance / max(distance, 1e-6)))
    ahead = min(left_to_go, tangent + arc_ahead)
    radius = clearance / math.cos(max(0.0, ahead - tangent))  # on the tangent: a chord would cut into the circle
    if inside:
        radius = clearance + (clearance - distance)  # push outwards the more the deeper it is inside
    angle = robot_angle + side * ahead
    return obstacle[0] + radius * math.cos(angle), obstacle[1] + radius * math.sin(angle)
