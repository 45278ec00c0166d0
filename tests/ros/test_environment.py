"""The set-up of .venv: every failure has its own words, and nothing half-made stays."""

from __future__ import annotations

import errno
import io
import json
import os
import re
import subprocess
import sys
from collections import namedtuple
from pathlib import Path

import _environment as environment
import pytest

Usage = namedtuple("Usage", "total used free")


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A small project in place of this one, whose environment is made by a fast stand-in for pip."""
    (tmp_path / "pyproject.toml").write_text("[project]\n")
    (tmp_path / "CMakeLists.txt").touch()
    (tmp_path / "tulip_msgs" / "msg").mkdir(parents=True)
    (tmp_path / "tulip_msgs" / "msg" / "A.msg").write_text("float64 x\n")
    monkeypatch.setattr(environment, "ROOT", tmp_path)
    monkeypatch.setattr(environment, "ENVIRONMENT", tmp_path / ".venv")
    monkeypatch.setattr(environment, "LOG", tmp_path / "build" / "setup.log")
    monkeypatch.setattr(environment, "LOCK", tmp_path / "build" / "setup.lock")
    monkeypatch.setattr(environment, "SPACE", 0)
    monkeypatch.setattr(environment, "run_step", make_environment)
    monkeypatch.delenv("TULIP_NO_VENV", raising=False)
    return tmp_path


steps: list[list[str]] = []


def make_environment(name: str, command: list[str], lock: io.TextIOBase) -> None:
    steps.append(command)
    python = environment.ENVIRONMENT / "bin" / "python"
    python.parent.mkdir(parents=True, exist_ok=True)
    if not python.exists():
        python.symlink_to(sys.executable)


@pytest.fixture(autouse=True)
def _no_steps_yet() -> None:
    steps.clear()


def failing_step(message: str):
    def fail(name: str, command: list[str], lock: io.TextIOBase) -> None:
        make_environment(name, command, lock)
        raise environment.SetupError(message)

    return fail


def test_first_use_makes_the_environment_and_the_second_does_nothing(project: Path):
    assert not environment.is_ready()
    environment.set_up(())
    assert environment.is_ready()
    assert [command[1:3] for command in steps] == [["-m", "venv"], ["-m", "pip"]]
    assert steps[1][-2:] == ["--editable", str(project)]
    environment.set_up(())
    assert len(steps) == 2


@pytest.mark.parametrize("file", ["pyproject.toml", "CMakeLists.txt", "tulip_msgs/msg/A.msg", "tulip_msgs/msg/New.msg"])
def test_change_of_what_is_installed_updates_the_environment(project: Path, file: str):
    environment.set_up(())
    (project / file).write_text("# changed\n")
    assert not environment.is_ready()
    environment.set_up(())
    assert environment.is_ready()
    assert [command[1:3] for command in steps[2:]] == [["-m", "pip"]]


def test_extras_are_added_and_stay(project: Path):
    environment.set_up(())
    assert not environment.is_ready(("test",))
    environment.set_up(("test",))
    assert environment.is_ready(("test",)) and environment.is_ready()
    (project / "pyproject.toml").write_text("# changed\n")
    environment.set_up(())
    assert steps[-1][-1] == f"{project}[test]"


def test_failed_first_use_leaves_nothing(project: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(environment, "run_step", failing_step("no network"))
    with pytest.raises(environment.SetupError, match="no network"):
        environment.set_up(())
    assert not environment.ENVIRONMENT.exists()


def test_failed_update_leaves_the_old_environment_and_is_tried_again(project: Path, monkeypatch: pytest.MonkeyPatch):
    environment.set_up(())
    (project / "CMakeLists.txt").write_text("syntax error\n")
    monkeypatch.setattr(environment, "run_step", failing_step("does not compile"))
    with pytest.raises(environment.SetupError, match="does not compile"):
        environment.set_up(())
    assert (environment.ENVIRONMENT / "bin" / "python").exists()
    assert not environment.is_ready()
    steps.clear()
    monkeypatch.setattr(environment, "run_step", make_environment)
    environment.set_up(())
    assert environment.is_ready() and len(steps) == 1


def test_half_made_environment_of_a_killed_set_up_is_made_anew(project: Path):
    environment.ENVIRONMENT.mkdir()
    environment.write_note("building")
    (environment.ENVIRONMENT / "half").touch()
    environment.set_up(())
    assert environment.is_ready()
    assert not (environment.ENVIRONMENT / "half").exists()


def test_environment_of_others_is_not_touched(project: Path):
    environment.ENVIRONMENT.mkdir()
    (environment.ENVIRONMENT / "pyvenv.cfg").write_text("mine\n")
    with pytest.raises(environment.SetupError, match="not made by these scripts"):
        environment.set_up(())
    assert (environment.ENVIRONMENT / "pyvenv.cfg").read_text() == "mine\n"


def test_environment_whose_python_is_gone_is_made_anew(project: Path):
    environment.set_up(())
    python = environment.ENVIRONMENT / "bin" / "python"
    python.unlink()
    python.symlink_to("/nowhere/python")
    assert not environment.is_ready()
    environment.set_up(())
    assert environment.is_ready()


def test_starts_at_the_same_time_make_one_environment(project: Path):
    program = f"""
import sys, time
from pathlib import Path
sys.path.insert(0, {str(Path(environment.__file__).parent)!r})
import _environment as e
root = Path({str(project)!r})
e.ROOT, e.ENVIRONMENT, e.LOG, e.LOCK, e.SPACE = root, root / ".venv", root / "build/l", root / "build/lock", 0
def step(name, command, lock):
    with open(root / "steps", "a") as steps:
        steps.write(name + "\\n")
    time.sleep(0.3)
    python = e.ENVIRONMENT / "bin" / "python"
    python.parent.mkdir(exist_ok=True)
    if not python.exists():
        python.symlink_to(sys.executable)
