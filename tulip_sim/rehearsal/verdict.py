"""Whether a motion may go to hardware: what was seen in all plays, against limits."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tulip_description.robot import Robot
from tulip_sim.rehearsal.watch import Course

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Limits:
    """What a motion may ask of the robot.

    Attributes:
        saturated: Share of the time in which one joint gives all its torque. A kick does so for 0.4 %, as planned; a
            joint that has none to give for longer does not follow.
        speed: Of a joint, as a share of its limit: near the limit a motor has little torque left.
        edge: Distance of the centre of pressure from the edge of the support polygon, within which it is on the edge
            [m].
        on_edge: Share of the time that it may be there. A walk at its top speed is there for 2 %, and 5 s with a kick
            for 7 %, while the foot swings.
        clearance: Between the legs and other parts [m].
    """

    saturated: float = 0.01
    speed: float = 0.9
    edge: float = 0.001
    on_edge: float = 0.15
    clearance: float = 0.005


@dataclass(frozen=True)
class Figures:
    """The worst of all plays.

    Attributes:
        torques: (n,) greatest of each joint, as a share of its limit.
        saturated: (n,) greatest share of the time at the limit.
        speeds: (n,) greatest, as a share of the limit.
        margin: Least distance of the centre of pressure from an edge [m].
        low_margin: That which it was below for 5 % of the time [m].
        on_edge: Share of the time on the edge.
        tilt: Greatest of the trunk [rad].
        clearance: Least between a leg and another part [m], and which two.
        falls: How often the robot fell.
    """

    torques: Array
    saturated: Array
    speeds: Array
    margin: float
    low_margin: float
    on_edge: float
    tilt: float
    clearance: tuple[float, str]
    falls: int


def figures(courses: Sequence[Course], limits: Limits) -> Figures:
    """Return the worst of all plays.

    Args:
        courses: At least one.
        limits: Say what the edge is.
    """
    margins = [course.margins[np.isfinite(course.margins)] for course in courses]
    margins = [each for each in margins if len(each)] or [np.array([math.nan])]
    return Figures(
        torques=np.max([np.abs(course.torques).max(axis=0) for course in courses], axis=0),
        saturated=np.max([course.saturated for course in courses], axis=0),
        speeds=np.max([np.abs(course.speeds).max(axis=0) for course in courses], axis=0),
        margin=min(float(each.min()) for each in margins),
        low_margin=min(float(np.percentile(each, 5.0)) for each in margins),
        on_edge=max(float((each < limits.edge).mean()) for each in margins),
        tilt=max(float(course.tilts.max()) for course in courses),
        clearance=min(course.clearance for course in courses),
        falls=sum(bool(course.fall) for course in courses),
    )


def reasons(robot: Robot, courses: Sequence[Course], limits: Limits) -> list[str]:
    """Return why a motion must not go to hardware; nothing if it may.

    Args:
        robot: Whose joints they are.
        courses: Of all plays.
        limits: Of the motion.
    """
    found = [
        f"falls (seed {course.seed}) after {course.times[-1]:.1f} s, in {_part_at_the_end(course)}: {course.fall}"
        for course in courses
        if course.fall
    ]
    found += list(dict.fromkeys(refusal for course in courses for refusal in course.refusals))
    seen = figures(courses, limits)
    for share, most, words in (
        (seen.saturated, limits.saturated, "gives all its torque for {:.1%} of the time; expected {:.1%} at most"),
        (seen.speeds, limits.speed, "turns at {:.0%} of its greatest speed; expected {:.0%} at most"),
    ):
        for name, value in zip(robot.joint_names, share.tolist(), strict=True):
            if value > most:
                found.append(f"{name} {words.format(value, most)}")
    if seen.on_edge > limits.on_edge:
        found.append(
            f"the centre of pressure is within {1e3 * limits.edge:.0f} mm of the edge of the soles for"
            f" {seen.on_edge:.0%} of the time; expected {limits.on_edge:.0%} at most"
        )
    room, parts = seen.clearance
    if room < limits.clearance:
        words = f"meet, {-1e3 * room:.0f} mm deep" if room <= 0.0 else f"come as near as {1e3 * room:.0f} mm"
        found.append(f"{parts} {words}; expected {1e3 * limits.clearance:.0f} mm of room")
    return found


def _part_at_the_end(course: Course) -> str:
    return course.beginnings[-1][1] if course.beginnings else "the beginning"
