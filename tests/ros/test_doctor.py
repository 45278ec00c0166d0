"""What the doctor finds on a machine and in an installation."""

from __future__ import annotations

import fcntl
import json
import os
import socket
import subprocess
import sys
from pathlib import Path

import _environment as environment
import _installation as installation
import doctor
import pytest
from _installation import ERROR, OK, WARNING, Found

from tulip_ros import run, transport
from tulip_strategy import game_controller
from tulip_view.bridge import settings
from tulip_view.live import beside


def levels(found: list[Found]) -> set[str]:
    return {each.level for each in found}


@pytest.mark.parametrize(
    ("variables", "level", "words"),
    [
        ({}, OK, "domain 0, discovery range LOCALHOST"),
        ({"ROS_DOMAIN_ID": "32", "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}, OK, "domain 32"),
        ({"RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp"}, ERROR, "only rmw_fastrtps_cpp is installed: unset it"),
        ({"RMW_IMPLEMENTATION": "rmw_fastrtps_cpp"}, OK, "domain 0"),
        ({"ROS_DISTRO": "humble"}, WARNING, "ROS humble is sourced"),
        ({"ROS_DISTRO": "jazzy"}, OK, "domain 0"),
        ({"ROS_DOMAIN_ID": "233"}, ERROR, "expected a number from 0 to 101"),
        ({"ROS_DOMAIN_ID": "-1"}, ERROR, "expected a number from 0 to 101"),
        ({"ROS_DOMAIN_ID": "home"}, ERROR, "expected a number from 0 to 101"),
        ({"ROS_DOMAIN_ID": "150"}, WARNING, "choose 0 to 101"),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"}, ERROR, "do not find each other"),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "localhost"}, WARNING, "expected one of SUBNET"),
        ({"ROS_DISCOVERY_SERVER": "10.0.0.1:11811"}, WARNING, "without that server"),
        ({"FASTRTPS_DEFAULT_PROFILES_FILE": "/nowhere.xml"}, ERROR, "/nowhere.xml does not exist"),
        ({"ROS_SECURITY_ENABLE": "true"}, WARNING, "nodes without keys"),
        ({"TULIP_EXECUTOR": "fast"}, ERROR, "expected events or single"),
        ({"PYTHONPATH": "/opt/ros/humble/lib", "TULIP_NO_VENV": "1"}, WARNING, "holds another ROS"),
    ],
)
def test_variables_that_disturb_are_named_with_the_remedy(variables: dict[str, str], level: str, words: str) -> None:
    (found,) = installation.variables(variables)
    assert found.level == level and words in found.words


def test_the_executors_named_are_those_that_there_are() -> None:
    assert set(installation.EXECUTORS) == set(run.EXECUTORS)


@pytest.mark.parametrize(("kind", "socket_kind"), [("UDP", socket.SOCK_DGRAM), ("TCP", socket.SOCK_STREAM)])
def test_a_taken_port_is_named_with_the_program_that_holds_it(kind: str, socket_kind: socket.SocketKind) -> None:
    with socket.socket(socket.AF_INET, socket_kind) as taken:
        taken.bind(("127.0.0.1", 0))
        if kind == "TCP":
            taken.listen()
        number = taken.getsockname()[1]
        port = installation.Port(kind, number, "packets", ("no_such_program",), "choose another")
        (found,) = installation.ports([port])
        command = Path("/proc/self/cmdline").read_text().split("\0")
        assert found.level == WARNING and command[0] in found.words
        assert found.words.endswith("wanted for packets: end that program, or choose another")
        (found,) = installation.ports([port._replace(holders=(command[0],))])
        assert found.level == OK and "held by a running program" in found.words
    (found,) = installation.ports([port])
    assert found == Found(OK, f"{kind} port {number}", "free for packets")


def test_the_ports_looked_at_are_those_that_the_programs_listen_on_by_default() -> None:
    assert {(port.kind, port.number) for port in installation.PORTS} == {
        ("UDP", game_controller.REFEREE_PORT),
        ("TCP", beside.PORT),
        ("TCP", settings.PORT),
    }


def test_shared_memory_of_a_dead_process_is_told_and_that_of_a_living_one_is_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(transport, "SHARED_MEMORY", tmp_path)
    monkeypatch.setattr(transport, "SEGMENT", 1)
    for name in ("fastrtps_dead", "fastrtps_dead_el", "fastrtps_alive", "fastrtps_alive_el", "other"):
        (tmp_path / name).write_bytes(bytes(1024))
    holder = "import mmap, sys; file = open(sys.argv[1], 'r+b'); held = mmap.mmap(file.fileno(), 0); print(); input()"
    with subprocess.Popen(
        [sys.executable, "-c", holder, str(tmp_path / "fastrtps_alive")], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        process.stdout.readline()
        assert {path.name for path in transport.leftovers()} == {"fastrtps_dead", "fastrtps_dead_el"}
        room, left = installation.shared_memory()
        process.communicate(b"\n")
    assert room.level == OK
    assert left.level == WARNING and left.words.startswith("2 files of dead processes") and "--mend" in left.words
    assert (tmp_path / "fastrtps_dead").exists()  # only told


def test_segments_of_dead_processes_go_at_once_and_ports_and_what_is_locked_stay(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(transport, "SHARED_MEMORY", tmp_path)
    dead, alive, port = "fastrtps_00000000000000aa", "fastrtps_00000000000000bb", "fastrtps_port7411"
    for name in (dead, f"{dead}_el", alive, f"{alive}_el", port, f"{port}_el"):
        (tmp_path / name).write_bytes(bytes(16))
    with open(tmp_path / f"{alive}_el") as lock:  # as Fast DDS does, also in a container where nobody sees who maps it
        fcntl.flock(lock, fcntl.LOCK_EX)
        transport.remove_dead_segments()
        assert {path.name for path in tmp_path.iterdir()} == {alive, f"{alive}_el", port, f"{port}_el"}


def test_a_dead_port_goes_with_all_that_belongs_to_it_and_those_of_other_domains_only_on_request(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(transport, "SHARED_MEMORY", tmp_path)
    monkeypatch.setenv("ROS_DOMAIN_ID", "2")
    shared, dead, bare, alive, other = (f"fastrtps_port{number}" for number in (7000, 7900, 8149, 7911, 8150))
    locks = {shared: f"{shared}_el", dead: f"{dead}_el", alive: f"{alive}_sl", other: f"{other}_el"}
    mutexes = {name: f"sem.{name}_mutex" for name in (shared, dead, bare, alive, other)}
    for name in (*mutexes, *mutexes.values(), *locks.values(), "fastrtps_port7913_el", "fastrtps_00000000000000aa_el"):
        (tmp_path / name).write_bytes(bytes(16))
    of_alive, of_other = {alive, locks[alive], mutexes[alive]}, {other, locks[other], mutexes[other]}
    with open(tmp_path / locks[alive]) as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        transport.remove_leftovers()
        assert {path.name for path in tmp_path.iterdir()} == of_alive | of_other
        transport.remove_leftovers(everywhere=True)
        assert {path.name for path in tmp_path.iterdir()} == of_alive


def test_little_shared_memory_is_a_warning_with_the_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(transport, "SEGMENT", 2**60)
    found = next(installation.shared_memory())
    assert found.level == WARNING and "--shm-size" in found.words


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A small project in place of this one, with a .venv that fits it."""
    monkeypatch.delenv("TULIP_NO_VENV", raising=False)
    (tmp_path / "pyproject.toml").write_text("[project]\n")
    (tmp_path / "CMakeLists.txt").touch()
    monkeypatch.setattr(environment, "ROOT", tmp_path)
    monkeypatch.setattr(environment, "ENVIRONMENT", tmp_path / ".venv")
    monkeypatch.setattr(installation, "MODULES", ("json",))
    python = tmp_path / ".venv" / "bin" / "python"
    python.parent.mkdir(parents=True)
    python.symlink_to(sys.executable)
    environment.write_note("ready", ("test",))
    return tmp_path


def test_a_whole_environment_is_well_and_its_extras_are_named(project: Path) -> None:
    found = list(installation.environment())
    assert levels(found) == {OK}
    assert "extras: test" in found[0].words


def test_an_environment_that_does_not_fit_the_code_any_more_is_a_warning(project: Path) -> None:
    (project / "pyproject.toml").write_text("[project]\ndependencies = []\n")
    found = next(installation.environment())
    assert found.level == WARNING and "changed since it was made" in found.words


@pytest.mark.parametrize(("state", "words"), [("building", "interrupted"), (None, "not made by these scripts")])
def test_an_environment_that_is_half_made_or_of_others_is_an_error(project: Path, state: str, words: str) -> None:
    if state:
        environment.write_note(state)
    else:
        (project / ".venv" / environment.NOTE).unlink()
    (found,) = installation.environment()
    assert found.level == ERROR and words in found.words


def test_an_environment_without_its_python_and_one_that_is_not_there_are_errors(project: Path) -> None:
    (project / ".venv" / "bin" / "python").unlink()
    (found,) = installation.environment()
    assert found.level == ERROR and "does not start" in found.words
    (project / ".venv").rename(project / "elsewhere")
    (found,) = installation.environment()
    assert found.level == ERROR and "there is none yet" in found.words
    assert doctor.graph(1.0)[0].level == ERROR  # which cannot be looked at then


def test_a_library_that_cannot_be_imported_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TULIP_NO_VENV", "1")
    monkeypatch.setattr(installation, "MODULES", ("json", "no_such_library"))
    found = installation.imports()
    assert found.level == ERROR and "no_such_library cannot be imported (ModuleNotFoundError" in found.words


def test_a_full_disk_and_little_memory_are_warnings(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(installation, "ROOM", 2**70)
    monkeypatch.setattr(installation, "MEMORY", 2**70)
    monkeypatch.setattr(installation, "CORES", 10**6)
    assert levels([*installation.disk(), *installation.memory()]) == {WARNING}


@pytest.mark.parametrize(("level", "code"), [(OK, 0), (WARNING, 1), (ERROR, 2)])
def test_the_exit_code_is_that_of_the_worst_and_json_holds_everything(
    level: str, code: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    found = [Found(OK, "disk", "10 GiB free"), Found(level, "memory", "words")]
    monkeypatch.setattr(doctor, "check_all", lambda: found)
    assert doctor.main(["--only", "installation", "--json"]) == code
    assert json.loads(capsys.readouterr().out) == {"worst": level, "findings": [each._asdict() for each in found]}


def test_the_table_wraps_long_words_under_their_column(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("shutil.get_terminal_size", lambda *_: os.terminal_size((70, 24)))
    doctor.show([Found(OK, "disk", "well"), Found(WARNING, "memory", "much " * 20)])
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "ok       disk    well"
    assert lines[1].startswith("warning  memory  much much") and lines[2].startswith(" " * 17 + "much")
    assert max(map(len, lines)) <= 70


def test_the_installation_part_runs_on_the_standard_library_alone(tmp_path: Path) -> None:
    """Where nothing is installed, it must say so: no site-packages, nothing of the project but its folder."""
    program = (
        f"import sys; sys.path.insert(0, {str(Path(doctor.__file__).parent)!r}); import doctor, _installation; "
        "list(_installation.shared_memory()); list(_installation.ports()); "
        "print(sorted(set(sys.modules) & {'rclpy', 'numpy', 'rich', 'typer'}))"
    )
    done = subprocess.run(
        [sys.executable, "-I", "-S", "-c", program], capture_output=True, text=True, cwd=tmp_path, check=False
    )
    assert (done.stdout, done.stderr) == ("[]\n", "")
