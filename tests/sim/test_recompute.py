"""Recorded runs, computed anew: exactly as they were, inside bounds against the truth, told apart when they differ."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import replay
from rclpy.serialization import serialize_message
from rosbags.highlevel import AnyReader
from typer.testing import CliRunner

from tulip_description.field import load_field
from tulip_description.planar import Pose2D
from tulip_msgs.msg import EmergencyStop
from tulip_ros import topics
from tulip_ros.bag import Bag
from tulip_ros.errors import BadInputError
from tulip_ros.log_edit import cut, writing
from tulip_ros.log_file import Log
from tulip_ros.time import stamp_of
from tulip_sim.lockstep import Lockstep, Settings
from tulip_sim.lockstep_notes import explain_trial
from tulip_sim.lockstep_recording import LockstepRecording, RecordedPictures
from tulip_sim.messages import jpeg_to_message, png_to_message
from tulip_sim.perception import PerceptionParameters
from tulip_sim.recompute.differences import Comparison
from tulip_sim.recompute.heard import Made
from tulip_sim.recompute.run import Outcome, recompute
from tulip_sim.recompute.settings import parameters_of
from tulip_sim.recompute.verdict import bounds_of, violations
from tulip_sim.scenario import make_scenario
from tulip_worldmodel.messages import features_from_message

pytestmark = pytest.mark.sim

RECORDINGS = Path(__file__).parent.parent / "data" / "recordings"
SEED = 7
WALK = ["position=0.0065", "heading=0.002", "ball=0.005"]
MATCH = ["position=0.006", "heading=0.002"]
PICTURES = ["position=0.006", "heading=0.002", "ball=0.0045", "ball_recall=0.95", "latency=0.05"]
"""Bounds against the truth [m], [rad], [s]: some 1.4 times what was measured when the recordings were made."""
AS_RECORDED = [
    *("position=0.0002", "heading=0.0001", "ball=0.0005", "ball known=0.05"),
    *("angle=0.0002", "unmatched=0.02", "tree=0.1", "kick=0.1", "statuses=0.5"),
]
"""How far the estimates may move before the recordings are to be made anew: far more than another machine's rounding,
and less than any change that is meant."""


def record(folder: Path, seconds: float, perception: PerceptionParameters | None) -> Path:
    recording = LockstepRecording(folder, RecordedPictures("png", 0.0))
    settings = Settings(perception=perception)
    scenario = make_scenario("trial", np.random.default_rng(SEED), load_field())
    trial = Lockstep(scenario, SEED, settings, recording.write)
    explain_trial(recording.notebook, SEED, "trial", scenario.robot, settings, trial.user.strategy)
    while trial.stamp < seconds * 1e9:
        trial.step()
        if perception is not None and trial.stamp == round(seconds / 2.0) * 10**9:
            trial.told_to_stand_at(Pose2D(-1.234, 0.1, 0.3))  # wrongly: the filters have something to do
    trial.close()
    recording.close()
    return folder


@pytest.fixture(scope="module")
def without_pictures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("lockstep") / "run", 4.0, PerceptionParameters())


@pytest.fixture(scope="module")
def with_pictures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("lockstep") / "run", 1.1, None)


def outcome_of(recording: Path, *components: str, judge: bool = False) -> Outcome:
    with Log(recording) as log:
        return recompute(log, components, judge=judge)


def test_a_lockstep_run_without_pictures_comes_out_byte_by_byte(without_pictures: Path) -> None:
    outcome = outcome_of(without_pictures, "worldmodel", "strategy", "head")
    assert outcome.lockstep and outcome.shortcomings == []
    assert outcome.differences["/world_state"].recorded == 200
    for name, difference in outcome.differences.items():
        assert difference.is_none, (name, difference)
    assert violations(outcome, {}) == []


def test_vision_on_pictures_without_losses_comes_out_byte_by_byte(with_pictures: Path) -> None:
    with Log(with_pictures) as log:
        assert log.topics["/camera/camera_info"].messages == 1
    outcome = outcome_of(with_pictures, "vision", "worldmodel", "strategy", "head")
    assert not outcome.lossy
    assert outcome.differences["/features"].recorded >= 14
    for name, difference in outcome.differences.items():
        assert difference.is_none, (name, difference)


def test_the_new_recording_has_the_recomputed_topics_and_all_others_as_they_were(
    without_pictures: Path, tmp_path: Path
) -> None:
    with Log(without_pictures) as log:
        recompute(log, ["worldmodel"], tmp_path / "new", judge=False)
        before = {name: [each.data for each in log.records([name])] for name in log.topics}
        notes = log.metadata
    with Log(tmp_path / "new") as log:
        after = {name: [each.data for each in log.records([name])] for name in log.topics}
        assert log.metadata == notes
    assert {name: len(each) for name, each in before.items()} == {name: len(each) for name, each in after.items()}
    assert all(before[name] == after[name] for name in before if name not in ("/world_state", "/robot_pose", "/tf"))
    with AnyReader([tmp_path / "new"]) as reader:  # another reader agrees
        assert sum(1 for _ in reader.messages()) == sum(map(len, before.values()))


def test_another_parameter_is_told_and_bounds_decide(without_pictures: Path, tmp_path: Path) -> None:
    file = tmp_path / "parameters.yaml"
    file.write_text(
        "worldmodel: {localization.position_noise_per_metre: 0.1, localization.start_position_spread: 0.05}\n"
    )
    with Log(without_pictures) as log:
        outcome = recompute(log, ["worldmodel"], parameter_files=[file])
    difference = outcome.differences["/world_state"]
    assert 0 < difference.equal < difference.recorded == difference.recomputed
    assert difference.largest["position [m]"] > 0.0
    assert any("/world_state" in line for line in violations(outcome, {}))
    wide = bounds_of(["position=1.0", "truth:position=2.0"])
    assert violations(outcome, wide) == []
    narrow = violations(outcome, bounds_of(["position=1e-12"]))
    assert any("bound 1e-12" in line for line in narrow)
    assert violations(outcome, bounds_of(["position=1.0", "truth:position=0.0"]))


def test_recorded_parameters_hold_and_those_that_are_gone_are_named(without_pictures: Path, tmp_path: Path) -> None:
    with Log(without_pictures) as log:
        known = parameters_of(log, "")
        start = make_scenario("trial", np.random.default_rng(SEED), load_field()).robot
        assert known.start == start
        with writing(tmp_path / "old") as bag:
            for name in ("/odometry", "/features", "/world_state"):
                for each in log.records([name], None, 10**9):
                    bag.copy(each)
            bag.attach("parameters/worldmodel.yaml", "text/yaml", b"worldmodel: {gone: 3, ball.floor: 1}\n")
    with Log(tmp_path / "old") as log:
        outcome = recompute(log, ["worldmodel"])
    assert any("worldmodel.gone" in line for line in outcome.shortcomings)


def test_a_part_without_the_beginning_begins_where_it_was_recorded_and_tells_so(
    without_pictures: Path, tmp_path: Path
) -> None:
    names = ["/odometry", "/features", "/world_state"]
    with Log(without_pictures) as log:
        cut(log, names, 10**9, 19 * 10**8, tmp_path / "part", lambda _: None)  # before somebody set the robot down
    outcome = outcome_of(tmp_path / "part", "worldmodel")
    assert [line for line in outcome.shortcomings if "begun in the middle" in line]
    assert outcome.differences["/world_state"].largest["position [m]"] < 0.02
    assert not [line for line in outcome.shortcomings if "no recorded parameters" in line]


def test_a_recording_without_parameters_tells_so(without_pictures: Path, tmp_path: Path) -> None:
    with Log(without_pictures) as log, writing(tmp_path / "bare") as bag:
        for each in log.records(["/odometry", "/features", "/world_state"], None, 10**9):
            bag.copy(each)
    (line,) = outcome_of(tmp_path / "bare", "worldmodel").shortcomings
    assert line == "no recorded parameters of worldmodel: today's defaults were taken"


def test_inputs_that_are_lost_are_counted(without_pictures: Path, tmp_path: Path) -> None:
    with Log(without_pictures) as log, writing(tmp_path / "lossy") as bag:
        for index, each in enumerate(log.records(["/odometry", "/features", "/world_state"])):
            if each.topic.name != "/features" or index % 10:
                bag.copy(each)
    outcome = outcome_of(tmp_path / "lossy", "worldmodel")
    assert outcome.differences["/world_state"].unmatched == 0.0
    assert not outcome.differences["/world_state"].is_none


def test_arrival_in_another_order_changes_nothing(without_pictures: Path, tmp_path: Path) -> None:
    """A recorder beside a graph hears messages of different topics in another order than the nodes did."""
    rng = np.random.default_rng(3)
    epoch = 1_700_000_000 * 10**9
    with Log(without_pictures) as log, writing(tmp_path / "shuffled") as bag:
        last: dict[str, int] = {}
        for each in log.records(["/odometry", "/features", "/world_state"]):
            # Up to 15 ms late, but in order on each topic, as the middleware has it.
            late = max(epoch + each.log_time + int(rng.integers(15_000_000)), last.get(each.topic.name, 0) + 1)
            last[each.topic.name] = late
            bag.copy_topic(each.topic)
            bag.write(each.topic.name, each.data, late)
    # Without the start pose told in the middle, the second half differs in the original as well.
    outcome = outcome_of(tmp_path / "shuffled", "worldmodel")
    assert not outcome.lockstep
    difference = outcome.differences["/world_state"]
    assert difference.recorded == difference.pairs == 200
    assert difference.equal >= 90


def test_an_emergency_stop_in_the_recording_is_obeyed_until_its_release(without_pictures: Path, tmp_path: Path) -> None:
    name, begin, end = "/emergency_stop", 15 * 10**8, 25 * 10**8
    with Log(without_pictures) as log, writing(tmp_path / "stopped") as bag:
        told = [(begin, EmergencyStop(engaged=True, sequence=1)), (end, EmergencyStop(engaged=False, sequence=2))]
        bag.add_topic(name, topics.EMERGENCY_STOP.type_name, topics.EMERGENCY_STOP.quality)
        for each in log.records():
            while told and each.log_time > told[0][0]:
                moment, word = told.pop(0)
                bag.write(name, serialize_message(word), moment)
            bag.copy(each)
        bag.copy_notes(log)
    with Log(tmp_path / "stopped") as log:
        for component in ("strategy", "head"):
            recompute(log, [component], tmp_path / component, judge=False)
    with Log(tmp_path / "strategy") as log:
        decisions = [log.decode(each) for each in log.records(["/decision"])]
    # The release alone lets nobody play: the user has to say so.
    assert all(each.tree.startswith("robot > limp") == (stamp_of(each) > begin) for each in decisions)
    with Log(tmp_path / "head") as log:
        heads = [log.decode(each) for each in log.records(["/head/joint_command"])]
    assert all(np.any(each.stiffness) != (begin < stamp_of(each) <= end) for each in heads)
    assert min(map(stamp_of, heads)) < begin and max(map(stamp_of, heads)) > end


def test_features_keep_every_field_on_their_way_through_messages(without_pictures: Path) -> None:
    with Log(without_pictures) as log:
        sides = [
            each.side for r in log.records(["/features"]) for each in features_from_message(log.decode(r)).features
        ]
    assert {-1, 1} & set(sides)


def test_unmatched_messages_are_counted_and_the_first_difference_is_noted() -> None:
    message = topics.GAME_STATE.message()
    data = serialize_message(message)
    comparison = Comparison("game_state")
    comparison.add_recorded(1, 10, data, lambda: message)
    comparison.add_recorded(2, 20, data, lambda: message)
    comparison.add_made(Made("game_state", 10, 1, message))
    comparison.add_made(Made("game_state", 30, 3, message))
    comparison.finish()
    difference = comparison.difference
    assert (difference.equal, difference.pairs, difference.first, difference.unmatched) == (1, 1, 20, 0.5)


@pytest.mark.parametrize(
    ("name", "components", "against_truth"),
    [
        ("walk", ["worldmodel", "strategy"], WALK),
        ("match", ["worldmodel"], MATCH),
        ("pictures", ["vision", "worldmodel"], PICTURES),
    ],
)
def test_recordings_that_are_kept_stay_inside_their_bounds(
    name: str, components: list[str], against_truth: list[str]
) -> None:
    outcome = outcome_of(RECORDINGS / name, *components, judge=True)
    assert outcome.shortcomings == []
    truth = [f"truth:{each}" for each in against_truth]
    assert violations(outcome, bounds_of([*AS_RECORDED, *truth])) == []


def test_recordings_that_are_kept_are_small() -> None:
    assert sum(path.stat().st_size for path in RECORDINGS.rglob("*.mcap")) < 5e6


def test_the_command_compares_writes_and_tells_by_its_exit_code(without_pictures: Path, tmp_path: Path) -> None:
    runner, kept = CliRunner(), tmp_path / "run"
    shutil.copytree(without_pictures, kept)
    app = replay.typer.Typer()
    app.command()(replay.main)
    done = runner.invoke(app, [str(kept), "--recompute", "worldmodel", "--json", str(tmp_path / "result.json")])
    assert done.exit_code == 0, done.output
    assert json.loads((tmp_path / "result.json").read_text())["topics"]["/world_state"]["equal"] == 200
    assert (tmp_path / "run_recomputed" / "run_recomputed.mcap").exists()
    again = runner.invoke(app, [str(kept), "--recompute", "worldmodel"])
    assert again.exit_code == 2
    different = tmp_path / "p.yaml"
    different.write_text("worldmodel: {localization.start_position_spread: 0.1}\n")
    other = ["--no-output", "--parameters", str(different)]
    assert runner.invoke(app, [str(kept), "--recompute", "worldmodel", *other]).exit_code == 1
    assert runner.invoke(app, [str(kept), "--bound", "position=1"]).exit_code == 2


@pytest.mark.parametrize(
    ("components", "message"),
    [
        (["visoin"], "Did you mean vision"),
        ([], "expected some of vision, worldmodel"),
        (["vision"], r"lacks pictures on /camera/image_raw or /camera/image_raw/compressed"),
    ],
)
def test_what_cannot_be_recomputed_is_refused(without_pictures: Path, components: list[str], message: str) -> None:
    with Log(without_pictures) as log, pytest.raises(BadInputError, match=message):
        recompute(log, components)


@pytest.mark.parametrize(
    ("text", "message"),
    [("position", "expected TOPIC"), ("truth:bal=3", "Did you mean ball"), ("position=-1", "expected TOPIC")],
)
def test_bounds_that_are_none_are_refused(text: str, message: str) -> None:
    with pytest.raises(BadInputError, match=message):
        bounds_of([text])


def test_no_recording_to_recompute_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    Bag(tmp_path / "empty").close()
    with Log(tmp_path / "empty") as log, pytest.raises(BadInputError, match="lacks /odometry"):
        recompute(log, ["worldmodel"], tmp_path / "new")
    assert not (tmp_path / "new").exists()


def test_png_loses_nothing_and_jpeg_does() -> None:
    import cv2

    picture = np.random.default_rng(1).integers(0, 256, (48, 64, 3)).astype(np.uint8)
    png, jpeg = png_to_message(picture, 5), jpeg_to_message(picture, 5, 50)
    assert (png.format, jpeg.format) == ("png", "jpeg")
    decoded = [cv2.imdecode(np.frombuffer(each.data, np.uint8), cv2.IMREAD_COLOR) for each in (png, jpeg)]
    assert np.array_equal(decoded[0], picture) and not np.array_equal(decoded[1], picture)
