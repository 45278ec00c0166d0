"""Processes: started, watched, restarted, ended."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from diagnostic_msgs.msg import DiagnosticArray

from tulip_ros import topics, transport
from tulip_ros.aggregation import Report
from tulip_ros.errors import BadInputError
from tulip_ros.finding import Level
from tulip_ros.launch import Launcher
from tulip_ros.monitor import Monitor
from tulip_ros.node_process import DEATHS
from tulip_ros.nodes import NodeEntry
from tulip_ros.plan import Start, make_plan
from tulip_ros.run import ComponentNode, session

WAIT = 20.0  # [s] for things that take a fraction of a second

TELLING = "import os, time; print('started again', os.environ['TULIP_RESTARTS'], flush=True); time.sleep(60)"
SLEEP = "print('up', flush=True)\ntime.sleep(60)"
STEADY = f"import signal, sys, time\nsignal.signal(signal.SIGTERM, lambda *_: sys.exit(0))\n{SLEEP}"
STUBBORN = f"import signal, time\nsignal.signal(signal.SIGTERM, signal.SIG_IGN)\n{SLEEP}"
CRASHING = "raise RuntimeError('broken motor')"
REFUSING = "import sys; print('error: gain is -1', file=sys.stderr); sys.exit(2)"


@pytest.fixture
def launch(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Return a function that makes a launcher for small programs."""
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])]))

    def make(**programs: str) -> Launcher:
        for name, text in programs.items():
            (tmp_path / f"fake_{name}.py").write_text(text)
        return Launcher([Start(name, NodeEntry(name, f"fake_{name}"), {}, "") for name in programs], tmp_path / "logs")

    return make


def wait_for(condition: Callable[[], object]) -> None:
    deadline = time.monotonic() + WAIT
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.02)


def is_up(launcher: Launcher, name: str) -> bool:
    log = launcher.log_folder / f"{name}.log"
    return log.exists() and "up" in log.read_text()


def is_alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def test_killed_node_starts_again_and_the_other_is_left_alone(launch):
    with launch(a=STEADY, b=STEADY) as launcher:
        wait_for(lambda: is_up(launcher, "a") and is_up(launcher, "b"))
        first, other = launcher.states()
        os.kill(first.pid, signal.SIGKILL)
        lines: list[str] = []
        wait_for(lambda: lines.extend(launcher.poll()) or launcher.states()[0].restarts == 1)
        again, unchanged = launcher.states()
        assert again.state == "running" and again.pid != first.pid and again.exit_code == -signal.SIGKILL
        assert unchanged.pid == other.pid
        assert "a was killed by SIGKILL; starting it again" in lines[0]
    assert [state.state for state in launcher.states()] == ["ended", "ended"]
    assert not is_alive(again.pid) and not is_alive(other.pid)


def test_a_node_is_told_how_many_times_it_was_started_again(launch):
    with launch(a=TELLING) as launcher:
        log = launcher.log_folder / "a.log"
        wait_for(lambda: "started again 0" in log.read_text())
        os.kill(launcher.states()[0].pid, signal.SIGKILL)
        wait_for(lambda: launcher.poll() is not None and "started again 1" in log.read_text())


