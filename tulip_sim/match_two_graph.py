"""A match as a ROS 2 graph: two robots, every component a process of its own, one simulator; watched from outside."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from std_msgs.msg import String

from tulip_description.planar import Pose2D
from tulip_description.quaternion import pose_on_ground
from tulip_msgs.msg import Decision, GroundTruth, WorldState
from tulip_ros import topics
from tulip_ros.errors import BadInputError
from tulip_ros.launch import Launcher
from tulip_ros.plan import Start, make_plan
from tulip_ros.run import ComponentNode, session
from tulip_ros.time import stamp_of
from tulip_sim.match_graph import ENDING, LOOK, NODES, SILENCE, refuse_taken
from tulip_sim.match_report import MatchReport
from tulip_sim.match_rules import COLOUR_NAMES, NAMESPACES, STRATEGY_OF, TEAMS, MatchRules, Role
from tulip_sim.match_summary import MatchSummary
from tulip_sim.messages import report_from_message
from tulip_sim.trial import TrialObserver
from tulip_strategy.game_controller import REFEREE_PORT

Progress = Callable[[float, str], None]
"""Is told simulated time [s] and what the robots are doing."""
Values = Mapping[str, Mapping[str, Any]]


class MatchWatcher(ComponentNode):
    """Follows a match from the ground truth and the referee's report; no component that plays."""

    def __init__(self) -> None:
        """Connect."""
        super().__init__("match_watcher")
        self.heard = time.monotonic()
        self.report = MatchReport()
        self.stamp = 0  # [ns]
        self._plays = [False for _ in TEAMS]  # as each robot's last truth says: the two come one after the other
        self.doing = ["", ""]
        self.observers = [TrialObserver() for _ in TEAMS]
        self._first: tuple[float, int] | None = None
        self.listen(topics.REPORT, self._on_report)
        for team, namespace in enumerate(NAMESPACES):
            self.listen(topics.GROUND_TRUTH.within(namespace), self._truth_of(team))
            self.listen(topics.WORLD_STATE.within(namespace), self._estimate_of(team))
            self.listen(topics.DECISION.within(namespace), self._decision_of(team))

    def _on_report(self, message: String) -> None:
        self.report = report_from_message(message)

    def _truth_of(self, team: int) -> Callable[[GroundTruth], None]:
        def on_truth(message: GroundTruth) -> None:
            self.heard, self.stamp = time.monotonic(), stamp_of(message)
            if self._first is None:
                self._first = (self.heard, self.stamp)
            self._plays[team] = message.trial_time > 0.0 and not message.outcome
            if self._plays[team]:
                pose, turn = message.robot.position, message.robot.orientation
                self.observers[team].see_truth(pose_on_ground((pose.x, pose.y), (turn.x, turn.y, turn.z, turn.w)))

        return on_truth

    def _estimate_of(self, team: int) -> Callable[[WorldState], None]:
        def on_estimate(message: WorldState) -> None:
            if self._plays[team]:
                self.observers[team].see_estimate(Pose2D(*(float(value) for value in message.robot_pose)))

        return on_estimate

    def _decision_of(self, team: int) -> Callable[[Decision], None]:
        def on_decision(message: Decision) -> None:
            self.doing[team] = message.tree

        return on_decision

    @property
    def real_time_factor(self) -> float:
        """Simulated time by wall-clock time since the first truth."""
        if self._first is None or self.heard <= self._first[0]:
            return float("nan")
        return (self.stamp - self._first[1]) * 1e-9 / (self.heard - self._first[0])


