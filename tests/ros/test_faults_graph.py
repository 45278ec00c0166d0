"""Faults in a running graph: the quick ones of the bench `faults`, one after the other while the robot walks."""

from __future__ import annotations

import signal
from pathlib import Path
from typing import Any

import pytest
from sensor_msgs.msg import JointState

from tulip_msgs.msg import Decision, GroundTruth, MotionState, UserCommand, WalkCommand
from tulip_ros import topics
from tulip_ros.run import ComponentNode, session
from tulip_ros.time import to_message
from tulip_sim.bench.free_port import free_port
from tulip_sim.fault_table import ROWS
from tulip_sim.fault_trial import MOST_DAMPING, RULES, SECOND, FaultTrial, FaultWatcher, running
from tulip_sim.match_graph import trial_plan
from tulip_sim.perception import PerceptionParameters
from tulip_sim.trial import TrialObserver

pytestmark = [pytest.mark.ros, pytest.mark.sim, pytest.mark.slow, pytest.mark.usefixtures("ros_domain")]


def ask(trial: FaultTrial, node: ComponentNode, request: int) -> None:
    client = node.create_client(topics.SET_USER_COMMAND.type, topics.SET_USER_COMMAND.name)
    assert trial.go_on(client.service_is_ready, 10.0)
    answer = client.call_async(topics.SET_USER_COMMAND.type.Request(request=request))
    assert trial.go_on(answer.done, 10.0)
    assert answer.result().success, answer.result().message


def stands(trial: FaultTrial, seconds: float) -> bool:
    begin = trial.watcher.stamp
    trial.go_on(lambda: trial.watcher.stamp > begin + seconds * SECOND, seconds + 1.0)
    return all(each.mode == MotionState.STAND for each in trial.watcher.samples if each.stamp > begin)


def localization_error(trial: FaultTrial, seconds: float) -> float:
    trial.watcher.observer, begin = TrialObserver(), trial.watcher.stamp
    trial.go_on(lambda: trial.watcher.stamp > begin + seconds * SECOND, seconds + 1.0)
    return trial.watcher.observer.localization_error


def test_torques_less_damping_go_to_the_sample_of_their_own_time_though_they_come_early_or_late() -> None:
    def at(message: Any, hundredths: int) -> Any:
        message.header.stamp = to_message(hundredths * SECOND // 100)
        return message

    with session(FaultWatcher, [], handle_signals=False) as (watcher, _):

        def joints(hundredths: int, torque: float, damped: float = 0.0) -> None:
            names, efforts = ["left_knee", "head_pan"], [-torque - damped, 99.0]
            speeds = [damped / MOST_DAMPING["left_knee"], 0.0]
            watcher._on_joints(at(JointState(name=names, velocity=speeds, effort=efforts), hundredths))

        joints(101, 5.0)
        joints(103, 60.0)  # before the truth of the instant before
        for hundredths in (100, 102, 104, 106):
            watcher._on_truth(at(GroundTruth(), hundredths))
        joints(105, 7.0)
        joints(106, 6.0, damped=20.0)
        assert [sample.torque for sample in watcher.samples] == [0.0, 5.0, 60.0, 7.0]


def test_a_robot_that_is_about_to_stop_by_itself_does_not_count_as_walking() -> None:
    with session(FaultWatcher, [], handle_signals=False) as (watcher, _):
        for stamp in range(2 * SECOND, 4 * SECOND, SECOND // 10):
            walking, truth, decision = MotionState(mode=MotionState.WALK), GroundTruth(), Decision()
            for message in (walking, truth, decision):
                message.header.stamp = to_message(stamp)
            watcher._on_motion(walking)
            watcher._on_truth(truth)
        decision.walk.mode = WalkCommand.WALK
        watcher._on_decision(decision)
        assert watcher.walks
        decision.walk.mode = WalkCommand.STAND
        watcher._on_decision(decision)
        assert not watcher.walks


def test_killed_nodes_come_back_with_all_that_was_latched_or_known_and_a_stopped_one_lets_the_robot_stand(
    tmp_path: Path,
) -> None:
    values = {"driver": {"rules": RULES, "hands": True}}
    plan = trial_plan(1, "open", values=values, referee_port=free_port(), perception=PerceptionParameters())
    with running(plan, tmp_path, hung=0.0) as trial:
        for node in ("strategy", "worldmodel", "motion"):
            killed = trial.kill(node, 0.5)
            assert killed["safe"] and killed["plays on"], killed
            assert trial.process(node).restarts == 1
        # It knows the user's wish, the game and its own place: else it would not play on where it was.
        trial.walk()
        # From now on: while people carried it, if it fell, it could not know its place.
        error = localization_error(trial, 2.0)
        later = [] if error < 0.5 else [localization_error(trial, 2.0) for _ in range(7)]
        assert error < 0.5, (error, later, killed)  # whether it finds its place later tells what is wrong

        row = next(row for row in ROWS if row.name == "strategy stopped")
        found = trial.react(row)
        assert found["observed"] == found["stated"] and found["told"], found

        ask(trial, trial.watcher, UserCommand.STOP)
        trial.go_on(lambda: stands(trial, 0.5), 10.0)
        trial.send("user_input", signal.SIGKILL)
        trial.go_on(lambda: trial.process("user_input").restarts == 1, 20.0)
        assert stands(trial, 3.0)  # though it begins with PLAY
        ask(trial, trial.watcher, UserCommand.PLAY)
        trial.walk()
