"""A trial's beginning, recorded in lockstep: what other parts of bench log work on."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tulip_description.field import load_field
from tulip_sim.lockstep import Lockstep, Settings
from tulip_sim.lockstep_notes import explain_trial
from tulip_sim.lockstep_recording import LockstepRecording, RecordedPictures
from tulip_sim.perception import PerceptionParameters
from tulip_sim.scenario import make_scenario


def record_trial(folder: Path, pictures: str, seed: int, seconds: float) -> None:
    """Record a trial.

    Args:
        folder: Of the new recording.
        pictures: "compressed", "png", or "none" for features made up from the truth.
        seed: Of the trial.
        seconds: Of it that are recorded.
    """
    recording = LockstepRecording(folder, RecordedPictures(pictures, 0.0))
    settings = Settings(perception=PerceptionParameters() if pictures == "none" else None)
    scenario = make_scenario("trial", np.random.default_rng(seed), load_field())
    trial = Lockstep(scenario, seed, settings, recording.write)
    try:
        explain_trial(recording.notebook, seed, "trial", scenario.robot, settings, trial.user.strategy)
        while trial.stamp < seconds * 1e9:
            trial.step()
    finally:
        trial.close()
        recording.close()
