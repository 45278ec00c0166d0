"""The driver node around the echo body: topics, refusals, the end."""

from __future__ import annotations

import itertools
import os
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bodies import command
from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import JointState

from tulip_description.robot import JOINTS
from tulip_motion.messages import joint_command_to_message
from tulip_ros import topics
from tulip_ros.errors import BadInputError
from tulip_ros.launch import Launcher
from tulip_ros.plan import make_plan
from tulip_ros.run import ComponentNode, session
from tulip_ros.time import stamp_of

pytestmark = [pytest.mark.ros, pytest.mark.usefixtures("ros_domain")]
PATIENCE = 60.0  # [s] for what takes a second or two
KNEE = JOINTS.index("left_knee")


class Motion(ComponentNode):
    """Commands the legs, in place of motion control."""

    def __init__(self) -> None:
        super().__init__("motion")
        self.legs = self.sender(topics.LEG_COMMAND)
        self.readings: list[JointState] = []
        self.words: set[str] = set()
        self.answer: Callable[[JointState, int], None] = lambda message, sequence: None
        self.listen(topics.JOINT_STATES, self._on_joints)
        self.listen(topics.DIAGNOSTICS, self._on_diagnostics)

    def _on_joints(self, message: JointState) -> None:
        self.readings.append(message)
        self.answer(message, len(self.readings))

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        self.words |= {status.message for status in message.status if status.name == "driver"}


@contextmanager
def graph(driver: str, logs: Path) -> Iterator[tuple[Motion, Callable[[Callable[[], object]], None], Launcher]]:
    with (
        Launcher(make_plan(["aggregator"], driver), logs) as launcher,
        session(Motion, ["test"], handle_signals=False) as (node, spin),
    ):

        def until(condition: Callable[[], object]) -> None:
            deadline = time.monotonic() + PATIENCE
            while not condition():
                assert time.monotonic() < deadline, node.words
                spin(0.05)
                launcher.poll()

        yield node, until, launcher


def test_commands_move_the_joints_bad_ones_are_named_and_silence_is_told(tmp_path: Path) -> None:
    with graph("echo", tmp_path) as (node, until, launcher):

        def bend(message: JointState, sequence: int) -> None:
            order = command(stamp_of(message), sequence, position=np.zeros(12), stiffness=100.0)
            node.legs.publish(joint_command_to_message(order))

        until(lambda: len(node.readings) > 10)
        assert node.readings[-1].position[KNEE] > 0.3  # it stands with bent knees
        node.answer = bend
        until(lambda: node.readings[-1].position[KNEE] == 0.0)

        def garbage(message: JointState, sequence: int) -> None:
            bad = replace(command(stamp_of(message), sequence, stiffness=100.0), position=np.full(12, np.nan))
            node.legs.publish(joint_command_to_message(bad))

        node.answer = garbage
        until(lambda: any("position of left_hip_yaw is not finite" in words for words in node.words))
        until(lambda: any("commands of the legs outlived their time-to-live" in words for words in node.words))
        stamps = [stamp_of(message) for message in node.readings]
        assert all(later > earlier for earlier, later in itertools.pairwise(stamps))
        assert abs(stamps[-1] - time.time_ns()) < 60_000_000_000  # the computer's time, within a minute
        pid = launcher.states()[0].pid
        os.kill(pid, signal.SIGTERM)
        until(lambda: launcher.states()[0].exit_code == 0)


def test_a_driver_that_cannot_be_found_ends_the_launch_with_its_name(tmp_path: Path) -> None:
    words = "Driver nobodys_robot:Mine: there is no module 'nobodys_robot'"
    with pytest.raises(BadInputError, match=words), graph("nobodys_robot:Mine", tmp_path) as (_, until, _):
        until(lambda: False)
