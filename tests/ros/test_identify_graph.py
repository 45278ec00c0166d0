"""The experiment as nodes: begun, aborted by its service, and recorded."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from std_srvs.srv import Trigger

from tulip_description.emergency_stop import StopWord
from tulip_description.robot import load_robot
from tulip_motion.identification.experiment_plan import PlanParameters
from tulip_motion.identification.experiment_settings import ExperimentSettings
from tulip_motion.identification.identify_node import TOLD_LIMP, IdentifyNode
from tulip_motion.identification.passages import Doing
from tulip_motion.identification.progress import Progress
from tulip_motion.lipm import GRAVITY
from tulip_msgs.msg import UserCommand
from tulip_ros import topics
from tulip_ros.errors import BadInputError
from tulip_ros.launch import Launcher
from tulip_ros.log_file import Log
from tulip_ros.run import session
from tulip_sim.identify_graph import Watcher, experiment_nodes
from tulip_sim.secret_body import secret_body
from tulip_view.recorded_sensors import sensors_of

pytestmark = [pytest.mark.ros, pytest.mark.sim, pytest.mark.slow, pytest.mark.usefixtures("ros_domain")]

SECRET = 3
LONGEST = 120.0  # [s] of wall-clock time, after which the test has failed


def test_abort_by_the_service_ends_in_a_stand_and_the_recording_says_why(tmp_path: Path):
    settings = ExperimentSettings(plan=PlanParameters(postures=9, candidates=40))
    record, last = tmp_path / "experiment", None
    with (
        Launcher(experiment_nodes(settings, "sim", 1, record, SECRET), tmp_path / "logs") as launcher,
        session(Watcher, arguments=[], handle_signals=False) as (watcher, spin),
    ):
        asked, end = False, time.monotonic() + LONGEST
        while (last is None or not last.finished) and time.monotonic() < end:
            spin(0.1)
            assert launcher.poll() == []  # no node died
            last = watcher.progress
            if last is not None and last.doing is Doing.MOVE and not asked:
                asked = True
                watcher.abort()
    assert isinstance(last, Progress)
    assert (last.finished, last.doing, last.reason) == (True, Doing.STAND, "on request")
    with Log(record) as log:
        names = {name for name, topic in log.topics.items() if topic.messages}
    assert {"/identification/progress", "/joint_states", "/imu", "/foot_forces", "/legs/joint_command"} <= names
    believed = load_robot()
    truth = secret_body(believed, np.random.default_rng(SECRET))
    weights = [sensors.foot_cells.sum() / GRAVITY for sensors in sensors_of(record)]
    assert np.mean(weights) == pytest.approx(truth.mass, rel=0.01)
    assert abs(truth.mass - believed.mass) > 0.04 * believed.mass


def test_node_that_waits_stands_until_the_service_begins_the_experiment(tmp_path: Path):
    settings = ExperimentSettings(plan=PlanParameters(postures=9, candidates=40), at_once=False)
    with (
        Launcher(experiment_nodes(settings, "sim", 1, tmp_path / "experiment"), tmp_path / "logs") as launcher,
        session(Watcher, arguments=[], handle_signals=False) as (watcher, spin),
    ):
        begin = watcher.create_client(topics.BEGIN_IDENTIFICATION.type, topics.BEGIN_IDENTIFICATION.name)

        def until(holds: Callable[[Progress], bool]) -> Progress:
            end = time.monotonic() + LONGEST
            while watcher.progress is None or not holds(watcher.progress):
                assert time.monotonic() < end, watcher.progress
                spin(0.1)
                assert launcher.poll() == []  # no node died
            return watcher.progress

        def ask() -> tuple[bool, str]:
            asked = begin.call_async(Trigger.Request())
            until(lambda _: asked.done())
            return asked.result().success, asked.result().message

        waiting = until(lambda progress: progress.finished)
        assert (waiting.doing, waiting.postures, waiting.held) == (Doing.STAND, 0, 0)
        assert ask() == (True, "")
        assert until(lambda progress: progress.doing is Doing.SHIFT).postures == 18
        assert ask() == (False, "the experiment is under way")
        watcher.abort()
        ended = until(lambda progress: progress.finished)
        assert (ended.doing, ended.reason) == (Doing.STAND, "on request")
        assert ask() == (True, "")
        again = until(lambda progress: not progress.finished)
        assert (again.held, again.reason) == (0, "")


@pytest.mark.parametrize("driver", ["none", "echo"])
def test_secret_body_without_a_simulated_robot_is_refused(driver: str, tmp_path: Path):
    with pytest.raises(BadInputError, match=f"expected --driver sim with it, not {driver}"):
        experiment_nodes(ExperimentSettings(), driver, 1, tmp_path, SECRET)


def test_an_emergency_stop_is_the_reason_though_the_wish_that_follows_from_it_may_come_first():
    with session(IdentifyNode, arguments=[], handle_signals=False) as (node, _):
        node._on_user_command(UserCommand(request=UserCommand.LIMP))
        assert node._experiment.reason == TOLD_LIMP
        stop = StopWord(True, "menu", "key l", 0, 1)
        node._on_emergency_stop(stop)
        assert node._experiment.is_limp and node._experiment.reason == str(stop)
