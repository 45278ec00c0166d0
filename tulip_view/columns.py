"""The columns of tables made from recordings: name with unit, where the value comes from, how it is aligned in time."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np

from tulip_description.quaternion import quaternion_matrix
from tulip_description.robot import JOINTS, LEG_JOINTS
from tulip_msgs.msg import Feature, GameState, HeadCommand, MotionState, WalkCommand
from tulip_ros import topics


class Alignment(Enum):
    """How a value is found at an instant between two messages."""

    LINEAR = "linear"  # between the two
    ANGLE = "linear, the short way round"
    LAST = "last"  # that of the message before


@dataclass(frozen=True)
class Column:
    """One column.

    Attributes:
        name: With the unit at its end, as in robot_x_m.
        unit: As in "m"; "" for numbers without one and for words.
        alignment: How it is found between messages.
        words: Whether it holds words instead of numbers.
    """

    name: str
    unit: str
    alignment: Alignment
    words: bool = False


@dataclass(frozen=True)
class Source:
    """Columns from one topic.

    Attributes:
        group: Of which group of columns, as in "joints".
        topic: Of which topic.
        columns: What they are.
        values: Returns the columns' values of one message, in their order.
        running: The values are sums over all messages so far, instead of single ones.
    """

    group: str
    topic: topics.Topic
    columns: tuple[Column, ...]
    values: Callable[[Any], Sequence[float | str]]
    running: bool = False


LINEAR, ANGLE, LAST = Alignment.LINEAR, Alignment.ANGLE, Alignment.LAST
UNITS = {"m": "_m", "rad": "_rad", "m/s": "_m_s", "rad/s": "_rad_s", "N m": "_Nm", "N": "_N", "s": "_s", "": ""}
NAN = math.nan


def column(name: str, unit: str = "", alignment: Alignment = LINEAR, words: bool = False) -> Column:
    """Return a column, with its unit added to its name."""
    return Column(name + UNITS[unit], unit, alignment, words)


def numbers(names: Sequence[str], unit: str = "", alignment: Alignment = LINEAR) -> list[Column]:
    """Return columns of the same unit and alignment."""
    return [column(name, unit, alignment) for name in names]


def word(name: str) -> Column:
    """Return a column of words."""
    return column(name, "", LAST, words=True)


def constants(message: type[Any], *names: str) -> dict[int, str]:
    """Return the names of some of a message's constants, in small letters, by their values."""
    return {int(getattr(message, name)): name.lower() for name in names}


MODES = constants(MotionState, "LIMP", "STAND", "WALK", "KICK", "FALLEN")
SUPPORTS = {0: "double", 1: "left", 2: "right", 3: "none"}
WALKS = constants(WalkCommand, "LIMP", "STAND", "WALK", "GO")
HEADS = constants(HeadCommand, "HOLD", "SEARCH", "LOOK_AT", "TRACK")
PHASES = constants(GameState, "INITIAL", "READY", "SET", "PLAYING", "FINISHED")
SECONDARY = {0: "normal", 1: "penalty_shoot", 2: "overtime", 3: "timeout"}
SET_PLAYS = {
    getattr(GameState, f"SET_PLAY_{name}"): name.lower()
    for name in (
        "NONE", "GOAL_KICK", "CORNER_KICK", "THROW_IN", "DIRECT_FREE_KICK", "INDIRECT_FREE_KICK", "PENALTY_KICK",
    )
}  # fmt: skip
FEATURES = {
    getattr(Feature, name): name.lower()
    for name in (
        "BALL", "GOAL_POST", "OPPONENT", "LINE", "CROSSING_L", "CROSSING_T", "CROSSING_X", "POLE_YELLOW_BLUE_YELLOW",
        "POLE_BLUE_YELLOW_BLUE", "PENALTY_MARK", "CENTRE_CIRCLE", "FIELD_BORDER", "GOAL",
    )
}  # fmt: skip
OPPONENTS = 3
"""More opponents than this have no columns of their own."""


def name_of(names: dict[int, str], value: int) -> str:
    """Return the name of a constant, or its number where it has none."""
    return names.get(int(value), str(int(value)))


def attitude(orientation: Any) -> tuple[float, float, float]:
    """Return roll, pitch and yaw [rad] of a quaternion in a message."""
    matrix = quaternion_matrix((orientation.x, orientation.y, orientation.z, orientation.w))
    return (
        math.atan2(matrix[2, 1], matrix[2, 2]),
        -math.asin(max(-1.0, min(1.0, float(matrix[2, 0])))),
        math.atan2(matrix[1, 0], matrix[0, 0]),
    )


def _joint_states(message: Any) -> list[float]:
    index = {name: number for number, name in enumerate(message.name)}
    found = []
    for values in (message.position, message.velocity, message.effort):
        found += [float(values[index[name]]) if name in index and len(values) else NAN for name in JOINTS]
    return found


