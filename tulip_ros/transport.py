"""Settings of Fast DDS: shared memory large enough for pictures, dead nodes forgotten soon, leftovers removed."""

from __future__ import annotations

import contextlib
import fcntl
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

PROFILE_VARIABLE = "FASTRTPS_DEFAULT_PROFILES_FILE"
SHARED_MEMORY = Path("/dev/shm")
SEGMENT = 17 * 2**20  # [B] one process's shared memory: 16 MiB of messages and what Fast DDS adds
PROCESSES = 12  # of one robot's graph with tools
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


def remove_leftovers() -> None:
    """Remove shared memory of processes that were killed; what a living process holds stays.

    Each killed process leaves 17 MB. Fast DDS's own tool tells by file locks which are dead; without the tool nothing
    happens. The tool misses ports that other processes had open when one was killed: their users were counted, and the
    count never comes to zero, though their owner removed its lock. Such a port that no process maps goes as well.
    """
    own = Path(sys.prefix) / "tools" / "fastdds" / "fastdds.py"
    tool = shutil.which("fastdds")
    command = [sys.executable, str(own)] if own.exists() else [tool] if tool else None
    if command is None or not any(SHARED_MEMORY.glob("fastrtps_*")):
        return
    subprocess.run([*command, "shm", "clean"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
    ports = {path for path in SHARED_MEMORY.glob("fastrtps_port*") if path.name[-1].isdigit()}
    for port in ports - _mapped():
        if not any(SHARED_MEMORY.glob(f"{port.name}_?l")):  # no lock
            for leftover in (port, SHARED_MEMORY / f"sem.{port.name}_mutex"):
                with contextlib.suppress(OSError):  # gone by now, or another user's
                    leftover.unlink()


def remove_dead_segments() -> None:
    """Remove most of what killed processes left, their segments, while others start and end.

    A segment's name is drawn anew for each process, so none that starts can want it. Ports are let be: a node that is
    started again takes up its predecessor's, and if that was removed at this very moment, nobody reaches it any more.
    """
    for path in leftovers():
        lock = path.with_name(f"{path.name}_el")
        if re.fullmatch(r"fastrtps_[0-9a-f]{16}", path.name) and not _is_locked(lock):
            for leftover in (path, lock):
                with contextlib.suppress(OSError):  # gone by now
                    leftover.unlink()


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
    return {path for path in files if re.sub(r"_(el|sl)$", "", path.name) not in mapped}


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
