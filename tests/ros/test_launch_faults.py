"""What the launcher does about nodes that hang, die for good, or die while others wait; and about its own death."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from graph_trial import left_in_shared_memory, shared_memory
from std_srvs.srv import Trigger
from test_launch import CRASHING, STEADY, is_alive, wait_for

from tulip_msgs.msg import UserCommand
from tulip_ros import topics
from tulip_ros.heartbeat import Pulse
from tulip_ros.keepsake import SIZE, VARIABLE, Keepsake, Memory
from tulip_ros.launch import Launcher
from tulip_ros.nodes import NodeEntry
from tulip_ros.plan import Start, make_plan
from tulip_ros.run import ComponentNode, session

HUNG = 0.6  # [s]
BEATING = """
import time
from tulip_ros import heartbeat
while True:
    heartbeat.beat()
    time.sleep(0.05)
"""
KEEPING = """
import time
from tulip_ros.keepsake import Keepsake
keepsake = Keepsake()
print("knows", keepsake.read(), flush=True)
keepsake.keep({"pose": [1.5, -2.0], "life": keepsake.read().get("life", 0) + 1})
time.sleep(60)
"""
LIBRARY = "import os\nprint('loaded by', os.getpid(), flush=True)\n"
NODE = """
import os, sys, time
import tulip_fake_library
from tulip_ros import heartbeat
if __name__ == "__main__":
    print("runs as", os.getpid(), os.environ["TULIP_RESTARTS"], "--ros-args" in sys.argv, flush=True)
    while True:
        heartbeat.beat()
        time.sleep(0.05)
