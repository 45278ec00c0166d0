from __future__ import annotations

import socket

from tulip_description.planar import Pose2D
from tulip_sim.referee_udp import RefereeSocket
from tulip_strategy.game_controller import Rejected, Reply, RobotStatus, encode_reply


def test_packets_arrive_over_udp_and_replies_come_back() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as robot:
        robot.bind(("127.0.0.1", 0))
        robot.settimeout(5.0)
        with RefereeSocket(port=robot.getsockname()[1]) as referee:
            referee.send(b"RGme-packet")
            data, sender = robot.recvfrom(1024)
            assert data == b"RGme-packet"
            assert referee.replies() == []
            robot.sendto(encode_reply(Reply(25, 1)), sender)
            robot.sendto(b"nonsense", sender)
            received: list[Reply | Rejected] = []
            while len(received) < 2:  # the loopback delivers in order, though not at once
                received += referee.replies()
            assert received[0] == Reply(25, 1)
            assert isinstance(received[1], Rejected)


def test_sending_while_nobody_listens_is_no_error() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as robot:
        robot.bind(("127.0.0.1", 0))
        port = robot.getsockname()[1]
    with RefereeSocket(port=port) as referee:
        for _ in range(4):
            referee.send(b"packet")
        assert referee.replies() == []


def test_replies_to_a_port_of_their_own_are_heard_too() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as robot:
        robot.bind(("127.0.0.1", 0))
        port = robot.getsockname()[1]
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.bind(("127.0.0.1", 0))
            reply_port = probe.getsockname()[1]
        status = RobotStatus(True, Pose2D(-1.5, 0.25, 0.5))
        replies = [Reply(25, 1), Reply(25, 1, version=2), Reply(25, 1, version=4, status=status)]
        with RefereeSocket(port=port, reply_port=reply_port) as referee:
            for reply in replies:
                robot.sendto(encode_reply(reply), ("127.0.0.1", reply_port))
            received: list[Reply | Rejected] = []
            while len(received) < 3:
                received += referee.replies()
            assert received == replies
