"""Makes and updates the environment `.venv` that every script runs in. Standard library only.

Each script starts with

    import _environment
    _environment.prepare()

On first use this checks what the machine lacks, makes `.venv`, installs the project into it (editable: a change in
the code has effect at once) and runs the script again inside. Afterwards it only compares a fingerprint of the files
that the installation depends on. With TULIP_NO_VENV set, the present Python is used as it is.

This file keeps to the syntax of old Pythons, so that they can say why they do not fit.
"""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import json
import os
import platform
import re
import shutil
import subprocess
import sys
import sysconfig
import time
from pathlib import Path
from types import TracebackType
from typing import IO, Dict, Iterator, List, NoReturn, Optional, Sequence, Type  # noqa: UP035

ROOT = Path(__file__).resolve().parent.parent
ENVIRONMENT = ROOT / ".venv"
LOG = ROOT / "build" / "setup.log"
LOCK = ROOT / "build" / "setup.lock"
NOTE = "tulip-environment.json"

OLDEST, NEWEST = (3, 11), (3, 13)  # rclpy has wheels for these
SPACE = 3 * 2**30  # [B] the environment takes 1.6 GiB, the build some more for a while
EXIT = 2

OTHER_ENVIRONMENTS = (
    "LD_LIBRARY_PATH",  # the ROS wheels set these two for their own Python
    "_ROS_WHEELS_BOOTSTRAP_COMPLETE",
    "PYTHONPATH",  # a sourced ROS installation puts packages of another Python there
    "PYTHONHOME",
    "AMENT_PREFIX_PATH",
    "CMAKE_PREFIX_PATH",
    "COLCON_PREFIX_PATH",
)

LAST = 3000  # characters of a failed step's output in which the failure itself is
INTERFACE_FILES = (".msg", ".srv", ".action", ".txt", ".xml")

NO_NETWORK = re.compile(
    r"NewConnectionError|name resolution|Failed to establish a new connection|Connection refused|Network is unreachable"
    r"|ConnectTimeout|ReadTimeout|ProxyError|Connection reset|Connection aborted|No route to host"
)
NO_PACKAGE = re.compile(r"No matching distribution found for (\S+)")
NO_SPACE = re.compile(r"No space left on device|Disk quota exceeded")


class SetupError(Exception):
    """The environment cannot be made; the message names the cause and the remedy."""


BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
"""What tests of pages run in, where one is installed; they are skipped elsewhere."""


def prepare(extras: Sequence[str] = ()) -> None:
    """Return inside a complete environment; otherwise make it and run the script again in it.

    Args:
        extras: Extras of the project that the script needs, as in ("test",).
    """
    sys.excepthook = tell
    if os.environ.get("TULIP_NO_VENV"):
        return
    try:
        complete = is_ready(extras)
        if not complete:
            check_machine()
            set_up(extras)
    except SetupError as error:
        stop(str(error))
    except KeyboardInterrupt:
        stop("Set-up interrupted; the next start begins it anew.")
    except OSError as error:
        stop(f"Set-up failed: {error}. Check that {ROOT} can be written and has space.")
    if not complete or Path(sys.prefix).resolve() != ENVIRONMENT.resolve():
        python = str(ENVIRONMENT / "bin" / "python")
        sys.stdout.flush()
        os.execve(python, [python, *sys.argv], clean_variables())


def tell(kind: Type[BaseException], error: BaseException, trace: Optional[TracebackType]) -> None:  # noqa: UP006, UP045
    """Say in one line what is wrong with gait.yaml or colours.yaml: imports read them, where no script can catch it."""
    if kind.__name__ in ("GaitFileError", "ColourFileError"):
        sys.stderr.write(f"error: {error}\n")
        sys.stderr.flush()
        os._exit(EXIT)  # after the hook, Python would end with 1
    sys.__excepthook__(kind, error, trace)


def stop(message: str) -> NoReturn:
    """Say what is wrong and end with exit code 2."""
    sys.stderr.write(f"error: {message}\n")
    raise SystemExit(EXIT)


