"""Centre of mass, zero-moment point and divergent component of motion, seen from the foot that carries."""

from __future__ import annotations

import numpy as np

from tulip_description.robot import Foot, Robot
from tulip_msgs.msg import MotionState
from tulip_ros import topics
from tulip_view.recording import Recording
from tulip_view.report.figures import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    RED,
    Array,
    Band,
    Figure,
    LeftOut,
    Line,
    Section,
    peaks,
    thin,
)

TITLE = "CoM, ZMP and DCM in the foot"
POINTS = 1500  # of each kind in the pictures of one foot


def balance(recording: Recording, robot: Robot) -> Section:
    """Return the section.

    Raises:
        LeftOut: if no motion state is recorded.
    """
    track = recording.get(topics.MOTION_STATE)
    if track is None:
        raise LeftOut(TITLE, "motion_state is not recorded")
    support = track.gather("support")
    soles = np.stack([track.gather("left_sole"), track.gather("right_sole")], axis=1).reshape(-1, 2, 4, 4)
    carrying = _carrying(support)
    frames = soles[np.arange(len(support)), carrying]
    quantities = [
        ("CoM", "com", BLUE, False),
        ("DCM", "dcm", GREEN, False),
        ("DCM, desired", "dcm_desired", GREEN, True),
        ("ZMP, measured", "zmp", RED, False),
        ("ZMP, commanded", "zmp_desired", ORANGE, True),
    ]
    seen = [
        (name, _in_sole(track.gather(field)[:, :2], frames), colour, dashed)
        for name, field, colour, dashed in quantities
    ]
    low, high = _polygon_limits(robot.feet, soles, frames, support)
    changes = np.flatnonzero(np.diff(carrying)) + 1
    section = Section(
        "balance",
        TITLE,
        [
            "CoM: centre of mass. ZMP: zero-moment point, where the ground's forces balance. DCM: divergent component "
            "of motion, the CoM plus its speed times a time constant: where the robot tends to fall.",
            "In the sole frame of the foot that carries (in double support: that carried last): x towards the toes, "
            "y to the left. The grey band is the support polygon: one sole, or the hull of both.",
        ],
    )
    for axis, label in enumerate(("forward", "left")):
        figure = Figure(f"balance{label}", f"Towards the {('toes', 'left')[axis]}", "time [s]", f"{label} [m]")
        t, below, above = thin(track.times, low[:, axis], high[:, axis])
        figure.items.append(Band("support polygon", t, below, above, GREY))
        for name, points, colour, dashed in seen:
            values = points[:, axis].copy()
            values[changes] = np.nan  # the frame changes from one foot to the other
            figure.items.append(Line(name, *peaks(track.times, values), colour, dashed=dashed))
        figure.y_range = _limits(low[:, axis], high[:, axis])
        section.figures.append(figure)
    for side, name in enumerate(("left", "right")):
        alone = support == (MotionState.SUPPORT_LEFT, MotionState.SUPPORT_RIGHT)[side]
        if not alone.any():
            section.words.append(f"The {name} foot never carried alone.")
            continue
        figure = Figure(f"foot{name}", f"On the {name} foot alone", "to the right [m]", "towards the toes [m]")
        figure.equal, figure.time, figure.half, figure.height = True, False, True, 460
        foot = robot.feet[side]
        corners = np.array([(foot.x[i], foot.y[j]) for i, j in ((0, 0), (1, 0), (1, 1), (0, 1), (0, 0))])
        # Turned by a quarter, so that the toes point up; x to the right would be y to the right.
        figure.items.append(Line("sole", -corners[:, 1], corners[:, 0], BLACK, closed=True, width=1.5))
        for label, points, colour, dashed in seen:
            if dashed:
                continue
            x, y = thin(points[alone, 0], points[alone, 1], most=POINTS)
            figure.items.append(Line(label, -y, x, colour, points=True, width=3))
        figure.x_range, figure.y_range = (-0.24, 0.24), (-0.22, 0.28)
        section.figures.append(figure)
    return section


def _carrying(support: Array) -> Array:
    """Return (n,) 0 while the left foot carries, 1 while the right one does; the last one in double support."""
    found = np.zeros(len(support), dtype=int)
    last = 0
    for index, each in enumerate(support):
        if each == MotionState.SUPPORT_LEFT:
            last = 0
        elif each == MotionState.SUPPORT_RIGHT:
            last = 1
        found[index] = last
    return found


def _in_sole(points: Array, frames: Array) -> Array:
    """Return (n, 2) points of odom in sole frames (n, 4, 4), as seen from above."""
    offset = points - frames[:, :2, 3]
    x_axis = frames[:, :2, 0] / np.maximum(np.linalg.norm(frames[:, :2, 0], axis=1, keepdims=True), 1e-9)
    forward = np.sum(offset * x_axis, axis=1)
    left = offset[:, 1] * x_axis[:, 0] - offset[:, 0] * x_axis[:, 1]
    return np.column_stack([forward, left])


def _polygon_limits(feet: tuple[Foot, Foot], soles: Array, frames: Array, support: Array) -> tuple[Array, Array]:
    """Return (n, 2) least and greatest x and y of the support polygon in the carrying sole's frame; NaN in the air."""
    low, high = np.full((len(soles), 2), np.inf), np.full((len(soles), 2), -np.inf)
    for side, foot in enumerate(feet):
        alone_on_other = support == (MotionState.SUPPORT_RIGHT, MotionState.SUPPORT_LEFT)[side]
        for x in foot.x:
            for y in foot.y:
                corner = np.einsum("nij,j->ni", soles[:, side], np.array([x, y, 0.0, 1.0]))[:, :2]
                seen = _in_sole(corner, frames)
                low = np.where(alone_on_other[:, None], low, np.minimum(low, seen))
                high = np.where(alone_on_other[:, None], high, np.maximum(high, seen))
    air = support == MotionState.SUPPORT_NONE
    low[air], high[air] = np.nan, np.nan
    return low, high


def _limits(low: Array, high: Array) -> tuple[float, float] | None:
    valid = np.isfinite(low) & np.isfinite(high)
    if not valid.any():
        return None
    least, greatest = float(np.percentile(low[valid], 1)), float(np.percentile(high[valid], 99))
    margin = 0.25 * (greatest - least)
    return least - margin, greatest + margin
