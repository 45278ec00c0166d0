"""Makes the recordings of tests/data/recordings anew, in place: `python3 tests/make_recordings.py`.

Whole lockstep runs are recorded and then thinned out to what recomputing needs. Vision's features are those of the
small JPEG pictures that are kept, computed when the recordings are made: a later run is compared with them. What the
messages say depends on the code and the seed alone.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from functools import partial
from pathlib import Path

import cv2
import numpy as np
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import CompressedImage

from tulip_description.field import load_field
from tulip_ros.log_edit import writing
from tulip_ros.log_file import Log
from tulip_ros.serialized import time_at
from tulip_ros.time import stamp_of
from tulip_sim.lockstep import Lockstep, Settings
from tulip_sim.lockstep_match import LockstepMatch
from tulip_sim.lockstep_notes import explain_match, explain_trial
from tulip_sim.lockstep_recording import LockstepRecording, RecordedPictures
from tulip_sim.match_rules import NAMESPACES
from tulip_sim.match_settings import MatchSettings
from tulip_sim.messages import jpeg_to_message
from tulip_sim.perception import PerceptionParameters
from tulip_sim.recompute.run import recompute
from tulip_sim.referee import RefereeParameters
from tulip_sim.robot_stack import RobotSettings
from tulip_sim.scenario import make_scenario

RECORDINGS = Path(__file__).parent / "data" / "recordings"
SEED = 4
SEED_WITH_PICTURES = 8  # the ball lies 1.5 m in front of the robot: the camera sees it from the beginning
SOON = RefereeParameters(initial_time=0.5, ready_time=0.5, set_time=1.0)
"""Of the recording with pictures: play begins soon, so that most of them show the ball."""
QUALITY = 50  # of the pictures, of which every second one is kept
EVERY_TRUTH = 3  # of which one is kept: a moment is judged by the truth nearest to it, 30 ms away at most
WORLD = ("odometry", "features", "world_state", "ground_truth", "initialpose")
STRATEGY = ("motion_state", "game_state", "user_command", "decision", "behaviour_tree")
EYES = ("joint_states", "camera/camera_info", "camera/image_raw/compressed")


def trial(folder: Path, seed: int, seconds: float, settings: Settings) -> None:
    """Record the beginning of a trial, all topics, with pictures that lose nothing."""
    recorder = LockstepRecording(folder, RecordedPictures("png", 0.0))
    scenario = make_scenario("trial", np.random.default_rng(seed), load_field())
    run = Lockstep(scenario, seed, settings, recorder.write)
    explain_trial(recorder.notebook, seed, "trial", scenario.robot, settings, run.user.strategy)
    while run.stamp < seconds * 1e9:
        run.step()
    run.close()
    recorder.close()


def match(folder: Path, seconds: float) -> None:
    """Record the beginning of a match of two robots without pictures."""
    recorder = LockstepRecording(folder)
    robot = RobotSettings(perception=PerceptionParameters())

    def listen(team: int, topic: str, stamp: int, value: object) -> None:
        recorder.write(topic, stamp, value, NAMESPACES[team])

    settings = MatchSettings(robots=(robot, robot))
    explain_match(recorder.notebook, SEED, settings)
    run = LockstepMatch(SEED, settings, listen)
    while run.stamp < seconds * 1e9:
        run.step()
    run.close()
    recorder.close()


def thin(source: Path, folder: Path, names: tuple[str, ...]) -> None:
    """Keep some topics: pictures as small JPEG, head angles at the odometry's instants alone."""
    with Log(source) as log, writing(folder) as bag:
        bag.copy_notes(log)
        chosen = [full for full in log.topics if any(full.endswith(f"/{name}") for name in names)]
        slow = {record.log_time for record in log.records(["/odometry"])}
        counts: Counter[str] = Counter()
        dropped: set[int] = set()  # stamps of pictures [ns]
        for record in log.records(chosen):
            name, data = record.topic.name, record.data
            counts[name] += 1
            if name.endswith("/joint_states") and record.log_time not in slow:
                continue
            if name.endswith("/ground_truth") and counts[name] % EVERY_TRUTH:
                continue
            if name.endswith("/compressed") and counts[name] % 2:
                dropped.add(record.log_time)
                continue
            if name.endswith("/features") and time_at(data) in dropped:
                continue
            if record.topic.name.endswith("/compressed"):
                message = deserialize_message(data, CompressedImage)
                picture = cv2.imdecode(np.frombuffer(message.data, np.uint8), cv2.IMREAD_COLOR)
                data = serialize_message(jpeg_to_message(picture, stamp_of(message), QUALITY))
            bag.copy_topic(record.topic)
            bag.write(record.topic.name, data, record.log_time)


def make(target: Path, whole: Callable[[Path], None], names: tuple[str, ...], components: tuple[str, ...]) -> None:
    """Make one recording."""
    with tempfile.TemporaryDirectory() as temporary:
        there = Path(temporary)
        whole(there / "whole")
        thin(there / "whole", there / "thin", names)
        with Log(there / "thin") as log:
            recompute(log, components, target, judge=False)


def main(target: Path) -> None:
    """Make all of them, and put them into a folder in place of the old ones."""
    made_up = Settings(perception=PerceptionParameters())
    seen = partial(trial, seed=SEED_WITH_PICTURES, seconds=8.0, settings=Settings(referee=SOON))
    with tempfile.TemporaryDirectory() as temporary:
        there = Path(temporary)
        for name, whole, topics, components in (
            ("walk", partial(trial, seed=SEED, seconds=20.0, settings=made_up), WORLD + STRATEGY, ("worldmodel",)),
            ("match", partial(match, seconds=12.0), WORLD, ("worldmodel",)),
            ("pictures", seen, WORLD + EYES, ("vision", "worldmodel")),
        ):
            begin = time.monotonic()
            make(there / name, whole, topics, components)
            size = sum(file.stat().st_size for file in (there / name).glob("*.mcap"))
            print(f"{name}: {size / 1e6:.2f} MB in {time.monotonic() - begin:.0f} s", flush=True)
            shutil.rmtree(target / name, ignore_errors=True)
            shutil.copytree(there / name, target / name)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else RECORDINGS)
