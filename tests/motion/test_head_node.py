from __future__ import annotations

import numpy as np
import pytest
from sensor_msgs.msg import JointState

from tulip_description.robot import HEAD_JOINTS, JOINTS
from tulip_motion.head_node import HeadNode
from tulip_motion.interface import HeadCommand, HeadMode
from tulip_motion.messages import head_command_to_message
from tulip_ros import topics
from tulip_ros.run import session
from tulip_ros.time import header, stamp_of

pytestmark = pytest.mark.ros


def test_node_answers_every_fifth_joint_state_at_250_hz_and_looks_where_it_is_told(ros_domain: int) -> None:
    commands = []
    with session(HeadNode, arguments=["test"]) as (node, spin):
        topics.HEAD_JOINT_COMMAND.subscribe_from(node, commands.append)
        joints = topics.JOINT_STATES.publish_from(node)
        orders = topics.HEAD_COMMAND.publish_from(node)
        for _ in range(20):
            spin(0.02)
        orders.publish(head_command_to_message(HeadCommand(1, HeadMode.LOOK_AT, (1.0, 1.0, 0.0))))
        for _ in range(20):
            spin(0.02)
        for tick in range(250):
            message = JointState(
                header=header(10**9 + tick * 4_000_000), name=list(JOINTS), position=np.zeros(14).tolist()
            )
            expected = tick // 5 + 1
            joints.publish(message)
            for _ in range(100):
                spin(0.02)
                if len(commands) >= expected:
                    break
    assert [stamp_of(command) for command in commands] == [10**9 + tick * 20_000_000 for tick in range(50)]
    assert commands[-1].names == list(HEAD_JOINTS)
    assert commands[-1].position[0] > 0.7  # to the left
    assert commands[-1].position[1] > 0.4  # and down


def test_joint_states_without_head_are_not_answered(ros_domain: int) -> None:
    commands = []
    with session(HeadNode, arguments=["test"]) as (node, spin):
        topics.HEAD_JOINT_COMMAND.subscribe_from(node, commands.append)
        joints = topics.JOINT_STATES.publish_from(node)
        for _ in range(20):
            spin(0.02)
        joints.publish(JointState(header=header(10**9), name=["left_knee"], position=[0.3]))
        for _ in range(20):
            spin(0.02)
    assert commands == []
