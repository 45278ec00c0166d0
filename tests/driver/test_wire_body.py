"""Driver and body at the two ends of a wire: the whole contract, and everything that can be wrong at the other end."""

from __future__ import annotations

import os
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from bodies import ROBOT, VirtualBody, command
from wires import Pipe, VirtualWire

from tulip_description.robot import JOINTS
from tulip_driver.check.rows import Judgement, verdict
from tulip_driver.check.run import check_driver
from tulip_driver.contract import BodyError
from tulip_driver.wire.body import WireBody
from tulip_driver.wire.frames import command_frames, identity_frames, reading_frames
from tulip_driver.wire.links import SerialLine, UdpServer
from tulip_driver.wire.packet import Kind, Packet, encode
from tulip_driver.wire.server import WireServer

READING = VirtualBody().exchange(None)


@contextmanager
def served(names: tuple[str, ...] = ROBOT.joint_names, version: int = 1, flip: bool = False) -> Iterator[int]:
    """Run a body behind UDP in a thread; yield its port."""
    link = UdpServer(port=0)
    sent = link.send

    def spoiled(data: bytes) -> None:
        data = data[:2] + bytes([version]) + data[3:]
        sent(data[:-1] + bytes([data[-1] ^ flip]))

    link.send = spoiled  # type: ignore[method-assign]
    server, over = WireServer(link, names), threading.Event()

    def live() -> None:
        body = VirtualBody()
        while not over.is_set():
            server.send(body.exchange(server.receive(0.002)))

    thread = threading.Thread(target=live)
    thread.start()
    try:
        yield link.port
    finally:
        over.set()
        thread.join()
        server.close()


def test_the_echo_body_behind_the_wire_passes_every_check() -> None:
    rows = list(check_driver(VirtualWire(), ROBOT, lambda: True))
    assert verdict(rows)[0], [row for row in rows if row.judgement is Judgement.FAIL]


def test_commands_go_to_the_body_over_udp_and_readings_come_back() -> None:
    with served() as port:
        body = WireBody(ROBOT, port=port, patience=20.0)
        body.start()
        order = command(position=0.5, stiffness=10.0)
        for _ in range(1000):
            reading = body.exchange(order)
            if reading.joint_positions[0] == 0.5:
                break
        assert reading.joint_positions[:12].tolist() == [0.5] * 12
        body.stop()
        body.stop()
        body.start()
        body.stop()


def test_a_silent_peer_is_told_with_what_to_do() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as nobody:
        nobody.bind(("127.0.0.1", 0))
        port = nobody.getsockname()[1]
        with pytest.raises(BodyError, match=rf"UDP port {port} does not answer within 0.3 s.*emulate_body.py"):
            WireBody(ROBOT, port=port, patience=0.3).start()


def test_a_noisy_line_is_told_by_its_checksum() -> None:
    with served(flip=True) as port, pytest.raises(BodyError, match=r"none was understood.*checksum"):
        WireBody(ROBOT, port=port, patience=0.5).start()


def test_another_version_is_told() -> None:
    with served(version=3) as port, pytest.raises(BodyError, match=r"version 3 of the wire; expected 1.*Update"):
        WireBody(ROBOT, port=port, patience=20.0).start()


def test_another_robot_is_told() -> None:
    names = tuple(f"{name}_of_another" for name in JOINTS)
    with served(names) as port, pytest.raises(BodyError, match="another robot: the body's joints have other names"):
        WireBody(ROBOT, port=port, patience=20.0).start()
    with served(names[:12]) as port, pytest.raises(BodyError, match="has 12 joints; expected 14"):
        WireBody(ROBOT, port=port, patience=20.0).start()


def test_a_port_that_is_taken_and_an_address_that_is_none_are_told() -> None:
    with served() as port, pytest.raises(BodyError, match=f"cannot listen on UDP 127.0.0.1:{port}"):
        UdpServer(port=port)
    with pytest.raises(BodyError, match=r"cannot be at no\.such\.host"):
        WireBody(ROBOT, address="no.such.host").start()


