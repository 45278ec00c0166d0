"""Identify the robot's own body from static postures and from motion: run, fit, validate, compare, dynamic."""

from __future__ import annotations

import _environment

if __name__ == "__main__":
    _environment.prepare()

import signal
import sys
from collections.abc import Sequence
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Annotated, NoReturn

import numpy as np
import typer
from _progress import progress
from _rehearsal import REFUSED, may_go
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from tulip_description.body_file import BodySource, read_body, write_body
from tulip_description.robot import Robot, load_robot
from tulip_motion.identification.body_prior import Spread
from tulip_motion.identification.com_identification import IdentificationSettings, identify_com
from tulip_motion.identification.dynamic_body import com_of
from tulip_motion.identification.dynamic_identification import DynamicIdentification, dynamic_prior, identify_dynamics
from tulip_motion.identification.experiment_plan import PlanParameters
from tulip_motion.identification.experiment_settings import ExperimentSettings
from tulip_motion.identification.identification_error import IdentificationError
from tulip_motion.identification.joint_friction import FrictionResult, identify_friction
from tulip_motion.identification.motion_log import MotionLog
from tulip_motion.identification.physical_consistency import as_body, most_probable_body
from tulip_motion.identification.progress import Progress
from tulip_motion.identification.static_measurement import StaticMeasurement
from tulip_motion.identification.validation import Validation
from tulip_motion.identification.validation import validate as validate_body
from tulip_motion.identification.zmp_regressor import ZmpRegressor
from tulip_motion.identification.zmp_rows import ZmpRows, zmp_rows
from tulip_ros.errors import EXIT_BAD_INPUT, BadInputError, check_new_file
from tulip_ros.log_file import files_of
from tulip_sim.identify_graph import run_graph
from tulip_sim.identify_lockstep import run_lockstep
from tulip_sim.rehearsal.experiment import play_experiment
from tulip_sim.rehearsal.present import standing
from tulip_view import identification as tables
from tulip_view.present_sensors import running
from tulip_view.recorded_sensors import motion_log_of
from tulip_view.static_measurements import measurements_of

MODES = ("lockstep", "graph")
INTERRUPTED = 130  # exit code after Ctrl-C, as shells have it

app = typer.Typer(help=__doc__, add_completion=False, no_args_is_help=True)


@app.command()
def run(
    postures: Annotated[int, typer.Option(help="On each foot.", min=9, max=100)] = PlanParameters.postures,
    mode: Annotated[str, typer.Option(help="lockstep (one process) or graph (nodes as processes)")] = MODES[0],
    driver: Annotated[
        str, typer.Option(help="What stands for the body in the graph; 'none' for the real one.")
    ] = "sim",
    body: Annotated[Path | None, typer.Option(help="Body file that is believed; none: robot.yaml.")] = None,
    secret: Annotated[
        int | None, typer.Option(help="Seed of another body that the simulated robot has, untold.", min=0)
    ] = None,
    seed: Annotated[int, typer.Option(help="Of all noise in the simulation.", min=0)] = 1,
    record: Annotated[Path | None, typer.Option(help="New folder for the recording.")] = None,
    rehearse: Annotated[
        bool, typer.Option("--rehearse", help="First do it in the simulator; do not begin if it fails.")
    ] = False,
    anyway: Annotated[bool, typer.Option("--anyway", help="Begin all the same if it fails.")] = False,
) -> None:
    """Drive the robot through postures on one foot, then on the other, and record it.

    The robot stands free on level ground. Ctrl-C makes it put its foot down and stand (graph). The exit code is 0 if
    every posture was held, 1 if some were not or the rehearsal failed, 2 for bad input, 130 after Ctrl-C.
    """
    console = Console()
    try:
        if mode not in MODES:
            raise BadInputError(f"--mode is {mode!r}; expected one of {', '.join(MODES)}.")
        settings = ExperimentSettings("" if body is None else str(body.absolute()), PlanParameters(postures))
        if anyway and not rehearse:
            raise BadInputError("--anyway is for a rehearsal; give --rehearse with it.")
        if rehearse:
            runs = mode == "graph" and driver == "none"
            present = running(load_robot()) if runs else standing(load_robot())
            if not may_go(partial(play_experiment, settings, present), f"{2 * postures} postures", anyway):
                raise typer.Exit(REFUSED)
        folder = record or Path("recordings") / f"{datetime.now():%Y%m%d_%H%M%S}_identify"
        with progress() as bar:
            task = bar.add_task("planning", total=2 * postures)

            def show(now: Progress) -> None:
                doing = f"{now.doing} {now.posture + 1} of {now.postures}" if now.posture >= 0 else now.doing
                bar.update(task, completed=now.held, description=f"{doing}, {now.seconds_left:.0f} s left")

            if mode == "graph":
                end = run_graph(settings, driver, seed, folder, show, console.print, secret)
            else:
                end = run_lockstep(settings, seed, folder, show, secret)
    except (BadInputError, ValueError) as error:
        _refuse(error)
    except KeyboardInterrupt:
        print("stopped", file=sys.stderr)
        raise typer.Exit(INTERRUPTED) from None
    console.print(f"held {end.held} of {end.postures} postures")
    if end.left_out:
        console.print(f"not still: {', '.join(str(number + 1) for number in end.left_out)}")
    if end.reason:
        console.print(f"aborted: {end.reason}")
    console.print(f"recording: {files_of(folder)[0]}", soft_wrap=True, highlight=False)
    raise typer.Exit(0 if end.held == end.postures else 1)


