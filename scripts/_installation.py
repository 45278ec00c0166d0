"""What may be wrong with a machine and an installation. Standard library only: it must run where nothing is installed.

Each check returns findings as (level, part, words): "ok", "warning" or "error"; what it is about; and what is wrong
and how to mend it. This file keeps to the syntax of old Pythons, as `_environment` does.
"""

from __future__ import annotations

import os
import re
import shutil
import socket
import subprocess
import sys
from pathlib import Path
from typing import Callable, Iterator, Mapping, NamedTuple, Sequence, Tuple  # noqa: UP035

import _environment

OK, WARNING, ERROR = "ok", "warning", "error"

MODULES = ("rclpy", "tulip_msgs.msg", "pinocchio", "pybullet", "cv2", "numba", "mcap", "textual", "py_trees")
"""What an installation consists of: if these can be imported, it is whole."""
IMPORT_TIME = 120.0  # [s] for all of them on a slow disk
ROOM = 2**30  # [B] of disk: a recording of a match takes 0.5 GB
MEMORY = int(1.5 * 2**30)  # [B] that the graph of a robot and its simulator take
CORES = 2  # physics and vision together fill more than one

RMW = "rmw_fastrtps_cpp"  # the one in the wheels
JAZZY = "jazzy"
HIGHEST_DOMAIN, SAFE_DOMAINS = 232, range(102)
"""Above 101 the ports collide with those that Linux gives out by itself."""
RANGES = ("SUBNET", "LOCALHOST", "OFF", "SYSTEM_DEFAULT")
EXECUTORS = ("events", "single")


class Port(NamedTuple):
    """A port that a program of this project listens on.

    Attributes:
        kind: "UDP" or "TCP".
        number: Its number.
        purpose: What for.
        holders: Of which one is in the command line of that program.
        other: How to have it listen on another port.
    """

    kind: str
    number: int
    purpose: str
    holders: Tuple[str, ...]  # noqa: UP006
    other: str


PORTS = (
    Port("UDP", 3838, "packets of the referee", ("game_input_node",), "set the parameter port of game_input"),
    Port("TCP", 8080, "the page (view)", ("live.view_node", "scripts/view.py"), "choose another with --port"),
    Port("TCP", 8765, "the bridge for Foxglove", ("bridge_node", "scripts/bridge.py"), "choose another with --port"),
)
SOCKETS = {"UDP": (socket.SOCK_DGRAM, "/proc/net/udp", ""), "TCP": (socket.SOCK_STREAM, "/proc/net/tcp", "0A")}
"""Of each kind its type, where Linux lists them, and the state in which one listens."""


class Found(NamedTuple):
    """One finding: level, part and words."""

    level: str
    part: str
    words: str


def check_all() -> list[Found]:
    """Return everything found about this machine and installation."""
    checks: tuple[Callable[[], Iterator[Found]], ...] = (
        python,
        environment,
        disk,
        memory,
        shared_memory,
        lambda: variables(os.environ),
        ports,
        optional,
    )
    return [found for check in checks for found in check()]


def interpreter() -> str:
    """Return the Python that the scripts run in."""
    if os.environ.get("TULIP_NO_VENV"):
        return sys.executable
    return str(_environment.ENVIRONMENT / "bin" / "python")


def python() -> Iterator[Found]:
    """Check Python, the system and the tools that compile the messages."""
    version = ".".join(map(str, sys.version_info[:3]))
    try:
        _environment.check_machine()
        yield Found(OK, "Python", f"{version} at {sys.executable}")
    except _environment.SetupError as error:
        yield Found(ERROR, "Python", str(error))
    try:
        _environment.check_tools()
        yield Found(OK, "compiler", "there, with Python's headers")
    except _environment.SetupError as error:
        needed = not (os.environ.get("TULIP_NO_VENV") or _environment.is_ready())
        yield Found(ERROR if needed else WARNING, "compiler", str(error))


def environment() -> Iterator[Found]:
    """Check that .venv is whole and belongs to the code as it is now."""
    if os.environ.get("TULIP_NO_VENV"):
        yield Found(OK, ".venv", f"not used: TULIP_NO_VENV is set, so {sys.executable} runs the scripts")
    else:
        note, folder = _environment.read_note(), _environment.ENVIRONMENT
        again = "run any script, or this one with --mend"
        if not folder.exists():
            yield Found(ERROR, ".venv", f"there is none yet: {again}")
            return
        if note is None:
            yield Found(ERROR, ".venv", "it was not made by these scripts: move it away, then run any script")
            return
        if note.get("state") != "ready":
            yield Found(ERROR, ".venv", f"its making was interrupted: {again}")
            return
        if not _environment.runs():
            yield Found(ERROR, ".venv", f"its Python does not start, the system's was replaced: {again}")
            return
        if note.get("fingerprint") != _environment.fingerprint():
            yield Found(WARNING, ".venv", f"dependencies or messages changed since it was made: {again}")
        else:
            extras = ", ".join(map(str, note.get("extras", []))) or "none"  # type: ignore[call-overload]
            yield Found(OK, ".venv", f"complete and up to date; extras: {extras}")
    yield imports()


