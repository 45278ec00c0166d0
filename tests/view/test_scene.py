"""The scene and its feeds: what they show agrees with the truth and with what the messages say."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point, Pose, PoseArray, PoseWithCovariance, Quaternion
from nav_msgs.msg import Odometry
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState

from tulip_description.keeper import keeper_parts
from tulip_description.robot import JOINTS, LEG_JOINTS, load_robot
from tulip_msgs.msg import BehaviourTree, GameState, MotionState, ObjectEstimate, UserCommand, WorldState
from tulip_ros import topics
from tulip_ros.errors import BadInputError
from tulip_ros.log_file import Log
from tulip_ros.time import header
from tulip_ros.topics import Topic
from tulip_view.body_pose import COLOURS
from tulip_view.live import words
from tulip_view.live.balance_picture import COLOURS as POINTS
from tulip_view.live.balance_picture import balance_picture
from tulip_view.live.curves import error_curves, joint_curves
from tulip_view.live.inputs import INPUTS, WINDOW, not_shown
from tulip_view.live.intake import Intake
from tulip_view.live.log_feed import LogFeed
from tulip_view.live.pace import BROWSER_SHARE, FASTEST, SLOWEST, Pace
from tulip_view.live.scene import Scene
from tulip_view.live.shapes import CORNERS, FACES
from tulip_view.live.words import SILENT

RECORDINGS = Path(__file__).parent.parent / "data" / "recordings"
MS = 1_000_000  # [ns]


@pytest.fixture
def scene() -> Scene:
    return Scene(load_robot())


@pytest.fixture
def walk() -> Iterator[tuple[Scene, LogFeed]]:
    with Log(RECORDINGS / "walk") as log:
        scene = Scene(load_robot())
        yield scene, LogFeed(log, scene)


def turn(yaw: float) -> Quaternion:
    return Quaternion(z=math.sin(yaw / 2.0), w=math.cos(yaw / 2.0))


def standing(scene: Scene, stamp: int = 1000 * MS) -> None:
    """Tell of a robot that odometry has at (1, 0) with its back to where it began, and the world model at (3, -2)."""
    pose = Pose(position=Point(x=1.0, y=0.0, z=1.1), orientation=turn(math.pi))
    world = WorldState(header=header(stamp), ball_known=True)
    world.robot_pose = np.array([3.0, -2.0, math.pi / 2.0])
    world.robot_pose_in_odom = np.array([1.0, 0.0, math.pi])
    world.robot_covariance = np.diag([0.04, 0.01, 0.001]).ravel()
    world.ball = ObjectEstimate(position_in_map=np.array([4.0, 1.0]), covariance=np.diag([0.09, 0.01, 1, 1]).ravel())
    world.opponents = [ObjectEstimate(position_in_map=np.array([-1.0, 2.0]))]
    for topic, message in (
        (topics.ODOMETRY, Odometry(header=header(stamp), pose=PoseWithCovariance(pose=pose))),
        (topics.JOINT_STATES, JointState(header=header(stamp), name=list(JOINTS), position=[0.0] * len(JOINTS))),
        (topics.WORLD_STATE, world),
    ):
        scene.take(topic.name, message, stamp * 1e-9)


def test_the_robot_stands_where_the_world_model_has_it_with_the_height_and_attitude_of_odometry(scene: Scene):
    standing(scene)
    body = scene.estimate()
    assert body is not None
    base = body.links[scene.body.names.index("base_link")]
    assert base[:3] == pytest.approx((3.0, -2.0, 1.1), abs=1e-6)
    assert body.footprint.yaw == pytest.approx(math.pi / 2.0, abs=1e-6)
    # With straight legs both soles lie below the hips; to its left is -x now.
    left, right = (body.links[scene.body.names.index(name)] for name in ("left_foot", "right_foot"))
    assert left[0] < base[0] < right[0]
    assert left[2] == pytest.approx(right[2], abs=1e-6) and left[2] < 0.2


def test_without_a_world_model_the_robot_is_drawn_where_odometry_has_it(scene: Scene):
    standing(scene)
    scene.forget(topics.WORLD_STATE)
    body = scene.estimate()
    assert body is not None and body.footprint.x == pytest.approx(1.0)
    assert scene.around().pose is None


def test_ellipses_have_the_half_axes_of_two_standard_deviations(scene: Scene):
    standing(scene)
    around = scene.around()
    assert around.robot_spread is not None and around.ball_spread is not None and around.ball is not None
    assert np.ptp(around.robot_spread, axis=0) / 2.0 == pytest.approx((0.4, 0.2), abs=0.01)
    # The ball's covariance is that in the robot's axes: what is 0.3 m ahead of the robot lies along y of the map.
    assert np.ptp(around.ball_spread, axis=0) / 2.0 == pytest.approx((0.2, 0.6), abs=0.02)
    assert around.ball.tolist() == [4.0, 1.0] and around.opponents.tolist() == [[-1.0, 2.0]]


def test_nothing_is_drawn_of_what_did_not_come(scene: Scene):
    assert scene.estimate() is None and scene.truth() is None and scene.balance() is None and scene.sight() is None
    around = scene.around()
    assert around.pose is None and around.ball is None and around.true_ball is None and not around.true_others
    assert len(scene.told(error_curves).times) == 0 == len(scene.told(lambda b: joint_curves(b, "left_knee")).times)
    assert scene.told(words.tree) == "no behaviour tree" and scene.told(words.health) == "no diagnostics"


def test_notes_name_each_topic_that_is_missing_and_any_picture_will_do():
    lines = not_shown(set(INPUTS) - {topics.BEHAVIOUR_TREE.name, topics.CAMERA_COMPRESSED.name})
    assert lines == ["Not shown: the behaviour tree (no behaviour_tree)."]
    assert len(not_shown(())) == sum(1 for entry in INPUTS.values() if entry.without)


@pytest.mark.parametrize("time", [2.0, 9.0, 12.5, 19.0])
def test_the_estimate_lies_within_five_centimetres_of_the_true_body_link_by_link(
    walk: tuple[Scene, LogFeed], time: float
):
    scene, feed = walk
    feed.seek(time)
    body, truth = scene.estimate(), scene.truth()
    assert body is not None and truth is not None
    legs = [index for index, name in enumerate(scene.body.names) if name not in ("neck", "head")]  # no neck in this one
    assert np.abs(body.links[legs, :3] - truth.links[legs, :3]).max() < 0.05
    assert body.links[:, 2].max() > 0.9  # it is upright


def test_the_ground_carries_the_robot_in_the_sole_that_is_drawn_as_carrying(walk: tuple[Scene, LogFeed]):
    scene, feed = walk
    feed.seek(10.0)
    alone = 0
    while not feed.ended:
        feed.advance(0.05)
        balance = scene.balance()
        assert balance is not None
        if balance.carries in ((True, False), (False, True)) and np.isfinite(balance.zmp).all():
            alone += 1
            x, y = balance.carrying.inverse().transform(balance.zmp)
            foot = scene.robot.feet[balance.carries.index(True)]
            assert foot.x[0] - 0.01 <= x <= foot.x[1] + 0.01 and foot.y[0] - 0.01 <= y <= foot.y[1] + 0.01
        assert np.abs(balance.soles[:, :, 2].min()) < 0.02  # one sole is on the ground
    assert alone > 50


def test_the_picture_of_the_balance_has_each_point_on_its_side_of_the_feet(walk: tuple[Scene, LogFeed]):
    scene, feed = walk
    feed.seek(12.5)
    balance = scene.balance()
    assert balance is not None and balance.words == "walk, left"
    picture = balance_picture(balance)
    height, width = picture.shape[:2]
    rows, columns = np.nonzero((picture == POINTS["CoM"]).all(axis=2))
    drawn = columns[rows > height // 3]  # below the legend
    assert drawn.min() > width / 2  # the left foot carries in the middle: the CoM is to the right of it


def test_seeking_shows_the_same_as_running_there(walk: tuple[Scene, LogFeed]):
    scene, feed = walk
    for _ in range(300):
        feed.advance(0.05)
    assert feed.position == pytest.approx(15.0)
    body, curves, said = scene.estimate(), scene.told(lambda b: joint_curves(b, "right_knee")), scene.told(words.game)
    feed.seek(3.0)
    feed.seek(15.0)
    again, anew = scene.estimate(), scene.told(lambda b: joint_curves(b, "right_knee"))
    assert body is not None and again is not None
    assert np.abs(body.links - again.links).max() < 0.001  # which of two world states 20 ms apart is taken may differ
    assert said == scene.told(words.game)
    assert anew.times[-1] == curves.times[-1] and anew.times[-1] - anew.times[0] == pytest.approx(WINDOW, abs=0.1)
    common = np.isin(curves.times, anew.times)
    assert common.sum() > 400
    assert np.array_equal(curves.feedforward[common], anew.feedforward[np.isin(anew.times, curves.times)])


def test_a_latched_message_of_long_ago_still_holds_after_seeking(walk: tuple[Scene, LogFeed]):
    scene, feed = walk
    feed.seek(feed.duration)  # the user's command was recorded once, at the beginning
    assert "play dribble_and_kick" in scene.told(words.game)


def test_a_position_outside_the_recording_is_brought_into_it(walk: tuple[Scene, LogFeed]):
    _, feed = walk
    feed.seek(-5.0)
    assert feed.position == 0.0
    feed.seek(1e6)
    assert feed.position == feed.duration and feed.ended


def test_curves_hold_what_motion_control_said(walk: tuple[Scene, LogFeed]):
    scene, feed = walk
    feed.seek(12.0)
    with Log(RECORDINGS / "walk") as log:
        messages = [log.decode(record) for record in log.records(["/motion_state"])]
    curves = scene.told(lambda buffers: joint_curves(buffers, "left_ankle_pitch"))
    last = next(
        m for m in messages if m.header.stamp.sec + m.header.stamp.nanosec * 1e-9 == pytest.approx(curves.times[-1])
    )
    index = LEG_JOINTS.index("left_ankle_pitch")
    assert curves.desired[-1] == last.joint_positions_desired[index]
    assert curves.feedback[-1] == last.torque_feedback[index] and curves.learned[-1] == last.torque_learned[index]
    assert np.isnan(curves.sensed).all()  # no joint_states in this one


def test_the_localization_error_is_that_between_estimate_and_truth(walk: tuple[Scene, LogFeed]):
    scene, feed = walk
    feed.seek(12.0)
    errors = scene.told(error_curves)
    pose, truth = scene.around().pose, scene.truth()
    assert pose is not None and truth is not None
    off = math.hypot(pose.x - truth.footprint.x, pose.y - truth.footprint.y)
    assert errors.distance[-1] == pytest.approx(off, abs=0.015)  # the newest truth is up to 60 ms older
    assert errors.distance.max() < 0.1 and (errors.claimed > 0.0).all()


def test_features_are_drawn_into_the_picture_of_their_stamp():
    with Log(RECORDINGS / "pictures") as log:
        scene = Scene(load_robot())
        feed = LogFeed(log, scene)
        feed.seek(7.5)
        with_features = scene.sight()
        scene.forget(topics.FEATURES)
        without = scene.sight()
    assert with_features is not None and without is not None
    assert "ball" in with_features.words and without.words == "no features of this picture"
    assert with_features.picture.shape == (480, 640, 3)
    assert 7.0 < with_features.stamp <= 7.5
    colourful = np.ptp(with_features.picture.astype(int), axis=2).max()
    assert colourful > 200 and (with_features.picture != without.picture).any()


def test_each_robot_of_a_match_can_be_chosen():
    with Log(RECORDINGS / "match") as log:
        scene = Scene(load_robot())
        feed = LogFeed(log, scene)
        assert feed.robots == ("striker", "keeper") and feed.robot == "striker"
        feed.seek(6.0)
        striker = scene.around().pose
        feed.choose("keeper")
        keeper = scene.around().pose
        assert feed.position == 6.0 and striker is not None and keeper is not None
        assert math.hypot(striker.x - keeper.x, striker.y - keeper.y) > 0.5
        assert any("no motion_state" in line for line in feed.remarks())
        with pytest.raises(BadInputError, match="no robot 'referee'"):
            LogFeed(log, scene, "referee")


def take(intake: Intake, topic: Topic, milliseconds: int, decoded: list[int]) -> None:
    message = topic.message(header=header(milliseconds * MS))

    def decode() -> Any:
        decoded.append(milliseconds)
        return message

    intake.take(topic.name, serialize_message(message), milliseconds * 1e-3, decode)


def test_only_as_many_messages_are_decoded_as_are_drawn(scene: Scene):
    decoded: list[int] = []
    intake = Intake(scene)
    for milliseconds in range(4, 1000, 4):
        take(intake, topics.JOINT_STATES, milliseconds, decoded)
    assert len(decoded) == pytest.approx(50, abs=2)


def test_time_that_begins_anew_forgets_what_was_before_and_drops_what_comes_late(scene: Scene):
    decoded: list[int] = []
    intake = Intake(scene)
    take(intake, topics.ODOMETRY, 60_000, decoded)
    take(intake, topics.MOTION_STATE, 60_000, decoded)
    take(intake, topics.ODOMETRY, 20, decoded)
    assert scene.stamp == pytest.approx(0.02)
    take(intake, topics.MOTION_STATE, 60_020, decoded)
    take(intake, topics.DECISION, 60_020, decoded)  # tells no time: it may have waited since before
    assert scene.stamp == pytest.approx(0.02) and scene.balance() is None


def test_a_node_that_says_nothing_is_silent_and_its_words_are_no_markup(scene: Scene):
    def status(name: str, level: bytes, message: str) -> DiagnosticArray:
        values = [KeyValue(key="rate imu [1/s]", value="249.6"), KeyValue(key="processor [%]", value="12")]
        return DiagnosticArray(status=[DiagnosticStatus(name=name, level=level, message=message, values=values)])

    scene.take(topics.DIAGNOSTICS.name, status("old", DiagnosticStatus.OK, "running"), 10.0)
    scene.take(topics.DIAGNOSTICS.name, status("bad", DiagnosticStatus.WARN, "<b>x</b>"), 10.0 + SILENT + 0.1)
    told = scene.told(words.health)
    assert "silent" in told and "warning" in told
    assert "<b>x</b>" not in told and "&lt;b&gt;x" in told


def test_of_a_nodes_inputs_the_fastest_rate_and_the_slowest_latency_are_shown(scene: Scene):
    figures = {
        "rate imu [1/s]": "249.6",
        "rate camera/image_raw [1/s]": "15.0",
        "latency imu [ms]": "0.4",
        "latency camera/image_raw [ms]": "21.3",
        "rate <i> [1/s]": "soon",
        "processor [%]": "12.5",
        "restarts": "3",
    }
    values = [KeyValue(key=key, value=value) for key, value in figures.items()]
    status = DiagnosticStatus(name="vision", level=DiagnosticStatus.OK, message="running", values=values)
    scene.take(topics.DIAGNOSTICS.name, DiagnosticArray(status=[status]), 10.0)
    told = scene.told(words.health)
    cells = re.findall(r"<td[^>]*>(?:<[^>]*>)*([^<]*)", told)
    assert cells == ["vision", "ok", "250", "21.3", "12.5", "3"]
    assert 'title="imu"' in told and 'title="camera/image_raw"' in told and "<i>" not in told


def test_game_and_user_are_told(scene: Scene):
    game = GameState(phase=GameState.PLAYING, own_score=2, opponent_score=1, seconds_remaining=77, stale=True)
    scene.take(topics.GAME_STATE.name, game, 1.0)
    scene.take(topics.USER_COMMAND.name, UserCommand(request=UserCommand.WALK_TEST), 1.0)
    told = scene.told(words.game)
    assert "playing" in told and "2 : 1" in told and "77 s" in told and "stale" in told and "walk test" in told


def test_of_the_tree_only_what_was_asked_is_told(scene: Scene):
    tree = BehaviourTree(
        names=["root", "seen <ball>", "deep"],
        parents=[-1, 0, 1],
        kinds=[BehaviourTree.SELECTOR, BehaviourTree.SEQUENCE, BehaviourTree.LEAF],
        statuses=[BehaviourTree.RUNNING, BehaviourTree.RUNNING, BehaviourTree.IDLE],
    )
    scene.take(topics.BEHAVIOUR_TREE.name, tree, 1.0)
    told = scene.told(words.tree)
    assert "root" in told and "seen &lt;ball&gt;" in told and "deep" not in told


def test_the_pace_follows_a_slow_browser_down_and_up_again():
    pace = Pace()
    assert pace.period == pytest.approx(1.0 / FASTEST)
    for _ in range(20):
        pace.answered(math.inf)
    assert pace.period == pytest.approx(1.0 / SLOWEST)
    for _ in range(20):
        pace.answered(0.02)
    assert pace.period == pytest.approx(1.0 / FASTEST)
    pace.answered(0.1)
    pace.answered(0.02)  # this question came between two pictures
    assert 0.1 / pace.period == pytest.approx(BROWSER_SHARE)
    for _ in range(20):
        pace.answered(0.02)
    for _ in range(100):
        pace.worked(0.05)
    assert pace.period == pytest.approx(0.2, rel=0.01)  # a quarter of the time at most


def test_faces_of_the_box_look_outwards():
    a, b, c = CORNERS[FACES].transpose(1, 0, 2)
    assert (np.einsum("ij,ij->i", np.cross(b - a, c - a), a + b + c) > 0.0).all()


def test_every_box_has_a_colour():
    named = {box.colour for _, box in Scene(load_robot()).body.boxes} | {
        part.colour for part in keeper_parts("magenta")
    }
    assert named <= set(COLOURS)


def test_planned_footsteps_lie_in_the_map_with_the_size_of_a_sole(scene: Scene):
    standing(scene)  # where x of odom is -y of the map: the world model turns it by -90 degrees
    scene.take(topics.FOOTSTEPS.name, PoseArray(header=header(MS), poses=[Pose(position=Point(x=2.0, y=0.0))]), 1.0)
    (corners,) = scene.footsteps()
    foot = scene.robot.feet[0]
    assert (foot.x, foot.y) == (scene.robot.feet[1].x, scene.robot.feet[1].y)  # one shape for both feet
    middle = corners.mean(axis=0)
    ahead = (foot.x[0] + foot.x[1]) / 2.0
    assert middle == pytest.approx((3.0, -2.0 - (1.0 + ahead), 0.0), abs=1e-9)
    assert np.ptp(corners, axis=0) == pytest.approx((foot.y[1] - foot.y[0], foot.x[1] - foot.x[0], 0.0), abs=1e-9)


def test_support_words_follow_the_message(scene: Scene):
    standing(scene)
    state = MotionState(header=header(MS), mode=MotionState.KICK, support=MotionState.SUPPORT_RIGHT)
    state.left_sole = state.right_sole = np.eye(4).ravel()
    scene.take(topics.MOTION_STATE.name, state, 1.0)
    balance = scene.balance()
    assert balance is not None and balance.words == "kick, right" and balance.carries == (False, True)
