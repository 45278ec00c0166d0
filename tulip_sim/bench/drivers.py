"""How fast each driver takes the torque from the joints: when commands stop, and at an emergency stop; and its checks.

A robot's driver and user input run as processes. In place of motion control a commander presses the left hip against
the end of its range, so that its torque is there for as long as the driver obeys and stiffness is not zero. All times
are of the wall clock, from the message's or call's sending until the driver tells its body to have no stiffness, where
a body can be listened to, and until the first reading without that torque.
"""

from __future__ import annotations

import importlib.util
import select
import socket
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from typing import Any

import numpy as np

from tulip_description.robot import LEG_JOINTS, load_robot
from tulip_description.robot_io import JointCommand
from tulip_driver.check.rows import Judgement, verdict
from tulip_driver.check.run import check_driver
from tulip_driver.echo import EchoBody
from tulip_driver.guard import GuardParameters
from tulip_driver.wire.body import WireBody
from tulip_motion.messages import joint_command_to_message
from tulip_ros import topics
from tulip_ros.emergency_stop import StopLink
from tulip_ros.launch import Launcher
from tulip_ros.plan import make_plan
from tulip_ros.run import ComponentNode, session
from tulip_ros.time import stamp_of
from tulip_sim.bench import drivers_bodies
from tulip_sim.bench.drivers_stalls import TIME, upright_time
from tulip_sim.bench.free_port import free_port, own_domain
from tulip_sim.bench.runner import Bench, Row
from tulip_sim.simulated_body import SimulatedBody

DRIVERS = ("echo", "sim", "mujoco", "wire")
ROUNDS, TRIES = 5, 10  # tries of each kind in each round
TOLD, SEEN = "told to the body", "seen in a reading"
SILENCE, TOPIC, SERVICE = "commands stop", "stop by topic", "stop by service"
KINDS = {SILENCE: 50.0, TOPIC: 20.0, SERVICE: None}
"""What is tried, and the most that is asked for [ms]."""
JOINT = LEG_JOINTS.index("left_hip_yaw")
PRESSED, GONE = 1.5, 0.3  # [N m] torque that is there, and that is no more
AT_REST = 0.1  # [rad/s]
PATIENCE = 60.0  # [s] for what takes a second
STEADY = 25  # readings at rest before a try
CHECK = "check"
STALLS = "stalls"
LIVES, STALL_TIMES, WALKS = (40, 100), (60, 92, 140), 6  # [ms] and [ms]; walks of each
LISTENED = {"echo": drivers_bodies.ToldEcho, "wire": drivers_bodies.ToldWire}
"""Drivers whose bodies tell when they are told to have no stiffness."""
SOON = 1.0  # [s] in which that must have come
AGAIN = 20  # tries of one that is disturbed


class Commander(ComponentNode):
    """Presses a joint against the end of its range, and looks at its torque."""

    def __init__(self) -> None:
        """Connect."""
        super().__init__("commander")
        self._legs = self.sender(topics.LEG_COMMAND)
        self.stop = StopLink(self, "commander")
        self.engage, self.release = (
            self.create_client(service.type, service.name) for service in (topics.ENGAGE_STOP, topics.RELEASE_STOP)
        )
        self._sequence = 0
        self._pressing = np.zeros(len(LEG_JOINTS))
        self._pressing[JOINT] = 2.0 * PRESSED
        self._end = np.zeros(len(LEG_JOINTS))
        self._end[JOINT] = load_robot().position_limits[1][JOINT]
        self._stiffness, self._damping = np.zeros(len(LEG_JOINTS)), np.ones(len(LEG_JOINTS))
        self._stiffness[JOINT] = 5.0
        self._damping[5::6] = 0.2  # more is unstable at a light joint
        self.commands = True
        self.commanded_at = 0.0  # when the last command went out [s]
        self.steady = 0  # readings in a row with the torque there and at rest
        self.gone_at: float | None = None  # when the first reading without it came since it was last cleared [s]
        self.listen(topics.JOINT_STATES, self._on_joints)

    def _on_joints(self, message: Any) -> None:
        now = time.monotonic()
        torque, speed = message.effort[JOINT], message.velocity[JOINT]
        self.steady = self.steady + 1 if abs(torque) > PRESSED and abs(speed) < AT_REST else 0
        if self.gone_at is None and abs(torque) < GONE:
            self.gone_at = now
        if self.commands:
            self._sequence += 1
            order = JointCommand(
                sequence=self._sequence,
                stamp=stamp_of(message),
                names=LEG_JOINTS,
                position=self._end,
                velocity=np.zeros(len(LEG_JOINTS)),
                effort=self._pressing,
                stiffness=self._stiffness,
                damping=self._damping,
            )
            self._legs.publish(joint_command_to_message(order))
            self.commanded_at = time.monotonic()


Until = Callable[[Callable[[], object]], None]
"""Waits until something holds."""