def imports() -> Found:
    """Check that the libraries can be imported."""
    program = "\n".join(
        [
            "import importlib",
            f"for name in {MODULES!r}:",
            "    print(name, flush=True)",
            "    importlib.import_module(name)",
        ]
    )
    try:
        done = subprocess.run(
            [interpreter(), "-W", "ignore", "-c", program],
            env=_environment.clean_variables() if not os.environ.get("TULIP_NO_VENV") else None,
            capture_output=True,
            timeout=IMPORT_TIME,
            text=True,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return Found(ERROR, "libraries", f"they cannot be imported: {error}")
    if done.returncode == 0:
        return Found(OK, "libraries", f"all can be imported ({', '.join(name.split('.')[0] for name in MODULES)})")
    name = (done.stdout.split() or ["?"])[-1]
    reason = (done.stderr.strip().splitlines() or ["it ended without a word"])[-1]
    return Found(
        ERROR,
        "libraries",
        f"{name} cannot be imported ({reason}): remove .venv and run any script, which makes it anew",
    )


def disk() -> Iterator[Found]:
    """Check the room for recordings."""
    free = shutil.disk_usage(str(_environment.ROOT)).free
    words = f"{free / 2**30:.1f} GiB free"
    if free < ROOM:
        yield Found(WARNING, "disk", f"{words}: a recording of a match takes half of one; remove old recordings")
    else:
        yield Found(OK, "disk", words)


def memory() -> Iterator[Found]:
    """Check memory and processor cores."""
    match = re.search(r"MemAvailable:\s+(\d+) kB", _read(Path("/proc/meminfo")))
    if match:
        free = int(match.group(1)) * 1024
        words = f"{free / 2**30:.1f} GiB free"
        if free < MEMORY:
            words += f": robot and simulator take {MEMORY / 2**30:.1f}; end other programs"
        yield Found(WARNING if free < MEMORY else OK, "memory", words)
    cores = len(os.sched_getaffinity(0))
    words = f"{cores} core{'s' if cores != 1 else ''}"
    if cores < CORES:
        yield Found(WARNING, "processor", f"{words}: the simulation will run slower than real time, not worse")
    else:
        yield Found(OK, "processor", words)


def shared_memory() -> Iterator[Found]:
    """Check the room that pictures go through, and what dead processes left there."""
    from tulip_ros import transport

    try:
        status = os.statvfs(str(transport.SHARED_MEMORY))
    except OSError:
        yield Found(WARNING, "shared memory", f"there is no {transport.SHARED_MEMORY}: messages go by UDP, more slowly")
        return
    free, wanted = status.f_bavail * status.f_frsize, transport.PROCESSES * transport.SEGMENT
    if free < wanted:
        yield Found(
            WARNING,
            "shared memory",
            f"{free / 2**20:.0f} MiB free in {transport.SHARED_MEMORY}, expected {wanted / 2**20:.0f}: messages go by"
            " UDP, more slowly; in a container give it more (docker run --shm-size=1g)",
        )
    else:
        yield Found(OK, "shared memory", f"{free / 2**20:.0f} MiB free")
    left = transport.leftovers()
    if left:
        size = sum(path.stat().st_size for path in left if path.exists())
        yield Found(
            WARNING,
            "shared memory",
            f"{len(left)} files of dead processes hold {size / 2**20:.0f} MiB: remove them with --mend",
        )


def variables(values: Mapping[str, str]) -> Iterator[Found]:
    """Check the environment variables that change how ROS works.

    Args:
        values: The variables.
    """
    found = list(_disturbing(values))
    yield from found
    if not found:
        domain, reach = values.get("ROS_DOMAIN_ID", "0"), values.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        yield Found(OK, "ROS variables", f"domain {domain}, discovery range {reach}")


def _disturbing(values: Mapping[str, str]) -> Iterator[Found]:
    part = "ROS variables"
    rmw = values.get("RMW_IMPLEMENTATION", "")
    if rmw not in ("", RMW):
        yield Found(ERROR, part, f"RMW_IMPLEMENTATION is {rmw}; only {RMW} is installed: unset it")
    distribution = values.get("ROS_DISTRO", "")
    if distribution not in ("", JAZZY):
        yield Found(
            WARNING,
            part,
            f"ROS {distribution} is sourced; this is {JAZZY}: use a new terminal without it for the scripts",
        )
    if "/opt/ros" in values.get("PYTHONPATH", "") and values.get("TULIP_NO_VENV"):
        yield Found(WARNING, part, "PYTHONPATH holds another ROS, and TULIP_NO_VENV lets it in: unset one of them")
    domain = values.get("ROS_DOMAIN_ID", "")
    if domain and not (domain.isdigit() and int(domain) <= HIGHEST_DOMAIN):
        yield Found(ERROR, part, f"ROS_DOMAIN_ID is {domain!r}; expected a number from 0 to 101")
    elif domain and int(domain) not in SAFE_DOMAINS:
        yield Found(
            WARNING,
            part,
            f"ROS_DOMAIN_ID is {domain}; above 101 its ports may be taken by other programs: choose 0 to 101",
        )
    profile = values.get("FASTRTPS_DEFAULT_PROFILES_FILE") or values.get("FASTDDS_DEFAULT_PROFILES_FILE", "")
    reach = values.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "")
    if reach not in ("", *RANGES):
        yield Found(
            WARNING,
            part,
            f"ROS_AUTOMATIC_DISCOVERY_RANGE is {reach}; expected one of {', '.join(RANGES)}: it is ignored",
        )
    elif reach == "OFF" and not values.get("ROS_STATIC_PEERS"):
        yield Found(ERROR, part, "ROS_AUTOMATIC_DISCOVERY_RANGE is OFF: nodes do not find each other; set LOCALHOST")
    if not profile and (reach in ("SUBNET", "SYSTEM_DEFAULT") or values.get("ROS_STATIC_PEERS")):
        yield Found(
            WARNING,
            part,
            "ROS_AUTOMATIC_DISCOVERY_RANGE or ROS_STATIC_PEERS looks beyond this machine, but the transport's profile"
            " keeps to it: use option --network in their place",
        )
    if values.get("ROS_DISCOVERY_SERVER"):
        yield Found(WARNING, part, "ROS_DISCOVERY_SERVER is set: without that server nodes do not find each other")
    if profile and not Path(profile).exists():
        yield Found(
            ERROR, part, f"the profile of Fast DDS {profile} does not exist: unset FASTRTPS_DEFAULT_PROFILES_FILE"
        )
    if values.get("ROS_SECURITY_ENABLE", "").lower() == "true":
        yield Found(WARNING, part, "ROS_SECURITY_ENABLE is true: nodes without keys do not start; unset it")
    executor = values.get("TULIP_EXECUTOR", "")
    if executor not in ("", *EXECUTORS):
        yield Found(ERROR, part, f"TULIP_EXECUTOR is {executor}; expected {' or '.join(EXECUTORS)}")