def test_node_that_ignores_sigterm_is_killed(launch, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("tulip_ros.ending.PATIENCE", 0.2)
    with launch(a=STUBBORN) as launcher:
        wait_for(lambda: is_up(launcher, "a"))
        pid = launcher.states()[0].pid
    assert not is_alive(pid)
    assert launcher.states()[0].exit_code == -signal.SIGKILL


NOTING = """
import signal, sys, time
from pathlib import Path
def end(*_):
    Path(__file__).with_suffix(".asked").write_text(str(time.monotonic_ns()))
    time.sleep(0.3)
    Path(__file__).with_suffix(".ended").write_text(str(time.monotonic_ns()))
    sys.exit(0)
signal.signal(signal.SIGTERM, end)
print('up', flush=True)
time.sleep(60)
"""


def test_the_driver_has_ended_before_the_others_are_asked_to_and_the_recorder_comes_last(launch, tmp_path: Path):
    names = ("recorder", "motion", "driver")
    with launch(**dict.fromkeys(names, NOTING)) as launcher:
        wait_for(lambda: all(is_up(launcher, name) for name in names))
    asked, ended = (
        {name: int((tmp_path / f"fake_{name}.{what}").read_text()) for name in names} for what in ("asked", "ended")
    )
    assert ended["driver"] < asked["motion"] < ended["motion"] < asked["recorder"]


def test_a_second_ctrl_c_hurries_the_end_and_leaves_no_orphans(launch, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("tulip_ros.ending.PATIENCE", 1e6)
    monkeypatch.setattr("tulip_ros.ending.ALONE", 1e6)
    names = ("driver", "motion", "recorder")
    with launch(**dict.fromkeys(names, STUBBORN)) as launcher:
        wait_for(lambda: all(is_up(launcher, name) for name in names))
        pids = [state.pid for state in launcher.states()]
        again = [threading.Timer(delay, os.kill, (os.getpid(), signal.SIGINT)) for delay in (0.3, 0.4)]
        for timer in again:
            timer.start()
    assert not any(is_alive(pid) for pid in pids)
    assert {state.exit_code for state in launcher.states()} == {-signal.SIGKILL}
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_refused_input_ends_the_launch_with_the_nodes_own_words(launch):
    with (
        launch(a=STEADY, b=REFUSING) as launcher,
        pytest.raises(BadInputError, match=r"Node b refused what it was given: gain is -1$"),
    ):
        wait_for(lambda: launcher.poll() and False)
    assert [state.state for state in launcher.states()] == ["ended", "ended"]


def test_node_that_dies_again_and_again_is_given_up(launch, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("tulip_ros.node_process.LONGEST_PAUSE", 0.01)
    with launch(a=CRASHING) as launcher:
        lines: list[str] = []
        wait_for(lambda: lines.extend(launcher.poll()) or launcher.states()[0].state == "given up")
        assert launcher.states()[0].restarts == DEATHS - 1
        assert launcher.given_up == ("a",)
        assert any("broken motor" in line for line in lines)


def test_log_folder_that_cannot_be_made_is_refused(tmp_path: Path):
    (tmp_path / "file").touch()
    with pytest.raises(BadInputError, match="cannot be made"):
        Launcher([], tmp_path / "file" / "logs")


def figures(sums: list[DiagnosticArray]) -> dict[str, str]:
    """Return what the newest sum tells of the recorder."""
    statuses = sums[-1].status if sums else []
    return {pair.key: pair.value for each in statuses if each.name.endswith("/recorder") for pair in each.values}


@pytest.mark.ros
def test_monitor_hears_a_launched_node_and_its_recording_ends_with_it(ros_domain: int, tmp_path: Path):
    values = {"recorder": {"path": str(tmp_path / "bag")}}
    plan = make_plan(["recorder"], driver=None, namespace="striker", values=values)
    with (
        Launcher(plan, tmp_path / "logs") as launcher,
        session(lambda: ComponentNode("listener", namespace="striker"), ["test"], handle_signals=False) as (node, spin),
    ):
        sums: list[DiagnosticArray] = []
        monitor = Monitor(node, ["recorder"])
        topics.DIAGNOSTICS_AGG.subscribe_from(node, sums.append)
        assert monitor.summary() == Report(Level.OK, "waits for recorder")
        wait_for(lambda: spin(0.1) or "processor [%]" in monitor.reports()["recorder"].values)
        assert monitor.summary() == Report(Level.OK, "all nodes are well")
        assert monitor.table(launcher.states()).row_count == 1
        wait_for(lambda: spin(0.1) or {"restarts", "recording"} <= figures(sums).keys())
        assert figures(sums)["restarts"] == "0"
        assert figures(sums)["recording"] == str(tmp_path / "bag" / "bag.mcap")
    assert (tmp_path / "bag" / "metadata.yaml").exists()
    assert launcher.states()[0].exit_code == 0


def test_transport_follows_the_free_shared_memory(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(transport, "_free_shared_memory", lambda: 64 * 2**20)
    assert transport.profile_path().name == "udp.xml"
    monkeypatch.setattr(transport, "_free_shared_memory", lambda: 2**30)
    assert transport.profile_path().name == "shared_memory.xml"
    assert transport.profile_path("udp").exists() and transport.profile_path("shared_memory").exists()
    with pytest.raises(ValueError, match="expected one of auto, shared_memory, udp"):
        transport.profile_path("tcp")


def test_users_own_profile_is_kept(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv(transport.PROFILE_VARIABLE, "/own.xml")
    transport.use_profile("udp")
    assert os.environ[transport.PROFILE_VARIABLE] == "/own.xml"


def test_commands_use_this_interpreter(tmp_path: Path):
    assert make_plan(["vision"], None)[0].command(tmp_path / "p.yaml")[0] == sys.executable