def check_machine() -> None:
    """Check what no installation can change.

    Raises:
        SetupError: for a Python, a system or a processor that the libraries do not support.
    """
    version = sys.version_info[:2]
    if not OLDEST <= version <= NEWEST:
        fitting = [f"python3.{minor}" for minor in range(OLDEST[1], NEWEST[1] + 1) if shutil.which(f"python3.{minor}")]
        remedy = (
            f"Run it with {fitting[0]}, which this machine has."
            if fitting
            else "Install Python 3.11 (Debian 12 has it as python3) and run the script with it."
        )
        raise SetupError(
            f"This is Python {version[0]}.{version[1]}; expected 3.{OLDEST[1]} to 3.{NEWEST[1]}, "
            f"for which ROS has wheels. {remedy}"
        )
    if platform.system() != "Linux" or platform.machine() != "x86_64":
        raise SetupError(
            f"This is {platform.system()} on {platform.machine()}; expected Linux on x86_64, the only one that "
            "ROS has wheels for. Use such a machine, or a container or virtual machine of that kind."
        )
    library, library_version = platform.libc_ver()
    if library != "glibc" or tuple(int(part) for part in library_version.split(".")[:2]) < (2, 28):
        raise SetupError(
            f"The C library is {library or 'not glibc'} {library_version}; expected glibc 2.28 or newer. "
            "Use Debian 10, Ubuntu 20.04 or newer (Alpine's musl does not do)."
        )


def check_tools() -> None:
    """Check what making the environment needs.

    Raises:
        SetupError: if the compiler, Python's headers, the venv module or disk space is missing.
    """
    for variable, fallbacks, name in (("CC", ("cc", "gcc", "clang"), "C"), ("CXX", ("c++", "g++", "clang++"), "C++")):
        candidates = (os.environ[variable].split()[0],) if os.environ.get(variable, "").strip() else fallbacks
        if not any(shutil.which(candidate) for candidate in candidates):
            raise SetupError(
                f"There is no {name} compiler (looked for {', '.join(candidates)}); "
                "the ROS messages are compiled on first use. Install one: sudo apt-get install g++"
            )
    headers = Path(sysconfig.get_paths()["include"]) / "Python.h"
    minor = f"3.{sys.version_info[1]}"
    if not headers.exists():
        raise SetupError(
            f"Python's headers are missing ({headers}). Install them: sudo apt-get install python{minor}-dev"
        )
    try:
        import ensurepip  # noqa: F401
        import venv  # noqa: F401
    except ImportError:
        raise SetupError(
            f"This Python cannot make environments. Install what it lacks: sudo apt-get install python{minor}-venv"
        ) from None
    free = shutil.disk_usage(ROOT).free
    if free < SPACE:
        raise SetupError(
            f"Only {free / 2**30:.1f} GiB of disk space are free at {ROOT}; expected {SPACE / 2**30:.0f} GiB. "
            "Make room and start again."
        )


