"""The report: its sections, what they say, and that it needs nothing but itself."""

from __future__ import annotations

import base64
import json
import math
import re
from pathlib import Path

import cv2
import numpy as np
import pytest
import report as report_script
import typer
from rclpy.serialization import serialize_message
from recordings_to_view import play, write
from typer.testing import CliRunner, Result

from tulip_description.camera_pose import camera_in_footprint
from tulip_description.robot import load_robot
from tulip_ros import topics
from tulip_ros.bag import Bag
from tulip_ros.log_file import Log
from tulip_ros.time import from_message
from tulip_view.ellipse import ellipse
from tulip_view.recording import Recording, message_at, read
from tulip_view.report.build import WANTED, Report, make_report
from tulip_view.report.figures import Band, Figure, ink_on
from tulip_view.report.happened import _without_echoes, doing
from tulip_view.report.page import draw, fitting, make_page, packed
from tulip_view.report.paper import write_pdf
from tulip_view.report.stills import _head
from tulip_view.report.timing import gaps
from tulip_vision.messages import picture_to_message

pytestmark = pytest.mark.sim

SECONDS = 1.3
SECTIONS = {"happened", "replay", "fieldpaths", "errors", "stills", "balance", "joints", "timing", "about"}

app = typer.Typer()
app.command()(report_script.main)


