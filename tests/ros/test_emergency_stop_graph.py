"""The emergency stop in a running graph: obeyed by all, latched to those that start later, ended by a release alone."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import launch
import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import JointState

from tulip_msgs.msg import EmergencyStop, JointCommand, MotionState, UserCommand
from tulip_ros import topics
from tulip_ros.launch import Launcher
from tulip_ros.plan import make_plan
from tulip_ros.run import ComponentNode, session
from tulip_ros.topics import Service

pytestmark = [pytest.mark.ros, pytest.mark.usefixtures("ros_domain")]
PATIENCE = 90.0  # [s] for what takes a second or two
MANY = 100  # messages of a topic that comes 250 times a second
BUTTON = Path(__file__).with_name("button_body.py")


class Ears(ComponentNode):
    """Hears what the robot does."""

    def __init__(self) -> None:
        super().__init__("ears")
        self.legs: list[JointCommand] = []
        self.joints: list[JointState] = []
        self.words: list[EmergencyStop] = []
        self.users: list[UserCommand] = []
        self.motion: list[MotionState] = []
        self.said: dict[str, str] = {}
        for topic, heard in (
            (topics.LEG_COMMAND, self.legs),
            (topics.JOINT_STATES, self.joints),
            (topics.EMERGENCY_STOP, self.words),
            (topics.USER_COMMAND, self.users),
            (topics.MOTION_STATE, self.motion),
        ):
            topic.subscribe_from(self, heard.append)
        topics.DIAGNOSTICS.subscribe_from(self, self._on_diagnostics)
        services = (topics.ENGAGE_STOP, topics.RELEASE_STOP, topics.STAND, topics.RESET)
        self._callers = {each.name: self.create_client(each.type, each.name) for each in services}

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        self.said |= {status.name: status.message for status in message.status}

    @property
    def stiff(self) -> bool:
        """Whether motion control's last command gives the legs stiffness."""
        return bool(self.legs) and bool(np.any(self.legs[-1].stiffness))

    @property
    def torque(self) -> float:
        """Greatest torque of the legs in the last reading [N m]."""
        return float(np.abs(self.joints[-1].effort[:12]).max()) if self.joints else 0.0

    def ask(self, service: Service, until: Callable[[Callable[[], object]], None], **fields: Any) -> Any:
        client = self._callers[service.name]
        until(client.service_is_ready)
        answer = client.call_async(service.type.Request(**fields))
        until(answer.done)
        return answer.result()


@contextmanager
def graph(
    logs: Path, driver: str, values: dict[str, dict[str, Any]] | None = None
) -> Iterator[tuple[Ears, Callable[[Callable[[], object]], None], Launcher]]:
    with (
        Launcher(make_plan(["motion", "user_input"], driver, values=values), logs) as launcher,
        session(Ears, ["test"], handle_signals=False) as (ears, spin),
    ):

        def until(condition: Callable[[], object]) -> None:
            end = time.monotonic() + PATIENCE
            while not condition():
                assert time.monotonic() < end, ears.said
                spin(0.02)
                launcher.poll()

        yield ears, until, launcher


def more(heard: list[Any], count: int = MANY) -> Callable[[], bool]:
    """Return whether so many more messages have come."""
    wanted = len(heard) + count
    return lambda: len(heard) >= wanted


def test_a_stop_told_by_topic_alone_outlives_driver_and_user_input_and_ends_by_release_alone(tmp_path: Path) -> None:
    with graph(tmp_path, "echo") as (ears, until, launcher):
        until(lambda: ears.stiff and ears.torque > 0.0 and ears.users)
        refused = ears.ask(topics.RELEASE_STOP, until)
        assert not refused.success and refused.message.startswith("no emergency stop holds")
        face = topics.EMERGENCY_STOP.publish_from(ears)
        until(lambda: face.get_subscription_count() >= 4)
        face.publish(EmergencyStop(engaged=True, by="tester", reason="a test"))
        until(lambda: not ears.stiff and ears.torque == 0.0)
        until(lambda: ears.users[-1].request == UserCommand.LIMP)
        until(lambda: ears.motion and ears.motion[-1].mode == MotionState.LIMP)
        assert ears.motion[-1].reason == "emergency stop by tester (a test)"
        until(lambda: "emergency stop by tester (a test): release it" in ears.said.get("driver", ""))
        ears.destroy_publisher(face)  # those that live remember it
        ears.said.clear()
        for name in ("driver", "user_input"):
            os.kill(next(state.pid for state in launcher.states() if state.name == name), signal.SIGKILL)
        users = len(ears.users)
        for name in ("driver", "user_input"):
            until(lambda name=name: "emergency stop by tester (a test)" in ears.said.get(name, ""))
        until(lambda: len(ears.users) > users and ears.users[-1].request == UserCommand.LIMP)
        until(more(ears.joints))
        assert ears.torque == 0.0
        refused = ears.ask(topics.STAND, until)
        assert not refused.success and refused.message == "emergency stop by tester (a test); release it first"
        assert ears.ask(topics.RELEASE_STOP, until).success
        until(lambda: ears.words and not ears.words[-1].engaged)
        until(more(ears.legs))
        assert not any(np.any(each.stiffness) for each in ears.legs[-MANY:])  # limp until somebody wants another thing
        assert ears.ask(topics.ENGAGE_STOP, until).success
        until(lambda: ears.words and ears.words[-1].engaged and ears.words[-1].by == "user_input")


