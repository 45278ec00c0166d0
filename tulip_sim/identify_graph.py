"""The identification experiment as nodes: driver, experiment and recorder, started, watched and ended."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from std_msgs.msg import String
from std_srvs.srv import Trigger

from tulip_motion.identification.experiment_settings import ExperimentSettings
from tulip_motion.identification.progress import Progress
from tulip_motion.messages import progress_from_message
from tulip_ros import parameters, topics
from tulip_ros.errors import BadInputError
from tulip_ros.launch import Launcher
from tulip_ros.plan import Start, make_plan
from tulip_ros.run import ComponentNode, session

LOOK = 0.1  # [s] between two looks at the processes
SILENCE = 60.0  # [s] after which the experiment counts as dead; it plans for some seconds first
ENDING = 0.5  # [s] for the recorder to hear the last messages


class Watcher(ComponentNode):
    """Listens to the progress and can end the experiment."""

    def __init__(self) -> None:
        """Connect."""
        super().__init__("identify_watcher")
        self.progress: Progress | None = None
        self.heard = time.monotonic()
        self.listen(topics.IDENTIFICATION, self._on_progress)
        self._abort = self.create_client(topics.ABORT_IDENTIFICATION.type, topics.ABORT_IDENTIFICATION.name)

    def abort(self) -> None:
        """Ask the robot to put its foot down and stand."""
        self._abort.call_async(Trigger.Request())

    def _on_progress(self, message: String) -> None:
        self.progress, self.heard = progress_from_message(message), time.monotonic()


def experiment_nodes(
    settings: ExperimentSettings, driver: str, seed: int, record: Path, secret: int | None = None
) -> tuple[Start, ...]:
    """Return the nodes to start.

    Args:
        settings: Of the experiment.
        driver: Name of the driver, or "none" for one that runs already.
        seed: Of the simulation's noise.
        record: New folder for the recording.
        secret: Seed of the body that the simulated robot has; None for that of robot.yaml.

    Raises:
        BadInputError: for an unknown driver, or one that has no secret body.
    """
    if secret is not None and driver != "sim":
        raise BadInputError(f"--secret is for a simulated robot; expected --driver sim with it, not {driver}.")
    nodes = ["identify", "recorder"]
    given: dict[str, dict[str, Any]] = {
        "identify": parameters.plain(settings),
        "recorder": {
            "path": str(record.absolute()),
            "notes": [f"seed={seed}", "scenario=identification", "mode=graph"],
        },
    }
    if driver == "sim":
        given["driver"] = {"scenario": "open", "seed": seed, "camera": False, "speed": 0.0, "wait_for": nodes}
        given["driver"]["referee"] = False
    if secret is not None:
        given["driver"]["secret_body"] = secret
        given["recorder"]["notes"].append(f"secret_body={secret}")
    return make_plan(nodes, None if driver == "none" else driver, values=given)


def run_graph(
    settings: ExperimentSettings,
    driver: str,
    seed: int,
    record: Path,
    show: Callable[[Progress], None],
    say: Callable[[str], None],
    secret: int | None = None,
) -> Progress:
    """Do the experiment; Ctrl-C aborts it, and a second one ends everything at once.

    Args:
        settings: Of the experiment.
        driver: Name of the driver, or "none" for one that runs already.
        seed: Of the simulation's noise.
        record: New folder for the recording.
        show: Told the progress.
        say: Told what happens to the processes, a line each.
        secret: Seed of the body that the simulated robot has; None for that of robot.yaml.

    Raises:
        BadInputError: if a node refuses what it was given, or falls silent.
        KeyboardInterrupt: at the second Ctrl-C.
    """
    plan = experiment_nodes(settings, driver, seed, record, secret)
    with Launcher(plan) as launcher, session(Watcher, arguments=[], handle_signals=False) as (watcher, spin):
        aborted = False
        while watcher.progress is None or not watcher.progress.finished:
            try:
                spin(LOOK)
                for line in launcher.poll():
                    say(line)
            except KeyboardInterrupt:
                if aborted:
                    raise
                aborted = True
                say("aborting: the robot goes home and stands")
                watcher.abort()
            if watcher.progress is not None:
                show(watcher.progress)
            if time.monotonic() - watcher.heard > SILENCE:
                raise BadInputError(f"The experiment has said nothing for {SILENCE:.0f} s; see {launcher.log_folder}.")
        end = time.monotonic() + ENDING
        while time.monotonic() < end:
            spin(LOOK)
        return watcher.progress