"""
LAUNCHER = """
import sys, time
from pathlib import Path
from tulip_ros import launch
from tulip_ros.launch import Launcher
from tulip_ros.plan import make_plan
launch.BUSY = 0.0
with Launcher(make_plan(["user_input", "game_input"], None), Path(sys.argv[1])) as launcher:
    while True:
        launcher.poll()
        child = launcher._standby._child
        waiting = child.process.pid if child else 0
        print(*(state.pid for state in launcher.states()), waiting, flush=True)
        time.sleep(0.1)
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder whose programs nodes can be made of."""
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])]))
    return tmp_path


def starts(folder: Path, **programs: str) -> list[Start]:
    for name, text in programs.items():
        (folder / f"fake_{name}.py").write_text(text)
    return [Start(name, NodeEntry(name, f"fake_{name}"), {}, "") for name in programs]


def restarts(launcher: Launcher) -> list[int]:
    return [state.restarts for state in launcher.states()]


def go_on(launcher: Launcher, seconds: float) -> list[str]:
    lines, end = [], time.monotonic() + seconds
    while time.monotonic() < end:
        lines += launcher.poll()
        time.sleep(0.02)
    return lines


def beat_all(launcher: Launcher) -> bool:
    launcher.poll()
    return all(process.last_beat for process in launcher._processes)


def test_a_node_that_hangs_while_another_lives_is_killed_and_started_again(folder: Path) -> None:
    with Launcher(starts(folder, a=BEATING, b=BEATING), folder / "logs", hung=HUNG) as launcher:
        wait_for(lambda: beat_all(launcher))
        os.kill(launcher.states()[0].pid, signal.SIGSTOP)
        lines: list[str] = []
        wait_for(lambda: lines.extend(launcher.poll()) or restarts(launcher) == [1, 0])
        assert lines[0].startswith("a gives no sign of life for")
        assert sum("gives no sign" in line for line in lines) == 1
        wait_for(lambda: beat_all(launcher))


def test_nodes_that_all_fall_silent_together_are_left_alone_and_so_are_those_that_nobody_watched(folder: Path) -> None:
    with Launcher(starts(folder, a=BEATING, b=BEATING), folder / "logs", hung=HUNG) as launcher:
        wait_for(lambda: beat_all(launcher))
        for state in launcher.states():
            os.kill(state.pid, signal.SIGSTOP)
        # Both stopped: what the machine does to all of them is nobody's fault. (The later one was heard until now.)
        time.sleep(3.1)
        assert go_on(launcher, 2.0 * HUNG) == []
        assert restarts(launcher) == [0, 0]
        for state in launcher.states():
            os.kill(state.pid, signal.SIGCONT)


def test_a_program_without_signs_of_life_is_not_taken_to_hang(folder: Path) -> None:
    with Launcher(starts(folder, a=STEADY, b=BEATING), folder / "logs", hung=HUNG) as launcher:
        assert go_on(launcher, 3.0 * HUNG) == []
        assert restarts(launcher) == [0, 0]


def test_a_pulse_tells_the_last_beat_and_is_not_stopped_by_many(monkeypatch: pytest.MonkeyPatch) -> None:
    from tulip_ros import heartbeat

    pulse = Pulse()
    monkeypatch.setenv(heartbeat.VARIABLE, str(pulse.inlet))
    pulse.feel(1.0)
    assert pulse.last is None
    for _ in range(100_000):  # more than a pipe holds
        heartbeat.beat()
    pulse.feel(2.0)
    assert pulse.last == 2.0
    pulse.close()
    heartbeat.beat()  # nobody listens any more


def test_what_a_node_kept_is_known_to_the_next_of_its_name(folder: Path) -> None:
    with Launcher(starts(folder, a=KEEPING), folder / "logs") as launcher:
        log = launcher.log_folder / "a.log"
        wait_for(lambda: log.exists() and "knows {}" in log.read_text())
        time.sleep(0.1)
        os.kill(launcher.states()[0].pid, signal.SIGKILL)
        wait_for(lambda: launcher.poll() is not None and "'life': 1" in log.read_text())
        assert "knows {'pose': [1.5, -2.0], 'life': 1}" in log.read_text()


def test_a_keepsake_is_replaced_as_a_whole_and_refuses_more_than_its_page(monkeypatch: pytest.MonkeyPatch) -> None:
    memory = Memory("test")
    monkeypatch.setenv(VARIABLE, memory.path)
    Keepsake().keep({"words": "x" * 1000})
    Keepsake().keep({"a": 1})
    assert Keepsake().read() == {"a": 1}
    with pytest.raises(ValueError, match=f"expected at most {SIZE}"):
        Keepsake().keep({"words": "x" * SIZE})
    assert Keepsake().read() == {"a": 1}
    memory.close()
    assert Keepsake().read() == {}
    monkeypatch.delenv(VARIABLE)
    Keepsake().keep({"a": 2})
    assert Keepsake().read() == {}


def test_a_killed_node_comes_back_from_a_process_that_had_imported_what_it_needs(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tulip_ros.launch.BUSY", 0.0)
    (folder / "tulip_fake_library.py").write_text(LIBRARY)
    (folder / "tulip_fake_node.py").write_text(NODE)
    with Launcher([Start("a", NodeEntry("a", "tulip_fake_node"), {}, "")], folder / "logs") as launcher:
        log, waiting = launcher.log_folder / "a.log", launcher.log_folder / "standby.log"
        wait_for(lambda: launcher.poll() is not None and waiting.exists() and "loaded by" in waiting.read_text())
        ready = int(waiting.read_text().split()[2])
        os.kill(launcher.states()[0].pid, signal.SIGKILL)
        wait_for(lambda: launcher.poll() is not None and log.read_text().count("runs as") == 2)
        assert log.read_text().splitlines()[-1] == f"runs as {ready} 1 True"
        assert launcher.states()[0].pid == ready
        wait_for(lambda: launcher.poll() is not None and waiting.read_text().count("loaded by") == 2)
        following = int(waiting.read_text().split()[5])
    assert not is_alive(ready) and not is_alive(following)


def test_without_user_input_strategy_is_ended_when_a_node_is_given_up(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tulip_ros.node_process.LONGEST_PAUSE", 0.01)
    plan = starts(folder, vision=CRASHING, strategy=STEADY, motion=STEADY)
    with Launcher(plan, folder / "logs") as launcher:
        lines: list[str] = []
        wait_for(lambda: lines.extend(launcher.poll()) or launcher.given_up == ("vision",))
        assert [state.state for state in launcher.states()] == ["given up", "ended", "running"]
        assert "strategy was ended: motion control stops walking and stands" in lines
        assert go_on(launcher, 0.5) == []  # it stays ended


@pytest.mark.ros
@pytest.mark.usefixtures("ros_domain")
def test_when_a_node_is_given_up_the_user_s_wish_becomes_stop_and_outlives_user_input(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tulip_ros.node_process.LONGEST_PAUSE", 0.01)
    values = {"user_input": {"autostart": True}}
    plan = [*make_plan(["user_input"], None, values=values), *starts(folder, vision="import time; time.sleep(60)")]
    heard: list[UserCommand] = []
    with (
        Launcher(plan, folder / "logs") as launcher,
        session(lambda: ComponentNode("listener"), ["test"], handle_signals=False) as (node, spin),
    ):
        lines: list[str] = []

        def until(condition: object) -> None:
            wait_for(lambda: lines.extend(launcher.poll()) or spin(0.05) or condition())  # type: ignore[operator]

        topics.USER_COMMAND.subscribe_from(node, heard.append)
        until(lambda: heard and heard[-1].request == UserCommand.PLAY)
        (folder / "fake_vision.py").write_text(CRASHING)
        os.kill(launcher.states()[1].pid, signal.SIGKILL)
        until(lambda: heard[-1].request == UserCommand.STOP)
        assert launcher.given_up == ("vision",)
        until(lambda: "the robot was told to stand" in lines)
        count = len(heard)
        os.kill(launcher.states()[0].pid, signal.SIGKILL)
        until(lambda: len(heard) > count)
        assert heard[-1].request == UserCommand.STOP
        start = node.create_client(Trigger, topics.START.name)
        until(start.service_is_ready)


@pytest.mark.ros
@pytest.mark.usefixtures("ros_domain")
def test_a_launcher_that_is_killed_leaves_no_process_and_no_shared_memory(tmp_path: Path) -> None:
    before = shared_memory()
    command = [sys.executable, "-c", LAUNCHER, str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as launcher:
        assert launcher.stdout is not None
        pids: list[int] = []
        while not pids or not all(pids):  # until a process waits, too: the nodes are up then
            pids = [int(word) for word in launcher.stdout.readline().split()]
        launcher.kill()
    wait_for(lambda: not any(is_alive(pid) for pid in pids))
    assert left_in_shared_memory(before) == set()
