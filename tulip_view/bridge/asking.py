"""Calls of ROS services from a thread that does not run the node: the node's own thread must be running it."""

from __future__ import annotations

import threading
from typing import Any

from rclpy.client import Client
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.serialization import deserialize_message, serialize_message

ANSWER = 10.0  # [s] of wall-clock time until an answer must be there


class NotServedError(Exception):
    """A service did not do what it was asked for; the message says why."""


def ask(client: Client, request: Any) -> Any:
    """Return the answer to a request.

    Raises:
        NotServedError: if nobody serves it, or no answer comes in time.
    """
    if not client.service_is_ready():
        raise NotServedError(f"no node serves {client.srv_name} now")
    future, done = client.call_async(request), threading.Event()
    future.add_done_callback(lambda _: done.set())
    if not done.wait(ANSWER):
        client.remove_pending_request(future)
        raise NotServedError(f"{client.srv_name} does not answer within {ANSWER:.0f} s; is its node still running?")
    return future.result()


def ask_serialized(client: Client, request: bytes) -> bytes:
    """Return the serialized answer (CDR) to a serialized request.

    Raises:
        NotServedError: if the request is no such message, or as for `ask`.
    """
    request_class = client.srv_type.Request
    if request_class.get_fields_and_field_types():
        try:
            message = deserialize_message(request, request_class)
        except rclpy_implementation.RMWError as error:
            raise NotServedError(f"{len(request)} bytes are no request of {client.srv_name}") from error
    else:
        message = request_class()  # ROS sends a byte for nothing, others send nothing
    return bytes(serialize_message(ask(client, message)))
