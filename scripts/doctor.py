"""Check the installation and the running graph, and say what is wrong and how to mend it.

Exit code: 0 all well, 1 warnings, 2 errors. Nothing is changed without --mend.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import textwrap
from collections.abc import Sequence

import _environment
from _installation import ERROR, OK, WARNING, Found, check_all, interpreter

sys.path.insert(0, str(_environment.ROOT))  # where nothing is installed, the packages lie there

from tulip_ros import network
from tulip_ros.errors import BadInputError

EXIT_CODES = {OK: 0, WARNING: 1, ERROR: 2}
COLOURS = {OK: "32", WARNING: "33", ERROR: "31"}
START = 60.0  # [s] that ROS may take to start and to end


def main(arguments: Sequence[str]) -> int:
    """Run the checks that were asked for and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", choices=("installation", "graph"), help="check this alone")
    parser.add_argument("--seconds", type=float, default=3.0, help="how long to listen to the graph (default 3)")
    parser.add_argument(
        "--mend",
        action="store_true",
        help="make or update .venv if it needs that, and remove what dead processes left in shared memory",
    )
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.add_argument(network.OPTION, default="", metavar=network.METAVAR, help=network.HELP)
    chosen = parser.parse_args(arguments)
    try:
        network.join(chosen.network)
    except BadInputError as error:
        print(f"error: {error}", file=sys.stderr)
        return EXIT_CODES[ERROR]
    if chosen.mend:
        mend()
    found: list[Found] = []
    if chosen.only != "graph":
        found += check_all()
    if chosen.only != "installation":
        found += graph(chosen.seconds)
    level = max((each.level for each in found), key=lambda each: EXIT_CODES[each], default=OK)
    if chosen.json:
        print(json.dumps({"worst": level, "findings": [each._asdict() for each in found]}, indent=2))
    else:
        show(found)
    return EXIT_CODES[level]


def mend() -> None:
    """Do what can be done without asking: the environment, and shared memory that nobody uses any more."""
    try:
        if not os.environ.get("TULIP_NO_VENV") and not _environment.is_ready():
            _environment.check_machine()
            _environment.set_up(())
        subprocess.run(
            [interpreter(), "-c", "from tulip_ros import transport; transport.remove_leftovers(everywhere=True)"],
            check=False,
        )
    except (_environment.SetupError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)  # the checks tell what is left


def graph(seconds: float) -> list[Found]:
    """Return what is found in the running graph. It is looked at by another process: ROS may be what is broken."""
    part = "graph"
    if not shutil.which(interpreter()):
        return [Found(ERROR, part, "it cannot be looked at before the installation is mended")]
    variables = dict(os.environ) if os.environ.get("TULIP_NO_VENV") else _environment.clean_variables()
    try:
        done = subprocess.run(
            [interpreter(), "-W", "ignore", "-m", "tulip_ros.graph_doctor", str(seconds)],
            env=variables,
            capture_output=True,
            timeout=seconds + START,
            text=True,
        )
        return [Found(*each) for each in json.loads(done.stdout)]
    except subprocess.TimeoutExpired:
        return [Found(ERROR, part, f"ROS does not start and end within {START:.0f} s: mend the installation first")]
    except ValueError:
        reason = (done.stderr.strip().splitlines() or ["it ended without a word"])[-1]
        return [Found(ERROR, part, f"ROS does not start: {reason}")]


def show(found: Sequence[Found]) -> None:
    """Print a table: level, what it is about, what is wrong and what to do."""
    on_terminal = sys.stdout.isatty()
    first, second = (max([len(each[column]) for each in found] or [0]) + 2 for column in (0, 1))
    width = max(40, shutil.get_terminal_size((120, 24)).columns - first - second)
    for each in found:
        level = each.level.ljust(first)
        if on_terminal:
            level = f"\033[{COLOURS[each.level]}m{level}\033[0m"
        lines = textwrap.wrap(each.words, width, break_long_words=False) or [""]
        print(f"{level}{each.part.ljust(second)}{lines[0]}")
        for line in lines[1:]:
            print(" " * (first + second) + line)


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
