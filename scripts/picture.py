"""Make the pictures of the documents: a trial with ball and goal, what the camera sees, postures of the experiment."""

from __future__ import annotations

import _environment

if __name__ == "__main__":
    _environment.prepare()

import sys
from pathlib import Path
from typing import Annotated

import cv2
import numpy as np
import typer
from numpy.typing import NDArray

from tulip_description.camera_pose import camera_in_footprint
from tulip_description.field import load_field
from tulip_description.robot import load_robot
from tulip_motion.identification.experiment_plan import make_plan
from tulip_motion.interface import MotionMode, Support
from tulip_sim.camera import CameraParameters, CameraRenderer
from tulip_sim.lockstep import Lockstep
from tulip_sim.posture_picture import posture_picture
from tulip_sim.scenario import make_scenario
from tulip_sim.spectator import Spectator, behind
from tulip_sim.truth import Truth
from tulip_vision.features import FeatureClass
from tulip_vision.lens import head_camera_lens
from tulip_vision.pipeline import Vision, VisionParameters

PICTURES = Path(__file__).resolve().parent.parent / "docs" / "pictures"
BALL_AHEAD = (0.5, 1.5)  # [m] near enough for one picture, too far to be hidden by the feet
BALL_ASIDE = (-0.3, 0.1)  # [m] to the left; seen from the right, the legs would hide it there
MID_STEP = (0.3, 0.7)  # of a step: the swing foot is off the ground
WANTED = {FeatureClass.BALL, FeatureClass.GOAL_POST}  # in the head camera's picture
SECOND = 10**9  # [ns]
PERIOD = 20_000_000  # [ns] between two looks
LONGEST = 160  # [s] of simulated time
TRIALS = 20
POSTURES = (1, 5, 6, 23, 27)  # of the identification experiment: they differ much

Picture = NDArray[np.uint8]


class HeadCamera:
    """The head camera and what vision finds in its picture."""

    def __init__(self) -> None:
        lens = head_camera_lens()
        self._robot = load_robot()
        self._renderer = CameraRenderer(CameraParameters(), load_field(), self._robot, lens)
        self._vision = Vision(VisionParameters(), lens)

    def look(self, truth: Truth) -> tuple[set[FeatureClass], Picture]:
        """Return what vision finds, and the picture with the features drawn in."""
        picture = self._renderer.render(truth, np.random.default_rng(truth.stamp))
        pan, tilt = truth.joint_positions[12:]
        pose = camera_in_footprint(self._robot, truth.base_position[2], truth.base_orientation, pan, tilt)
        features = self._vision.process(picture, truth.stamp, pose)
        return {feature.kind for feature in features.features}, self._vision.annotate(picture, features)


def worth_a_picture(trial: Lockstep, truth: Truth) -> bool:
    """Return whether the robot walks behind the ball in the half of the goal that it attacks."""
    legs, pose = trial.motion.state(), truth.footprint
    ahead, aside = (truth.ball_position[:2] - [pose.x, pose.y]) @ pose.rotation()
    return (
        legs.mode is MotionMode.WALK
        and legs.support is not Support.DOUBLE
        and MID_STEP[0] < legs.phase < MID_STEP[1]
        and pose.x > 0.0
        and BALL_AHEAD[0] < ahead < BALL_AHEAD[1]
        and BALL_ASIDE[0] < aside < BALL_ASIDE[1]
    )


def find_moment(seed: int, camera: HeadCamera) -> tuple[Truth, Picture] | None:
    """Play a trial until robot, ball and goal make a picture; return what is, and what the head camera sees."""
    trial = Lockstep(make_scenario("trial", np.random.default_rng(seed), load_field()), seed)
    try:
        while trial.referee.outcome is None and trial.stamp < LONGEST * SECOND:
            trial.step()
            truth = trial.world.truth()
            if trial.stamp % PERIOD == 0 and worth_a_picture(trial, truth):
                kinds, seen = camera.look(truth)
                if kinds >= WANTED:
                    return truth, seen
        return None
    finally:
        trial.close()


def main(
    seed: Annotated[int, typer.Option(help="Of the first trial to look at; the next ones follow.", min=0)] = 2,
    folder: Annotated[Path, typer.Option(help="Where match.png, camera.png and postures.png go.")] = PICTURES,
) -> None:
    """Play trials in lockstep until robot, ball and goal make a picture."""
    camera = HeadCamera()
    for number in range(seed, seed + TRIALS):
        found = find_moment(number, camera)
        if found is not None:
            break
        print(f"seed {number}: ball and goal were never in sight together")
    else:
        print("error: no trial had a moment for a picture; try another --seed.", file=sys.stderr)
        raise typer.Exit(1)
    truth, seen = found
    field = load_field()
    view = Spectator(field, load_robot()).render(truth, behind(truth.footprint, field.opponent_goal))
    folder.mkdir(parents=True, exist_ok=True)
    of_trial = f"seed {number}, {truth.stamp / SECOND:.2f} s"
    postures = [visit.posture for plan in make_plan(load_robot()) for visit in plan.visits]
    experiment = posture_picture(load_robot(), [postures[index] for index in POSTURES])
    for name, picture, what in (
        ("match.png", view, of_trial),
        ("camera.png", seen, of_trial),
        ("postures.png", experiment, f"postures {', '.join(str(index + 1) for index in POSTURES)}"),
    ):
        cv2.imwrite(str(folder / name), picture, [cv2.IMWRITE_PNG_COMPRESSION, 9])
        print(f"wrote {folder / name}: {what}")


if __name__ == "__main__":
    typer.run(main)