e.run_step = step
e.set_up(())
"""
    processes = [subprocess.Popen([sys.executable, "-c", program], stderr=subprocess.DEVNULL) for _ in range(3)]
    assert [process.wait(30) for process in processes] == [0, 0, 0]
    assert (project / "steps").read_text().split() == ["environment", "libraries"]
    assert environment.is_ready()


@pytest.mark.parametrize("version", [(3, 10, 1), (3, 14, 0)])
def test_wrong_python_is_named_with_the_remedy(version: tuple[int, int, int], monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(sys, "version_info", version)
    monkeypatch.setattr(environment.shutil, "which", lambda name: f"/usr/bin/{name}" if name == "python3.12" else None)
    with pytest.raises(environment.SetupError, match=rf"This is Python 3\.{version[1]};.*Run it with python3\.12"):
        environment.check_machine()


@pytest.mark.parametrize(("system", "machine"), [("Linux", "aarch64"), ("Darwin", "x86_64")])
def test_wrong_machine_is_named(system: str, machine: str, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(environment.platform, "system", lambda: system)
    monkeypatch.setattr(environment.platform, "machine", lambda: machine)
    with pytest.raises(environment.SetupError, match=f"{system} on {machine}; expected Linux on x86_64"):
        environment.check_machine()


@pytest.mark.parametrize("library", [("", ""), ("glibc", "2.17")])
def test_wrong_c_library_is_named(library: tuple[str, str], monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(environment.platform, "libc_ver", lambda: library)
    with pytest.raises(environment.SetupError, match=r"expected glibc 2\.28"):
        environment.check_machine()


@pytest.mark.parametrize(("variable", "missing"), [("CC", "C compiler"), ("CXX", r"C\+\+ compiler")])
def test_missing_compiler_is_named_with_the_remedy(variable: str, missing: str, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv(variable, "no-such-compiler -O2")
    with pytest.raises(environment.SetupError, match=f"no {missing} .*no-such-compiler.*apt-get install"):
        environment.check_tools()


def test_missing_headers_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(environment.sysconfig, "get_paths", lambda: {"include": str(tmp_path)})
    with pytest.raises(environment.SetupError, match=r"headers are missing.*-dev"):
        environment.check_tools()


def test_full_disk_is_named_before_anything_is_made(project: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(environment, "SPACE", 3 * 2**30)
    monkeypatch.setattr(environment.shutil, "disk_usage", lambda path: Usage(2**40, 2**40, 2**30))
    with pytest.raises(environment.SetupError, match=r"Only 1\.0 GiB of disk space.*expected 3 GiB"):
        environment.set_up(())
    assert not environment.ENVIRONMENT.exists()


@pytest.mark.parametrize(
    ("output", "message"),
    [
        ("OSError: [Errno 28] No space left on device", "The disk is full"),
        (
            "WARNING: Retrying after connection broken by 'NewConnectionError(...)'\n"
            "ERROR: No matching distribution found for ninja",
            "cannot be reached",
        ),
        (
            "ERROR: No matching distribution found for ros-jazzy-rclpy==7.1.6",
            "has no ros-jazzy-rclpy==7.1.6 for Python",
        ),
        ("CMake Error: bad message", "Set-up failed.*\nCMake Error: bad message"),
    ],
)
def test_failure_of_pip_is_explained(output: str, message: str):

    assert re.search(message, environment.explain(output))


def test_failing_command_is_explained_by_its_own_output(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(environment, "LOG", tmp_path / "log")
    command = [sys.executable, "-c", "print('Temporary failure in name resolution'); raise SystemExit(1)"]
    with open(tmp_path / "lock", "w") as lock, pytest.raises(environment.SetupError, match="cannot be reached"):
        environment.run_step("libraries", command, lock)
    assert "name resolution" in (tmp_path / "log").read_text()


@pytest.mark.parametrize("error", [environment.SetupError("no compiler"), OSError(errno.EROFS, "read-only")])
def test_every_failure_ends_with_exit_code_2_and_one_message(
    project: Path, error: Exception, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    def fail(extras: object) -> None:
        raise error

    monkeypatch.setattr(environment, "set_up", fail)
    with pytest.raises(SystemExit) as end:
        environment.prepare()
    assert end.value.code == 2
    said = capsys.readouterr().err
    assert said.startswith("error: ") and "Traceback" not in said


def test_script_runs_again_in_the_environment_without_variables_of_other_installations(
    project: Path, monkeypatch: pytest.MonkeyPatch
):
    started = {}

    def execve(python: str, arguments: list[str], variables: dict[str, str]) -> None:
        started.update(python=python, arguments=arguments, variables=variables)

    monkeypatch.setattr(os, "execve", execve)
    monkeypatch.setenv("LD_LIBRARY_PATH", "/opt/ros/lib")
    monkeypatch.setenv("_ROS_WHEELS_BOOTSTRAP_COMPLETE", "1")
    environment.prepare()
    assert started["python"] == str(project / ".venv" / "bin" / "python")
    assert started["arguments"] == [started["python"], *sys.argv]
    assert {"LD_LIBRARY_PATH", "_ROS_WHEELS_BOOTSTRAP_COMPLETE"}.isdisjoint(started["variables"])
    assert json.loads((project / ".venv" / environment.NOTE).read_text())["state"] == "ready"


def test_own_python_can_be_demanded(project: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("TULIP_NO_VENV", "1")
    environment.prepare(("test",))
    assert not environment.ENVIRONMENT.exists()
