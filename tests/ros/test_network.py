"""Who may be named as the graph's other computers, and what is opened to them."""

from __future__ import annotations

import os
import re
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import _installation as installation
import doctor
import pytest
from rclpy.node import Node

from tulip_ros import network, ports, transport
from tulip_ros.errors import BadInputError
from tulip_ros.nodes import LOOKERS, NODES
from tulip_ros.run import session

WORDS = {  # with nothing asked of the network
    "10.0.0": "'10.0.0' is no address",
    "10.0.0.2:7400": "'10.0.0.2:7400' is no address",
    "256.1.1.1": "'256.1.1.1' is no address",
    "robot local": "'robot local' is no address",
    "-robot": "'-robot' is no address",
    "fe80::1": "is an address of IPv6; expected IPv4",
    "239.255.0.1": "is not one computer's address",
    "0.0.0.0": "is not one computer's address",
    "255.255.255.255": "is not one computer's address",
    "127.0.0.1": "127.0.0.1 is this computer itself",
    "127.1.2.3": "127.1.2.3 is this computer itself",
    " , ": "expected addresses or names",
}


ADDRESSES = {"robot.local": "192.0.2.7", "operator": "192.0.2.8", "me": "192.0.2.1", "far": "198.51.100.1"}


class Roads:
    """In place of a machine's sockets and names: one interface, 192.0.2.1/24, and nothing beyond it."""

    AF_INET, SOCK_DGRAM = socket.AF_INET, socket.SOCK_DGRAM

    def socket(self, *_: Any) -> Roads:
        return self

    def __enter__(self) -> Roads:
        return self

    def __exit__(self, *_: Any) -> None:
        pass

    def connect(self, where: tuple[str, int]) -> None:
        if where[0] == "192.0.2.255":
            raise PermissionError(13, "Permission denied")
        if not where[0].startswith("192.0.2."):
            raise OSError(101, "Network is unreachable")

    def getsockname(self) -> tuple[str, int]:
        return "192.0.2.1", 40000

    def getaddrinfo(self, name: str, *_: Any) -> list[Any]:
        if name not in ADDRESSES:
            raise socket.gaierror(-2, "Name or service not known")
        return [(None, None, None, "", (ADDRESSES[name], 0))]


@pytest.fixture
def roads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(network, "socket", Roads())
    for name in (transport.PROFILE_VARIABLE, network.PEERS_VARIABLE, transport.RANGE_VARIABLE, "ROS_LOCALHOST_ONLY"):
        monkeypatch.setenv(name, "")  # whatever is set meanwhile is taken back
        monkeypatch.delenv(name)


@pytest.mark.parametrize("names", WORDS)
def test_what_is_no_other_computer_is_refused_in_words(names: str) -> None:
    with pytest.raises(BadInputError, match=re.escape(WORDS[names])):
        network.find_peers(names)


@pytest.mark.parametrize(
    ("names", "words"),
    [
        ("192.0.2.1", "192.0.2.1 is this computer itself"),
        ("me", "me (192.0.2.1) is this computer itself"),
        ("192.0.2.255", "is not one computer's address"),
        ("198.51.100.1", "no interface of this computer leads to 198.51.100.1 (Network is unreachable)"),
        ("operator,far", "leads to far (198.51.100.1)"),
        ("nobody", "the name 'nobody' does not resolve (Name or service not known)"),
    ],
)
@pytest.mark.usefixtures("roads")
def test_who_cannot_be_found_or_reached_is_told_with_the_reason(names: str, words: str) -> None:
    with pytest.raises(BadInputError, match=re.escape(words)):
        network.find_peers(names)


@pytest.mark.usefixtures("roads")
def test_peers_are_found_by_address_or_name_each_once() -> None:
    robot = network.Peer("robot.local", "192.0.2.7", "192.0.2.1")
    assert network.find_peers("robot.local, 192.0.2.9,") == (robot, network.Peer("192.0.2.9", "192.0.2.9", "192.0.2.1"))
    assert network.find_peers("192.0.2.7,robot.local") == (robot,)


@pytest.mark.parametrize("name", transport.NAMES)
def test_by_default_data_come_by_loopback_alone_and_with_peers_by_their_interfaces_too(name: str) -> None:
    def allowed(text: str) -> list[str | None]:
        (udp,) = (each for each in ElementTree.fromstring(text).iter() if _has(each, "type", "UDPv4"))
        assert _has(udp, "maxInitialPeersRange", "32")
        (addresses,) = (each for each in udp if each.tag.endswith("interfaceWhiteList"))
        return [each.text for each in addresses]

    closed = transport.profile_path(name).read_text()
    assert allowed(closed) == ["127.0.0.1"]
    opened = network.profile(name, ["192.0.2.1", "10.8.0.3"])
    assert allowed(opened) == ["127.0.0.1", "192.0.2.1", "10.8.0.3"]
    without = re.sub(r"\s*<address>(192|10)[0-9.]*</address>", "", opened)  # else it is the same profile
    assert ElementTree.canonicalize(without, strip_text=True) == ElementTree.canonicalize(closed, strip_text=True)