def measure(driver: str, number: int | str) -> Row:
    """Try each way of stopping some times, or check the driver.

    Args:
        driver: One of `DRIVERS`, or STALLS for what a walk makes of late commands.
        number: Of the round, or CHECK; or the seed of a walk.

    Raises:
        RuntimeError: if a process ends or the torque does not come or go.
    """
    row: Row = {"driver": driver, "round": number}
    if driver == STALLS:
        walks = [(life, stall, upright_time(life, stall, int(number))) for stall in STALL_TIMES for life in LIVES]
        return row | {f"life {life} ms, stalls of {stall} ms: upright [s]": time for life, stall, time in walks}
    own_domain()
    if driver == "mujoco" and importlib.util.find_spec("mujoco") is None:
        return row | {"left out": "MuJoCo is not installed"}
    if number == CHECK:
        return row | _check(driver)
    rng = np.random.default_rng([DRIVERS.index(driver), int(number)])
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ear,
        running(driver, _listening(ear)) as (commander, until),
    ):
        for _ in range(TRIES):
            for kind in KINDS:
                for name, moment in _times(driver, ear, commander, kind, until, rng).items():
                    row.setdefault(f"{kind}, {name} [ms]", []).append(round(1e3 * moment, 2))
    return row


def _times(
    driver: str, ear: socket.socket, commander: Commander, kind: str, until: Until, rng: np.random.Generator
) -> dict[str, float]:
    """Stop the robot at a random moment and return how long it took until it was told and seen [s].

    On a busy machine commands grow old by themselves, so that nothing is left to stop: then it is tried again.

    Raises:
        RuntimeError: if that happens again and again.
    """
    for _ in range(AGAIN):
        until(lambda: commander.steady >= STEADY)
        until(partial(_is_past, time.monotonic() + float(rng.uniform(0.0, 0.05))))
        while _heard(ear, 0.0) is not None:
            pass
        begin, seen = _try(commander, kind, until)
        if driver not in LISTENED:
            return {SEEN: seen - begin}
        told = _heard(ear, SOON)
        if told is not None and begin < told < seen:
            return {TOLD: told - begin, SEEN: seen - begin}
    raise RuntimeError(f"commands come late by themselves, {AGAIN} times in a row: end other programs")


def _heard(ear: socket.socket, seconds: float) -> float | None:
    """Return when a body was told to have no stiffness [s], if it says so within so many seconds [s]."""
    if not select.select([ear], [], [], seconds)[0]:
        return None
    (moment,) = drivers_bodies.MOMENT.unpack(ear.recv(64))
    return float(moment)


def _is_past(moment: float) -> bool:
    return time.monotonic() > moment


def _listening(ear: socket.socket) -> int:
    """Open a socket for what bodies tell, and return its port."""
    ear.bind(("127.0.0.1", 0))
    return int(ear.getsockname()[1])


def _try(commander: Commander, kind: str, until: Until) -> tuple[float, float]:
    """Stop the robot in one way, bring it back; return when that began and when the torque was gone [s]."""
    commander.gone_at = None
    begin = time.monotonic()
    if kind == SILENCE:
        begin, commander.commands = commander.commanded_at, False
    elif kind == TOPIC:
        commander.stop.engage("bench")
    else:
        commander.engage.call_async(commander.engage.srv_type.Request())
    until(lambda: commander.gone_at is not None)
    assert commander.gone_at is not None
    gone_at = commander.gone_at
    commander.commands = True
    if kind != SILENCE:
        until(lambda: commander.stop.engaged)
        released = commander.release.call_async(commander.release.srv_type.Request())
        until(released.done)
        until(lambda: not commander.stop.engaged)
    return begin, gone_at


@contextmanager
def running(driver: str, report: int) -> Iterator[tuple[Commander, Until]]:
    """Run driver and user input, and yield the commander and what waits.

    Args:
        driver: One of `DRIVERS`.
        report: UDP port for what its body tells.
    """
    port = free_port()
    simulated = {"camera": False, "referee": False, "mode": "free", "wait_for": ["user_input"]}
    nodes, name = ["user_input"], driver
    values: dict[str, dict[str, Any]] = {"driver": dict(simulated)}
    if driver in LISTENED:
        name = f"{drivers_bodies.__name__}:{LISTENED[driver].__name__}"
        values = {"driver": {"options": [f"report={report}"]}}
    if driver == "wire":
        nodes.append("emulator")
        values["emulator"] = {**simulated, "port": port}
        values["driver"]["options"] += [f"port={port}", f"patience={PATIENCE}"]
        values["driver"]["clock"] = "body"
    with (
        Launcher(make_plan(nodes, name, values=values)) as launcher,
        session(Commander, arguments=[], handle_signals=False) as (commander, spin),
    ):

        def until(holds: Callable[[], object]) -> None:
            end = time.monotonic() + PATIENCE
            while not holds():
                spin(0.002)
                said = launcher.poll()
                if said or time.monotonic() > end:
                    raise RuntimeError(f"{said or 'the torque does not come or go'}; see {launcher.log_folder}")

        until(lambda: commander.engage.service_is_ready() and commander.release.service_is_ready())
        yield commander, until


