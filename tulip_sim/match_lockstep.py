"""A trial in lockstep: one process, deterministic, as fast as it can."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from tulip_description.field import load_field
from tulip_sim.lockstep import Lockstep, Settings
from tulip_sim.lockstep_notes import explain_trial
from tulip_sim.lockstep_recording import LockstepRecording, RecordedPictures
from tulip_sim.scenario import make_scenario
from tulip_sim.trial import NO_CAMERA, TrialObserver, TrialSummary
from tulip_strategy.interface import UserRequest

Progress = Callable[[float, str], None]
"""Is told simulated time [s] and what the robot is doing."""


def play_lockstep(
    seed: int,
    scenario: str = "trial",
    settings: Settings | None = None,
    record: Path | None = None,
    progress: Progress | None = None,
    eyes_beside: bool = False,
    strategy: str = "dribble_and_kick",
    recorded: RecordedPictures | None = None,
) -> TrialSummary:
    """Play one trial.

    Args:
        seed: Of the scenario and of all noise.
        scenario: Name of the scenario.
        settings: Parameters of all cores.
        record: New folder for the recording, or None for none.
        progress: Told once in a simulated second.
        eyes_beside: Let camera and vision work in a process of their own.
        strategy: Name of what the robot plays.
        recorded: What of the pictures is recorded.

    Raises:
        BadInputError: if the recording cannot be written.
    """
    observer = TrialObserver()
    recording = LockstepRecording(record, recorded) if record else None

    def listen(topic: str, stamp: int, value: object) -> None:
        if recording is not None:
            recording.write(topic, stamp, value)

    trial: Lockstep | None = None
    try:
        start = make_scenario(scenario, np.random.default_rng(seed), load_field())
        if recording is not None:
            explain_trial(recording.notebook, seed, scenario, start.robot, settings, strategy)
        trial = Lockstep(start, seed, settings, listen, eyes_beside)
        if strategy != trial.user.strategy:
            trial.ask(UserRequest.PLAY, strategy)
        begin = time.monotonic()

        def watch(now: Lockstep) -> None:
            observer.see_truth(now.world.truth().footprint)
            observer.see_estimate(now.world_model.state(now.stamp).robot.pose)
            if progress is not None:
                progress(now.stamp * 1e-9, now.doing)

        outcome = trial.play(watch)
        real_time_factor = trial.stamp * 1e-9 / (time.monotonic() - begin)
        truth = trial.world.truth()
    finally:
        if recording is not None:
            recording.close()
        if trial is not None:
            trial.close()
    return TrialSummary(
        mode="lockstep" if settings is None or settings.perception is None else f"lockstep, {NO_CAMERA}",
        seed=seed,
        outcome=outcome.result.value if outcome else "unfinished",
        time=trial.referee.played,
        touches=sum(truth.foot_touches) + truth.body_touches,
        falls=trial.referee.falls,
        distance_walked=observer.distance,
        localization_error=observer.localization_error,
        heading_error=observer.heading_error,
        real_time_factor=real_time_factor,
        recording=str(recording.path) if recording else "",
    )
