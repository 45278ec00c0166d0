"""The ports of a graph: UDP's, and those of the same numbers in shared memory."""

from __future__ import annotations

import os
from typing import NamedTuple

DOMAIN_VARIABLE = "ROS_DOMAIN_ID"


class Ports(NamedTuple):
    """Ports from first to last."""

    first: int
    last: int

    def __contains__(self, port: object) -> bool:
        """Return whether a port is one of them."""
        return isinstance(port, int) and self.first <= port <= self.last


GRAPH_PORTS = Ports(7000, 7399)
"""By which each process learns who has which topics: the first that is free, in every domain."""


def domain_ports(domain: int) -> Ports:
    """Return the ports of a domain's discovery and data (DDSI-RTPS 2.2, 9.6.1.1).

    Args:
        domain: As in ROS_DOMAIN_ID.
    """
    return Ports(7400 + 250 * domain, 7649 + 250 * domain)


def own_ports() -> Ports:
    """Return the ports of the domain that the environment tells; those of domain 0 for what ROS refuses."""
    domain = os.environ.get(DOMAIN_VARIABLE, "")
    return domain_ports(int(domain) if domain.isdecimal() else 0)