@pytest.fixture(scope="module")
def trial(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return play(tmp_path_factory.mktemp("report") / "trial", SECONDS)


@pytest.fixture(scope="module")
def recording(trial: Path) -> Recording:
    with Log(trial) as log:
        return read(log, "", WANTED)


@pytest.fixture(scope="module")
def report(trial: Path) -> Report:
    with Log(trial) as log:
        return make_report(log, "", lambda number: None)


@pytest.fixture(scope="module")
def page(report: Report) -> str:
    return make_page(report)


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def test_a_trial_has_all_sections_and_the_page_shows_them(report: Report, page: str):
    assert {section.key for section in report.sections} == SECTIONS and not report.left_out
    for section in report.sections:
        assert f'<section id="{section.key}">' in page
        for figure in section.figures:
            assert f'id="figure-{figure.key}"' in page


def test_the_page_needs_no_network(page: str):
    head, library, rest = page.partition("/**\n* plotly.js")[0], "", page[page.rindex('id="content"') :]
    assert not library
    for part in (head, rest):
        assert not re.search(r"""(src|href)\s*=\s*["'](?!#|data:)""", part)
        assert not re.search(r"@import|url\(|fetch\(|XMLHttpRequest|https?://", part)
    assert not re.search(r"<(link|iframe|base)\b", head + rest)
    assert "Plotly" in page


def test_data_in_the_page_is_what_was_recorded(page: str, recording: Recording):
    content = json.loads(re.search(r'type="application/json">(.*?)</script>', page, re.DOTALL).group(1))  # type: ignore[union-attr]
    traces = content["figures"]["jointangle"]["traces"]
    knee = next(each for each in traces if each["meta"] == "left knee" and each["name"] == "measured")
    found = np.frombuffer(base64.b64decode(knee["y"]["bdata"]), dtype="<f4")
    track = recording.get(topics.MOTION_STATE)
    assert track is not None
    assert found == pytest.approx(np.degrees([m.joint_positions[3] for m in track.messages]), abs=1e-4)
    assert np.frombuffer(base64.b64decode(knee["x"]["bdata"]), dtype="<f4") == pytest.approx(track.times, abs=1e-6)


def test_stills_have_the_detections_of_their_stamp_drawn_in(report: Report, recording: Recording, trial: Path):
    stills = next(section for section in report.sections if section.key == "stills").stills
    pictures, features = recording.get(topics.CAMERA_COMPRESSED), recording.get(topics.FEATURES)
    assert pictures is not None and features is not None and len(stills) >= 5
    for still in stills:
        index = int(np.argmin(np.abs(pictures.times - still.time)))
        with Log(trial) as log:
            message = message_at(log, recording, topics.CAMERA_COMPRESSED, index)
        raw = cv2.imdecode(np.frombuffer(bytes(message.data), np.uint8), cv2.IMREAD_COLOR)
        drawn = cv2.imdecode(np.frombuffer(still.jpeg, np.uint8), cv2.IMREAD_COLOR)
        assert raw is not None and drawn is not None
        found = features.messages[int(np.argmin(np.abs(features.times - still.time)))].features
        changed = np.abs(raw.astype(int) - drawn).max(axis=2) > 90  # more than compressing it once more does
        assert "not drawn" not in still.caption
        assert (changed.sum() > 60) == bool(found), still.caption


def test_the_camera_that_features_are_drawn_by_is_where_vision_had_it(recording: Recording):
    features, robot = recording.get(topics.FEATURES), load_robot()
    assert features is not None
    for time, message in list(zip(features.times, features.messages, strict=True))[3:]:
        pose = _head(recording, float(time))
        assert pose is not None
        camera = camera_in_footprint(robot, *pose)
        assert camera[:3, 3] == pytest.approx(message.camera_position, abs=0.01)


def test_the_replayed_robot_stands_on_its_soles_where_the_truth_says(report: Report, recording: Recording):
    replay = next(section.replay for section in report.sections if section.key == "replay")
    truth, robot = recording.get(topics.GROUND_TRUTH), load_robot()
    assert replay is not None and truth is not None
    names = [link.name for link in robot.links if link.boxes]
    for frame, time in list(enumerate(replay["times"]))[2:]:
        near = truth.messages[int(np.argmin(np.abs(truth.times - time)))]
        base = replay["links"][frame, names.index("base_link")] if "base_link" in names else None
        if base is not None:
            assert base[:2] == pytest.approx([near.robot.position.x, near.robot.position.y], abs=0.01)
        for sole in robot.soles:
            place = replay["links"][frame, names.index(sole.link)]
            assert place[2] + sole.origin[2] == pytest.approx(0.0, abs=0.01)  # it stands nearly upright


def test_sections_without_topics_are_left_out_with_the_reason(tmp_path: Path):
    path = write(tmp_path / "few")
    result = run(path, "--to", tmp_path / "few.html")
    assert result.exit_code == 0, result.stderr
    page = (tmp_path / "few.html").read_text()
    for words in (
        "left out: CoM, ZMP and DCM in the foot (motion_state is not recorded)",
        "left out: What the camera saw",
    ):
        assert words in result.stdout
    assert "Left out: Joints (motion_state is not recorded)." in page
    assert '<section id="joints">' not in page and '<section id="errors">' in page


def test_the_reports_kick_and_errors_are_those_of_the_messages(tmp_path: Path):
    with Log(write(tmp_path / "known")) as log:
        found = {section.key: section for section in make_report(log, "", lambda number: None).sections}
    kicks = [row for row in found["happened"].rows if row[2].startswith("kick asked for")]
    assert [row[:2] for row in kicks] == [("0.70", "strategy")]
    assert any(row[2].startswith("playing, 0:0, 99 s left") for row in found["happened"].rows)
    x = next(row for row in found["errors"].rows if row[0].startswith("Robot's x"))
    assert x[1] == "0.000 m" and x[4] == "100 %"  # the estimate is the truth there


def test_pdf_and_pictures_are_written_and_nothing_is_overwritten(tmp_path: Path):
    path = write(tmp_path / "few", end=1500)
    page = tmp_path / "r.html"
    assert run(path, "--to", page, "--pdf", "--png", tmp_path / "png").exit_code == 0
    assert (tmp_path / "r.pdf").read_bytes()[:5] == b"%PDF-"
    pictures = sorted((tmp_path / "png").glob("*.png"))
    assert any("timeline" in each.name for each in pictures)
    assert all(cv2.imread(str(each)) is not None for each in pictures)
    before = page.stat().st_mtime_ns
    for target, options in ((page, ()), (tmp_path / "new.html", ("--png", tmp_path / "png"))):
        result = run(path, "--to", target, *options)
        assert result.exit_code == 2 and "--force" in result.stderr
    assert page.stat().st_mtime_ns == before and not (tmp_path / "new.html").exists()
    assert run(path, "--to", page, "--force").exit_code == 0 and page.stat().st_mtime_ns > before


def test_bad_input_is_told(tmp_path: Path):
    (tmp_path / "text.mcap").write_bytes(b"no recording at all")
    for name, said in (("text.mcap", "is no MCAP file"), ("missing", "There is no recording")):
        result = run(tmp_path / name, "--to", tmp_path / "r.html")
        assert result.exit_code == 2 and said in result.stderr
    assert not (tmp_path / "r.html").exists()


def test_a_whole_trial_fits_on_paper(report: Report, tmp_path: Path):
    write_pdf(report, tmp_path / "r.pdf")
    assert (tmp_path / "r.pdf").read_bytes().count(b"/Type /Page ") >= len(SECTIONS)


def test_gaps_count_what_is_missing():
    times = np.delete(np.arange(100) * 0.02, [50, 51, 70])
    assert gaps(times) == ("97", "20.0 ms", "2", "3 (3.0 %)", "60 ms")


def test_an_ellipse_holds_its_share_of_samples():
    covariance = np.array([[0.04, 0.03], [0.03, 0.09]])
    points = ellipse(np.array([1.0, 2.0]), covariance)
    assert points is not None
    offset = points - (1.0, 2.0)
    distance = np.einsum("ni,ij,nj->n", offset, np.linalg.inv(covariance), offset)
    assert distance == pytest.approx(4.0)  # 2 sigma
    assert ellipse(np.zeros(2), np.eye(2) * 1e6) is None


def test_words_that_come_again_and_again_are_told_once():
    said = [(0.1 * number, "too early") for number in range(10)] + [(0.35, "goal"), (5.0, "too early")]
    assert _without_echoes(sorted(said)) == [(0.0, "too early, 10 times"), (0.35, "goal"), (5.0, "too early")]


def test_a_band_with_a_gap_is_drawn_in_two_pieces():
    low, x = np.array([0.0, 0.1, math.nan, 0.3, 0.4]), np.arange(5.0)
    (trace,) = draw(Figure("f", "f", "x", "y", [Band("spread", x, low, low + 1.0, "#0072b2")]))["traces"]
    found = np.frombuffer(base64.b64decode(trace["x"]["bdata"]), dtype="<f4")
    assert found == pytest.approx([0, 1, 1, 0, math.nan, 3, 4, 4, 3, math.nan], nan_ok=True)


def test_the_replay_begins_and_ends_with_the_robot_in_the_picture(report: Report):
    links = next(section.replay for section in report.sections if section.key == "replay")["links"]  # type: ignore[index]
    assert np.isfinite(links[[0, -1]]).all()


def test_pictures_that_were_not_compressed_are_shown_too(trial: Path, tmp_path: Path):
    bag = Bag(tmp_path / "raw")
    with Log(trial) as log:
        for record in log.records():
            if record.topic.name != "/camera/image_raw/compressed":
                bag.copy_topic(record.topic)
                bag.write(record.topic.name, record.data, record.log_time)
                continue
            message = log.decode(record)
            picture = cv2.imdecode(np.frombuffer(bytes(message.data), np.uint8), cv2.IMREAD_COLOR)
            raw = picture_to_message(np.asarray(picture, dtype=np.uint8), from_message(message.header.stamp))
            bag.add_topic("/camera/image_raw", topics.CAMERA_IMAGE.type_name, topics.CAMERA_IMAGE.quality)
            bag.write("/camera/image_raw", serialize_message(raw), record.log_time)
    bag.close()
    with Log(tmp_path / "raw") as log:
        found = {section.key: section for section in make_report(log, "", lambda number: None).sections}
    assert len(found["stills"].stills) >= 5 and all("not drawn" not in each.caption for each in found["stills"].stills)


def test_ink_can_be_read_on_every_colour():
    assert (ink_on("#0072b2"), ink_on("#e69f00"), ink_on("#56b4e9")) == ("#ffffff", "#1a222b", "#1a222b")


def test_small_things():
    assert doing("robot > attack > kick at goal > until it succeeds") == "kick at goal"
    assert fitting("sweep the head", 0.5) == "sweep the head" and fitting("sweep the head", 0.01) == ""
    assert fitting("sweep the head", 0.05).endswith("…")
    values = np.frombuffer(base64.b64decode(packed([1.5, math.nan])["bdata"]), dtype="<f4")
    assert values[0] == 1.5 and math.isnan(values[1])
