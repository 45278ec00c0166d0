"""What the 3D replay in the page moves: boxes of the robot's links, the ball, the other robot, the estimates."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tulip_description.field import Field
from tulip_description.keeper import keeper_parts
from tulip_description.robot import LEG_JOINTS, Robot
from tulip_ros import topics
from tulip_view.body_pose import COLOURS, OTHER_TEAM, BodyPose, pose_row, turned
from tulip_view.columns import ANGLE, LAST, LINEAR, Alignment
from tulip_view.recording import Recording, Track
from tulip_view.report.field_paths import ground_lines
from tulip_view.report.figures import Array, LeftOut, Section
from tulip_view.tables import align

TITLE = "Replay"
RATE = 15.0  # [1/s]
MOST_FRAMES = 3600  # longer recordings have fewer frames a second


def replay(recording: Recording, robot: Robot, field: Field) -> Section:
    """Return the section; its data is described in `page.js`.

    Raises:
        LeftOut: if the recording does not tell where the robot was, or how its joints stood.
    """
    joints, odometry = recording.get(topics.JOINT_STATES), recording.get(topics.ODOMETRY)
    truth, world = recording.get(topics.GROUND_TRUTH), recording.get(topics.WORLD_STATE)
    motion = recording.get(topics.MOTION_STATE)
    if joints is None and motion is None:
        raise LeftOut(TITLE, "neither joint_states nor motion_state is recorded")
    if truth is None and (world is None or odometry is None):
        raise LeftOut(TITLE, "neither ground_truth nor world_state with odometry is recorded")
    rate = min(RATE, MOST_FRAMES / max(recording.end - recording.begin, 1e-9))
    times = recording.begin + np.arange(int((recording.end - recording.begin) * rate) + 1) / rate
    if truth is not None:
        base = _poses(truth, [m.robot for m in truth.messages], times)
        words = "Where the robot is comes from ground truth; the blue arrow is where it believes to be."
    else:
        assert world is not None and odometry is not None
        base = _believed(world, odometry, times)
        words = "Where the robot is comes from its own estimate: the recording holds no truth."
    if joints is not None:
        angles = _angles(joints, list(joints.messages[0].name), joints.gather("position"), robot, times)
    else:
        assert motion is not None
        angles = _angles(motion, list(LEG_JOINTS), motion.gather("joint_positions"), robot, times)
        words += " Its head looks straight ahead: the angles of the neck are not recorded."
    data: dict[str, Any] = {"times": times.astype(np.float32), "rate": rate}
    body = BodyPose(robot)
    data["links"] = np.stack([body.links(place, joints) for place, joints in zip(base, angles, strict=True)])
    data["boxes"] = [
        {"link": index, "size": box.size, "centre": box.centre, "colour": COLOURS[box.colour]}
        for index, box in body.boxes
    ]
    data["ground"] = [
        {"x": line.x, "y": line.y, "colour": line.colour, "fill": line.closed} for line in ground_lines(field)
    ]
    data["goals"] = [
        {"x": goal.x, "left": goal.posts[0].y, "right": goal.posts[1].y, "height": goal.height}
        for goal in (field.own_goal, field.opponent_goal)
    ]
    data["radius"] = field.ball_radius
    data["reach"] = [field.carpet_length / 2.0, field.carpet_width / 2.0]
    nothing = np.full((len(times), 3), np.nan, dtype=np.float32)
    data["ball"] = data["other"] = data["belief"] = data["ball_belief"] = nothing
    if truth is not None:
        data["ball"] = _columns(
            truth, [(m.ball.position.x, m.ball.position.y, m.ball.position.z) for m in truth.messages], times
        )
        others = [
            (m.keeper.position.x, m.keeper.position.y, 2.0 * math.atan2(m.keeper.orientation.z, m.keeper.orientation.w))
            if m.keeper_present
            else (math.nan,) * 3
            for m in truth.messages
        ]
        data["other"] = _columns(truth, others, times, (LINEAR, LINEAR, ANGLE))
        data["other_boxes"] = [
            {"size": part.size, "centre": part.centre, "colour": COLOURS[part.colour]}
            for part in keeper_parts(OTHER_TEAM)
        ]
    if world is not None:
        poses = [tuple(m.robot_pose) for m in world.messages]
        data["belief"] = _columns(world, poses, times, (LAST, LAST, LAST))
        balls = [
            (*m.ball.position_in_map, field.ball_radius) if m.ball_known else (math.nan,) * 3 for m in world.messages
        ]
        data["ball_belief"] = _columns(world, balls, times, (LAST, LAST, LAST))
    known = np.flatnonzero(np.isfinite(data["links"]).all(axis=(1, 2)))
    if not len(known):
        raise LeftOut(TITLE, "the robot's place and its joints are never known at the same time")
    shown = slice(known[0], known[-1] + 1)  # it begins and ends with the robot in the picture
    for name in ("times", "links", "ball", "other", "belief", "ball_belief"):
        data[name] = data[name][shown]
    note = f"{words} {rate:.0f} frames a second."
    return Section("replay", TITLE, [note], replay=data)


def _columns(
    track: Track,
    rows: Sequence[tuple[float, ...]],
    times: Array,
    kinds: tuple[Alignment, ...] = (LINEAR, LINEAR, LINEAR),
) -> NDArray[np.float32]:
    values = np.array(rows, dtype=float)
    return np.column_stack([align(track, values[:, i], kind, times) for i, kind in enumerate(kinds)]).astype(np.float32)


def _poses(track: Track, poses: list[Any], times: Array) -> Array:
    """Return (n, 7): position and quaternion x, y, z, w at each time."""
    rows = np.array([pose_row(pose) for pose in poses])
    for index in range(1, len(rows)):  # the same attitude has two quaternions: take the near one
        if rows[index, 3:] @ rows[index - 1, 3:] < 0.0:
            rows[index, 3:] *= -1.0
    found = np.column_stack([align(track, column, LINEAR, times) for column in rows.T])
    found[:, 3:] /= np.maximum(np.linalg.norm(found[:, 3:], axis=1, keepdims=True), 1e-9)
    return found


def _believed(world: Track, odometry: Track, times: Array) -> Array:
    """Return (n, 7) poses of base_link: height and attitude from odometry, the rest from the world state."""
    base = _poses(odometry, [m.pose.pose for m in odometry.messages], times)
    pose = world.gather("robot_pose")
    in_odom = world.gather("robot_pose_in_odom")
    turn = align(world, pose[:, 2] - in_odom[:, 2], ANGLE, times)
    base[:, 3:] = turned(base, turn)
    for axis in (0, 1):
        base[:, axis] = align(world, pose[:, axis], LINEAR, times)
    return base


def _angles(track: Track, names: list[str], rows: Array, robot: Robot, times: Array) -> Array:
    """Return (n, 14) joint angles; 0 for joints that the recording does not tell."""
    angles = np.zeros((len(times), len(robot.joint_names)))
    for column, name in enumerate(robot.joint_names):
        if name in names:
            angles[:, column] = align(track, rows[:, names.index(name)], LINEAR, times)
    return angles