@app.command()
def fit(
    recording: Annotated[Path, typer.Argument(help="Of the experiment: a folder, or a file in it.")],
    output: Annotated[Path, typer.Option(help="Body file to write.")] = Path("body.yaml"),
    body: Annotated[Path | None, typer.Option(help="Body file that is believed; none: robot.yaml.")] = None,
    aside: Annotated[int, typer.Option(help="Postures that are kept aside to validate a first fit.", min=0)] = 8,
    unlisted: Annotated[float, typer.Option(help="[kg] that each link may bear beside.", min=0.0)] = 0.0,
    robot: Annotated[str, typer.Option(help="Namespace in the recording.")] = "",
    force: Annotated[bool, typer.Option("--force", help="Replace the output.")] = False,
) -> None:
    """Fit masses and CoMs to a recording, simulated or of the real robot, and write a body file.

    The exit code is 0 if a body was found and written, 2 if the recording is refused; then it says why.
    """
    console = Console()
    try:
        check_new_file(output, "--output", force)
        believed = _robot(body)
        settings = IdentificationSettings(spread=Spread(unlisted=unlisted))
        measured = _measured(recording, believed, robot)
        if aside:
            _tell_validation(console, _held_aside(believed, measured, settings, aside))
        found = identify_com(believed, measured, settings)
        whole = most_probable_body(found)
        write_body(output, as_body(found, whole, BodySource(recording.name, _day(recording), found.postures)))
    except (BadInputError, ValueError) as error:
        _refuse(error)
    _print_table(console, "What the postures tell", tables.BASE_HEADINGS, tables.base_rows(found))
    _print_table(console, "The most probable body with it", tables.LINK_HEADINGS, tables.link_rows(found, whole))
    x, y = (1e3 * tables.com_difference(found.prior, whole.robot)).tolist()
    console.print(f"mass              {found.mass:.2f} kg (believed: {believed.mass:.2f} kg)")
    console.print(f"CoM               was off by {x:.1f} mm forwards, {y:.1f} mm sideways (RMS of all postures)")
    about_x, about_y = (1e3 * found.mount).tolist()
    console.print(f"IMU               mounted askew by {about_x:+.1f} mrad about x, {about_y:+.1f} mrad about y")
    console.print(f"left over         {1e3 * found.model_error:.2f} mm of each CoP, beside the cells' noise")
    console.print(f"written           {output}", soft_wrap=True, highlight=False)


