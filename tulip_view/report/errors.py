"""Estimates against truth over time, with the spread that the estimates claim."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tulip_msgs.msg import GameState
from tulip_ros import topics
from tulip_view.columns import Alignment, attitude
from tulip_view.recording import Recording, Track
from tulip_view.report.figures import BLUE, RED, SKY, Array, Band, Figure, LeftOut, Line, Section, peaks, thin
from tulip_view.tables import align

Mask = NDArray[np.bool_]

TITLE = "Errors of the estimates"
SIGMAS = 2.0
WIDEST = 4.0  # of the greatest error: a band wider than that is cut by the axis at first, so that errors can be seen


def errors(recording: Recording) -> Section:
    """Return the section.

    Raises:
        LeftOut: if the recording holds no truth, or no world state.
    """
    truth, world = recording.get(topics.GROUND_TRUTH), recording.get(topics.WORLD_STATE)
    if truth is None or world is None:
        raise LeftOut(TITLE, f"{'ground_truth' if truth is None else 'world_state'} is not recorded")
    real = _truth_at(truth, world.times)
    play = _in_play(recording, world.times)
    section = Section("errors", TITLE, [f"Bands: {SIGMAS:g} sigma of the estimates' own covariances."])
    if play.all():
        section.words.append("All of the recording counts as play: it was, or the recording does not tell.")
    else:
        section.words.append(
            "At first the diagrams show as much as is needed for the errors in play; a double click shows all."
        )
    within = f"within {SIGMAS:g} sigma (95 % expected)"
    section.header = ("estimate", "RMS error in play", "median", "greatest", within, "RMS error at all times")
    pose = world.gather("robot_pose")
    spread = np.sqrt(np.maximum(world.gather("robot_covariance").reshape(-1, 3, 3).diagonal(axis1=1, axis2=2), 0.0))
    difference = pose - real[:, :3]
    difference[:, 2] = np.degrees(_wrap(difference[:, 2]))
    spread[:, 2] = np.degrees(spread[:, 2])
    for index, (axis, unit) in enumerate((("x", "m"), ("y", "m"), ("yaw", "deg"))):
        _add(
            section,
            f"robot{axis}",
            f"Robot's {axis} in the map",
            unit,
            world.times,
            difference[:, index],
            spread[:, index],
            play,
        )
    known = np.array([message.ball_known for message in world.messages])
    if known.any():
        ball, ball_spread = _ball(world, real, known)
        for index, axis in enumerate(("forward", "left")):
            name = f"Ball as seen from the robot, {axis}"
            _add(section, f"ball{axis}", name, "m", world.times, ball[:, index], ball_spread[:, index], play)
    else:
        section.words.append("The robot never knew where the ball was.")
    return section


def _truth_at(truth: Track, times: Array) -> Array:
    """Return (n, 5): robot's x, y, yaw and the ball's x, y in map, NaN where not known."""
    rows = np.array(
        [
            (
                m.robot.position.x,
                m.robot.position.y,
                attitude(m.robot.orientation)[2],
                m.ball.position.x,
                m.ball.position.y,
            )
            for m in truth.messages
        ]
    )
    kinds = [Alignment.LINEAR, Alignment.LINEAR, Alignment.ANGLE, Alignment.LINEAR, Alignment.LINEAR]
    return np.column_stack([align(truth, rows[:, index], kind, times) for index, kind in enumerate(kinds)])


def _ball(world: Track, real: Array, known: Mask) -> tuple[Array, Array]:
    """Return (n, 2) errors of the ball in base_footprint, and what they should be; NaN where no ball is known."""
    offset = real[:, 3:5] - real[:, :2]
    cosine, sine = np.cos(real[:, 2]), np.sin(real[:, 2])
    seen = np.column_stack([cosine * offset[:, 0] + sine * offset[:, 1], -sine * offset[:, 0] + cosine * offset[:, 1]])
    found = np.array([message.ball.position for message in world.messages]) - seen
    covariances = np.array([message.ball.covariance for message in world.messages]).reshape(-1, 4, 4)
    spread = np.sqrt(np.maximum(covariances[:, [0, 1], [0, 1]], 0.0))
    found[~known], spread[~known] = np.nan, np.nan
    return found, spread


def _add(
    section: Section, key: str, name: str, unit: str, times: Array, error: Array, spread: Array, play: Mask
) -> None:
    t, s = thin(times, SIGMAS * spread)
    figure = Figure(f"error{key}", f"{name}: estimate - truth", "time [s]", f"error [{unit}]", height=210)
    figure.items = [Band(f"{SIGMAS:g} sigma", t, -s, s, SKY), Line("error", *peaks(times, error), BLUE)]
    known = np.isfinite(error)
    counted = known & play if (known & play).any() else known
    if known.any():
        size, claimed = np.abs(error[counted]), SIGMAS * spread[counted]
        digits = 3 if unit == "m" else 2
        figures = (_rms(size), float(np.median(size)), float(size.max()))
        section.rows.append(
            (
                name,
                *(f"{each:.{digits}f} {unit}" for each in figures),
                f"{100.0 * float(np.mean(size <= claimed)):.0f} %",
                f"{_rms(error[known]):.{digits}f} {unit}",
            )
        )
        widest = max(1.15 * figures[2], min(1.2 * float(np.percentile(claimed, 90)), WIDEST * figures[2]), 1e-3)
        figure.y_range = (-widest, widest)
        outside = np.abs(error) > SIGMAS * spread
        if outside.any():
            x, y = peaks(times, np.where(outside, error, np.nan))
            figure.items.append(Line("outside the band", x, y, RED, points=True, width=3))
    section.figures.append(figure)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _in_play(recording: Recording, times: Array) -> Mask:
    """Return (n,) whether the game was played and the robot not penalised; all true where nobody tells."""
    game = recording.get(topics.GAME_STATE)
    if game is None:
        return np.ones(len(times), dtype=bool)
    playing = np.array([m.phase == GameState.PLAYING and not m.penalty for m in game.messages], dtype=float)
    found: Mask = align(game, playing, Alignment.LAST, times) > 0.5
    return found if found.any() else np.ones(len(times), dtype=bool)


def _wrap(angle: Array) -> Array:
    wrapped: Array = (angle + np.pi) % (2.0 * np.pi) - np.pi
    return wrapped