def test_a_bodys_own_stop_button_stops_everybody_and_holds_after_it_is_out_again(tmp_path: Path) -> None:
    button = tmp_path / "pressed"
    sys_path = os.pathsep.join(filter(None, [str(BUTTON.parent), os.environ.get("PYTHONPATH")]))
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", sys_path)
        values = {"driver": {"options": [f"file={button}"]}}
        with graph(tmp_path / "logs", "button_body:ButtonBody", values) as (ears, until, _):
            until(lambda: ears.stiff and ears.torque > 0.0 and ears.users)
            button.touch()
            until(
                lambda: (
                    not ears.stiff and ears.torque == 0.0 and ears.users and ears.users[-1].request == UserCommand.LIMP
                )
            )
            assert (ears.words[-1].by, ears.words[-1].reason) == ("driver", "its stop button is pressed")
            number = ears.words[-1].sequence
            assert ears.ask(topics.RELEASE_STOP, until).success
            until(lambda: ears.words[-1].engaged and ears.words[-1].sequence > number)  # it is still pressed
            button.unlink()
            until(more(ears.joints))
            assert ears.torque == 0.0 and ears.words[-1].engaged


@pytest.mark.sim
def test_the_simulated_robot_sinks_and_another_world_is_no_release(tmp_path: Path) -> None:
    with graph(tmp_path, "sim", {"driver": {"camera": False, "referee": False}}) as (ears, until, _):
        until(lambda: ears.stiff and ears.torque > 1.0 and len(ears.joints) > MANY)
        assert ears.ask(topics.ENGAGE_STOP, until).success
        until(lambda: ears.torque == 0.0)
        stamp = ears.joints[-1].header.stamp
        assert ears.ask(topics.RESET, until, seed=2).success
        until(lambda: ears.joints[-1].header.stamp.sec < max(stamp.sec, 1) and ears.torque == 0.0)
        until(more(ears.joints))
        assert not any(np.any(each.effort) for each in ears.joints[-MANY // 2 :]) and not ears.stiff
        until(lambda: "emergency stop by user_input (asked by service)" in ears.said.get("driver", ""))


def test_ctrl_c_of_the_launcher_stops_the_robot_for_everybody_and_a_second_one_leaves_no_orphans(
    tmp_path: Path,
) -> None:
    with session(Ears, ["test"], handle_signals=False) as (ears, spin):

        def until(condition: Callable[[], object]) -> None:
            end = time.monotonic() + PATIENCE
            while not condition():
                assert time.monotonic() < end, ears.said
                spin(0.02)

        launcher = subprocess.Popen(
            [sys.executable, launch.__file__, "motion", "user_input", "--driver", "echo", "--logs", str(tmp_path)],
            env={**os.environ, "TULIP_NO_VENV": "1"},
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        children = Path(f"/proc/{launcher.pid}/task/{launcher.pid}/children")
        until(lambda: ears.stiff and ears.torque > 0.0)
        pids = children.read_text().split()
        assert len(pids) == 3
        os.kill(launcher.pid, signal.SIGINT)
        until(lambda: ears.words)
        os.kill(launcher.pid, signal.SIGINT)
        word = ears.words[0]
        assert (word.engaged, word.by, word.reason) == (True, "launcher", "its nodes are ended")
        until(lambda: launcher.poll() is not None)
        assert launcher.returncode == 0 and "Traceback" not in launcher.communicate()[1]
        assert not [pid for pid in pids if Path(f"/proc/{pid}").exists()]