@app.command()
def validate(
    recording: Annotated[Path, typer.Argument(help="Of postures that the body was not fitted to.")],
    body: Annotated[Path, typer.Argument(help="Body file.")],
    robot: Annotated[str, typer.Option(help="Namespace in the recording.")] = "",
) -> None:
    """Foretell the CoP of other postures with a body file, beside robot.yaml.

    The exit code is 0 if the body foretells them better and its covariance is not too small for what is left, 1 if not,
    2 for bad input.
    """
    console = Console()
    try:
        identified, prior = read_body(body), load_robot()
        measured = _measured(recording, identified.on(prior), robot)
        found = validate_body(
            prior,
            identified.base_values,
            identified.base_covariance,
            identified.model_error,
            measured,
            IdentificationSettings(),
        )
    except (BadInputError, ValueError) as error:
        _refuse(error)
    _tell_validation(console, found)
    raise typer.Exit(1 if found.too_sure or found.rms > found.prior_rms else 0)


@app.command()
def compare(
    first: Annotated[Path, typer.Argument(help="Body file.")],
    second: Annotated[Path | None, typer.Argument(help="Another one; none: robot.yaml.")] = None,
) -> None:
    """Tell by what two bodies differ: the CoM over all postures, and each base parameter."""
    console = Console()
    try:
        files = [read_body(path) for path in (first, second) if path is not None]
        bodies = [_robot(first), _robot(second)]
    except ValueError as error:
        _refuse(error)
    covariance = np.sum([file.base_covariance for file in files], axis=0)
    rows = tables.difference_rows(bodies[0], bodies[1], covariance)
    _print_table(console, f"{first} and {second or 'robot.yaml'}", tables.DIFFERENCE_HEADINGS, rows)
    x, y = (1e3 * tables.com_difference(bodies[0], bodies[1])).tolist()
    console.print(f"mass {bodies[0].mass:.2f} kg and {bodies[1].mass:.2f} kg")
    console.print(f"CoM differs by {x:.2f} mm forwards, {y:.2f} mm sideways (RMS of {tables.POSTURES} postures)")


@app.command()
def dynamic(
    recordings: Annotated[list[Path], typer.Argument(help="Of squats, sways, swings of a leg, walks; or of `run`.")],
    output: Annotated[Path | None, typer.Option(help="Body file to write; none: only tell.")] = None,
    body: Annotated[Path | None, typer.Option(help="Body file that is believed; none: robot.yaml.")] = None,
    robot: Annotated[str, typer.Option(help="Namespace in the recordings.")] = "",
    force: Annotated[bool, typer.Option("--force", help="Replace the output.")] = False,
) -> None:
    """Tell what motion adds: inertial parameters by the ZMP equation against the CoP, and the joints' friction.

    The exit code is 0 if the motion told a body, 2 if the recordings are refused; then it says why.
    """
    console = Console()
    try:
        if output is not None:
            check_new_file(output, "--output", force)
        regressor = ZmpRegressor(_robot(body))
        with progress() as bar:
            task = bar.add_task("reading", total=len(recordings) + 2)
            logs, rows = [], []
            for path in recordings:
                logs.append(motion_log_of(path, robot))
                rows.append(_zmp_rows(path, regressor, logs[-1]))
                bar.advance(task)
            bar.update(task, description="fitting")
            found = identify_dynamics(regressor, rows)
            bar.update(task, description="friction", advance=1)
            friction, no_friction = _friction(regressor, logs, found)
        if output is not None:
            com = com_of(found)
            source = BodySource(", ".join(path.name for path in recordings), _day(recordings[-1]), 0)
            write_body(output, as_body(com, most_probable_body(com), source))
    except (BadInputError, ValueError) as error:
        _refuse(error)
    _print_table(console, "What motion tells [kg, kg m, kg m^2]", tables.DYNAMIC_HEADINGS, tables.dynamic_rows(found))
    if friction is not None:
        title = "Friction of the joints [N m], viscous by speed [N m s/rad]"
        _print_table(console, title, tables.FRICTION_HEADINGS, tables.friction_rows(friction))
        for name, reason in friction.refused.items():
            console.print(f"{name:<17} {reason}", highlight=False)
    else:
        console.print(f"friction          not told: {no_friction}", highlight=False)
    believed = dynamic_prior(regressor.robot).mean
    for path, row in zip(recordings, rows, strict=True):
        before, after = (1e3 * row.rms_error(parameters) for parameters in (believed, found.all_parameters))
        told = f"ZMP               off by {after:.1f} mm (RMS), before {before:.1f} mm: {path.name}"
        console.print(told, soft_wrap=True, highlight=False)
    mass, deviation = found.mass
    console.print(f"mass              {mass:.2f} kg +- {deviation:.2f} (believed: {regressor.robot.mass:.2f} kg)")
    along, across = (100.0 * found.cells[:2]).tolist()
    console.print(
        f"CoP               {along:.0f} % farther out along the soles than the cells show, {across:.0f} % across"
    )
    if output is not None:
        console.print(f"written           {output}", soft_wrap=True, highlight=False)


