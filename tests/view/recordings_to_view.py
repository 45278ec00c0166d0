"""Recordings that tests of log tool, tables and report read."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from geometry_msgs.msg import Point, Pose, Quaternion
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState

from tulip_description.field import load_field
from tulip_description.robot import JOINTS
from tulip_msgs.msg import Decision, GameState, GroundTruth, WorldState
from tulip_ros import topics
from tulip_ros.bag import Bag
from tulip_ros.time import header
from tulip_ros.topics import Topic
from tulip_sim.lockstep import Lockstep
from tulip_sim.lockstep_recording import LockstepRecording
from tulip_sim.scenario import make_scenario

MS = 1_000_000  # [ns]
KICK_AT = 730  # [ms]
GAP = (1200, 2600)  # [ms] without ground truth
DURATION = 4000  # [ms]


def joint_position(milliseconds: int, index: int) -> float:
    """Return what joint_states says [rad]."""
    return 0.1 * index + 0.001 * milliseconds


def yaw(milliseconds: int) -> float:
    """Return where the robot looks: it turns through the place where angles jump [rad]."""
    angle = math.pi - 0.1 + 0.0002 * milliseconds
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


def messages(milliseconds: int) -> list[tuple[Topic, Any]]:
    """Return what is sent at an instant."""
    stamp = header(milliseconds * MS)
    found: list[tuple[Topic, Any]] = []
    if milliseconds % 10 == 0:
        positions = [joint_position(milliseconds, index) for index in range(len(JOINTS))]
        found.append((topics.JOINT_STATES, JointState(header=stamp, name=list(JOINTS), position=positions)))
    if milliseconds % 50 == 0:
        found.append((topics.DECISION, Decision(header=stamp, kick_requested=milliseconds // 50 == KICK_AT // 50)))
        world = WorldState(header=stamp)
        world.robot_pose = np.array([0.001 * milliseconds, -1.0, yaw(milliseconds)])
        world.robot_covariance = np.diag([0.01, 0.04, 0.0]).reshape(-1)
        found.append((topics.WORLD_STATE, world))
        if not GAP[0] < milliseconds < GAP[1]:
            truth = GroundTruth(header=stamp)
            truth.robot = Pose(
                position=Point(x=0.001 * milliseconds, y=-1.0, z=1.0),
                orientation=Quaternion(z=math.sin(yaw(milliseconds) / 2.0), w=math.cos(yaw(milliseconds) / 2.0)),
            )
            found.append((topics.GROUND_TRUTH, truth))
    if milliseconds in (500, 1500):
        phase = GameState.SET if milliseconds == 500 else GameState.PLAYING
        found.append((topics.GAME_STATE, GameState(header=stamp, phase=phase, seconds_remaining=99)))
    return found


def write(folder: Path, robots: tuple[str, ...] = ("",), begin: int = 10, end: int = DURATION) -> Path:
    """Write a recording with messages of known content; times in ms."""
    bag = Bag(folder)
    for milliseconds in range(begin, end, 10):
        for robot in robots:
            for topic, message in messages(milliseconds):
                add(bag, topic.within(robot), message, milliseconds)
    bag.close()
    return folder


def add(bag: Bag, topic: Topic, message: Any, milliseconds: int) -> None:
    """Write one message that comes in the moment it is stamped."""
    name = f"/{topic.name.lstrip('/')}"
    bag.add_topic(name, topic.type_name, topic.quality)
    bag.write(name, serialize_message(message), milliseconds * MS)


def play(folder: Path, seconds: float) -> Path:
    """Write a recording of the begin of a simulated trial, with its camera."""
    recording = LockstepRecording(folder)
    trial = Lockstep(make_scenario("trial", np.random.default_rng(3), load_field()), 3, listener=recording.write)
    try:
        while trial.stamp < seconds * 1e9:
            trial.step()
    finally:
        trial.close()
        recording.close()
    return folder
