"""Option `network`: a graph on several computers, who name each other. Standard library only: the doctor uses it, too.

Nodes keep to their own machine unless this lets others in: by the interfaces that lead to the peers, and no others.
"""

from __future__ import annotations

import atexit
import ipaddress
import os
import re
import socket
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

from tulip_ros import transport
from tulip_ros.errors import BadInputError
from tulip_ros.ports import GRAPH_PORTS, own_ports

OPTION = "--network"
METAVAR = "PEER[,PEER]"
HELP = "The graph's other computers, which it is opened to: addresses or names, as in 192.168.8.2,robot.local."
PEERS_VARIABLE = "ROS_STATIC_PEERS"
NAME = re.compile(r"([a-z0-9_]([a-z0-9_-]*[a-z0-9])?\.)*[a-z0-9_]*[a-z_]([a-z0-9_-]*[a-z0-9])?\.?", re.IGNORECASE)
"""A computer's name: the last part is no number, or it would be a torn address."""
SCHEMA = "http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles"
LIST_PATH = ".//{*}interfaceWhiteList"
PROBE = 9  # a UDP port; nothing is sent there


class Peer(NamedTuple):
    """Another computer of the graph.

    Attributes:
        name: As the user named it.
        address: IPv4.
        own: Address of this computer's interface that leads there.
    """

    name: str
    address: str
    own: str


def find_peers(names: str) -> tuple[Peer, ...]:
    """Find the computers that a user has named, and by which interface each can be reached.

    Args:
        names: Addresses or names with commas between them.

    Raises:
        BadInputError: for what is no address or name, does not resolve, is this computer, or cannot be reached.
    """
    peers = {peer.address: peer for peer in map(_find, filter(None, map(str.strip, names.split(","))))}
    if not peers:
        raise BadInputError(f"{OPTION} is {names!r}; expected addresses or names, as in 192.168.8.2,robot.local.")
    return tuple(peers.values())


def _find(name: str) -> Peer:
    address = _resolve(name)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((address, PROBE))  # sends nothing: the system only chooses the interface
        except PermissionError:  # all of a network: broadcast
            raise _not_one(name) from None
        except OSError as error:
            raise BadInputError(
                f"{OPTION}: no interface of this computer leads to {_told(name, address)} ({error.strerror});"
                " join its network or VPN first."
            ) from None
        own = str(probe.getsockname()[0])
    if own == address or ipaddress.ip_address(address).is_loopback:
        raise BadInputError(
            f"{OPTION}: {_told(name, address)} is this computer itself; expected the other computer's address."
        )
    return Peer(name, address, own)


def _resolve(name: str) -> str:
    """Return the IPv4 address of an address or a name."""
    try:
        address = ipaddress.ip_address(name)
    except ValueError:
        if not NAME.fullmatch(name):
            raise BadInputError(
                f"{OPTION}: {name!r} is no address; expected one as in 192.168.8.2, or a name as in robot.local."
            ) from None
    else:
        if address.version != 4:
            raise BadInputError(f"{OPTION}: {name} is an address of IPv6; expected IPv4, which the transport speaks.")
        if address.is_multicast or address.is_unspecified or address == ipaddress.ip_address("255.255.255.255"):
            raise _not_one(name)
        return str(address)
    try:
        return str(socket.getaddrinfo(name, None, socket.AF_INET, socket.SOCK_DGRAM)[0][4][0])
    except OSError as error:
        raise BadInputError(
            f"{OPTION}: the name {name!r} does not resolve ({error.strerror}); give the computer's address."
        ) from None


def _not_one(name: str) -> BadInputError:
    return BadInputError(f"{OPTION}: {name} is not one computer's address; expected one as in 192.168.8.2.")


def _told(name: str, address: str) -> str:
    return name if name == address else f"{name} ({address})"


def profile(name: str, interfaces: Sequence[str]) -> str:
    """Return a transport's profile that lets in further interfaces.

    Args:
        name: As for `transport.profile_path`.
        interfaces: Their IPv4 addresses.

    Raises:
        ValueError: for another name.
    """
    ElementTree.register_namespace("", SCHEMA)
    root = ElementTree.parse(transport.profile_path(name)).getroot()
    for allowed in root.findall(LIST_PATH):
        for interface in interfaces:
            ElementTree.SubElement(allowed, f"{{{SCHEMA}}}address").text = interface
    return ElementTree.tostring(root, encoding="unicode")


def join(names: str, transport_name: str = "auto") -> None:
    """Open this process, and those that it starts, to other computers, and tell in a line what is open to whom.

    Args:
        names: As for `find_peers`; "" for none: all stays on this machine.
        transport_name: As for `transport.profile_path`.

    Raises:
        BadInputError: as `find_peers`, or if variables of the environment say something else.
    """
    if not names:
        return
    _check_environment()
    peers = find_peers(names)
    own = tuple(dict.fromkeys(peer.own for peer in peers))
    os.environ[transport.PROFILE_VARIABLE] = str(_kept(profile(transport_name, own)))
    os.environ[transport.RANGE_VARIABLE] = transport.RANGE
    os.environ[PEERS_VARIABLE] = ";".join(peer.address for peer in peers)
    ports, graph = own_ports(), GRAPH_PORTS
    print(
        f"network: looks for nodes on {', '.join(_told(peer.name, peer.address) for peer in peers)}; UDP"
        f" {ports.first}-{ports.last} and {graph.first}-{graph.last} of {', '.join(own)} are open, without password, to"
        " whatever computer reaches them (docs/network.md)",
        file=sys.stderr,
    )


def _check_environment() -> None:
    for variable, fitting in (
        (transport.PROFILE_VARIABLE, ""),
        (PEERS_VARIABLE, ""),
        ("ROS_LOCALHOST_ONLY", "0"),
        (transport.RANGE_VARIABLE, transport.RANGE),
    ):
        value = os.environ.get(variable, "")
        if value not in ("", fitting):
            raise BadInputError(
                f"{variable} is {value}, which {OPTION} would replace; unset it, or do without {OPTION}."
            )


def _kept(text: str) -> Path:
    """Write a file that is there until this process ends: nodes that are started again read it anew."""
    number, name = tempfile.mkstemp(prefix="tulip_network_", suffix=".xml")
    atexit.register(Path(name).unlink, missing_ok=True)
    with open(number, "w") as file:
        file.write(text)
    return Path(name)
