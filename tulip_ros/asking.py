"""Calls of ROS services without waiting, each answered in time: by the server, or by words that say why not.

A request that was not answered in time is taken back, so that it does not arrive later.
"""

from __future__ import annotations

from concurrent.futures import Future
from threading import Lock
from time import monotonic
from typing import Any, NamedTuple

import rclpy.task
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

ANSWER = 5.0  # [s] of wall-clock time until an answer must be there
LOOK = 0.2  # [s] between two looks for answers that are overdue


class NotServedError(Exception):
    """A service was not asked, or did not answer; the message says why."""


class ServiceClient:
    """A client whose requests can be taken back.

    What was asked while a link was cut would be delivered when the link is back, long after whoever asked has been told
    that nothing was done.

    Attributes:
        srv_type: Class of the service.
        srv_name: Its name.
    """

    def __init__(self, node: Node, service_type: type[Any], name: str) -> None:
        self._node, self.srv_type, self.srv_name = node, service_type, name
        self._lock = Lock()
        self._client = node.create_client(service_type, name)

    def service_is_ready(self) -> bool:
        """Return whether a node serves it now."""
        with self._lock:
            return bool(self._client.service_is_ready())

    def call_async(self, request: Any) -> rclpy.task.Future:
        """Send a request and return what will hold the answer."""
        with self._lock:
            return self._client.call_async(request)

    def take_back(self) -> None:
        """Have nothing delivered any more that was not yet; from the node's own thread.

        A writer that is gone repeats nothing. What a server has got already it may still do.
        """
        with self._lock:
            self._node.destroy_client(self._client)
            self._client = self._node.create_client(self.srv_type, self.srv_name)


class _Question(NamedTuple):
    client: ServiceClient
    due: float
    answer: Future[Any]


class Asker:
    """Calls services from any thread; the node's own thread must be running it."""

    def __init__(self, node: Node) -> None:
        """Begin.

        Args:
            node: Has the clients.
        """
        self._node = node
        self._questions: dict[rclpy.task.Future, _Question] = {}
        self._lock = Lock()
        self._timer = node.create_timer(LOOK, self._give_up, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def client(self, service_type: type[Any], name: str) -> ServiceClient:
        """Return a client of the node for a service, given its class and its name."""
        return ServiceClient(self._node, service_type, name)

    def ask(self, client: ServiceClient, request: Any) -> Future[Any]:
        """Send a request and return at once. One that nobody answers in time is taken back.

        Args:
            client: One of the node's.
            request: Of the client's type.

        Returns:
            What will hold the answer; or a NotServedError, if nobody serves it now or no answer comes in time.
        """
        answer: Future[Any] = Future()
        if not client.service_is_ready():
            answer.set_exception(NotServedError(f"no node serves {client.srv_name} now"))
            return answer
        asked = client.call_async(request)
        with self._lock:
            self._questions[asked] = _Question(client, monotonic() + ANSWER, answer)
        asked.add_done_callback(self._on_answer)
        return answer

    def wait_for(self, client: ServiceClient, request: Any) -> Any:
        """Send a request and return the answer; from any thread but the node's own. Arguments as for `ask`.

        Raises:
            NotServedError: if nobody serves it now, or no answer comes in time.
        """
        try:
            return self.ask(client, request).result(ANSWER + 1.0)
        except TimeoutError:
            raise NotServedError(f"{client.srv_name} was asked by a node that is ending") from None

    def _on_answer(self, asked: rclpy.task.Future) -> None:
        with self._lock:
            question = self._questions.pop(asked, None)
        if question is None:
            return  # given up
        error = asked.exception()
        if error is not None:
            question.answer.set_exception(error)
        else:
            question.answer.set_result(asked.result())

    def _give_up(self) -> None:
        """End what is overdue."""
        now = monotonic()
        with self._lock:
            overdue = [asked for asked, question in self._questions.items() if question.due < now]
            questions = [(asked, self._questions.pop(asked)) for asked in overdue]
        for client in {question.client for _, question in questions}:
            client.take_back()
        for _, (client, _, answer) in questions:
            words = f"{client.srv_name} does not answer within {ANSWER:.0f} s; is its node still running?"
            answer.set_exception(NotServedError(words))
