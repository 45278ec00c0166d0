"""Check a robot's driver against the contract: rates, units, signs, limits, garbage, time-out, stop."""

from __future__ import annotations

import sys

import _environment

if __name__ == "__main__":
    _environment.prepare(("mujoco",) if "mujoco" in sys.argv else ())

from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from tulip_description.robot import load_robot
from tulip_driver.check.rows import Judgement, Row, verdict
from tulip_driver.check.run import check_driver
from tulip_driver.contract import BodyError
from tulip_driver.loading import flag, make_body, read_options
from tulip_ros.errors import EXIT_BAD_INPUT, BadInputError, unknown

BODIES: dict[str, tuple[str, dict[str, Any]]] = {
    "echo": ("tulip_driver.echo:EchoBody", {}),
    "sim": ("tulip_sim.simulated_body:SimulatedBody", {"harness": True}),
    "mujoco": ("tulip_sim.simulated_body:SimulatedBody", {"harness": True, "engine": "mujoco"}),
    "log": ("tulip_driver.log_body:LogBody", {}),
    "wire": ("tulip_driver.wire.body:WireBody", {}),
}
"""Class of each driver, and the options that it is checked with."""
COLOURS = {Judgement.PASS: "green", Judgement.FAIL: "bold red", Judgement.SKIPPED: "dim"}


def main(
    driver: Annotated[str, typer.Option(help=f"{', '.join(BODIES)}, or package.module:Class.")],
    option: Annotated[
        list[str] | None, typer.Option(help="For the class, as name=value; repeatable. log: file=RECORDING.")
    ] = None,
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask before a real robot moves.")] = False,
) -> None:
    """Check a driver, print a table and a verdict.

    Every joint moves by 3 degrees, and in the end the robot goes limp: let it hang in its harness. The exit code is 0
    if all checks passed, 1 if one failed, 2 for bad input.
    """
    console = Console()
    try:
        if driver not in BODIES and ":" not in driver:
            raise unknown("driver", driver, [*BODIES, "package.module:Class"])
        name, own = BODIES.get(driver, (driver, {}))
        body = make_body(name, load_robot(), own | read_options(option or ()))

        def may_move() -> bool:
            if yes or not flag(body, "hardware"):
                return True
            console.print("Now each joint moves by 3 degrees, and then the robot goes limp. Is it held by its harness?")
            return typer.confirm("Move it?", default=False)

        rows: list[Row] = []
        for row in check_driver(body, load_robot(), may_move):
            rows.append(row)
            if console.is_terminal:
                console.print(
                    f"[dim]{row.what}[/]: [{COLOURS[row.judgement]}]{row.judgement.value}[/]", highlight=False
                )
    except (BodyError, BadInputError) as error:
        print(f"error: {error}", file=sys.stderr)
        raise typer.Exit(EXIT_BAD_INPUT) from None
    table = Table("check", "measured", "expected", "", title=f"Driver {driver}")
    for row in rows:
        colour = COLOURS[row.judgement]
        table.add_row(row.what, row.measured, row.expected, f"[{colour}]{row.judgement.value}[/]")
    console.print(table, highlight=False)
    well, words = verdict(rows)
    console.print(f"[{'bold green' if well else 'bold red'}]{words}[/]", highlight=False)
    raise typer.Exit(0 if well else 1)


if __name__ == "__main__":
    typer.run(main)
