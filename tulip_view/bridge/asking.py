"""Calls of ROS services with requests that are serialized already, as viewers send them."""

from __future__ import annotations

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.serialization import deserialize_message, serialize_message

from tulip_ros.asking import Asker, NotServedError, ServiceClient


def ask_serialized(asker: Asker, client: ServiceClient, request: bytes) -> bytes:
    """Return the serialized answer (CDR) to a serialized request; from any thread but the node's own.

    Raises:
        NotServedError: if the request is no such message, nobody serves it, or no answer comes in time.
    """
    request_class = client.srv_type.Request
    if request_class.get_fields_and_field_types():
        try:
            message = deserialize_message(request, request_class)
        except rclpy_implementation.RMWError as error:
            raise NotServedError(f"{len(request)} bytes are no request of {client.srv_name}") from error
    else:
        message = request_class()  # ROS sends a byte for nothing, others send nothing
    return bytes(serialize_message(asker.wait_for(client, message)))