def _robot(body: Path | None) -> Robot:
    return load_robot() if body is None else load_robot(body=body)


def _measured(recording: Path, robot: Robot, namespace: str) -> list[StaticMeasurement]:
    with progress() as bar:
        task = bar.add_task("averaging", total=None)
        found = measurements_of(recording, robot, namespace, lambda number: bar.advance(task, number))
    return [measurement for _, measurement in found]


def _zmp_rows(path: Path, regressor: ZmpRegressor, log: MotionLog) -> ZmpRows:
    try:
        return zmp_rows(regressor, log)
    except ValueError as error:
        raise BadInputError(f"Recording {path}: {error}.") from error


def _friction(
    regressor: ZmpRegressor, logs: Sequence[MotionLog], found: DynamicIdentification
) -> tuple[FrictionResult | None, str]:
    """Return the friction of the joints, or why the recordings do not tell it: the body they told stays."""
    try:
        return identify_friction(regressor, logs, found.prior), ""
    except IdentificationError as error:
        return None, str(error)


def _day(recording: Path) -> str:
    """Return the day of a recording."""
    return datetime.fromtimestamp(files_of(recording)[0].stat().st_mtime).date().isoformat()


def _held_aside(
    robot: Robot, measured: Sequence[StaticMeasurement], settings: IdentificationSettings, count: int
) -> Validation:
    """Fit to most postures and foretell the others, which are spread evenly over the experiment."""
    others = set(np.linspace(0, len(measured) - 1, min(count, len(measured))).round().astype(int).tolist())
    fitted = identify_com(robot, [each for index, each in enumerate(measured) if index not in others], settings)
    return validate_body(
        robot,
        fitted.values,
        fitted.covariance,
        fitted.model_error,
        [measured[index] for index in sorted(others)],
        settings,
    )


def _tell_validation(console: Console, found: Validation) -> None:
    low, high = found.bounds
    console.print(
        f"foretold CoP of {len(found.residuals)} other postures: off by {1e3 * found.rms:.2f} mm (RMS),"
        f" before {1e3 * found.prior_rms:.2f} mm"
    )
    verdict = "too small" if found.too_sure else "honest" if found.nees >= low else "too large, as for fitted postures"
    console.print(f"covariance {verdict}: NEES {found.nees:.2f}, expected {low:.2f} to {high:.2f}")


def _print_table(console: Console, title: str, headings: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    table = Table(*map(escape, headings), title=title)
    for row in rows:
        table.add_row(*row)
    console.print(table)


def _refuse(error: Exception) -> NoReturn:
    print(f"error: {error}", file=sys.stderr)
    raise typer.Exit(EXIT_BAD_INPUT) from None


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    app()