def fingerprint() -> str:
    """Return a hash of everything that the installation depends on."""
    digest = hashlib.sha256(str(ROOT).encode())  # an environment cannot be moved
    files = [ROOT / "pyproject.toml", ROOT / "CMakeLists.txt"]
    for folder in ("tulip_msgs", "third_party"):
        files += (path for path in (ROOT / folder).rglob("*") if path.suffix in INTERFACE_FILES)
    for path in sorted(files):
        digest.update(str(path.relative_to(ROOT)).encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()


def read_note() -> Optional[Dict[str, object]]:  # noqa: UP006, UP045
    """Return what the environment says about itself, or None: there is none, or others made it."""
    try:
        note = json.loads((ENVIRONMENT / NOTE).read_text())
    except (OSError, ValueError):
        return None
    return note if isinstance(note, dict) else None


def write_note(state: str, extras: Sequence[str] = ()) -> None:
    """Write "building" or "ready" into the environment, at one stroke."""
    temporary = ENVIRONMENT / f"{NOTE}.{os.getpid()}"
    temporary.write_text(json.dumps({"state": state, "fingerprint": fingerprint(), "extras": sorted(extras)}))
    temporary.replace(ENVIRONMENT / NOTE)


def is_ready(extras: Sequence[str] = ()) -> bool:
    """Return whether the environment is complete and up to date."""
    note = read_note()
    return bool(
        note
        and note.get("state") == "ready"
        and set(extras) <= set(note.get("extras", []))  # type: ignore[call-overload]
        and note.get("fingerprint") == fingerprint()
        and (ENVIRONMENT / "bin" / "python").exists()
    )


def set_up(extras: Sequence[str]) -> None:
    """Make or update the environment, one process at a time.

    Raises:
        SetupError: if that fails. A new environment is removed then; an old one stays as it was.
    """
    LOCK.parent.mkdir(exist_ok=True)
    with open(LOCK, "w") as lock, locked(lock):
        if is_ready(extras):  # another process made it meanwhile
            return
        check_tools()
        note = read_note()
        if note is None and ENVIRONMENT.exists() and any(ENVIRONMENT.iterdir()):
            raise SetupError(
                f"{ENVIRONMENT} exists and was not made by these scripts. Move it away, or install the project into it "
                "(pip install -e .) and set TULIP_NO_VENV=1 to run the scripts with the Python of your choice."
            )
        old = note if note and note.get("state") == "ready" and note.get("fingerprint") and runs() else None
        wanted = sorted({*extras, *(old["extras"] if old else [])})  # type: ignore[misc]
        if old is None:
            make_new(wanted, lock)
        else:
            update(wanted, lock, old)


def make_new(extras: Sequence[str], lock: IO[str]) -> None:
    """Make the environment from nothing."""
    shutil.rmtree(str(ENVIRONMENT), ignore_errors=True)
    ENVIRONMENT.mkdir()
    write_note("building")
    say(f"First use: making {ENVIRONMENT} (once, one to two minutes)")
    if sys.version_info[:2] > (3, 11):
        say("pybullet has no wheel for this Python and is compiled: some minutes more, which Python 3.11 avoids")
    started = time.monotonic()
    try:
        run_step("environment", [base_python(), "-m", "venv", str(ENVIRONMENT)], lock)
        install(extras, lock)
    except BaseException:
        shutil.rmtree(str(ENVIRONMENT), ignore_errors=True)
        raise
    write_note("ready", extras)
    say(f"Ready after {time.monotonic() - started:.0f} s")


def update(extras: Sequence[str], lock: IO[str], old: Dict[str, object]) -> None:  # noqa: UP006
    """Bring an existing environment up to date."""
    say("The project's dependencies or messages changed: updating .venv")
    write_note("building")  # if this process is killed, the next one begins from nothing
    started = time.monotonic()
    try:
        install(extras, lock)
    except SetupError:  # pip undid what it had begun
        (ENVIRONMENT / NOTE).write_text(json.dumps(old))
        raise
    write_note("ready", extras)
    say(f"Ready after {time.monotonic() - started:.0f} s")


def install(extras: Sequence[str], lock: IO[str]) -> None:
    """Install the project, editable, into the environment."""
    target = f"{ROOT}[{','.join(extras)}]" if extras else str(ROOT)
    python = str(ENVIRONMENT / "bin" / "python")
    run_step("libraries", [python, "-m", "pip", "install", "--no-input", "--editable", target], lock)


def run_step(name: str, command: List[str], lock: IO[str]) -> None:  # noqa: UP006
    """Run a command with its output in the log and its progress on the terminal.

    The command keeps the lock open: should this process be killed, the next one waits for what it left running.

    Raises:
        SetupError: if it fails.
    """
    variables = {**clean_variables(), "PIP_DISABLE_PIP_VERSION_CHECK": "1", "PIP_PROGRESS_BAR": "off"}
    variables.setdefault("PIP_RETRIES", "2")
    started = time.monotonic()
    lines: List[str] = []  # noqa: UP006
    with open(LOG, "a") as log:
        process = subprocess.Popen(
            command,
            cwd=str(ROOT),
            env=variables,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            universal_newlines=True,
            pass_fds=(lock.fileno(),),
        )
        assert process.stdout is not None
        shown = Progress(started)
        try:
            shown.step(name)
            for line in process.stdout:
                log.write(line)
                lines.append(line)
                shown.step(step_of(line))
        except BaseException:
            process.terminate()
            process.wait()
            raise
        finally:
            shown.end()
    if process.wait() != 0:
        raise SetupError(explain("".join(lines)))


def step_of(line: str) -> str:
    """Return what pip is doing, in words, or "" when the line does not tell."""
    text = line.strip()
    for start, words in (
        ("Installing build dependencies", "fetching the tools that compile the messages"),
        ("Preparing editable metadata", "reading the project"),
        ("Building editable", "compiling the messages"),
        ("Building wheel for", "compiling " + " ".join(text.split()[3:4])),
        ("Installing collected packages", "installing"),
    ):
        if text.startswith(start):
            return words
    if text.startswith("Collecting "):
        return "fetching " + re.split(r"[\s=<>!~\[]", text[11:])[0]
    return ""


class Progress:
    """Shows the present step and the time: one changing line on a terminal, else a line for each long step."""

    def __init__(self, started: float) -> None:
        self._started = started
        self._on_terminal = sys.stderr.isatty()
        self._last = ""

    def step(self, words: str) -> None:
        """Show a step; "" or the same again changes nothing."""
        if not words or words == self._last:
            return
        fetches = words.startswith("fetching ") and self._last.startswith("fetching ")
        self._last = words
        elapsed = time.monotonic() - self._started
        if self._on_terminal:
            sys.stderr.write(f"\r\033[K  [{elapsed:4.0f} s] {words}")
        elif not fetches:  # in a log file one line for all the libraries is enough
            sys.stderr.write(f"  [{elapsed:4.0f} s] {words}\n")
        sys.stderr.flush()

    def end(self) -> None:
        """Leave the line."""
        if self._on_terminal and self._last:
            sys.stderr.write("\r\033[K")
            sys.stderr.flush()


def explain(output: str) -> str:
    """Return cause and remedy for the output of a failed step."""
    missing = NO_PACKAGE.search(output)
    if NO_SPACE.search(output):
        return (
            f"The disk is full. Make room at {ROOT} and in the folder for temporary files ({SPACE / 2**30:.0f} GiB), "
            "then start again."
        )
    if NO_NETWORK.search(output if missing else output[-LAST:]):  # pip may have got over an early one
        return (
            "The package registry cannot be reached. Check the network (or the proxy, or pip's settings), "
            "then start again."
        )
    if missing:
        return (
            f"The package registry has no {missing.group(1)} for Python {sys.version_info[0]}.{sys.version_info[1]} "
            "on this machine. Check pip's settings (mirror, constraints), or use Python 3.11."
        )
    tail = "".join(output.strip().splitlines(keepends=True)[-15:])
    return f"Set-up failed; the whole output is in {LOG}. Its end:\n{tail}"


def base_python() -> str:
    """Return the interpreter that is in no environment: .venv must not depend on another environment."""
    return getattr(sys, "_base_executable", None) or sys.executable


def runs() -> bool:
    """Return whether the environment's Python still starts (it stops when the system's Python is replaced)."""
    python = ENVIRONMENT / "bin" / "python"
    try:
        return subprocess.run([str(python), "-c", ""], env=clean_variables(), stderr=subprocess.DEVNULL).returncode == 0
    except OSError:
        return False


def clean_variables() -> Dict[str, str]:  # noqa: UP006
    """Return the environment variables without those of other Pythons and ROS installations."""
    return {name: value for name, value in os.environ.items() if name not in OTHER_ENVIRONMENTS}


@contextlib.contextmanager
def locked(lock: IO[str]) -> Iterator[None]:
    """Hold the lock; say so when another process has it."""
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        say("Another process sets up .venv; waiting for it")
        fcntl.flock(lock, fcntl.LOCK_EX)
    yield


def say(words: str) -> None:
    """Tell the user."""
    sys.stderr.write(words + "\n")
    sys.stderr.flush()
