"""What a viewer may see, call and publish."""

from __future__ import annotations

from rclpy.exceptions import InvalidTopicNameException
from rclpy.validate_full_topic_name import validate_full_topic_name

from tulip_ros import topics
from tulip_ros.topics import Service, is_called

ENCODING = "cdr"
"""How messages are serialized, in both directions."""
DEFINITIONS = "ros2msg"
"""How their types are described."""


def known_service(name: str, type_name: str) -> Service | None:
    """Return which of this project's services that is, in whichever namespace; None: viewers are not offered it.

    Args:
        name: Full name, as in /striker/start.
        type_name: As in std_srvs/srv/Trigger.
    """
    return next((each for each in topics.SERVICES if each.type_name == type_name and is_called(name, each)), None)


def why_not_publish(name: str, type_name: str, encoding: str) -> str:
    """Return why a viewer may not publish on a topic, or "" if it may.

    Args:
        name: Full name, as in /striker/user_wish.
        type_name: As in tulip_msgs/msg/UserCommand; some viewers leave out the part between.
        encoding: How the messages would be serialized.
    """
    topic = next((each for each in topics.FROM_PEOPLE if is_called(name, each)), None)
    if topic is None:
        *others, last = (each.name for each in topics.FROM_PEOPLE)
        open_ones = f"{', '.join(others)} and {last}"
        return f"{name[:100]} is not for viewers to publish; only {open_ones} are. For the rest there are services."
    if not (name.isascii() and name.isprintable()):  # as C ends a text at a byte 0, so would the check
        return f"{name[:100]!r} is no name of a topic"
    try:
        validate_full_topic_name(f"/{name.removeprefix('/')}")
    except InvalidTopicNameException as error:
        return f"{name[:100]!r} is no name of a topic: {' '.join(str(error).split())[:200]}"
    if type_name not in (topic.type_name, topic.type_name.replace("/msg/", "/")):
        return f"the type of {name} is {type_name[:100]}; expected {topic.type_name}"
    if encoding != ENCODING:
        return f"the encoding of {name} is {encoding[:100]}; expected {ENCODING}"
    return ""
