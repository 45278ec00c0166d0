"""Play a trial of the dribble and kick competition, or a match of two robots; record it, and say who scored and how."""

from __future__ import annotations

import _environment

if __name__ == "__main__":
    import sys

    EXTRAS = {"--view": "view", "mujoco": "mujoco", "--engine=mujoco": "mujoco"}  # that a word of the command needs
    _environment.prepare(tuple(extra for word, extra in EXTRAS.items() if word in sys.argv))

import json
import os
import signal
import sys
from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any

import typer
from _network import Network
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from tulip_driver.wire.links import PORT as WIRE_PORT
from tulip_ros import network
from tulip_ros.errors import EXIT_BAD_INPUT, BadInputError, check_writable, require, unknown
from tulip_ros.picture_rate import PICTURE_RATE, PictureRate
from tulip_ros.plan import Start
from tulip_ros.recorder_node import PICTURES
from tulip_sim.lockstep import Settings
from tulip_sim.lockstep_recording import KINDS, RecordedPictures
from tulip_sim.match_graph import play_graph
from tulip_sim.match_lockstep import play_lockstep
from tulip_sim.match_rules import NAMESPACES, MatchRules
from tulip_sim.match_settings import MatchSettings
from tulip_sim.match_summary import MatchSummary
from tulip_sim.match_two_graph import match_plan, play_match_graph
from tulip_sim.parameters import ENGINES, WorldParameters
from tulip_sim.perception import EYES, PerceptionParameters
from tulip_sim.play_lockstep_match import play_lockstep_match
from tulip_sim.robot_stack import RobotSettings
from tulip_sim.scenario import SCENARIOS
from tulip_sim.trial import TrialSummary
from tulip_strategy.behaviour.tree import STRATEGIES
from tulip_strategy.game_controller import REFEREE_PORT
from tulip_view.live.beside import PORT, address, page_beside

MODES = ("graph", "lockstep")
DRIVERS = ("sim", "wire")
INTERRUPTED = 130  # exit code after Ctrl-C, as shells have it
LONGEST = 155.0  # [s] preparation and 150 s of play