def _has(element: ElementTree.Element, tag: str, text: str) -> bool:
    return any(child.tag.endswith(f"}}{tag}") and child.text == text for child in element)


@pytest.mark.usefixtures("roads")
def test_joining_sets_what_ros_reads_and_says_what_is_open_to_whom(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv(ports.DOMAIN_VARIABLE, "43")
    network.join("robot.local,192.0.2.9")
    (line,) = capsys.readouterr().err.splitlines()
    assert "nodes on robot.local (192.0.2.7), 192.0.2.9; UDP 18150-18399 and 7000-7399 of 192.0.2.1 are open" in line
    assert os.environ[network.PEERS_VARIABLE] == "192.0.2.7;192.0.2.9"
    assert os.environ[transport.RANGE_VARIABLE] == "LOCALHOST"
    profile = Path(os.environ[transport.PROFILE_VARIABLE])
    assert "<address>192.0.2.1</address>" in profile.read_text()
    transport.use_profile()
    assert os.environ[transport.PROFILE_VARIABLE] == str(profile)


def test_the_profile_is_there_as_long_as_the_process_that_made_it() -> None:
    code = "from tulip_ros import network; path = network._kept('x'); print(path, path.read_text())"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    path, text = done.stdout.split()
    assert text == "x" and not Path(path).exists()


@pytest.mark.usefixtures("roads")
def test_without_peers_nothing_is_opened(capsys: pytest.CaptureFixture[str]) -> None:
    network.join("")
    assert not {network.PEERS_VARIABLE, transport.PROFILE_VARIABLE} & os.environ.keys()
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    ("variable", "value"),
    [
        (transport.PROFILE_VARIABLE, "/own.xml"),
        (network.PEERS_VARIABLE, "192.0.2.3"),
        (transport.RANGE_VARIABLE, "SUBNET"),
        ("ROS_LOCALHOST_ONLY", "1"),
    ],
)
@pytest.mark.usefixtures("roads")
def test_variables_that_say_something_else_are_named(
    monkeypatch: pytest.MonkeyPatch, variable: str, value: str
) -> None:
    monkeypatch.setenv(variable, value)
    with pytest.raises(BadInputError, match=f"{variable} is {value}, which --network would replace"):
        network.join("robot.local")


@pytest.mark.parametrize("name", ["ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_STATIC_PEERS"])
def test_the_doctor_tells_of_variables_that_open_nothing_any_more(name: str) -> None:
    (found,) = installation.variables({name: "SUBNET"})
    assert found.level == installation.WARNING and "use option --network" in found.words
    (found,) = installation.variables({name: "SUBNET", "FASTRTPS_DEFAULT_PROFILES_FILE": __file__})
    assert found.level == installation.OK


def test_the_doctor_refuses_a_peer_that_is_none(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv(transport.PROFILE_VARIABLE, raising=False)  # a node of another test may have set it
    assert doctor.main(["--network", "10.0.0"]) == 2
    assert capsys.readouterr().err.startswith("error: --network: '10.0.0' is no address")


def test_ports_of_domains_do_not_overlap_and_follow_the_standard() -> None:
    assert ports.domain_ports(0) == (7400, 7649)
    assert ports.domain_ports(1).first == ports.domain_ports(0).last + 1
    assert ports.GRAPH_PORTS.last + 1 == ports.domain_ports(0).first


def test_nodes_that_only_look_are_nodes_and_none_of_them_plays() -> None:
    assert LOOKERS and not any(NODES[name].playing for name in LOOKERS)


@pytest.mark.ros
def test_what_nodes_listen_on_is_bound_to_loopback_by_default(ros_domain: int) -> None:
    with session(lambda: Node("listener"), ["test"], handle_signals=False):
        inodes = {os.readlink(path) for path in Path("/proc/self/fd").iterdir() if path.exists()}
        lines = [line.split() for line in Path("/proc/self/net/udp").read_text().splitlines()[1:]]
        own = [fields[1].split(":") for fields in lines if f"socket:[{fields[9]}]" in inodes]
    # Sockets at other ports are those that it sends from.
    listened = [ports.domain_ports(ros_domain), ports.GRAPH_PORTS]
    bound = [address for address, port in own if any(each.first <= int(port, 16) <= each.last for each in listened)]
    assert len(bound) >= 2 and set(bound) == {"0100007F"}


@pytest.mark.ros
@pytest.mark.usefixtures("ros_domain")
def test_security_of_dds_is_not_in_the_wheels_as_the_documents_say(tmp_path: Path) -> None:
    (tmp_path / "enclaves").mkdir()
    keys = {"ROS_SECURITY_ENABLE": "true", "ROS_SECURITY_KEYSTORE": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, "-m", "tulip_strategy.user_input_node"],
        env={**os.environ, **keys},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 2
    assert "This Fast DDS version doesn't have the security libraries" in done.stderr
