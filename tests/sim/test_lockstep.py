"""Lockstep: deterministic bit for bit, with the graph's latencies; a whole trial; recordings read by another reader."""

from __future__ import annotations

import dataclasses
import gc
import hashlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.highlevel import AnyReader

from tulip_description.field import load_field
from tulip_motion.interface import MotionMode
from tulip_ros import topics
from tulip_sim.lockstep import Lockstep, Settings
from tulip_sim.lockstep_match import LockstepMatch
from tulip_sim.lockstep_recording import LockstepRecording
from tulip_sim.match_lockstep import play_lockstep
from tulip_sim.perception import PerceptionParameters
from tulip_sim.play_lockstep_match import play_lockstep_match
from tulip_sim.scenario import make_scenario
from tulip_sim.timing import FEATURE_DELAY_TICKS, TICK
from tulip_sim.truth import Truth
from tulip_sim.world import World
from tulip_vision.lens import Lens
from tulip_worldmodel.world_state import WorldState

pytestmark = pytest.mark.sim

MILLISECOND = 1_000_000  # [ns]
SEED = 4
WALKING = 8.0  # [s] the referee lets the robot play after 5: it has begun to walk then
RECORDED = 3.0  # [s]
NOT_IN_LOCKSTEP = {
    topics.BATTERY,  # of real bodies
    topics.CAMERA_IMAGE,  # as JPEG only
    topics.VISION_PICTURE,
    topics.ROBOT_DESCRIPTION,
    topics.DIAGNOSTICS,
    topics.CLOCK,
    topics.START_POSE,  # in matches alone
    topics.REPORT,
    topics.USER_WISH,  # nobody is there to wish
    topics.USER_PRESENT,
    topics.EMERGENCY_STOP,
    topics.DIAGNOSTICS_AGG,
    topics.IDENTIFICATION,  # in the experiment alone
    topics.MARKERS,
}