def ports(wanted: Sequence[Port] = PORTS) -> Iterator[Found]:
    """Check that the ports that the programs listen on are free, or held by them."""
    for port in wanted:
        part = f"{port.kind} port {port.number}"
        with socket.socket(socket.AF_INET, SOCKETS[port.kind][0]) as probe:
            if port.kind == "TCP":  # a connection that has ended a moment ago does not keep a server from it
                probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind(("127.0.0.1", port.number))
                yield Found(OK, part, f"free for {port.purpose}")
                continue
            except OSError:
                pass
        holder = _holder(port)
        if any(words in holder for words in port.holders):
            yield Found(OK, part, f"held by a running program of this project, for {port.purpose}")
        else:
            who = f"by `{holder}`" if holder else "by another user's program"
            yield Found(WARNING, part, f"taken {who}, wanted for {port.purpose}: end that program, or {port.other}")


def optional() -> Iterator[Found]:
    """Tell what is optional and not there."""
    browsers = [name for name in _environment.BROWSERS if shutil.which(name)]
    if browsers:
        yield Found(OK, "browser", f"{browsers[0]}, for the pages of view and report")
    else:
        yield Found(OK, "browser", "none here: open the pages in a browser of another machine; their tests are skipped")


def _holder(port: Port) -> str:
    """Return the command line of the own process that holds a port of this machine, or ""."""
    _, table, listens = SOCKETS[port.kind]
    inodes = set()
    for line in _read(Path(table)).splitlines()[1:]:
        fields = line.split()
        if len(fields) > 9 and int(fields[1].rpartition(":")[2], 16) == port.number and listens in ("", fields[3]):
            inodes.add(f"socket:[{fields[9]}]")
    for process in Path("/proc").glob("[0-9]*"):
        try:
            if any(os.readlink(str(entry)) in inodes for entry in (process / "fd").iterdir()):
                return _read(process / "cmdline").replace("\0", " ").strip()
        except OSError:
            continue
    return ""


def _read(path: Path) -> str:
    try:
        return path.read_text(errors="replace")
    except OSError:
        return ""
