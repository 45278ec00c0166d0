"""What all tests share."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator

import pytest
from hypothesis import HealthCheck, settings

# On a busy machine an example may take any time: that is no fault.
settings.register_profile("any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("any machine")

GRAPH = {"ros_domain", "module_ros_domain"}
"""Fixtures of tests that run nodes: one after the other, since a graph fills two cores."""
DOMAINS = 102  # above 101 the ports collide with those that the system gives out
APART = 31  # domains between those of two processes, who look for free ones from there on


def pytest_configure() -> None:
    """Give each process of pytest-xdist a ROS domain of its own, for tests whose nodes are all in one process."""
    worker = os.environ.get("PYTEST_XDIST_WORKER", "")
    if worker:
        first = int(os.environ.get("ROS_DOMAIN_ID", 0))
        os.environ["ROS_DOMAIN_ID"] = str((first + APART * int(worker.removeprefix("gw"))) % DOMAINS)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Tell pytest-xdist what belongs together: all tests that run nodes, and of the others those of a file."""
    for item in items:
        runs_nodes = bool(GRAPH & set(getattr(item, "fixturenames", ())))
        item.add_marker(pytest.mark.xdist_group("graph" if runs_nodes else str(item.path)))


def _is_free(domain: int) -> bool:
    """Return whether no first participant listens in a ROS domain (its port follows from the DDS standard)."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("", 7410 + 250 * domain))
        except OSError:
            return False
    return True


def _enter_free_domain(patch: pytest.MonkeyPatch) -> int:
    first = int(os.environ.get("ROS_DOMAIN_ID", os.getpid() % DOMAINS))
    domain = next(each % DOMAINS for each in range(first, first + DOMAINS) if _is_free(each % DOMAINS))
    patch.setenv("ROS_DOMAIN_ID", str(domain))
    patch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    return domain


@pytest.fixture
def ros_domain(monkeypatch: pytest.MonkeyPatch) -> int:
    """A ROS domain that nobody uses, set for this process and its children; traffic stays on this machine."""
    return _enter_free_domain(monkeypatch)


@pytest.fixture(scope="module")
def module_ros_domain() -> Iterator[int]:
    """The same, for all tests of a module."""
    with pytest.MonkeyPatch.context() as patch:
        yield _enter_free_domain(patch)