def main(
    seed: Annotated[int, typer.Option(help="Of the scenario and of all noise.", min=0)] = 1,
    mode: Annotated[str, typer.Option(help="graph (nodes as processes) or lockstep (one process)")] = "graph",
    scenario: Annotated[str, typer.Option(help=", ".join(SCENARIOS))] = "trial",
    record: Annotated[Path | None, typer.Option(help="New folder for the recording.")] = None,
    no_record: Annotated[bool, typer.Option("--no-record", help="Record nothing.")] = False,
    json_path: Annotated[Path | None, typer.Option("--json", help="Write the summary to this file.")] = None,
    parameters: Annotated[list[Path] | None, typer.Option(help="YAML file for the nodes (graph); repeatable.")] = None,
    referee_port: Annotated[
        int, typer.Option(help="UDP port of the referee (graph).", min=1, max=65535)
    ] = REFEREE_PORT,
    logs: Annotated[Path | None, typer.Option(help="Folder for one log file a node (graph).")] = None,
    eyes: Annotated[
        str,
        typer.Option(help="camera (pictures and vision), or features made up from the truth: degraded or ideal"),
    ] = "camera",
    engine: Annotated[str, typer.Option(help=f"Physics: {' or '.join(ENGINES)}.")] = WorldParameters.engine,
    pictures: Annotated[
        str,
        typer.Option(
            help=f"The cameras' pictures in the recording: {', '.join(PICTURES)}; in lockstep {', '.join(KINDS)}."
        ),
    ] = "compressed",
    picture_rate: Annotated[
        float, typer.Option(help="Pictures of each camera in a second of the recording; 0 for all.")
    ] = PICTURE_RATE,
    teams: Annotated[
        int, typer.Option(help="1 for a trial against a figure, 2 for a match of two robots.", min=1, max=2)
    ] = 1,
    trials: Annotated[int, typer.Option(help="Of a match, in turns.", min=1)] = MatchRules.trials,
    playing_time: Annotated[float, typer.Option(help="Seconds of each trial of a match.")] = MatchRules.playing_time,
    striker: Annotated[str, typer.Option(help="Strategy of the robot; of a match's striker.")] = MatchSettings.striker,
    keeper: Annotated[str, typer.Option(help="Strategy of a match's goalkeeper.")] = MatchSettings.keeper,
    driver: Annotated[
        str, typer.Option(help="sim, or wire: the body in a process of its own, behind bytes over UDP (graph).")
    ] = "sim",
    wire_port: Annotated[int, typer.Option(help="UDP port of that body.", min=1, max=65535)] = WIRE_PORT,
    view: Annotated[bool, typer.Option("--view", help="Open a page to watch and steer in a browser (graph).")] = False,
    view_port: Annotated[int, typer.Option(help="TCP port of that page.", min=1, max=65535)] = PORT,
    peers: Network = "",
) -> None:
    """Play one trial, or a match of two robots.

    The exit code is 0 after a goal or a whole match, 1 after a trial without a goal, 2 for bad input, 130 after Ctrl-C.
    """
    folder: Path | None = None
    console = Console()
    try:
        if mode not in MODES:
            raise BadInputError(f"--mode is {mode!r}; expected one of {', '.join(MODES)}.")
        if scenario not in SCENARIOS:
            raise unknown("scenario", scenario, SCENARIOS)
        for option, name in (("--striker", striker), ("--keeper", keeper)):
            if name not in STRATEGIES:
                raise BadInputError(f"{option} is {name!r}; expected one of {', '.join(STRATEGIES)}.")
        if eyes not in EYES:
            raise BadInputError(f"--eyes is {eyes!r}; expected one of {', '.join(EYES)}.")
        if engine not in ENGINES:
            raise BadInputError(f"--engine is {engine!r}; expected {' or '.join(ENGINES)}.")
        if engine == "mujoco":
            require("mujoco", "mujoco")
        if driver not in DRIVERS:
            raise BadInputError(f"--driver is {driver!r}; expected one of {', '.join(DRIVERS)}.")
        if driver == "wire" and (mode != "graph" or teams == 2):
            raise BadInputError("--driver wire is for one robot as a graph; expected --mode graph --teams 1.")
        if mode != "graph" and (parameters or logs or view or peers):
            raise BadInputError(
                "--parameters, --logs, --view and --network are for nodes; expected --mode graph with them."
            )
        kinds = tuple(PICTURES) if mode == "graph" else KINDS
        if pictures not in kinds:
            raise BadInputError(f"--pictures is {pictures!r}; expected one of {', '.join(kinds)} in mode {mode}.")
        PictureRate(picture_rate)
        own: dict[str, dict[str, Any]] = {"recorder": {"pictures": pictures, "picture_rate": picture_rate}}
        if engine != WorldParameters.engine:
            own["driver"] = {"world.engine": engine}
        recorded = RecordedPictures(pictures, picture_rate)
        if teams == 2:
            match = match_settings(trials, playing_time, striker, keeper, EYES[eyes], engine)
            if mode == "graph" and EYES[eyes] is not None:
                raise BadInputError("--eyes is for one robot, or for --mode lockstep; expected camera with two.")
        if json_path is not None:
            check_writable(json_path, "--json")
        network.join(peers)
        page = page_beside(view_port, NAMESPACES[0] if teams == 2 else "") if view else ()
        if view:
            console.print(f"watch it at {address(view_port)}", highlight=False)
        folder = None if no_record else record or default_folder(seed, mode if teams == 1 else f"match_{mode}")
        if teams == 2:
            result = play_match(
                seed, mode, match, folder, recorded, parameters or (), own, referee_port, logs, console, page
            )
            report(result.report.verdict, result, console)
            if json_path is not None:
                json_path.write_text(json.dumps(result.as_dict(), indent=2) + "\n")
            return
        with Progress(
            TextColumn("{task.description}", justify="left"),
            BarColumn(bar_width=20),
            TextColumn("{task.completed:5.1f} s of play"),
            TimeElapsedColumn(),
            console=console,
            transient=True,
        ) as bar:
            task = bar.add_task("starting", total=LONGEST)

            def show(time: float, doing: str) -> None:
                bar.update(task, completed=time, description=doing.rsplit(" > ", 1)[-1] or "starting")

            if mode == "graph":
                summary = play_graph(
                    seed,
                    scenario,
                    folder,
                    show,
                    lambda line: console.print(line, highlight=False, markup=False),
                    parameters or (),
                    own,
                    referee_port=referee_port,
                    logs=logs,
                    perception=EYES[eyes],
                    strategy=striker,
                    beside=page,
                    wire_port=wire_port if driver == "wire" else None,
                )
            else:
                beside = (os.cpu_count() or 1) > 1 and EYES[eyes] is None
                settings = Settings(perception=EYES[eyes], world=WorldParameters(engine=engine))
                summary = play_lockstep(seed, scenario, settings, folder, show, beside, striker, recorded)
    except (BadInputError, ValueError) as error:
        print(f"error: {error}", file=sys.stderr)
        raise typer.Exit(EXIT_BAD_INPUT) from None
    except KeyboardInterrupt:
        held = f"; {folder} holds what was played" if folder is not None and folder.exists() else ""
        print(f"stopped{held}", file=sys.stderr)
        raise typer.Exit(INTERRUPTED) from None
    report("GOAL" if summary.scored else "no goal", summary, console)
    if json_path is not None:
        json_path.write_text(json.dumps(summary.as_dict(), indent=2) + "\n")
    raise typer.Exit(0 if summary.scored else 1)


