"""A match in lockstep, from its first trial to its last: played, recorded, told."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from tulip_sim.lockstep_match import LockstepMatch
from tulip_sim.lockstep_notes import explain_match
from tulip_sim.lockstep_recording import LockstepRecording, RecordedPictures
from tulip_sim.match_places import team_truth
from tulip_sim.match_rules import NAMESPACES, TEAMS
from tulip_sim.match_settings import MatchSettings
from tulip_sim.match_summary import MatchSummary
from tulip_sim.trial import NO_CAMERA, TrialObserver
from tulip_strategy.interface import GamePhase

Progress = Callable[[float, str], None]
"""Is told simulated time [s] and what the robots are doing."""


def play_lockstep_match(
    seed: int,
    settings: MatchSettings | None = None,
    record: Path | None = None,
    progress: Progress | None = None,
    say: Callable[[str], None] | None = None,
    eyes_beside: bool = False,
    recorded: RecordedPictures | None = None,
) -> MatchSummary:
    """Play one match.

    Args:
        seed: Of everything random.
        settings: Parameters of everything.
        record: New folder for the recording, or None for none.
        progress: Told once in a simulated second.
        say: Told each line of the referee's log as it comes.
        eyes_beside: Let cameras and vision work in processes of their own.
        recorded: What of the pictures is recorded.

    Raises:
        BadInputError: if the recording cannot be written.
    """
    settings = settings or MatchSettings()
    observers = [TrialObserver() for _ in TEAMS]
    recording = LockstepRecording(record, recorded) if record else None
    match: LockstepMatch | None = None
    said = 0

    def listen(team: int, topic: str, stamp: int, value: object) -> None:
        if recording is not None:
            recording.write(topic, stamp, value, NAMESPACES[team])

    def watch(now: LockstepMatch) -> None:
        nonlocal said
        log = now.referee.report.log
        if said < len(log) and recording is not None:
            recording.write("referee/report", now.stamp, now.referee.report)
        for line in log[said:]:
            if say is not None:
                say(str(line))
        said = len(log)
        if now.referee.phase is GamePhase.PLAYING:
            for team in TEAMS:
                observers[team].see_truth(team_truth(now.world, team).footprint)
                observers[team].see_estimate(now.robots[team].world_model.state(now.stamp).robot.pose)
        if progress is not None:
            doing = " | ".join(robot.doing.rsplit(" > ", 1)[-1] for robot in now.robots)
            progress(now.stamp * 1e-9, f"trial {now.referee.trial}: {doing}")

    try:
        if recording is not None:
            explain_match(recording.notebook, seed, settings)
        match = LockstepMatch(seed, settings, listen, eyes_beside)
        begin = time.monotonic()
        report = match.play(watch)
        watch(match)
        duration = match.stamp * 1e-9
        real_time_factor = duration / (time.monotonic() - begin)
    finally:
        if recording is not None:
            recording.close()
        if match is not None:
            match.close()
    pictures = all(robot.perception is None for robot in settings.robots)
    return MatchSummary(
        mode="lockstep" if pictures else f"lockstep, {NO_CAMERA}",
        seed=seed,
        report=report,
        duration=duration,
        localization_errors=(observers[0].localization_error, observers[1].localization_error),
        real_time_factor=real_time_factor,
        recording=str(recording.path) if recording else "",
    )
