"""How fast it ran: real-time factor, latencies from the picture on, and what is missing."""

from __future__ import annotations

import numpy as np

from tulip_ros import topics
from tulip_ros.log_notes import LOST
from tulip_ros.time import from_message
from tulip_view.recording import Recording, Track
from tulip_view.report.figures import BLUE, GREEN, ORANGE, Array, Figure, LeftOut, Line, Section, thin
from tulip_view.report.stills import pictures_of

TITLE = "Time"
WINDOW = 1.0  # [s] of the recorder's clock, over which the real-time factor is a mean
PERIODIC = (
    topics.JOINT_STATES,
    topics.LEG_COMMAND,
    topics.MOTION_STATE,
    topics.CAMERA_COMPRESSED,
    topics.CAMERA_IMAGE,
    topics.FEATURES,
    topics.WORLD_STATE,
)
"""Topics whose stamps come at a steady pace, so that a gap means that something is missing."""
LEAST = 0.01  # [ms]
GAP = 1.6  # of the usual period: longer ones count as gaps


def timing(recording: Recording) -> Section:
    """Return the section.

    Raises:
        LeftOut: if none of its topics is recorded.
    """
    section = Section("timing", TITLE)
    _real_time(recording, section)
    _latencies(recording, section)
    _lost(recording, section)
    section.header = ("topic", "messages", "usual period", "gaps", "missing", "longest gap")
    for topic in PERIODIC:
        track = recording.get(topic)
        if track is None or len(track) < 3:
            continue
        section.rows.append((topic.name, *gaps(track.times)))
    if not section.rows and not section.figures:
        raise LeftOut(TITLE, f"none of {', '.join(topic.name for topic in PERIODIC)} is recorded")
    return section


def gaps(times: Array) -> tuple[str, ...]:
    """Return number of messages, usual period, gaps, messages missing in them, and the longest gap, in words.

    Args:
        times: (n,) ascending stamps [s], n >= 2.
    """
    steps = np.diff(times)
    steps = steps[steps > 0.0]  # two messages of one stamp: the later one is more complete
    if not len(steps):
        return str(len(times)), "-", "0", "0", "-"
    period = float(np.median(steps))
    long = steps[steps > GAP * period]
    missing = int(np.sum(np.rint(long / period) - 1))
    return (
        str(len(times)),
        f"{1e3 * period:.1f} ms",
        str(len(long)),
        f"{missing} ({100.0 * missing / (missing + len(times)):.1f} %)",
        f"{1e3 * float(steps.max()):.0f} ms",
    )


def _real_time(recording: Recording, section: Section) -> None:
    if recording.log_time_is_stamp:
        section.words.append(
            "The recorder's clock was that of the stamps (lockstep, or a robot in real time): "
            "the recording does not tell a real-time factor."
        )
        return
    track = max(recording.tracks.values(), key=len)
    order = np.argsort(track.wall)
    wall, stamps = track.wall[order], track.arrivals[order]
    edges = np.arange(wall[0], wall[-1], WINDOW)
    if len(edges) < 3:
        section.words.append("Too short for a real-time factor.")
        return
    at = np.interp(edges, wall, stamps)
    figure = Figure("realtime", "Real-time factor", "time [s]", "simulated / real", height=210)
    figure.items.append(Line("real-time factor", at[1:], np.diff(at) / WINDOW, BLUE))
    section.figures.append(figure)
    whole = (stamps[-1] - stamps[0]) / (wall[-1] - wall[0])
    section.words.append(f"Real-time factor: {whole:.2f} as a whole.")


