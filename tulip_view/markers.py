"""What the robot knows and does as shapes for RViz: visualization markers out of our messages.

The robot itself is no marker: RViz draws it from `robot_description`, `joint_states` and `/tf`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from builtin_interfaces.msg import Duration
from geometry_msgs.msg import Point
from numpy.typing import NDArray
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker

from tulip_description import frames
from tulip_description.field import Field, GoalPost, Pole
from tulip_description.robot import Foot
from tulip_msgs.msg import Features, MotionState, WorldState
from tulip_view.ellipse import ball_ellipse, robot_ellipse
from tulip_vision.features import FeatureClass
from tulip_worldmodel.direction import HORIZON

Array = NDArray[np.float64]

LIFE = Duration(sec=0, nanosec=500_000_000)  # what is not sent again has been forgotten by the robot
LINE = 0.02  # [m] width of drawn lines
OPPONENT = (0.3, 1.5)  # [m] radius of the figure that stands for one, and its height

WHITE, GREEN, ORANGE, RED = (1.0, 1.0, 1.0), (0.2, 0.8, 0.2), (1.0, 0.5, 0.0), (0.9, 0.1, 0.1)
BLUE, YELLOW = (0.2, 0.4, 1.0), (1.0, 0.9, 0.1)
Colour = tuple[float, float, float]


def field_markers(field: Field) -> list[Marker]:
    """Return lines, goal posts and poles in map; they stay."""
    top = Header(frame_id=frames.MAP)
    ends = [point for line in field.line_segments for point in (line.start, line.end)]
    circle = field.centre_circle
    turn = np.linspace(0.0, 2.0 * math.pi, 49)
    ring = np.column_stack([circle.x + circle.radius * np.cos(turn), circle.y + circle.radius * np.sin(turn)])
    marks = np.array(field.penalty_marks)
    result = [
        _lines(top, "field", 0, ends, WHITE, Marker.LINE_LIST, field.line_width),
        _lines(top, "field", 1, ring, WHITE, Marker.LINE_STRIP, field.line_width),
        _points(top, "field", 2, np.column_stack([marks, np.zeros(2)]), WHITE, field.penalty_mark_size),
    ]
    upright: list[GoalPost | Pole] = [*field.goal_posts, *field.poles]
    for index, post in enumerate(upright):
        marker = _marker(top, "goals and poles", index, Marker.CYLINDER, YELLOW)
        _place(marker, (post.x, post.y, post.height / 2.0), (2.0 * post.radius, 2.0 * post.radius, post.height))
        result.append(marker)
    for marker in result:
        marker.lifetime = Duration()
    return result


def world_markers(world: WorldState, ball_radius: float) -> list[Marker]:
    """Return robot, ball and opponents as the world model believes them to be, in map.

    Args:
        world: The belief.
        ball_radius: [m].
    """
    top = Header(stamp=world.header.stamp, frame_id=frames.MAP)
    x, y, yaw = (float(value) for value in world.robot_pose)
    robot = _marker(top, "robot", 0, Marker.ARROW, BLUE)
    _place(robot, (x, y, 0.0), (0.5, 0.06, 0.06), yaw)
    result = [robot, *_ellipse(top, "robot", 1, robot_ellipse(world), BLUE)]
    if world.ball_known:
        at = np.asarray(world.ball.position_in_map, dtype=float)
        ball = _marker(top, "ball", 0, Marker.SPHERE, ORANGE)
        _place(ball, (*at, ball_radius), (2.0 * ball_radius,) * 3)
        result += [ball, *_ellipse(top, "ball", 1, ball_ellipse(world), ORANGE)]
        if world.ball_rest_after > 0.0:
            c, s = math.cos(yaw), math.sin(yaw)
            rest = np.array([x, y]) + np.array([[c, -s], [s, c]]) @ np.asarray(world.ball_rest, dtype=float)
            result.append(_lines(top, "ball", 2, [at, rest], ORANGE, Marker.LINE_STRIP))
    for index, opponent in enumerate(world.opponents):
        radius, height = OPPONENT
        figure = _marker(top, "opponents", index, Marker.CYLINDER, RED, 0.5)
        _place(figure, (*opponent.position_in_map, height / 2.0), (2.0 * radius, 2.0 * radius, height))
        result.append(figure)
    return result


def motion_markers(state: MotionState, feet: Iterable[Foot]) -> list[Marker]:
    """Return soles, CoM, DCM and ZMP on the ground, in odom; what is wanted is paler than what is.

    Args:
        state: Of the legs.
        feet: Left and right sole rectangle.
    """
    top = Header(stamp=state.header.stamp, frame_id=frames.ODOM)
    result = []
    for index, (foot, sole) in enumerate(zip(feet, (state.left_sole, state.right_sole), strict=True)):
        pose = np.asarray(sole, dtype=float).reshape(4, 4)
        corners = np.array([[foot.x[i], foot.y[j], 0.0, 1.0] for i, j in ((0, 0), (1, 0), (1, 1), (0, 1), (0, 0))])
        outline = (corners @ pose.T)[:, :3]
        result.append(_lines(top, "soles", index, outline, WHITE, Marker.LINE_STRIP, LINE / 2.0))
    named = (
        ("CoM", state.com, state.com_desired, YELLOW),
        ("DCM", state.dcm, state.dcm_desired, BLUE),
        ("ZMP", state.zmp, state.zmp_desired, GREEN),
    )
    for name, real, desired, colour in named:
        for index, (point, alpha) in enumerate(((real, 1.0), (desired, 0.4))):
            place = np.array([[float(point[0]), float(point[1]), 0.0]])
            if np.isfinite(place).all():  # a ZMP needs contact
                result.append(_points(top, name, index, place, colour, 0.03, alpha))
    return result


def feature_markers(features: Features) -> list[Marker]:
    """Return what vision found in the newest picture where its rays meet the ground, in base_footprint."""
    top = Header(stamp=features.header.stamp, frame_id=frames.BASE_FOOTPRINT)
    camera = np.asarray(features.camera_position, dtype=float)
    points: dict[FeatureClass, list[Array]] = {}
    lines: list[Array] = []
    for feature in features.features:
        here = _on_ground(camera, feature.azimuth, feature.elevation)
        there = _on_ground(camera, feature.end_azimuth, feature.end_elevation)
        if here is not None and there is not None:
            lines += [here, there]
        elif here is not None:
            points.setdefault(FeatureClass(feature.kind), []).append(here)
    result = [_lines(top, "seen lines", 0, lines, GREEN, Marker.LINE_LIST)] if lines else []
    for kind, found in points.items():
        colour = ORANGE if kind is FeatureClass.BALL else RED if kind is FeatureClass.OPPONENT else GREEN
        result.append(_points(top, f"seen {kind.name.lower().replace('_', ' ')}", 0, np.array(found), colour, 0.1))
    return result


def _on_ground(camera: Array, azimuth: float, elevation: float) -> Array | None:
    """Return where a ray meets the ground (3,) [m], or None: it does not, or too far away to tell."""
    if not elevation < HORIZON:  # NaN, too
        return None
    reach = camera[2] / math.tan(-elevation)
    return np.array([camera[0] + reach * math.cos(azimuth), camera[1] + reach * math.sin(azimuth), 0.0])


def _ellipse(top: Header, name: str, index: int, outline: Array | None, colour: Colour) -> list[Marker]:
    return [] if outline is None else [_lines(top, name, index, outline, colour, Marker.LINE_STRIP)]


def _lines(
    top: Header, name: str, index: int, points: Iterable[Iterable[float]], colour: Colour, kind: int,
    width: float = LINE,
) -> Marker:  # fmt: skip
    marker = _marker(top, name, index, kind, colour)
    marker.scale.x = width
    marker.points = [_point(point) for point in points]
    return marker


def _points(
    top: Header, name: str, index: int, points: Array, colour: Colour, size: float, alpha: float = 1.0
) -> Marker:
    marker = _marker(top, name, index, Marker.SPHERE_LIST, colour, alpha)
    marker.scale.x = marker.scale.y = marker.scale.z = size
    marker.points = [_point(point) for point in points]
    return marker


def _marker(top: Header, name: str, index: int, kind: int, colour: Colour, alpha: float = 1.0) -> Marker:
    red, green, blue = colour
    marker = Marker(header=top, ns=name, id=index, type=kind, action=Marker.ADD, lifetime=LIFE)
    marker.color = ColorRGBA(r=red, g=green, b=blue, a=alpha)
    marker.pose.orientation.w = 1.0
    return marker


def _place(
    marker: Marker, position: tuple[float, float, float], size: tuple[float, float, float], yaw: float = 0.0
) -> None:
    place, turn = marker.pose.position, marker.pose.orientation
    place.x, place.y, place.z = (float(value) for value in position)
    turn.z, turn.w = math.sin(yaw / 2.0), math.cos(yaw / 2.0)
    marker.scale.x, marker.scale.y, marker.scale.z = size


def _point(values: Iterable[float]) -> Point:
    x, y, *z = (float(value) for value in values)
    return Point(x=x, y=y, z=z[0] if z else 0.0)