def _check(driver: str) -> Row:
    """Return the verdict of the contract's test kit."""
    robot, port = load_robot(), free_port()
    emulator = {"port": port, "harness": True, "camera": False, "referee": False}
    plan = make_plan(["emulator"] if driver == "wire" else ["user_input"], None, values={"emulator": emulator})
    with Launcher(plan):
        if driver == "echo":
            body: Any = EchoBody(robot)
        elif driver == "wire":
            body = WireBody(robot, port=port, patience=PATIENCE)
        else:
            body = SimulatedBody(robot, harness=True, engine="mujoco" if driver == "mujoco" else "pybullet")
        rows = list(check_driver(body, robot, lambda: True))
    return {
        "checks": sum(each.judgement is not Judgement.SKIPPED for each in rows),
        "passed": sum(each.judgement is Judgement.PASS for each in rows),
        "failed": [f"{each.what}: {each.measured}" for each in rows if each.judgement is Judgement.FAIL],
        "verdict": verdict(rows)[1],
    }


def summarize(rows: list[Row]) -> list[str]:
    """Return a line a driver."""
    life = GuardParameters().time_to_live
    lines = [
        "From the sending of the last command, of the emergency stop's message, or of the call of its service, at"
        " random moments, on the wall clock: until the driver tells its body to have no stiffness, where the bench can"
        " stand between them; and until the first reading of the joints without torque. Medians, and the most. Asked"
        f" for: damping within {KINDS[SILENCE]:.0f} ms, of which commands live {life} ms; zero stiffness within"
        f" {KINDS[TOPIC]:.0f} ms in the driver. A reading comes every 4 ms, is up to 2 ms old, and tells the mean"
        " torque since the one before.",
        "",
        "| driver | `driver_check.py` | tries of each | until | commands stop | emergency stop by topic | by service |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for driver in DRIVERS:
        own = [row for row in rows if row["driver"] == driver and "left out" not in row]
        checks = "; ".join(f"{row['passed']} of {row['checks']}" for row in own if row["round"] == CHECK)
        for until in (TOLD, SEEN):
            tries = [[each for row in own for each in row.get(f"{kind}, {until} [ms]", ())] for kind in KINDS]
            if not tries[0]:
                continue
            lines.append(
                f"| {driver} | {checks or '-'} | {len(tries[0])} | {until} | {' | '.join(map(_told, tries))} |"
            )
    lines += [f"- {row['driver']} fails {what}" for row in rows for what in row.get("failed", ())]
    walks = [row for row in rows if row["driver"] == STALLS]
    if not walks:
        return lines
    lines += [
        "",
        f"Why commands live {life} ms: a walk at 0.5 m/s whose motion control does nothing at all for a while, about"
        f" once a second, for {TIME / 1000:.0f} s; how many of {len(walks)} robots stay upright.",
        "",
        f"| commands live | {' | '.join(f'stalls of {stall} ms' for stall in STALL_TIMES)} |",
        f"| --- {'| --- ' * len(STALL_TIMES)}|",
    ]
    for each in LIVES:
        names = [f"life {each} ms, stalls of {stall} ms: upright [s]" for stall in STALL_TIMES]
        upright = [str(sum(row[name] >= TIME / 1000 for row in walks)) for name in names]
        lines.append(f"| {each} ms | {' | '.join(upright)} |")
    return lines


def _told(times: list[float]) -> str:
    return f"{np.median(times):.1f} ms, {max(times):.1f} at most" if times else "-"


def choose(options: Mapping[str, str]) -> list[tuple[str, int | str]]:
    """Return what is tried.

    Args:
        options: rounds of tries; drivers, with commas between; walks of each kind with stalls.

    Raises:
        ValueError: for other options, or values that cannot be used.
    """
    known = {"rounds": str(ROUNDS), "drivers": ",".join(DRIVERS), "walks": str(WALKS)}
    if not options.keys() <= known.keys():
        raise ValueError(f"options are {', '.join(options)}; expected some of {', '.join(known)}")
    chosen = known | dict(options)
    drivers = chosen["drivers"].split(",")
    if not set(drivers) <= set(DRIVERS):
        raise ValueError(f"drivers are {chosen['drivers']}; expected some of {','.join(DRIVERS)}")
    trials = [(driver, number) for number in (CHECK, *range(1, int(chosen["rounds"]) + 1)) for driver in drivers]
    return [*trials, *((STALLS, seed) for seed in range(int(chosen["walks"])))]


BENCH = Bench(
    "drivers",
    "Time-out and emergency stop of the drivers",
    choose({}),
    measure,
    summarize,
    workers=1,
    choose=choose,
)