def _joint_plans(message: Any) -> list[float]:
    return [
        float(value)
        for values in (
            message.joint_positions_desired,
            message.joint_velocities_desired,
            message.torque_feedback,
            message.torque_feedforward,
            message.torque_learned,
        )
        for value in values
    ]


def _motion(message: Any) -> list[float | str]:
    soles = [np.asarray(sole, dtype=float).reshape(4, 4) for sole in (message.left_sole, message.right_sole)]
    places = [float(value) for sole in soles for value in (*sole[:3, 3], math.atan2(sole[1, 0], sole[0, 0]))]
    vectors = (
        message.com, message.com_desired, message.com_velocity, message.com_velocity_desired,
        message.dcm, message.dcm_desired, message.zmp, message.zmp_desired,
    )  # fmt: skip
    flat = [float(value) for vector in vectors for value in vector]
    return [
        name_of(MODES, message.mode), name_of(SUPPORTS, message.support), message.phase, message.step_count,
        *flat, *places, message.distance, message.reason,
    ]  # fmt: skip


def _forces(message: Any) -> list[float]:
    return [
        float(sum(message.left_cells)), float(sum(message.right_cells)), *map(float, message.left_cop),
        *map(float, message.right_cop),
    ]  # fmt: skip


def _odometry(message: Any) -> list[float]:
    pose = message.pose.pose
    return [pose.position.x, pose.position.y, pose.position.z, *attitude(pose.orientation)]


def _world(message: Any) -> list[float]:
    spread = np.sqrt(np.maximum(np.asarray(message.robot_covariance).reshape(3, 3).diagonal(), 0.0))
    found = [*map(float, message.robot_pose), *map(float, spread), *map(float, message.robot_pose_in_odom)]
    ball, known = message.ball, bool(message.ball_known)
    values = [
        *ball.position, *ball.position_in_map, *ball.velocity_in_map,
        *np.sqrt(np.maximum(np.asarray(ball.covariance).reshape(4, 4).diagonal()[:2], 0.0)), ball.age, ball.confidence,
    ]  # fmt: skip
    found += [float(known), *(float(value) if known else NAN for value in values)]
    found.append(float(len(message.opponents)))
    for number in range(OPPONENTS):
        there = number < len(message.opponents)
        found += [float(value) for value in message.opponents[number].position_in_map] if there else [NAN, NAN]
    return found


def _features(message: Any) -> list[float]:
    kinds = [feature.kind for feature in message.features]
    balls = [feature for feature in message.features if feature.kind == Feature.BALL]
    best = max(balls, key=lambda feature: float(feature.confidence), default=None)
    ball = (best.azimuth, best.elevation, best.confidence) if best is not None else (NAN, NAN, NAN)
    return [*(float(kinds.count(kind)) for kind in FEATURES), *ball, *map(float, message.camera_position)]


def _decision(message: Any) -> list[float | str]:
    walk, head = message.walk, message.head
    return [
        name_of(WALKS, walk.mode), *map(float, walk.velocity), *map(float, walk.goal),
        name_of(HEADS, head.mode), *map(float, head.target), message.tree,
    ]  # fmt: skip


def _truth(message: Any) -> list[float | str]:
    robot, ball, speed, keeper = message.robot, message.ball, message.ball_twist.linear, message.keeper
    there = message.keeper_present
    return [
        robot.position.x, robot.position.y, robot.position.z, *attitude(robot.orientation),
        ball.position.x, ball.position.y, ball.position.z, speed.x, speed.y, speed.z,
        keeper.position.x if there else NAN, keeper.position.y if there else NAN,
        float(message.robot_fallen), float(message.touches), float(message.falls),
        float(message.own_score), float(message.opponent_score), message.trial_time, message.outcome,
    ]  # fmt: skip


def _game(message: Any) -> list[float | str]:
    return [
        name_of(PHASES, message.phase), name_of(SECONDARY, message.secondary_state),
        name_of(SET_PLAYS, message.set_play), float(message.seconds_remaining), float(message.own_score),
        float(message.opponent_score), float(message.penalty), float(message.stopped), float(message.stale),
    ]  # fmt: skip


def _each(names: Sequence[str], axes: str) -> list[str]:
    return [f"{name}_{axis}" for name in names for axis in axes]


