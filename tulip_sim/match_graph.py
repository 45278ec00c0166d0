"""A trial as a ROS 2 graph: every component a process of its own, watched from outside."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from tulip_description.field import load_field
from tulip_description.planar import Pose2D
from tulip_description.quaternion import pose_on_ground
from tulip_msgs.msg import Decision, GroundTruth, WorldState
from tulip_ros import topics
from tulip_ros.errors import BadInputError, unknown
from tulip_ros.launch import Launcher
from tulip_ros.plan import Start, make_plan, read_parameters
from tulip_ros.run import ComponentNode, session
from tulip_ros.time import stamp_of
from tulip_sim.perception import PerceptionParameters
from tulip_sim.scenario import SCENARIOS, make_scenario
from tulip_sim.trial import NO_CAMERA, TrialObserver, TrialSummary
from tulip_strategy.game_controller import REFEREE_PORT

NODES = ("vision", "worldmodel", "head", "motion", "strategy", "game_input", "user_input")
LOOK = 0.1  # [s] between two looks at the processes
SILENCE = 60.0  # [s] of wall-clock time without news from the simulator after which the trial is given up
START = 60  # [s] that the driver waits for an emulated body, whose time begins when all nodes are there
ENDING = 0.5  # [s] of wall-clock time that the recording goes on after the end

Progress = Callable[[float, str], None]
"""Is told simulated time [s] and what the robot is doing."""


class TrialWatcher(ComponentNode):
    """Follows a trial from the ground truth; no component that plays."""

    def __init__(self) -> None:
        """Connect."""
        super().__init__("trial_watcher")
        self.heard = time.monotonic()
        self.begin_anew()
        self.listen(topics.GROUND_TRUTH, self._on_truth)
        self.listen(topics.WORLD_STATE, self._on_world_state)
        self.listen(topics.DECISION, self._on_decision)

    def begin_anew(self) -> None:
        """Forget the trial before."""
        self.observer = TrialObserver()
        self.truth: GroundTruth | None = None
        self.doing = ""
        self.first: tuple[float, int] | None = None

    def _on_truth(self, message: GroundTruth) -> None:
        self.truth, self.heard = message, time.monotonic()
        if self.first is None:
            self.first = (self.heard, stamp_of(message))
        pose, turn = message.robot.position, message.robot.orientation
        self.observer.see_truth(pose_on_ground((pose.x, pose.y), (turn.x, turn.y, turn.z, turn.w)))

    def _on_world_state(self, message: WorldState) -> None:
        self.observer.see_estimate(Pose2D(*(float(value) for value in message.robot_pose)))

    def _on_decision(self, message: Decision) -> None:
        self.doing = message.tree

    @property
    def stamp(self) -> int:
        """Newest simulated time [ns]."""
        return stamp_of(self.truth) if self.truth is not None else 0

    @property
    def real_time_factor(self) -> float:
        """Simulated time by wall-clock time since the first truth."""
        if self.first is None or self.heard <= self.first[0]:
            return float("nan")
        return (self.stamp - self.first[1]) * 1e-9 / (self.heard - self.first[0])


def trial_plan(
    seed: int,
    scenario: str = "trial",
    record: Path | None = None,
    parameter_files: Sequence[Path] = (),
    values: Mapping[str, Mapping[str, Any]] | None = None,
    referee_port: int = REFEREE_PORT,
    perception: PerceptionParameters | None = None,
    strategy: str = "dribble_and_kick",
    wire_port: int | None = None,
) -> tuple[Start, ...]:
    """Return the nodes of a trial: simulator, robot, and recorder if wanted. Arguments as for `play_graph`.

    With a `wire_port` the body is emulated: a process of its own, whose joints and sensors go over that UDP port to the
    driver. With `perception` node perception stands in for vision, without pictures: for fast tests of behaviour only.

    Raises:
        BadInputError: for an unknown scenario, or files that cannot be used.
    """
    if scenario not in SCENARIOS:
        raise unknown("scenario", scenario, SCENARIOS)
    start = make_scenario(scenario, np.random.default_rng(seed), load_field()).robot
    simulator = "driver" if wire_port is None else "emulator"
    given: dict[str, dict[str, Any]] = {
        simulator: {"scenario": scenario, "seed": seed, "referee_port": referee_port, "wait_for": list(NODES)},
        # The team tells its robot where it was put down, as people do on the real field.
        "worldmodel": {"start_x": start.x, "start_y": start.y, "start_yaw": start.yaw},
        "game_input": {"port": referee_port},
        "user_input": {"autostart": True, "strategy": strategy},
    }
    nodes = list(NODES)
    if perception is not None:
        nodes[nodes.index("vision")] = "perception"
        given[simulator].update(wait_for=list(nodes), camera=False)
        given["perception"] = {"seed": seed, **{f"quality.{name}": value for name, value in asdict(perception).items()}}
    if record is not None:
        nodes.append("recorder")
        given["recorder"] = {
            "path": str(record.absolute()),
            "notes": [f"seed={seed}", f"scenario={scenario}", f"strategy={strategy}", "mode=graph", "robots=1"],
            "wait_for": ["driver", *(name for name in nodes if name != "recorder")],
        }
        given[simulator]["wait_for"] = list(nodes)
    if wire_port is not None:
        nodes.append(simulator)
        given[simulator]["wait_for"].append("driver")
        given[simulator]["port"] = wire_port
        given["driver"] = {"options": [f"port={wire_port}", f"patience={START}"]}
    refuse_taken(parameter_files, given, "trial")
    for name, own in (values or {}).items():
        given.setdefault(name, {}).update(own)
    return make_plan(nodes, "sim" if wire_port is None else "wire", parameter_files=parameter_files, values=given)


def refuse_taken(parameter_files: Sequence[Path], given: Mapping[str, Mapping[str, Any]], what: str) -> None:
    """Refuse files that set what is set already.

    Args:
        parameter_files: YAML files for the nodes.
        given: What is set, by node name.
        what: Who sets it, as in "trial".

    Raises:
        BadInputError: with the first name that both set, or if a file cannot be used.
    """
    for path in parameter_files:
        for name, block in read_parameters(path).items():
            taken = sorted({str(key) for key in block} & given.get(name, {}).keys())
            if taken:
                raise BadInputError(f"Parameter file {path} sets {name}.{taken[0]}, which the {what} itself sets.")


def play_graph(
    seed: int,
    scenario: str = "trial",
    record: Path | None = None,
    progress: Progress | None = None,
    say: Callable[[str], None] = print,
    parameter_files: Sequence[Path] = (),
    values: Mapping[str, Mapping[str, Any]] | None = None,
    referee_port: int = REFEREE_PORT,
    logs: Path | None = None,
    perception: PerceptionParameters | None = None,
    strategy: str = "dribble_and_kick",
    beside: Sequence[Start] = (),
    wire_port: int | None = None,
) -> TrialSummary:
    """Play one trial.

    Args:
        seed: Of the scenario and of all noise.
        scenario: Name of the scenario.
        record: New folder for the recording, or None for none.
        progress: Told several times a second.
        say: Told what happens to the processes, a line each.
        parameter_files: YAML files for the nodes.
        values: Parameters by node name, which win over the files.
        referee_port: UDP port between referee and game input.
        logs: Folder for one log file a node.
        perception: How good node perception is, which then stands in for vision; None for camera and vision.
        strategy: Name of what the robot plays.
        beside: Further nodes to run, as a view.
        wire_port: UDP port between the driver and an emulated body; None for the simulator as the driver.

    Raises:
        BadInputError: if a node refuses what it was given, or the simulator falls silent.
    """
    plan = trial_plan(seed, scenario, record, parameter_files, values, referee_port, perception, strategy, wire_port)
    with (
        Launcher((*plan, *beside), logs) as launcher,
        session(TrialWatcher, arguments=[], handle_signals=False) as (watcher, spin),
    ):
        end: float | None = None
        while end is None or time.monotonic() < end:
            spin(LOOK)
            for line in launcher.poll():
                say(line)
            if progress is not None:
                progress(watcher.stamp * 1e-9, watcher.doing)
            if time.monotonic() - watcher.heard > SILENCE:
                raise BadInputError(f"The simulator has said nothing for {SILENCE:.0f} s; see {launcher.log_folder}.")
            if end is None and watcher.truth is not None and watcher.truth.outcome:
                end = time.monotonic() + ENDING
        truth = watcher.truth
        assert truth is not None
        return TrialSummary(
            mode="graph" if perception is None else f"graph, {NO_CAMERA}",
            seed=seed,
            outcome=truth.outcome,
            time=truth.trial_time,
            touches=truth.touches,
            falls=truth.falls,
            distance_walked=watcher.observer.distance,
            localization_error=watcher.observer.localization_error,
            heading_error=watcher.observer.heading_error,
            real_time_factor=watcher.real_time_factor,
            recording=str(record / f"{record.name}.mcap") if record is not None else "",
        )
