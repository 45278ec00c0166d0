"""A whole report: reads what it needs and makes the sections."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from tulip_description.field import load_field
from tulip_description.robot import load_robot
from tulip_ros import topics
from tulip_ros.log_file import Log
from tulip_view.recording import ALL, TIMES, Advance, Recording, Wanted, message_at, read
from tulip_view.report.about import about
from tulip_view.report.balance import balance
from tulip_view.report.errors import errors
from tulip_view.report.field_paths import field_paths
from tulip_view.report.figures import LeftOut, Section
from tulip_view.report.happened import happened
from tulip_view.report.joints import joints
from tulip_view.report.replay import replay
from tulip_view.report.stills import stills
from tulip_view.report.timing import timing

WANTED: dict[str, Wanted] = {
    topics.GAME_STATE.name: ALL,
    topics.DECISION.name: ALL,
    topics.MOTION_STATE.name: ALL,
    topics.GROUND_TRUTH.name: ALL,
    topics.WORLD_STATE.name: ALL,
    topics.FEATURES.name: ALL,
    topics.CAMERA_COMPRESSED.name: TIMES,  # all pictures would fill the memory: the few that are shown are read later
    topics.CAMERA_IMAGE.name: TIMES,
    topics.CAMERA_INFO.name: ALL,
    topics.ODOMETRY.name: ALL,
    topics.JOINT_STATES.name: ALL,
    topics.LEG_COMMAND.name: TIMES,
    topics.REPORT.name: ALL,
}


@dataclass
class Report:
    """What a page, a PDF or pictures are made of.

    Attributes:
        title: Name of the recording and of the robot.
        sections: In the order of the page.
        left_out: Sections that the recording has no data for.
        remarks: On topics that are not what they should be; see `Recording`.
    """

    title: str
    sections: list[Section]
    left_out: list[LeftOut]
    remarks: list[str]


def make_report(log: Log, robot: str, advance: Advance, working: Callable[[str], None] = lambda words: None) -> Report:
    """Return the report of one robot.

    Args:
        log: The recording.
        robot: Its namespace.
        advance: For a progress bar over the messages of WANTED.
        working: Is told which section is being made.

    Raises:
        BadInputError: if the recording is damaged.
    """
    recording = read(log, robot, WANTED, advance)
    body, field = load_robot(), load_field()
    parts: list[tuple[str, Callable[[Recording], Section]]] = [
        ("what happened", happened),
        ("replay", lambda read: replay(read, body, field)),
        ("field", lambda read: field_paths(read, field)),
        ("errors", errors),
        ("pictures", lambda read: stills(read, body, lambda topic, index: message_at(log, read, topic, index))),
        ("balance", lambda read: balance(read, body)),
        ("joints", joints),
        ("time", timing),
    ]
    sections: list[Section] = []
    left_out: list[LeftOut] = []
    for name, make in parts:
        working(name)
        try:
            section = make(recording)
        except LeftOut as reason:
            left_out.append(reason)
            continue
        for figure in section.figures:  # the same time lies at the same place in all diagrams
            if figure.time and figure.x_range is None:
                figure.x_range = (recording.begin, recording.end)
        sections.append(section)
    sections.append(about(recording, left_out, sum(file.stat().st_size for file in log.files)))
    title = recording.path.resolve().stem + (f", {robot}" if robot else "")
    return Report(title, sections, left_out, recording.remarks)