SOURCES: tuple[Source, ...] = (
    Source(
        "joints",
        topics.JOINT_STATES,
        (
            *numbers([f"{name}_position" for name in JOINTS], "rad"),
            *numbers([f"{name}_velocity" for name in JOINTS], "rad/s"),
            *numbers([f"{name}_torque" for name in JOINTS], "N m"),
        ),
        _joint_states,
    ),
    Source(
        "joints",
        topics.MOTION_STATE,
        (
            *numbers([f"{name}_desired_position" for name in LEG_JOINTS], "rad"),
            *numbers([f"{name}_desired_velocity" for name in LEG_JOINTS], "rad/s"),
            *numbers([f"{name}_feedback_torque" for name in LEG_JOINTS], "N m"),
            *numbers([f"{name}_feedforward_torque" for name in LEG_JOINTS], "N m"),
            *numbers([f"{name}_learned_torque" for name in LEG_JOINTS], "N m"),
        ),
        _joint_plans,
    ),
    Source(
        "motion",
        topics.MOTION_STATE,
        (
            word("motion_mode"),
            word("support"),
            column("step_phase", alignment=LAST),
            column("step_count", alignment=LAST),
            *numbers(_each(("com", "com_desired"), "xyz"), "m"),
            *numbers(_each(("com_velocity", "com_velocity_desired"), "xyz"), "m/s"),
            *numbers(_each(("dcm", "dcm_desired", "zmp", "zmp_desired"), "xy"), "m"),
            *numbers(_each(("left_sole",), "xyz"), "m"),
            column("left_sole_yaw", "rad", ANGLE),
            *numbers(_each(("right_sole",), "xyz"), "m"),
            column("right_sole_yaw", "rad", ANGLE),
            column("distance_walked", "m"),
            word("motion_reason"),
        ),
        _motion,
    ),
    Source(
        "motion",
        topics.FOOT_FORCES,
        (
            *numbers(("left_foot_force", "right_foot_force"), "N"),
            *numbers(_each(("left_foot_cop", "right_foot_cop"), "xy"), "m"),
        ),
        _forces,
    ),
    Source(
        "motion",
        topics.ODOMETRY,
        (
            *numbers(_each(("base_in_odom",), "xyz"), "m"),
            *numbers(("base_in_odom_roll", "base_in_odom_pitch", "base_in_odom_yaw"), "rad", ANGLE),
        ),
        _odometry,
    ),
    Source(
        "world",
        topics.WORLD_STATE,
        (
            *numbers(_each(("robot",), "xy"), "m"),
            column("robot_yaw", "rad", ANGLE),
            *numbers(_each(("robot_spread",), "xy"), "m"),
            column("robot_spread_yaw", "rad"),
            *numbers(_each(("robot_in_odom",), "xy"), "m"),
            column("robot_in_odom_yaw", "rad", ANGLE),
            column("ball_known", alignment=LAST),
            *numbers(_each(("ball_from_robot", "ball"), "xy"), "m"),
            *numbers(_each(("ball_velocity",), "xy"), "m/s"),
            *numbers(_each(("ball_spread",), "xy"), "m"),
            column("ball_age", "s", LAST),
            column("ball_confidence", alignment=LAST),
            column("opponents_known", alignment=LAST),
            *numbers(_each([f"opponent_{number}" for number in range(1, OPPONENTS + 1)], "xy"), "m", LAST),
        ),
        _world,
    ),
    Source(
        "features",
        topics.FEATURES,
        (
            *numbers([f"seen_{name}" for name in FEATURES.values()], alignment=LAST),
            *numbers(("seen_ball_azimuth", "seen_ball_elevation"), "rad", LAST),
            column("seen_ball_confidence", alignment=LAST),
            *numbers(_each(("camera_from_robot",), "xyz"), "m", LAST),
        ),
        _features,
    ),
    Source(
        "decisions",
        topics.DECISION,
        (
            word("walk_mode"),
            *numbers(("walk_forward", "walk_left"), "m/s", LAST),
            column("walk_turn", "rad/s", LAST),
            *numbers(("walk_goal_x", "walk_goal_y"), "m", LAST),
            column("walk_goal_yaw", "rad", LAST),
            word("head_mode"),
            *numbers(_each(("head_target",), "xyz"), "m", LAST),
            word("behaviour"),
        ),
        _decision,
    ),
    # A kick is asked for in one decision alone, which a table of a lower rate would miss: so they are counted.
    Source(
        "decisions",
        topics.DECISION,
        (column("kicks_asked_for", alignment=LAST),),
        lambda message: [float(message.kick_requested)],
        running=True,
    ),
    Source(
        "truth",
        topics.GROUND_TRUTH,
        (
            *numbers(_each(("truth_robot",), "xyz"), "m"),
            *numbers(("truth_robot_roll", "truth_robot_pitch", "truth_robot_yaw"), "rad", ANGLE),
            *numbers(_each(("truth_ball",), "xyz"), "m"),
            *numbers(_each(("truth_ball_velocity",), "xyz"), "m/s"),
            *numbers(_each(("truth_keeper",), "xy"), "m"),
            *numbers(
                ("truth_fallen", "truth_touches", "truth_falls", "truth_own_score", "truth_opponent_score"),
                alignment=LAST,
            ),
            column("truth_trial_time", "s", LAST),
            word("truth_outcome"),
        ),
        _truth,
    ),
    Source(
        "game",
        topics.GAME_STATE,
        (
            word("game_phase"),
            word("game_secondary_state"),
            word("game_set_play"),
            column("game_remaining", "s", LAST),
            *numbers(
                ("game_own_score", "game_opponent_score", "game_penalty", "game_stopped", "game_stale"), alignment=LAST
            ),
        ),
        _game,
    ),
)

GROUPS = tuple(dict.fromkeys(source.group for source in SOURCES))