def default_folder(seed: int, mode: str) -> Path:
    """Return a new folder under recordings/."""
    moment = datetime.now().strftime("%Y-%m-%d_%H-%M-%S")
    return _environment.ROOT / "recordings" / f"{moment}_{mode}_{seed}"


def match_settings(
    trials: int, playing_time: float, striker: str, keeper: str, perception: PerceptionParameters | None, engine: str
) -> MatchSettings:
    """Return the settings of a match.

    Raises:
        BadInputError: if they make no match.
    """
    try:
        rules = MatchRules(trials=trials, playing_time=playing_time)
    except ValueError as error:
        raise BadInputError(f"{error}.") from error
    robot = RobotSettings(perception=perception)
    world = WorldParameters(engine=engine)
    return MatchSettings(world=world, rules=rules, robots=(robot, robot), striker=striker, keeper=keeper)


def play_match(
    seed: int,
    mode: str,
    settings: MatchSettings,
    folder: Path | None,
    recorded: RecordedPictures,
    parameters: Sequence[Path],
    values: Mapping[str, Mapping[str, Any]],
    referee_port: int,
    logs: Path | None,
    console: Console,
    page: Sequence[Start],
) -> MatchSummary:
    """Play a match of two robots and print the referee's log as it grows."""
    rules = settings.rules
    seconds = rules.initial_time + rules.ready_time + rules.set_time + rules.playing_time + rules.finished_time
    columns = (TextColumn("{task.description}"), BarColumn(bar_width=20), TextColumn("{task.completed:6.1f} s"))
    with Progress(*columns, TimeElapsedColumn(), console=console, transient=True) as bar:
        task = bar.add_task("starting", total=rules.trials * seconds)

        def show(time: float, doing: str) -> None:
            bar.update(task, completed=time, description=doing)

        def say(line: str) -> None:
            console.print(line, highlight=False, markup=False)

        if mode == "graph":
            ports = (referee_port, referee_port + 2)
            plan = match_plan(seed, rules, folder, parameters, values, ports, settings.striker, settings.keeper)
            return play_match_graph((*plan, *page), seed, folder, show, say, logs)
        beside = (os.cpu_count() or 1) > 1 and all(robot.perception is None for robot in settings.robots)
        return play_lockstep_match(seed, settings, folder, show, say, eyes_beside=beside, recorded=recorded)


def report(verdict: str, summary: TrialSummary | MatchSummary, console: Console) -> None:
    """Print how it ended, and the summary."""
    console.print(f"[bold]{verdict}[/] (seed {summary.seed}, {summary.mode})")
    for name, value in summary.lines():
        console.print(f"{name:<21}{value}", highlight=False, markup=False, soft_wrap=True)


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    typer.run(main)
