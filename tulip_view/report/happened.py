"""What happened: states of the game, decisions, kicks, falls, and what the referee said."""

from __future__ import annotations

import json
from itertools import pairwise
from typing import Any

import numpy as np

from tulip_ros import topics
from tulip_view.columns import MODES, PHASES, SECONDARY, name_of
from tulip_view.recording import Recording, Track
from tulip_view.report.figures import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    RED,
    SKY,
    Figure,
    LeftOut,
    Mark,
    Section,
    Span,
    spans_of,
)
from tulip_view.state_words import stop_words

TITLE = "What happened"
TOLD_BY = (
    topics.EMERGENCY_STOP,
    topics.GAME_STATE,
    topics.DECISION,
    topics.MOTION_STATE,
    topics.GROUND_TRUTH,
    topics.REPORT,
)
KICK, TOUCH, FALL = "kick asked for", "touch of the ball", "fall"
PHASE_COLOURS = {"initial": GREY, "ready": SKY, "set": ORANGE, "playing": GREEN, "finished": PURPLE, "penalised": RED}
MODE_COLOURS = {"limp": GREY, "stand": SKY, "walk": GREEN, "kick": ORANGE, "fallen": RED}
PALETTE = (BLUE, ORANGE, GREEN, PURPLE, SKY, RED, "#b3a000", "#7f5539", GREY)
ECHO = 0.5  # [s]
WRAPPERS = ("until it succeeds",)
"""Nodes of the tree that say nothing about what the robot does."""

Event = tuple[float, str, str]
"""Time [s], who says it, what."""


def happened(recording: Recording) -> Section:
    """Return the section.

    Raises:
        LeftOut: if none of the topics is in the recording that tell anything of it.
    """
    end = recording.end
    items: list[Span | Mark] = []
    events: list[Event] = []
    for add in (_emergency_stop, _game, _decisions, _motion, _truth, _referee):
        spans, found = add(recording, end)
        items += spans
        events += found
    if all(recording.get(topic) is None for topic in TOLD_BY):
        raise LeftOut(TITLE, f"none of {', '.join(topic.name for topic in TOLD_BY)} is recorded")
    events.sort(key=lambda event: event[0])
    section = Section("happened", TITLE)
    if not events:
        section.words.append("No change of the game, decision, kick, touch, goal or fall was recorded.")
    if items:
        lanes = list(dict.fromkeys(item.lane for item in items))
        figure = Figure("timeline", "Timeline", "time [s]", "", list(items), height=90 + 46 * len(lanes))
        figure.x_range = (recording.begin, end)
        section.figures.append(figure)
    section.facts = _facts(recording, events)
    section.row_times = [time for time, _, _ in events]
    section.header = ("time [s]", "from", "what")
    section.rows = [(f"{time:.2f}", who, what) for time, who, what in events]
    return section


def _facts(recording: Recording, events: list[Event]) -> list[tuple[str, str]]:
    """Return the most important numbers, of what the recording tells."""
    facts = [("duration", f"{recording.end - recording.begin:.1f} s")]
    truth, game = recording.get(topics.GROUND_TRUTH), recording.get(topics.GAME_STATE)
    # A recording may end with a goal that only one of them tells any more.
    told = max((track for track in (truth, game) if track is not None), key=lambda track: track.times[-1], default=None)
    if told is not None:
        facts.append(("score, own : other", f"{told.messages[-1].own_score} : {told.messages[-1].opponent_score}"))
    if truth is not None and truth.messages[-1].outcome:
        facts.append(("outcome", truth.messages[-1].outcome))
    if recording.get(topics.DECISION) is not None:
        facts.append(("kicks asked for", str(sum(what.startswith(KICK) for _, _, what in events))))
    if truth is not None:
        for name, event in (("touches of the ball", TOUCH), ("falls", FALL)):  # the truth's own count may begin anew
            facts.append((name, str(sum(what == event for _, _, what in events))))
    elif recording.get(topics.MOTION_STATE) is not None:
        facts.append(("falls that it noticed", str(sum(what.startswith("fallen") for _, _, what in events))))
    return facts


def doing(tree: str) -> str:
    """Return what a behaviour tree's active path comes down to: its last telling name."""
    names = [name for name in tree.split(" > ") if name not in WRAPPERS]
    return names[-1] if names else ""


def _emergency_stop(recording: Recording, end: float) -> tuple[list[Span | Mark], list[Event]]:
    track = recording.get(topics.EMERGENCY_STOP)
    if track is None:
        return [], []
    said = [message.sequence for message in track.messages]
    first = [index for index, number in enumerate(said) if number > max(said[:index], default=0)]  # then it is repeated
    labels = ["emergency stop" if track.messages[index].engaged else "" for index in first]
    spans = spans_of("stop", track.times[first], labels, end, {"emergency stop": RED})
    return [*spans], [(float(track.times[index]), "stop", stop_words(track.messages[index])) for index in first]


