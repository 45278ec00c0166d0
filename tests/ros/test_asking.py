"""Calls of services without waiting: answers, nobody there, nobody who answers, an asker that ends."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from typing import Any

import pytest
from rclpy.node import Node
from std_srvs.srv import Trigger

from tulip_ros import asking
from tulip_ros.asking import Asker, NotServedError, ServiceClient
from tulip_ros.run import session

pytestmark = [pytest.mark.ros, pytest.mark.usefixtures("ros_domain")]


@pytest.fixture
def graph() -> Iterator[tuple[Node, Callable[[float], None]]]:
    with session(lambda: Node("asker"), ["test"], handle_signals=False) as found:
        yield found


def answer(request: Any, response: Any) -> Any:
    response.message = "here"
    return response


def ready(asker: Asker, spin: Callable[[float], None], name: str) -> ServiceClient:
    client = asker.client(Trigger, name)
    while not client.service_is_ready():
        spin(0.05)
    return client


def test_answer_comes_while_the_node_runs_and_another_thread_may_wait_for_it(
    graph: tuple[Node, Callable[[float], None]],
):
    node, spin = graph
    node.create_service(Trigger, "served", answer)
    asker = Asker(node)
    client = ready(asker, spin, "served")
    waiting: Future[Any] = Future()
    thread = threading.Thread(target=lambda: waiting.set_result(asker.wait_for(client, Trigger.Request())))
    thread.start()
    asked = asker.ask(client, Trigger.Request())
    while not (asked.done() and waiting.done()):
        spin(0.05)
    thread.join()
    assert asked.result().message == waiting.result().message == "here"


def test_nobody_there_is_said_at_once(graph: tuple[Node, Callable[[float], None]]):
    node, _ = graph
    asker = Asker(node)
    asked = asker.ask(asker.client(Trigger, "nowhere"), Trigger.Request())
    with pytest.raises(NotServedError, match="no node serves nowhere now"):
        asked.result(0.0)


def test_question_without_an_answer_ends_in_words(
    graph: tuple[Node, Callable[[float], None]], monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(asking, "ANSWER", 0.3)
    node, spin = graph
    silent = Node("silent")  # no executor serves it, as that of a node that hangs
    silent.create_service(Trigger, "silent", answer)
    asker = Asker(node)
    client = ready(asker, spin, "silent")
    asked = asker.ask(client, Trigger.Request())
    while not asked.done():
        spin(0.05)
    with pytest.raises(NotServedError, match="silent does not answer within 0 s; is its node still running"):
        asked.result()
    with pytest.raises(NotServedError, match="was asked by a node that is ending"):
        asker.wait_for(client, Trigger.Request())  # nobody runs the asking node either
    silent.destroy_node()
