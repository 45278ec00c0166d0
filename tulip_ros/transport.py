"""Settings of Fast DDS: shared memory large enough for pictures, dead nodes forgotten soon, leftovers removed."""

from __future__ import annotations

import contextlib
import fcntl
import os
import re
from pathlib import Path

from tulip_ros.ports import GRAPH_PORTS, own_ports

PROFILE_VARIABLE = "FASTRTPS_DEFAULT_PROFILES_FILE"
SHARED_MEMORY = Path("/dev/shm")
SEGMENT = 17 * 2**20  # [B] one process's shared memory: 16 MiB of messages and what Fast DDS adds
PROCESSES = 12  # of one robot's graph with tools
LOCK = r"_(el|sl)$"  # at the end of the name of a segment's or port's lock
NAMES = ("auto", "shared_memory", "udp")
RANGE_VARIABLE, RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"
"""How far nodes look for others, and are found: DDS knows no password, so this machine alone by default."""


def profile_path(name: str = "auto") -> Path:
    """Return the profile file to use.

    Args:
        name: "shared_memory", "udp", or "auto": shared memory where enough of it is free (a container often has
            64 MB, and a process that touches more is killed).

    Raises:
        ValueError: for another name.
    """
    if name not in NAMES:
        raise ValueError(f"transport is {name!r}; expected one of {', '.join(NAMES)}")
    if name == "auto":
        name = "shared_memory" if _free_shared_memory() > PROCESSES * SEGMENT else "udp"
    return Path(__file__).parent / "transport" / f"{name}.xml"


def use_profile(name: str = "auto") -> None:
    """Make this process and its children use a profile, and stay on this machine.

    What the user's environment says already is left as it is.
    """
    os.environ.setdefault(PROFILE_VARIABLE, str(profile_path(name)))
    os.environ.setdefault(RANGE_VARIABLE, RANGE)


def remove_leftovers(everywhere: bool = False) -> None:
    """Remove shared memory of processes that were killed; what a living process holds stays.

    Each killed process leaves 17 MB. For a launcher, before its nodes start and after they have ended: a node that is
    started again takes up its predecessor's port, and if that is removed at this very moment, nobody reaches the node
    any more. Another launcher may have such a node: ports of other domains stay, but those that all domains share.

    Args:
        everywhere: Remove ports of all domains.
    """
    remove_dead_segments()
    own = own_ports()
    for name in _dead_names():
        number = re.fullmatch(r"fastrtps_port(\d+)", name)
        if number is None or not (everywhere or int(number[1]) in own or int(number[1]) in GRAPH_PORTS):
            continue
        locks = list(SHARED_MEMORY.glob(f"{name}_?l"))
        if not any(map(_is_locked, locks)):
            _remove(name, *(lock.name for lock in locks), f"sem.{name}_mutex")


def remove_dead_segments() -> None:
    """Remove most of what killed processes left, their segments, while others start and end.

    A segment's name is drawn anew for each process, so none that starts can want it.
    """
    for name in _dead_names():
        if re.fullmatch(r"fastrtps_[0-9a-f]{16}", name) and not _is_locked(SHARED_MEMORY / f"{name}_el"):
            _remove(name, f"{name}_el")


def _dead_names() -> set[str]:
    """Return the names of segments and ports that have leftovers, their locks perhaps alone."""
    return {re.sub(LOCK, "", path.name) for path in leftovers()}


def _remove(*names: str) -> None:
    for name in names:
        with contextlib.suppress(OSError):  # gone by now
            (SHARED_MEMORY / name).unlink()


def _is_locked(path: Path) -> bool:
    """Return whether a process holds the lock of what it has in shared memory, in a container of its own perhaps."""
    try:
        with open(path) as file:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:  # held; or not there, so that nothing is known
        return True
    return False


def leftovers() -> set[Path]:
    """Return the files of Fast DDS in shared memory that no living process has open, as far as this user may look."""
    files = {path for path in SHARED_MEMORY.glob("fastrtps_*") if _owner(path) == os.getuid()}
    mapped = {path.name for path in _mapped()}
    return {path for path in files if re.sub(LOCK, "", path.name) not in mapped}


def _owner(path: Path) -> int | None:
    try:
        return path.stat().st_uid
    except OSError:
        return None


def _mapped() -> set[Path]:
    """Return the files of Fast DDS in shared memory that a process has open, as far as this user may look."""
    found: set[Path] = set()
    for maps in Path("/proc").glob("[0-9]*/maps"):
        with contextlib.suppress(OSError):  # ended, or another user's
            found |= {Path(path) for path in re.findall(rf"{SHARED_MEMORY}/fastrtps_\S+", maps.read_text())}
    return found


def _free_shared_memory() -> int:
    try:
        status = os.statvfs(SHARED_MEMORY)
    except OSError:
        return 0
    return status.f_bavail * status.f_frsize