def _game(recording: Recording, end: float) -> tuple[list[Span | Mark], list[Event]]:
    track = recording.get(topics.GAME_STATE)
    if track is None:
        return [], []
    labels, events = [], []
    before: tuple[Any, ...] = ()
    for time, message in zip(track.times, track.messages, strict=True):
        phase = name_of(PHASES, message.phase)
        labels.append("penalised" if message.penalty else phase)
        now = (phase, message.penalty, message.own_score, message.opponent_score, message.stopped, message.stale)
        if now != before:
            what = f"{phase}, {message.own_score}:{message.opponent_score}, {message.seconds_remaining} s left"
            what += f", {name_of(SECONDARY, message.secondary_state).replace('_', ' ')}"
            what += f", penalty {message.penalty}" if message.penalty else ""
            what += ", stopped" if message.stopped else ""
            what += ", no packets from the referee" if message.stale else ""
            events.append((float(time), "game", what))
        before = now
    return [*spans_of("game", track.times, labels, end, PHASE_COLOURS)], events


def _decisions(recording: Recording, end: float) -> tuple[list[Span | Mark], list[Event]]:
    track = recording.get(topics.DECISION)
    if track is None:
        return [], []
    labels = [doing(message.tree) for message in track.messages]
    ranked = sorted(set(labels), key=lambda label: -labels.count(label))
    colours = {label: PALETTE[index % len(PALETTE)] for index, label in enumerate(ranked)}
    spans = spans_of("decision", track.times, labels, end, colours)
    items: list[Span | Mark] = [*spans]
    events = [(span.begin, "strategy", f"{span.label}, for {span.end - span.begin:.2f} s") for span in spans]
    for time, message in zip(track.times, track.messages, strict=True):
        if message.kick_requested:
            what = (
                f"{KICK}: {('left', 'right')[min(message.kick_side, 1)]} foot, "
                f"{('forward', 'side', 'walking')[min(message.kick_kind, 2)]}, "
                f"{np.degrees(message.kick_direction):.0f} deg, {message.kick_speed:.1f} m/s"
            )
            items.append(Mark("decision", what, float(time), BLACK, KICK, "diamond"))
            events.append((float(time), "strategy", what))
    return items, events


def _motion(recording: Recording, end: float) -> tuple[list[Span | Mark], list[Event]]:
    track = recording.get(topics.MOTION_STATE)
    if track is None:
        return [], []
    labels = [name_of(MODES, message.mode) for message in track.messages]
    spans = spans_of("motion", track.times, labels, end, MODE_COLOURS)
    events = [
        (span.begin, "motion", f"{span.label} for {span.end - span.begin:.2f} s")
        for span in spans
        if span.label in ("kick", "fallen", "limp")
    ]
    return [*spans], events


def _truth(recording: Recording, end: float) -> tuple[list[Span | Mark], list[Event]]:
    track = recording.get(topics.GROUND_TRUTH)
    if track is None:
        return [], []
    items: list[Span | Mark] = []
    events = []
    for name, what, colour, symbol in (
        ("touches", TOUCH, BLUE, "circle"),
        ("falls", FALL, RED, "x"),
        ("own_score", "goal", GREEN, "star"),
        ("opponent_score", "goal of the opponent", PURPLE, "triangle-up"),
    ):
        for time in _increments(track, name):
            items.append(Mark("truth", what, time, colour, what, symbol))
            events.append((time, "truth", what))
    outcomes = [(float(time), each.outcome) for time, each in zip(track.times, track.messages, strict=True)]
    for (_, old), (time, new) in pairwise(outcomes):
        if new and new != old:
            events.append((time, "referee", f"outcome: {new}"))
    return items, events


def _increments(track: Track, name: str) -> list[float]:
    values = track.gather(name).astype(int)
    return [float(time) for time in track.times[1:][np.diff(values) > 0]]


def _referee(recording: Recording, end: float) -> tuple[list[Span | Mark], list[Event]]:
    track = recording.get(topics.REPORT)
    if track is None:
        return [], []
    try:
        lines = json.loads(track.messages[-1].data)["log"]
        found = [(float(line["time"]), f"{line['text']} ({line['score'][0]}:{line['score'][1]})") for line in lines]
    except (ValueError, LookupError, TypeError, RecursionError):
        return [], [
            (float(track.times[-1]), "referee", f"a report that cannot be read: {track.messages[-1].data[:60]}")
        ]
    found = _without_echoes(found)
    return (
        [Mark("referee", text, time, GREY, "the referee's words", "diamond") for time, text in found],
        [(time, "referee", text) for time, text in found],
    )


def _without_echoes(said: list[tuple[float, str]]) -> list[tuple[float, str]]:
    """Return what was said at which time; words that come again and again within ECHO are told once, with how often."""
    series: list[tuple[float, str, int]] = []
    newest: dict[str, tuple[int, float]] = {}  # where in `series`, and when it was said last
    for time, words in said:
        place, last = newest.get(words, (-1, -np.inf))
        if time - last <= ECHO:
            begin, _, count = series[place]
            series[place] = (begin, words, count + 1)
        else:
            place = len(series)
            series.append((time, words, 1))
        newest[words] = (place, time)
    return [(time, words if count == 1 else f"{words}, {count} times") for time, words, count in series]
