"""What was recorded: span, robot, what the recorder noted, and what could not be told."""

from __future__ import annotations

from datetime import UTC, datetime

from tulip_view.recording import Recording
from tulip_view.report.figures import LeftOut, Section

TITLE = "About this recording"


def about(recording: Recording, left_out: list[LeftOut], size: int) -> Section:
    """Return the section.

    Args:
        recording: What was read.
        left_out: Sections that could not be made.
        size: Of the recording's files [B].
    """
    section = Section("about", TITLE, header=("what", "value"))
    section.rows = [
        ("recording", str(recording.path)),
        ("size", f"{size / 2**20:.1f} MiB"),
        ("robot", recording.robot or "one, without a namespace"),
        ("robots in it", ", ".join(robot or "one" for robot in recording.robots)),
        ("time told here", f"{recording.begin:.2f} s to {recording.end:.2f} s"),
        ("0 s is", _origin(recording.origin)),
    ]
    if recording.runs > 1:
        section.rows.append(("time began anew", f"{recording.runs - 1} times; the longest part is told"))
    for note, values in recording.metadata.items():
        section.rows += [(f"{note}: {key}", value) for key, value in values.items()]
    if not recording.metadata:
        section.words.append("The recorder noted nothing about itself (versions, seed, parameters).")
    section.words += recording.remarks
    section.words += [f"Left out: {each.title} ({each.why})." for each in left_out]
    return section


def _origin(stamp: int) -> str:
    if stamp == 0:
        return "stamp 0, the begin of the simulation"
    return datetime.fromtimestamp(stamp * 1e-9, UTC).strftime("%Y-%m-%d %H:%M:%S UTC")