def match_plan(
    seed: int,
    rules: MatchRules | None = None,
    record: Path | None = None,
    parameter_files: Sequence[Path] = (),
    values: Values | None = None,
    referee_ports: tuple[int, int] = (REFEREE_PORT, REFEREE_PORT + 2),
    striker: str = STRATEGY_OF[Role.STRIKER],
    keeper: str = STRATEGY_OF[Role.KEEPER],
) -> tuple[Start, ...]:
    """Return the nodes of a match: one simulator, two robots, and a recorder if wanted.

    Args:
        seed: Of all that is random.
        rules: Of the match.
        record: New folder for the recording, or None for none.
        parameter_files: YAML files for the nodes, of both robots alike.
        values: Parameters by node name, of both robots alike, which win over the files.
        referee_ports: UDP ports between the referee and the two game inputs.
        striker: Strategy that a striker is told to play.
        keeper: Strategy that a goalkeeper is told to play.

    Raises:
        BadInputError: for files that cannot be used, or that set what the match itself sets.
    """
    rules = rules or MatchRules()
    names = [f"{namespace}/{name}" for namespace in NAMESPACES for name in NODES]
    own: dict[str, dict[str, Any]] = {
        "driver": {
            "seed": seed,
            "referee_port": referee_ports[0],
            "second_referee_port": referee_ports[1],
            "wait_for": names + ["recorder"] * (record is not None),
            "striker": striker,
            "keeper": keeper,
            "rules": {name: list(each) if isinstance(each, tuple) else each for name, each in asdict(rules).items()},
        }
    }
    if record is not None:
        own["recorder"] = {
            "path": str(record.absolute()),
            "robots": list(NAMESPACES),
            "notes": [f"seed={seed}", f"striker={striker}", f"keeper={keeper}", "mode=graph", "robots=2"],
            "wait_for": ["driver", *names],
        }
    refuse_taken(parameter_files, own, "match")
    for name in ("driver", "recorder"):
        own.setdefault(name, {}).update((values or {}).get(name, {}))
    starts = [
        start
        for start in make_plan(["recorder"], "match", parameter_files=parameter_files, values=own)
        if record is not None or start.name != "recorder"
    ]
    for team, namespace in enumerate(NAMESPACES):
        given: dict[str, dict[str, Any]] = {
            "vision": {"opponents": {"team_colour": COLOUR_NAMES[team]}},
            "worldmodel": {"field_turned": team == 1},
            "strategy": {"field_turned": team == 1},
            "game_input": {
                "port": referee_ports[team],
                "reply_port": referee_ports[team],  # the referee is on this machine: it is answered where it sent from
                "team_number": rules.team_numbers[team],
                "player_number": rules.player_number,
                "team_colour": COLOUR_NAMES[team],
            },
        }
        refuse_taken(parameter_files, given, "match")
        for name, block in (values or {}).items():
            if name not in ("driver", "recorder"):
                given.setdefault(name, {}).update(block)
        starts += make_plan(NODES, None, namespace, parameter_files, given, simulated=True)
    return tuple(starts)


def play_match_graph(
    plan: Sequence[Start],
    seed: int,
    record: Path | None = None,
    progress: Progress | None = None,
    say: Callable[[str], None] = print,
    logs: Path | None = None,
) -> MatchSummary:
    """Play one match.

    Args:
        plan: From `match_plan`, for the same seed and recording.
        seed: Of all that is random.
        record: Folder of the recording, or None for none.
        progress: Told several times a second.
        say: Told each line of the referee's log, and what happens to the processes.
        logs: Folder for one log file a node.

    Raises:
        BadInputError: if a node refuses what it was given, or the simulator falls silent.
    """
    with (
        Launcher(plan, logs) as launcher,
        session(MatchWatcher, arguments=[], handle_signals=False) as (watcher, spin),
    ):
        end: float | None = None
        said = 0
        while end is None or time.monotonic() < end:
            spin(LOOK)
            for line in launcher.poll():
                say(line)
            for entry in watcher.report.log[said:]:
                say(str(entry))
            said = len(watcher.report.log)
            if progress is not None:
                trial = watcher.report.log[-1].trial if watcher.report.log else 1
                doing = " | ".join(each.rsplit(" > ", 1)[-1] for each in watcher.doing)
                progress(watcher.stamp * 1e-9, f"trial {trial}: {doing}")
            if time.monotonic() - watcher.heard > SILENCE:
                raise BadInputError(f"The simulator has said nothing for {SILENCE:.0f} s; see {launcher.log_folder}.")
            if end is None and watcher.report.finished:
                end = time.monotonic() + ENDING
        return MatchSummary(
            mode="graph",
            seed=seed,
            report=watcher.report,
            duration=watcher.stamp * 1e-9,
            localization_errors=(watcher.observers[0].localization_error, watcher.observers[1].localization_error),
            real_time_factor=watcher.real_time_factor,
            recording=str(record / f"{record.name}.mcap") if record is not None else "",
        )
