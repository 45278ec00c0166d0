from __future__ import annotations

import time

import numpy as np
import pytest

from tulip_description.posture import standing_posture
from tulip_description.robot import JOINTS, load_robot
from tulip_description.robot_io import Sensors
from tulip_motion.interface import MotionMode, WalkCommand, WalkMode
from tulip_motion.messages import sensors_to_messages, walk_command_to_message
from tulip_motion.motion_node import MotionNode
from tulip_ros import topics
from tulip_ros.finding import Level
from tulip_ros.run import session
from tulip_ros.time import stamp_of

pytestmark = pytest.mark.ros
TICK = 4_000_000  # [ns]
WAIT = 30.0  # [s] of wall-clock time for reports that come each second


def test_health_counts_a_clipped_walk_command_once_with_its_words_and_names_a_saturated_joint(ros_domain: int) -> None:
    robot = load_robot()
    posture = standing_posture(robot).joint_positions
    level, gravity = np.array([0.0, 0.0, 0.0, 1.0]), np.array([0.0, 0.0, 9.81])
    cells = np.array([foot.cells for foot in robot.feet])
    efforts = np.zeros(14)
    efforts[JOINTS.index("left_knee")] = robot.effort_limits[JOINTS.index("left_knee")]
    commands, states, reports = [], [], []
    with session(MotionNode, arguments=["test"]) as (node, spin):
        topics.LEG_COMMAND.subscribe_from(node, commands.append)
        topics.MOTION_STATE.subscribe_from(node, states.append)
        topics.DIAGNOSTICS.subscribe_from(node, lambda message: reports.append(message.status[0]))
        senses = [each.publish_from(node) for each in (topics.JOINT_STATES, topics.IMU, topics.FOOT_FORCES)]
        orders = topics.WALK_COMMAND.publish_from(node)
        for _ in range(20):
            spin(0.02)

        def walk(first: int, velocity: tuple[float, float, float]) -> None:
            """Order a walk, and stand still for twenty ticks while motion control takes it up."""
            stamp = 10**9 + first * TICK
            orders.publish(walk_command_to_message(WalkCommand(stamp, WalkMode.WALK, velocity)))
            for _ in range(20):
                spin(0.01)
            for tick in range(first, first + 20):
                reading = Sensors(
                    10**9 + tick * TICK, posture, np.zeros(14), efforts, level, np.zeros(3), gravity,
                    np.full((2, 4), 28.0),
                )  # fmt: skip
                for sender, message in zip(senses, sensors_to_messages(reading, cells), strict=True):
                    sender.publish(message)
                for _ in range(100):
                    spin(0.01)
                    if commands and stamp_of(commands[-1]) == reading.stamp:
                        break

        walk(0, (0.2, 0.0, 0.0))
        assert "walk command clipped" not in node.health._events
        node.begin_anew()
        walk(100, (2.0, 0.0, 0.0))
        words = ("walk command clipped", "(left_knee 100%): walk slower")
        end = time.monotonic() + WAIT
        while not all(any(each in report.message for report in reports) for each in words):
            assert time.monotonic() < end, [report.message for report in reports]
            spin(0.05)
        events, (warning, _) = dict(node.health._events), node.health._warnings["walk command clipped"]
    assert [state.mode for state in states] == [MotionMode.WALK] * len(states)
    assert states[-1].notes[0].startswith("walk command clipped: (2.00, 0.00) m/s")
    assert events["walk command clipped"] == 1
    assert "limits are" in warning
    assert {report.level[0] for report in reports if "walk command clipped" in report.message} <= {
        Level.WARNING,
        Level.ERROR,  # since nobody sends sensors any more
    }