def _bits(value: object) -> object:
    """Turn a value into nested tuples that are equal only if every bit is: NaN equals itself, 0.0 is not -0.0."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return tuple((each.name, _bits(getattr(value, each.name))) for each in dataclasses.fields(value))
    if isinstance(value, Lens):
        return str(value.to_camera_info())
    if isinstance(value, np.ndarray):
        return value.shape, str(value.dtype), hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest()
    if isinstance(value, float):
        return value.hex()
    if isinstance(value, tuple | list):
        return tuple(_bits(each) for each in value)
    return value


@dataclasses.dataclass(frozen=True)
class Run:
    """What a run left behind: all that passed between the components, and the end."""

    told: list[tuple[str, int, object]]
    delays: set[int]  # [ns] from a picture to its features
    truth: Truth
    world: WorldState
    mode: MotionMode
    refused: list[str]


def _run(seed: int, eyes_beside: bool = False) -> Run:
    told: list[tuple[str, int, object]] = []
    delays: set[int] = set()

    def listen(topic: str, stamp: int, value: object) -> None:
        if topic == "features":
            delays.add(stamp - value.stamp)  # type: ignore[attr-defined]
        if topic == "ground_truth":
            value = value[0]  # type: ignore[index]  # without what the referee says
        told.append((topic, stamp, _bits(value)))

    scenario = make_scenario("trial", np.random.default_rng(seed), load_field())
    trial = Lockstep(scenario, seed, listener=listen, eyes_beside=eyes_beside)
    try:
        while trial.stamp < WALKING * 1e9:
            trial.step()
        world = trial.world_model.state(trial.stamp)
        return Run(told, delays, trial.world.truth(), world, trial.motion.mode, trial.refused)
    finally:
        trial.close()


@pytest.fixture(scope="module")
def reference() -> Run:
    return _run(SEED)


def test_the_run_reaches_walking_with_ball_and_landmarks_seen(reference: Run) -> None:
    assert reference.mode is MotionMode.WALK
    assert reference.world.ball is not None
    assert reference.refused == []


@pytest.mark.parametrize("eyes_beside", [False, True])
def test_the_same_seed_gives_the_same_run_bit_for_bit(reference: Run, eyes_beside: bool) -> None:
    again = _run(SEED, eyes_beside)
    for first, second in zip(reference.told, again.told, strict=True):
        assert first == second
    assert _bits(again.truth) == _bits(reference.truth)
    assert _bits(again.world) == _bits(reference.world)


def test_another_seed_gives_another_run(reference: Run) -> None:
    other = _run(SEED + 1)
    for field in ("base_position", "joint_positions", "ball_position"):
        assert not np.array_equal(getattr(other.truth, field), getattr(reference.truth, field)), field


def test_features_arrive_48_ms_after_their_picture(reference: Run) -> None:
    assert reference.delays == {FEATURE_DELAY_TICKS * TICK * MILLISECOND}


@pytest.mark.slow
def test_a_whole_trial_ends_in_a_goal_without_a_fall() -> None:
    summary = play_lockstep(SEED)
    assert summary.outcome == "goal"
    assert summary.scored
    assert summary.falls == 0
    assert summary.touches >= 1
    assert summary.distance_walked > 1.0
    assert summary.localization_error < 0.5


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    recorder = LockstepRecording(tmp_path_factory.mktemp("lockstep") / "trial")
    scenario = make_scenario("open", np.random.default_rng(SEED), load_field())
    trial = Lockstep(scenario, SEED, listener=recorder.write)
    while trial.stamp < RECORDED * 1e9:
        trial.step()
    trial.close()
    recorder.close()
    return recorder.path.parent


def test_a_recording_holds_the_topics_and_types_of_the_graph(recording: Path) -> None:
    with AnyReader([recording]) as reader:
        found = {connection.topic: connection.msgtype for connection in reader.connections}
    assert found == {f"/{topic.name}": topic.type_name for topic in topics.TOPICS if topic not in NOT_IN_LOCKSTEP}


@pytest.mark.parametrize(
    ("topic", "rate"),
    [
        (topics.JOINT_STATES, 250.0),
        (topics.IMU, 250.0),
        (topics.FOOT_FORCES, 250.0),
        (topics.LEG_COMMAND, 250.0),
        (topics.HEAD_JOINT_COMMAND, 50.0),
        (topics.ODOMETRY, 50.0),
        (topics.WORLD_STATE, 50.0),
        (topics.GROUND_TRUTH, 50.0),
        (topics.CAMERA_COMPRESSED, 15.625 / 2),
        (topics.FEATURES, 15.625),
    ],
    ids=lambda value: value.name if isinstance(value, topics.Topic) else "",
)
def test_messages_come_at_their_rate_with_growing_stamps(recording: Path, topic: topics.Topic, rate: float) -> None:
    messages = _messages(recording, topic)
    stamps = [message.header.stamp.sec * 10**9 + message.header.stamp.nanosec for _, message in messages]
    assert len(stamps) == pytest.approx(RECORDED * rate, abs=2)
    # Sensors are read some milliseconds late, but not the first ones: nothing was before them.
    assert np.diff(stamps[1:]) == pytest.approx(1e9 / rate)
    assert 0 < stamps[1] - stamps[0] <= 1e9 / rate


def test_recorded_values_are_those_that_were_told(recording: Path) -> None:
    _, joints = _messages(recording, topics.JOINT_STATES)[-1]
    assert joints.position.shape == (14,)
    assert np.abs(joints.position).max() > 0.1  # bent knees
    _, truth = _messages(recording, topics.GROUND_TRUTH)[-1]
    assert (truth.robot.position.x, truth.ball.position.x) == pytest.approx((-2.0, -1.0), abs=0.15)
    _, picture = _messages(recording, topics.CAMERA_COMPRESSED)[-1]
    assert picture.format == "jpeg"
    assert bytes(picture.data[:2]) == b"\xff\xd8"  # how a JPEG begins


def _messages(recording: Path, topic: topics.Topic) -> list[tuple[int, Any]]:
    with AnyReader([recording]) as reader:
        connections = [each for each in reader.connections if each.topic == f"/{topic.name}"]
        return [(at, reader.deserialize(raw, each.msgtype)) for each, at, raw in reader.messages(connections)]


def test_trials_and_matches_leave_no_world_in_memory(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    alive: list[int] = []

    def end_at_once(self: Lockstep | LockstepMatch, *_: object) -> Any:
        self.step()
        alive.append(sum(isinstance(each, World) for each in gc.get_objects()))
        return None if isinstance(self, Lockstep) else self.referee.report

    monkeypatch.setattr(Lockstep, "play", end_at_once)
    monkeypatch.setattr(LockstepMatch, "play", end_at_once)
    gc.disable()  # it comes when it likes
    try:
        for seed in (1, 2):
            play_lockstep(seed, settings=Settings(perception=PerceptionParameters()))
        for seed in (1, 2):
            play_lockstep_match(seed)
    finally:
        gc.enable()
    assert alive == [alive[0]] * 4  # whoever else may hold one
