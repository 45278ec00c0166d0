"""Joint tracking and torque parts, one joint at a time."""

from __future__ import annotations

import numpy as np

from tulip_description.robot import LEG_JOINTS
from tulip_ros import topics
from tulip_view.columns import LINEAR
from tulip_view.recording import Recording
from tulip_view.report.figures import BLACK, BLUE, GREEN, ORANGE, RED, Array, Figure, LeftOut, Line, Section, peaks
from tulip_view.tables import align

TITLE = "Joints"
MOST = 3000  # points of each line: there are twelve joints


def joints(recording: Recording) -> Section:
    """Return the section.

    Raises:
        LeftOut: if no motion state is recorded.
    """
    track = recording.get(topics.MOTION_STATE)
    if track is None:
        raise LeftOut(TITLE, "motion_state is not recorded")
    measured, desired = track.gather("joint_positions"), track.gather("joint_positions_desired")
    parts = [track.gather(f"torque_{name}") for name in ("feedback", "feedforward", "learned")]
    sensed = _measured_torques(recording, track.times)
    readable = tuple(name.replace("_", " ") for name in LEG_JOINTS)
    angle = Figure("jointangle", "Angle: desired and measured", "time [s]", "angle [deg]", choices=readable)
    error = Figure("jointerror", "Angle: desired - measured", "time [s]", "error [deg]", choices=readable, height=200)
    torque = Figure("jointtorque", "Torque and its parts", "time [s]", "torque [N m]", choices=readable)
    section = Section("joints", TITLE, figures=[angle, error, torque])
    if not parts[2].any():
        section.words.append(
            "The learned part of the torques is 0 throughout: learning was off, or had learned nothing."
        )
    section.header = ("joint", "RMS tracking error", "greatest", "RMS torque (sum of parts)", "of it feedback")
    for index, name in enumerate(readable):
        off = np.degrees(desired[:, index] - measured[:, index])
        angle.items += [
            # The desired one is broad: good tracking would hide it.
            Line("desired", *peaks(track.times, np.degrees(desired[:, index]), MOST), ORANGE, width=4.0, choice=name),
            Line("measured", *peaks(track.times, np.degrees(measured[:, index]), MOST), BLUE, choice=name),
        ]
        error.items.append(Line("desired - measured", *peaks(track.times, off, MOST), RED, choice=name))
        for label, values, colour in zip(
            ("feedback", "feedforward", "learned"), parts, (BLUE, ORANGE, GREEN), strict=True
        ):
            torque.items.append(Line(label, *peaks(track.times, values[:, index], MOST), colour, choice=name))
        if sensed is not None:
            t, values = peaks(track.times, sensed[:, index], MOST)
            torque.items.append(Line("measured", t, values, BLACK, dashed=True, width=1.0, choice=name))
        total = sum(part[:, index] for part in parts)
        feedback = parts[0][:, index]
        moving = np.isfinite(off)
        section.rows.append(
            (
                name,
                f"{np.sqrt(np.mean(off[moving] ** 2)):.2f} deg",
                f"{np.abs(off[moving]).max():.2f} deg",
                f"{np.sqrt(np.mean(np.square(total))):.1f} N m",
                f"{np.sqrt(np.mean(feedback**2)):.1f} N m",
            )
        )
    return section


def _measured_torques(recording: Recording, times: Array) -> Array | None:
    track = recording.get(topics.JOINT_STATES)
    if track is None or not track.messages or len(track.messages[0].effort) == 0:
        return None
    names = list(track.messages[0].name)
    if not set(LEG_JOINTS) <= set(names):
        return None
    rows = np.array([message.effort for message in track.messages])
    return np.column_stack([align(track, rows[:, names.index(name)], LINEAR, times) for name in LEG_JOINTS])
