"""What people type wrong: one line that says what, exit code 2, no traceback, nothing lost."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from pathlib import Path

import bench
import export_model
import launch
import match
import pytest
import record
import typer
from typer.testing import CliRunner

from tulip_ros.errors import BadInputError, check_writable, unknown

PORTLESS = ["--no-record", "--referee-port", "3839"]


def run(main: object, *arguments: str) -> tuple[int, list[str]]:
    """Return a script's exit code and the lines that it wrote."""
    app = typer.Typer()
    app.command()(main)
    result = CliRunner().invoke(app, list(arguments))
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, [line for line in result.output.splitlines() if line.strip()]


def run_apart(*arguments: str) -> tuple[int, list[str]]:
    """Run match.py as a process of its own."""
    environment = {**os.environ, "TULIP_NO_VENV": "1"}
    command = [sys.executable, match.__file__, "--no-record", *arguments]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120, check=False)
    return done.returncode, [line for line in (done.stdout + done.stderr).splitlines() if line.strip()]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with what the cases need."""
    monkeypatch.chdir(tmp_path)
    for name, text in (
        ("broken.yaml", "vision: [1\n b"),
        ("node.yaml", "visoin: {a: 1}"),
        ("seed.yaml", "driver: {seed: 3}"),
        ("file", ""),
    ):
        (tmp_path / name).write_text(text)
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "important.txt").write_text("kept")
    return tmp_path


TWO = ["--teams", "2", "--keeper", "dribble_and_kick", "--no-record"]


@pytest.mark.parametrize(
    ("main", "arguments", "words"),
    [
        (match.main, ["--mode", "grap"], "--mode is 'grap'; expected one of graph, lockstep"),
        (match.main, ["--engine", "ode"], "--engine is 'ode'; expected pybullet or mujoco"),
        (export_model.main, ["full"], "full exists already and is no empty folder; expected a new one"),
        (export_model.main, ["new", "--formats", "obj"], "formats are obj; expected some of urdf, sdf, mjcf"),
        (export_model.main, ["new", "--body", "broken.yaml"], "broken.yaml is not YAML"),
        (export_model.main, ["new", "--variant", "table"], "expected the playing variant, or urdf alone"),
        (match.main, [*PORTLESS, "--scenario", "trail"], "no scenario 'trail'. Did you mean trial?"),
        (match.main, [*PORTLESS, "--parameters", "broken.yaml"], "expected ',' or ']' in line 3, column 1"),
        (match.main, [*PORTLESS, "--parameters", "node.yaml"], "Did you mean vision?"),
        (match.main, [*PORTLESS, "--parameters", "seed.yaml"], "sets driver.seed, which the trial itself sets"),
        (match.main, [*PORTLESS, "--parameters", "none.yaml"], "none.yaml cannot be read: No such file"),
        (match.main, [*PORTLESS, "--json", "none/x.json"], "--json none/x.json cannot be written"),
        (match.main, [*PORTLESS, "--json", "full"], "--json full cannot be written: Is a directory"),
        (match.main, [*PORTLESS, "--logs", "file/logs"], "Log folder file/logs cannot be made"),
        (match.main, ["--teams", "2", "--keeper", "x"], "--keeper is 'x'; expected one of dribble_and_kick"),
        (match.main, [*TWO, "--playing-time", "0"], "playing_time is 0.0 s; expected > 0"),
        (match.main, [*TWO, "--eyes", "ideal"], "expected camera with two"),
        (match.main, [*TWO, "--parameters", "seed.yaml"], "sets driver.seed, which the match itself sets"),
        (match.main, ["--mode", "lockstep", "--parameters", "node.yaml"], "expected --mode graph"),
        (match.main, ["--mode", "lockstep", "--scenario", "x"], "no scenario 'x'. Known: dribble_course, open"),
        (match.main, ["--mode", "lockstep", "--record", "full"], "Recording folder full is not empty"),
        (match.main, ["--mode", "lockstep", "--record", "file/bag"], "cannot be written: Not a directory"),
        (launch.main, ["visoin"], "no node 'visoin'. Did you mean vision?"),
        (launch.main, ["--driver", "gazebo"], "no driver 'gazebo'"),
        (launch.main, ["--transport", "tcp"], "no transport 'tcp'"),
        (launch.main, ["--namespace", "3 x"], "Namespace is '3 x'"),
        (record.main, ["--namespace", "3 x"], "Namespace is '3 x'"),
        (record.main, ["--include", "("], "'(' is no regular expression"),
        (bench.main, ["wakl"], "no bench 'wakl'. Did you mean walk?"),
        (bench.main, ["walk", "--json", "none/x.json"], "--json none/x.json cannot be written"),
    ],
)
def test_one_line_says_what_is_wrong(folder: Path, main: object, arguments: list[str], words: str) -> None:
    before = sorted(path.relative_to(folder) for path in folder.rglob("*"))
    code, lines = run(main, *arguments)
    assert code == 2
    assert len(lines) == 1 and lines[0].startswith("error: ") and words in lines[0], lines
    assert sorted(path.relative_to(folder) for path in folder.rglob("*")) == before
    assert (folder / "full" / "important.txt").read_text() == "kept"


@pytest.mark.parametrize(
    "arguments", [["--seed", "-1"], ["--seed", "one"], ["--referee-port", "70000"], ["--sed", "1"]]
)
def test_options_out_of_range_are_refused(arguments: list[str]) -> None:
    code, lines = run(match.main, *arguments)
    assert code == 2
    assert arguments[0] in " ".join(lines)


@pytest.mark.ros
@pytest.mark.slow
@pytest.mark.usefixtures("ros_domain")
def test_what_a_node_refuses_ends_the_trial_with_its_words(folder: Path) -> None:
    (folder / "parameter.yaml").write_text("head: {sped: 1}")
    code, lines = run_apart("--parameters", "parameter.yaml", "--logs", "logs")
    assert (code, len(lines)) == (2, 1), lines
    assert "Node head refused what it was given: There is no parameter of node 'head' called 'sped'" in lines[0]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
        code, lines = run_apart("--referee-port", str(port), "--logs", "logs")
    assert (code, len(lines)) == (2, 1), lines
    assert f"Cannot listen to the referee on UDP 127.0.0.1:{port}: Address already in use" in lines[0]


def test_long_lists_of_names_are_shown_only_when_none_is_near() -> None:
    names = [f"gain_{index}" for index in range(30)]
    assert str(unknown("gain", "gian_3", names)).endswith("?")
    assert "gain_29" in str(unknown("gain", "zzz", names))


def test_a_look_at_a_file_leaves_it_as_it_is(tmp_path: Path) -> None:
    check_writable(tmp_path / "new", "--json")
    assert not (tmp_path / "new").exists()
    (tmp_path / "old").write_text("kept")
    check_writable(tmp_path / "old", "--json")
    assert (tmp_path / "old").read_text() == "kept"
    with pytest.raises(BadInputError, match="cannot be written"):
        check_writable(tmp_path, "--json")


def test_a_gait_file_that_cannot_be_used_is_told_in_one_line(tmp_path: Path) -> None:
    gait = tmp_path / "gait.yaml"
    gait.write_text("motion:\n  ros__parameters:\n    com_height: high\n")
    code = (
        "import _environment; _environment.prepare(); from pathlib import Path;"
        f" from tulip_motion.gait_file import GaitFile; GaitFile(Path({str(gait)!r}))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "TULIP_NO_VENV": "1"},
        cwd=Path(match.__file__).parent,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 2
    assert done.stderr.splitlines() == [f"error: {gait}: com_height is 'high'; expected a finite number"]


@pytest.mark.ros
@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("com_height:=2.0", "com_height is 2.0 m; expected less than "),
        ("max_speed_forward:=0.0", "max_speed_forward is 0.0; expected > 0"),
        ("gait:=trott", "gait is 'trott'; expected dcm or paper"),
    ],
)
def test_motion_refuses_parameters_that_it_cannot_walk_with(setting: str, message: str) -> None:
    command = [sys.executable, "-m", "tulip_motion.motion_node", "--ros-args", "-p", setting]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"error: Parameters of node 'motion': {message}")
