"""Plays a rehearsal and tells what came out; for all commands that send a motion to a robot."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

from _progress import progress
from rich.console import Console
from rich.table import Table

from tulip_description.robot import LEG_JOINTS, Robot, load_robot
from tulip_motion.parameters import MotionParameters
from tulip_ros import parameters
from tulip_ros.errors import BadInputError
from tulip_ros.nodes import DRIVER
from tulip_ros.parameters import ROS_NAMES
from tulip_ros.plan import Start
from tulip_sim.rehearsal.motions import everything
from tulip_sim.rehearsal.picture import draw
from tulip_sim.rehearsal.play import play
from tulip_sim.rehearsal.present import standing
from tulip_sim.rehearsal.run import SEEDS, Play, rehearse
from tulip_sim.rehearsal.verdict import Figures, Limits, figures, reasons

EVERYTHING = "some of everything that the walk may do"
REFUSED = 1
"""Exit code of a command whose motion is beyond the limits."""


def motion_parameters(starts: Sequence[Start]) -> MotionParameters:
    """Return the parameters that node motion of a plan starts with.

    Raises:
        BadInputError: if the plan has no such node, or its parameters cannot be used.
    """
    given: Mapping[str, object] | None = next((start.parameters for start in starts if start.name == "motion"), None)
    if given is None:
        raise BadInputError("A rehearsal is for node motion, which is not among the nodes to start.")
    own = {name: value for name, value in given.items() if name not in ROS_NAMES}
    return parameters.replace(MotionParameters(), own, "motion")


def may_launch(starts: Sequence[Start], anyway: bool) -> bool:
    """Rehearse the walk with the parameters of a plan, and return whether its nodes may be started.

    Args:
        starts: Nodes of the plan.
        anyway: They may be started whatever comes out.

    Raises:
        BadInputError: if the plan has no motion control, or its parameters cannot be used.
    """
    p = motion_parameters(starts)
    rate = next((start.parameters.get("rate", 1.0) for start in starts if start.name == DRIVER), 1.0)
    if isinstance(rate, bool) or not isinstance(rate, int | float) or not 0.0 < rate <= 1.0:
        raise BadInputError(f"Parameter driver.rate is {rate!r}; expected a number above 0 and at most 1.")
    walk = partial(play, everything(p), p, standing(load_robot()), rate=rate)
    return may_go(walk, EVERYTHING, anyway)


def may_go(one_play: Play, what: str, anyway: bool) -> bool:
    """Rehearse a motion that is about to be sent to a robot, tell it on the error output, and return whether it may.

    Args:
        one_play: Plays it once.
        what: Is rehearsed, in words.
        anyway: It may, whatever comes out.

    Raises:
        BadInputError: as `passes`.
    """
    console = Console(stderr=True)
    if passes(one_play, console, what):
        return True
    words = "It is sent all the same, as told by --anyway." if anyway else "It is not sent; --anyway sends it."
    console.print(words, highlight=False)
    return anyway


def passes(one_play: Play, console: Console, what: str, seeds: int = SEEDS, picture: Path | None = None) -> bool:
    """Rehearse a motion, tell what it asks of the robot, and return whether it may go to hardware.

    Args:
        one_play: Plays it once.
        console: Where it is told.
        what: Is rehearsed, in words.
        seeds: How often it is played.
        picture: File for a picture, or None.

    Raises:
        BadInputError: if it cannot be played.
    """
    robot, limits = load_robot(), Limits()
    try:
        with progress() as bar:
            task = bar.add_task("rehearsing", total=seeds)
            courses = rehearse(one_play, range(1, seeds + 1), lambda: bar.advance(task))
    except ValueError as error:
        raise BadInputError(f"Rehearsal: {error}.") from error
    seen, found = figures(courses, limits), reasons(robot, courses, limits)
    console.print(f"rehearsed         {what}: {courses[0].times[-1]:.0f} s, {seeds} times", highlight=False)
    console.print(_table(robot, seen))
    for name, words in _lines(seen, len(courses)):
        console.print(f"{name:<18}{words}", highlight=False, soft_wrap=True)
    for note in {note.partition(":")[0]: note for course in courses for note in course.notes}.values():
        console.print(f"{'note':<18}{note}", highlight=False, soft_wrap=True, markup=False)
    if picture is not None:
        try:
            draw(courses, limits, picture)
        except (OSError, ValueError) as error:
            raise BadInputError(f"--picture {picture} cannot be written: {error}. Name another file.") from error
        console.print(f"{'picture':<18}{picture}", highlight=False, soft_wrap=True)
    for reason in found:
        console.print(f"[bold red]beyond the limits[/] {reason}", highlight=False, soft_wrap=True)
    if not found:
        console.print("[bold green]within the limits[/]", highlight=False)
    return not found


def _table(robot: Robot, seen: Figures) -> Table:
    table = Table("joint", "torque", "of limit", "at limit", "speed", "of limit", box=None, pad_edge=False)
    for index, name in enumerate(LEG_JOINTS):
        effort, speed = robot.effort_limits[index], robot.velocity_limits[index]
        torque, share = float(seen.torques[index]), float(seen.speeds[index])
        table.add_row(
            name,
            f"{torque * effort:.1f} N m",
            f"{torque:.0%}",
            f"{seen.saturated[index]:.1%} of time",
            f"{share * speed:.1f} rad/s",
            f"{share:.0%}",
        )
    return table


def _lines(seen: Figures, plays: int) -> list[tuple[str, str]]:
    clearance, parts = seen.clearance
    return [
        ("falls", f"{seen.falls} of {plays}"),
        (
            "ZMP margin",
            f"{1e3 * max(seen.margin, 0.0):.0f} mm to the edge at least, below {1e3 * max(seen.low_margin, 0.0):.0f} mm"
            f" for 5 % of the time, on the edge for {seen.on_edge:.1%}",
        ),
        ("trunk", f"tilted by {math.degrees(seen.tilt):.1f} deg at most"),
        ("room", f"{1e3 * clearance:.0f} mm between {parts}"),
    ]
