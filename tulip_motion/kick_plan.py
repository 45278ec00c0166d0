"""Kicks from standing, planned: where the foot meets the ball, how it gets there, or why it cannot."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tulip_description.planar import Pose2D, wrap_angle
from tulip_description.robot import Foot
from tulip_motion.interface import KickGoal, KickKind, Side
from tulip_motion.kick_geometry import gap_between, striking_face
from tulip_motion.kick_path import Move, Profile
from tulip_motion.parameters import MotionParameters

Array = NDArray[np.float64]
Point = tuple[float, float]

WAY_STEP = 0.01  # [m] by which run-up and follow-through are shortened until they fit
# [m] where the kicking leg's hip is, ahead of and outside the standing ankle, while the CoM is over the standing foot:
# hips are 0.267 m apart and the CoM falls 0.01 m inside that ankle.
HIP = (0.018, 0.143)
SHORTEST_FOLLOW_THROUGH = 0.06  # [m] at most; in it a foot of 1.5 m/s stops with BRAKING
BRAKING = 29.0  # [m/s^2] greatest on a follow-through that is as short as it may be, 3 g
SLOWEST = 0.9  # of the wanted speed, where only a slower foot can stop within the leg's reach
CLEARANCE_STEP = 0.02  # [m] of the path between two looks at the room beside the other foot


@dataclass(frozen=True)
class KickStyle:
    """Numbers of one kind of kick.

    Attributes:
        gap: Between the face of the standing foot and the ball, where it is expected; at most, for a side kick [m].
        run_up, shortest_run_up, follow_through: Way of the foot before and after the contact [m].
        speed_ratio: Ball's speed over the foot's, measured.
        max_speed: Of the ball [m/s].
        straight: Direction in base_footprint that the range of directions lies about [rad].
        max_direction: Either side of it [rad].
        reach: How far the ball may lie from its expected place: nearer, farther, across [m].
    """

    gap: float
    run_up: float
    shortest_run_up: float
    follow_through: float
    speed_ratio: float
    max_speed: float
    straight: float
    max_direction: float
    reach: tuple[float, float, float]

    @staticmethod
    def of(parameters: MotionParameters, kind: KickKind, side: Side) -> KickStyle:
        """Return the numbers for a kick from standing."""
        p = parameters
        if kind is KickKind.SIDE:
            return KickStyle(
                p.side_kick_gap,
                p.side_kick_backswing,
                p.side_kick_shortest_backswing,
                p.side_kick_follow_through,
                p.side_kick_speed_ratio,
                p.max_side_kick_speed,
                0.5 * math.pi if side is Side.LEFT else -0.5 * math.pi,
                p.max_side_kick_direction,
                (p.side_kick_reach_near, p.side_kick_reach_far, p.side_kick_reach_across),
            )
        return KickStyle(
            p.kick_gap,
            p.kick_backswing,
            p.kick_shortest_backswing,
            p.kick_follow_through,
            p.kick_speed_ratio,
            p.max_kick_speed,
            0.0,
            p.max_kick_direction,
            (p.kick_reach_near, p.kick_reach_far, p.kick_reach_across),
        )


def refused_numbers(goal: KickGoal, max_speed: float, straight: float, max_direction: float) -> str:
    """Return why speed, direction or ball of a goal cannot be taken, or ""."""
    if not 0.0 < goal.speed <= max_speed:
        return f"speed is {goal.speed:.2f} m/s; expected above 0 and at most {max_speed} m/s"
    if not abs(wrap_angle(goal.direction - straight)) <= max_direction:
        return f"direction is {goal.direction:.2f} rad; expected within {max_direction} rad of {straight:.2f} rad"
    if goal.ball is not None and not all(math.isfinite(value) for value in goal.ball):
        return f"ball is at {goal.ball} m; expected two finite numbers"
    return ""


def plan_kick(
    parameters: MotionParameters, goal: KickGoal, feet: tuple[Pose2D, Pose2D], soles: tuple[Foot, Foot]
) -> tuple[Move, ...] | str:
    """Return the moves of the kicking foot in base_footprint, or in words why the kick cannot be done.

    Args:
        parameters: Of motion control.
        goal: What is wanted; FORWARD or SIDE.
        feet: Left and right sole in base_footprint.
        soles: Their rectangles.
    """
    p, style = parameters, KickStyle.of(parameters, goal.kind, goal.side)
    refusal = refused_numbers(goal, style.max_speed, style.straight, style.max_direction)
    if refusal:
        return refusal
    home, face = feet[goal.side], striking_face(goal.kind, goal.side, soles[goal.side])
    expected = expected_ball(p, goal.kind, goal.side, feet, soles)
    ball = goal.ball if goal.ball is not None else expected
    if out_of_reach(ball, expected, style):
        near, far, across = style.reach
        return (
            f"ball is at ({ball[0]:.2f}, {ball[1]:.2f}) m, out of reach of the {goal.side.name.lower()} foot; expected"
            f" at most {near} m nearer, {far} m farther and {across} m across from ({expected[0]:.2f},"
            f" {expected[1]:.2f}) m, seen along {style.straight:.2f} rad"
        )
    contact = face.sole_at_contact(ball, goal.direction, p.ball_radius)
    where = f"its swing along {goal.direction:.2f} rad through the ball at ({ball[0]:.2f}, {ball[1]:.2f}) m"
    foot_speed, follow = goal.speed / style.speed_ratio, style.follow_through
    slowest = SLOWEST * foot_speed
    while not _in_leg_reach(p, goal, feet, contact, follow):
        follow -= WAY_STEP
        if follow < shortest_follow_through(slowest):
            return f"the {goal.side.name.lower()} leg is too short for {where}"
    if follow < shortest_follow_through(foot_speed):
        foot_speed = math.sqrt(follow * BRAKING / (0.25 * math.pi))
    run_up = style.run_up
    while True:
        moves = _moves(p, foot_speed, goal.direction, home, contact, run_up, follow)
        reached = _in_leg_reach(p, goal, feet, contact, -run_up)
        if reached and _clear(moves, p.kick_clearance, soles[goal.side], feet[goal.side.other], soles[goal.side.other]):
            return moves
        run_up -= WAY_STEP
        if run_up < style.shortest_run_up:
            what = "foot would touch the other one on" if reached else "leg is too short for"
            return f"the {goal.side.name.lower()} {what} {where}"


def expected_ball(
    parameters: MotionParameters, kind: KickKind, side: Side, feet: tuple[Pose2D, Pose2D], soles: tuple[Foot, Foot]
) -> Point:
    """Return where a kick from standing expects the ball's centre: (x, y) in base_footprint [m].

    A side kick expects it the nearer the wider the feet stand: the leg has to reach it, and some way beyond to stop,
    also where it lies farthest.

    Args:
        parameters: Of motion control.
        kind: FORWARD or SIDE.
        side: The foot that kicks.
        feet: Left and right sole in base_footprint.
        soles: Their rectangles.
    """
    p, style = parameters, KickStyle.of(parameters, kind, side)
    gap = style.gap
    if kind is KickKind.SIDE:
        reach = HIP[1] + p.kick_leg_reach - abs((feet[side.other].inverse() @ feet[side]).y)
        gap = min(gap, max(reach - SHORTEST_FOLLOW_THROUGH - style.reach[1], 0.0))
    return striking_face(kind, side, soles[side]).ball_before(feet[side], gap, p.ball_radius)


def shortest_follow_through(foot_speed: float) -> float:
    """Return the way [m] beyond the contact that a foot of a speed [m/s] needs at least to stop.

    Along the second half of a cosine profile the greatest deceleration is pi / 4 v^2 / way.
    """
    return min(SHORTEST_FOLLOW_THROUGH, 0.25 * math.pi * foot_speed**2 / BRAKING)


def out_of_reach(ball: Point, expected: Point, style: KickStyle) -> bool:
    """Tell whether a ball lies outside the rectangle about its expected place, seen along the straight direction."""
    along, across = Pose2D(*expected, style.straight).inverse().transform(ball)
    near, far, sideways = style.reach
    return not (-near <= along <= far and abs(across) <= sideways)


def _in_leg_reach(
    p: MotionParameters, goal: KickGoal, feet: tuple[Pose2D, Pose2D], contact: Pose2D, way: float
) -> bool:
    """Tell whether the leg reaches a place `way` [m] beyond the contact: with a straight knee it falls."""
    x, y = Pose2D(contact.x, contact.y, goal.direction).transform((way, 0.0))
    forward, left = feet[goal.side.other].inverse().transform((x, y))
    outward = left if goal.side is Side.LEFT else -left
    return math.hypot(forward - HIP[0], outward - HIP[1]) <= p.kick_leg_reach


def _moves(
    p: MotionParameters,
    foot_speed: float,
    direction: float,
    home: Pose2D,
    contact: Pose2D,
    run_up: float,
    follow_through: float,
) -> tuple[Move, ...]:
    """Return lift, run-up, follow-through, return and lowering of the sole from `home` through `contact`."""
    along = np.array([math.cos(direction), math.sin(direction), 0.0, 0.0])
    ground = np.array([home.x, home.y, 0.0, home.yaw])
    over = ground + np.array([0.0, 0.0, p.kick_height, 0.0])
    # The yaw is unwrapped, so that the foot takes the short way.
    hit = np.array([contact.x, contact.y, p.kick_height, home.yaw + wrap_angle(contact.yaw - home.yaw)])
    back, front = hit - run_up * along, hit + follow_through * along
    return (
        Move(ground, back, p.kick_lift_time),
        Move(back, hit, 2.0 * run_up / foot_speed, Profile.FIRST_HALF),
        Move(hit, front, 2.0 * follow_through / foot_speed, Profile.SECOND_HALF),
        Move(front, over, p.kick_return_time),
        Move(over, ground, p.kick_lower_time),
    )


def _clear(moves: tuple[Move, ...], clearance: float, sole: Foot, other: Pose2D, other_sole: Foot) -> bool:
    """Tell whether the foot keeps clear of the standing one, seen from above, wherever the path leads it."""
    for move in moves:
        count = max(math.ceil(float(np.linalg.norm(move.end - move.start)) / CLEARANCE_STEP), 1)
        for i in range(count + 1):
            x, y, _, yaw = move.start + i / count * (move.end - move.start)
            if gap_between(Pose2D(float(x), float(y), float(yaw)), sole, other, other_sole) < clearance:
                return False
    return True
