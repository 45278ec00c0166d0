"""The whole robot as a graph of processes: nodes that die, and a simulation begun anew."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from graph_trial import SECOND, Trial, free_port, running_trial
from rosbags.highlevel import AnyReader

from tulip_msgs.msg import MotionState
from tulip_ros import topics
from tulip_ros.log_file import Log
from tulip_sim.match_graph import play_graph
from tulip_sim.recompute.run import recompute
from tulip_sim.referee_udp import RefereeSocket
from tulip_sim.trial import TrialObserver
from tulip_strategy.interface import GamePhase

pytestmark = [pytest.mark.ros, pytest.mark.sim, pytest.mark.slow, pytest.mark.usefixtures("ros_domain")]

START = (-2.0, 0.0)  # [m] where the robot stands in the scenario "open"


def test_vision_dies_while_the_robot_walks_and_the_game_goes_on(tmp_path: Path) -> None:
    with running_trial(tmp_path / "logs") as trial:
        watcher = trial.watcher
        trial.until(lambda: watcher.walks, 20.0)
        seen = watcher.pictures
        assert seen > 0
        trial.kill("vision")
        trial.until(lambda: trial.restarts("vision") == 1, 10.0)
        trial.until(lambda: watcher.pictures > seen + 10, 30.0)
        again = watcher.stamp
        trial.until(lambda: watcher.stamp > again + 2 * SECOND, 3.0)
        trial.until(lambda: watcher.motion.mode in (MotionState.WALK, MotionState.KICK), 20.0)
        assert not watcher.fell
        assert not watcher.truth.robot_fallen
        assert "vision was killed by SIGKILL" in trial.events[0]
        others = [state.restarts for state in trial.launcher.states() if state.name != "vision"]
        assert others == [0] * 7


def test_behind_a_wire_the_robot_walks_time_begins_anew_and_a_killed_driver_comes_back(tmp_path: Path) -> None:
    with running_trial(tmp_path / "logs", wire=True) as trial:
        watcher = trial.watcher
        walks_to_the_ball(trial)
        trial.begin_anew("open", 1)
        walks_to_the_ball(trial)
        assert trial.events == []
        trial.kill("driver")
        trial.until(lambda: trial.restarts("driver") == 1, 20.0)
        before = watcher.stamp
        trial.until(lambda: watcher.stamp > before + 2 * SECOND, 20.0)
        assert trial.restarts("emulator") == 0
        heard = watcher.motion.header.stamp.sec
        trial.until(lambda: watcher.motion.header.stamp.sec > heard, 20.0)  # sensors reach motion control again


def walks_to_the_ball(trial: Trial) -> None:
    watcher = trial.watcher
    trial.until(lambda: watcher.walks and watcher.truth.robot.position.x > START[0] + 0.3, 20.0)
    assert not watcher.fell


def test_a_simulation_begun_anew_by_request_or_since_it_died_and_the_robot_knows_where_it_stands_then(
    tmp_path: Path,
) -> None:
    with running_trial(tmp_path / "logs") as trial:
        watcher = trial.watcher

        def stands_and_knows_where() -> None:
            for _ in range(2):  # what comes first may have been on its way already
                watcher.observer = TrialObserver()
                trial.until(lambda: not math.isnan(watcher.observer.localization_error), 5.0)
                told = watcher.stamp
                trial.until(lambda told=told: watcher.stamp > told + SECOND // 4, 2.0)
            assert watcher.motion.mode == MotionState.STAND
            assert watcher.observer.localization_error < 0.1

        walks_to_the_ball(trial)
        trial.begin_anew("open", 1)
        stands_and_knows_where()
        x, y = watcher.truth.robot.position.x, watcher.truth.robot.position.y
        assert (x, y) == pytest.approx(START, abs=0.1)
        walks_to_the_ball(trial)
        trial.begin_anew("trial", 1)
        stands_and_knows_where()
        assert trial.events == []  # nobody had to be restarted
        before = watcher.stamp
        trial.kill("driver")
        trial.until(lambda: trial.restarts("driver") == 1 and 0 < watcher.stamp < before, 5.0)
        stands_and_knows_where()  # in the scenario of the beginning
        assert "driver was killed by SIGKILL" in trial.events[0]


def test_wrong_packets_during_a_game_change_nothing_and_are_named(tmp_path: Path) -> None:
    with running_trial(tmp_path / "logs") as trial, RefereeSocket(port=trial.port) as stranger:
        watcher = trial.watcher
        trial.until(lambda: any(game.phase == GamePhase.PLAYING for game in watcher.games), 10.0)
        begin = len(watcher.games)
        wrong = {
            b"RGme": "is 4 bytes long",
            b"RGme\x0b" + bytes(683): "version is 11",
            bytes(range(256)) * 8: "packet begins with",
        }
        for data, words in wrong.items():
            stranger.send(data)
            trial.until(lambda words=words: any(words in each for each in watcher.warnings["game_input"]), 10.0)
        now = watcher.stamp
        trial.until(lambda: watcher.games[-1].header.stamp.sec * SECOND > now and len(watcher.games) > begin + 2, 5.0)
        assert {game.phase for game in watcher.games[begin:]} == {GamePhase.PLAYING}
        assert not any(game.stale for game in watcher.games)
        assert watcher.motion.mode == MotionState.WALK
        assert trial.events == []


def test_whole_recording_of_a_trial_is_read_by_another_reader_and_computed_anew(tmp_path: Path) -> None:
    rules = {"initial_time": 0.5, "ready_time": 0.5, "set_time": 0.5, "playing_time": 1.0}
    values = {
        "driver": {"rules": rules},
        "recorder": {"pictures": "both", "picture_rate": 0.0, "exclude": ["/vision/picture"]},
    }
    summary = play_graph(1, "open", tmp_path / "trial", values=values, referee_port=free_port(), logs=tmp_path)
    assert summary.outcome == "time"
    of_others = (topics.START_POSE, topics.REPORT, topics.BATTERY)  # of matches, real bodies
    of_people = (topics.USER_WISH, topics.USER_PRESENT, topics.EMERGENCY_STOP)
    of_tools = (topics.DIAGNOSTICS_AGG, topics.MARKERS, topics.IDENTIFICATION)
    kept = [topic for topic in topics.TOPICS if topic not in (topics.VISION_PICTURE, *of_others, *of_people, *of_tools)]
    counts: dict[str, int] = {}
    with AnyReader([tmp_path / "trial"]) as reader:
        kinds = {each.topic: each.msgtype for each in reader.connections}
        for connection, _, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            assert message.__msgtype__ == connection.msgtype
            counts[connection.topic] = counts.get(connection.topic, 0) + 1
    kinds.pop("/rosout", None)  # there if a node logged something
    assert kinds == {f"/{topic.name.lstrip('/')}": topic.type_name for topic in kept}
    assert set(counts) - {"/rosout"} == set(kinds)
    assert counts["/joint_states"] > 500  # 2.5 s at 250 Hz
    assert counts["/camera/image_raw/compressed"] > 30
    assert Path(summary.recording).parent == tmp_path / "trial"
    come_out_as_recorded(tmp_path / "trial")


def come_out_as_recorded(recording: Path) -> None:
    """Check that today's cores, on the recorded inputs, say what the nodes said.

    World states tell all that they were computed on. Features do not tell which readings of odometry and joints a
    vision node missed that waited for the processor: those of a picture or two may differ, by little.
    """
    with Log(recording) as log:
        believed = recompute(log, ["worldmodel"])
        seen = recompute(log, ["vision"]).differences["/features"]
    assert believed.shortcomings == [] or all("missed" in line for line in believed.shortcomings)
    states = believed.differences["/world_state"].recorded
    assert states > 100
    for name in ("/world_state", "/robot_pose", "/tf"):
        difference = believed.differences[name]
        assert difference.equal == difference.recorded, (name, difference)
        assert difference.recomputed == states  # what is sent beside the last state may have come after the end
        assert states - difference.recorded <= 1
    assert seen.recorded == seen.recomputed == seen.pairs > 10
    assert seen.equal >= seen.recorded - 2
    assert seen.largest.get("angle [rad]", 0.0) < 0.01