def _latencies(recording: Recording, section: Section) -> None:
    camera = pictures_of(recording)
    features, world = recording.get(topics.FEATURES), recording.get(topics.WORLD_STATE)
    figure = Figure("latency", "From a picture's stamp to ...", "time [s]", "latency [ms]", height=240)
    for name, found, colour in (
        ("its features", None if features is None else (features.times, features.wall), BLUE),
        ("the world state with them", None if world is None else _first_with_picture(recording, world), ORANGE),
    ):
        if found is None or not len(found[0]):
            continue
        stamps, wall = found
        latency = 1e3 * (wall - _said(recording, stamps))
        stamps, latency = stamps[np.isfinite(latency)], latency[np.isfinite(latency)]
        if not _tells(latency):
            continue
        x, y = thin(stamps, latency)
        figure.items.append(Line(name, x, y, colour))
        section.words.append(
            f"Picture to {name}: median {np.median(latency):.1f} ms, 95 % below {np.percentile(latency, 95):.1f} ms, "
            f"longest {latency.max():.1f} ms."
        )
    commands = recording.get(topics.LEG_COMMAND)
    if commands is not None and _tells(latency := 1e3 * (commands.wall - _said(recording, commands.times))):
        known = np.isfinite(latency)
        latency = latency[known]
        section.words.append(
            f"Joint state to leg command: median {np.median(latency):.1f} ms, 95 % below "
            f"{np.percentile(latency, 95):.1f} ms."
        )
        control = Figure(
            "control", "From a joint state's stamp to the leg command", "time [s]", "latency [ms]", height=210
        )
        x, y = thin(commands.times[known], latency)
        control.items.append(Line("leg command", x, y, GREEN))
        section.figures.append(control)
    if figure.items:
        section.figures.append(figure)
        section.words.append(
            "Log times are stamps here, so these are the latencies that the lockstep imitates."
            if recording.log_time_is_stamp
            else "Latencies are by the recorder's clock, from when it heard the joint states of a stamp; where it "
            "hears messages out of their order, one may come out below 0."
        )
    if camera is not None and features is not None:
        pictures = camera[1]
        lost = len(np.setdiff1d(_nanoseconds(pictures.times), _nanoseconds(features.times)))
        section.words.append(f"Pictures without features: {lost} of {len(pictures)}.")
    if features is not None and world is not None:
        used = {from_message(message.picture) - recording.origin for message in world.messages}
        lost = len(np.setdiff1d(_nanoseconds(features.times), np.array(sorted(used), dtype=np.int64)))
        section.words.append(f"Features that no recorded world state names as its newest: {lost} of {len(features)}.")


def _lost(recording: Recording, section: Section) -> None:
    """Tell what the recorder itself counted: messages that were sent and never reached it."""
    counts = {name: int(count) for name, count in recording.metadata.get(LOST, {}).items() if count.isdigit()}
    if not counts and recording.log_time_is_stamp:
        return  # in lockstep nothing can get lost
    if not counts:
        section.words.append("The recorder noted no count of messages that were lost on their way to it.")
    elif any(counts.values()):
        lost = ", ".join(f"{count} of {name}" for name, count in counts.items() if count)
        section.words.append(f"Lost on the way to the recorder, by its own count: {lost}.")
    else:
        section.words.append("Lost on the way to the recorder, by its own count: none.")


def _tells(latency: Array) -> bool:
    """Return whether latencies say anything: in lockstep most come out as the 0 that they are not."""
    known = latency[np.isfinite(latency)]
    return bool(len(known)) and float(np.abs(known).max()) > LEAST


def _said(recording: Recording, stamps: Array) -> Array:
    """Return when stamps were the present, by the recorder's clock [s]; NaN where it does not tell.

    The joint states tell it best: no other topic is as frequent, and they are sent the moment they are measured.
    """
    joints = recording.get(topics.JOINT_STATES)
    track = joints if joints is not None else max(recording.tracks.values(), key=len)
    said: Array = np.interp(stamps, track.times, track.wall, left=np.nan, right=np.nan)
    return said


def _first_with_picture(recording: Recording, world: Track) -> tuple[Array, Array]:
    """Return stamps of pictures, and when the first world state came that had used each [s]."""
    first: dict[int, float] = {}
    for wall, message in zip(world.wall, world.messages, strict=True):
        stamp = from_message(message.picture)
        if stamp:
            first.setdefault(stamp, float(wall))
    stamps = np.array([(stamp - recording.origin) * 1e-9 for stamp in first])
    return stamps, np.array(list(first.values()))


def _nanoseconds(times: Array) -> Array:
    found: Array = np.rint(times * 1e9).astype(np.int64)
    return found