class TestServer:
    """What the body takes of what comes over the wire."""

    def setup_method(self) -> None:
        self.pipe = Pipe(VirtualBody())
        self.pipe.live()

    def give(self, kind: Kind, sequence: int, data: bytes | None = None) -> np.ndarray | None:
        frames = command_frames(command(position=0.1, stiffness=1.0), JOINTS)
        packet = Packet(kind, sequence, 0, frames) if kind is Kind.COMMAND else Packet(kind, sequence)
        self.pipe.to_body.append(encode(packet) if data is None else data)
        came = self.pipe.server.receive(0.0)
        return None if came is None else came.stiffness

    def test_nobody_is_obeyed_before_a_hello(self) -> None:
        assert self.give(Kind.COMMAND, 1) is None
        assert self.pipe.server.refused == {"packets of a stranger": 1}

    def test_stale_and_doubled_packets_change_nothing_until_the_next_hello(self) -> None:
        self.give(Kind.HELLO, 10)
        assert self.give(Kind.COMMAND, 12) is not None
        assert self.give(Kind.COMMAND, 12) is None
        assert self.give(Kind.COMMAND, 11) is None
        assert self.pipe.server.refused == {"stale packets": 2}
        self.give(Kind.HELLO, 1)
        assert self.give(Kind.COMMAND, 2) is not None

    def test_an_answer_to_a_reading_that_was_never_sent_is_from_another_time(self) -> None:
        self.give(Kind.HELLO, 1)
        frames = command_frames(command(), JOINTS)
        stamp = self.pipe.live().stamp
        assert self.give(Kind.COMMAND, 2, encode(Packet(Kind.COMMAND, 2, stamp + 1, frames))) is None
        assert self.give(Kind.COMMAND, 3, encode(Packet(Kind.COMMAND, 3, stamp, frames))) is not None
        self.pipe.server.begin_anew()
        assert self.give(Kind.COMMAND, 4, encode(Packet(Kind.COMMAND, 4, stamp, frames))) is None
        assert self.pipe.server.refused == {"answers to readings of another time": 2}

    def test_a_stop_takes_all_torque_from_all_joints(self) -> None:
        self.give(Kind.HELLO, 1)
        stiffness = self.give(Kind.STOP, 2)
        assert stiffness is not None and stiffness.tolist() == [0.0] * 14

    def test_garbage_changes_nothing_and_is_counted(self) -> None:
        self.give(Kind.HELLO, 1)
        for data in (b"", b"TU\x01", bytes(300), b"TU\x09" + bytes(40), encode(Packet(Kind.COMMAND, 5))):
            assert self.give(Kind.COMMAND, 0, data) is None
        assert self.pipe.server.refused == {"packets that are not understood": 4, "packets of another version": 1}
        assert self.give(Kind.COMMAND, 2) is not None

    def test_a_driver_of_another_version_gets_an_answer_from_which_it_learns_that(self) -> None:
        self.give(Kind.HELLO, 1, b"TU\x09" + bytes(40))
        assert self.pipe.to_driver.popleft()[2] == 1


def test_a_body_that_is_started_anew_is_heard_again() -> None:
    body = VirtualWire()
    body.start()
    for _ in range(50):
        body.exchange(None)
    newest = body.exchange(None).stamp
    pipe = body._link
    assert isinstance(pipe, Pipe)
    pipe.server = WireServer(pipe.server._link, ROBOT.joint_names)  # counts from one
    body._silent_since = -1.0
    pipe.to_driver.clear()
    pipe.receive = lambda timeout: None  # type: ignore[method-assign]
    body.exchange(None)  # hears nothing, and greets again
    del pipe.receive
    for _ in range(3):
        reading = body.exchange(None)
    assert reading.stamp > newest


def test_a_serial_line_carries_packets_and_has_no_echo() -> None:
    near, far = os.openpty()
    driver = SerialLine(os.ttyname(far))
    packet = encode(Packet(Kind.READING, 1, 0, reading_frames(READING)))
    os.write(near, b"noise" + packet[:100])
    assert driver.receive(0.0) is None
    os.write(near, packet[100:])
    assert driver.receive(5.0) == packet
    driver.send(packet)
    assert os.read(near, 4096) == packet
    driver.close()
    os.close(near)
    os.close(far)


def test_serial_lines_that_cannot_be_used_are_told() -> None:
    for device, baud, words in (
        ("/dev/no_such_line", 2_000_000, "cannot be opened: No such file"),
        ("/dev/null", 2_000_000, "is no serial line"),
        ("/dev/null", 12345, "cannot run at 12345 bits a second"),
    ):
        with pytest.raises(BodyError, match=words):
            WireBody(ROBOT, device=device, baud=baud).start()


def test_identity_of_the_robot_is_one_frame() -> None:
    assert identity_frames(JOINTS)["id"].tolist() == [1]
