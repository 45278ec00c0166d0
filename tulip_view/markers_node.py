"""Node "markers": what the robot knows and does in, shapes for RViz out; at work only while somebody looks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from rclpy.subscription import Subscription
from visualization_msgs.msg import MarkerArray

from tulip_description.field import FieldError, load_field
from tulip_description.robot import load_robot
from tulip_msgs.msg import Features, MotionState, WorldState
from tulip_ros import topics
from tulip_ros.errors import BadInputError
from tulip_ros.priority import give_way
from tulip_ros.run import ComponentNode, run
from tulip_ros.time import stamp_of
from tulip_view.markers import feature_markers, field_markers, motion_markers, world_markers

LOOK = 0.5  # [s] of wall-clock time between two looks at whether somebody listens
FIELD_LOOKS = 4  # after which the field is sent again, for viewers that came later


@dataclass(frozen=True)
class MarkersParameters:
    """What is drawn, and how often."""

    period: float = 0.1  # [s] at least between two drawings of the same message: enough for eyes
    field_file: str = ""  # "" for the AdultSize field of 2013

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if one is out of range.
        """
        if not self.period >= 0.0:
            raise ValueError(f"period is {self.period} s; expected >= 0")


class MarkersNode(ComponentNode):
    """Draws for RViz."""

    def __init__(self) -> None:
        """Wait for listeners."""
        super().__init__("markers")
        self._settings = self.load(MarkersParameters())
        try:
            self._field = load_field(self._settings.field_file or None)
        except FieldError as error:
            raise BadInputError(f"Parameter field_file of node 'markers': {error}") from error
        self._feet = load_robot().feet
        self._markers = self.sender(topics.MARKERS)
        self._ears: list[Subscription] = []
        self._looks = 0
        self.begin_anew()
        self.every(LOOK, self._look)

    def begin_anew(self) -> None:
        """Draw the next message of each kind at once."""
        self._drawn: dict[type[Any], int] = {}

    def _look(self) -> None:
        """Listen while somebody listens to the markers, and send them the field."""
        wanted = self._markers.get_subscription_count() > 0
        if wanted and not self._ears:
            self._looks = 0
            ears = {
                topics.WORLD_STATE: self._on_world,
                topics.MOTION_STATE: self._on_motion,
                topics.FEATURES: self._on_features,
            }
            self._ears = [
                topic.subscribe_from(self, callback, depth=1, only_looks=True) for topic, callback in ears.items()
            ]
        elif not wanted:
            while self._ears:
                self.destroy_subscription(self._ears.pop())
        if wanted and self._looks % FIELD_LOOKS == 0:
            self._markers.publish(MarkerArray(markers=field_markers(self._field)))
        self._looks += 1

    def _is_due(self, message: Any) -> bool:
        stamp, last = stamp_of(message), self._drawn.get(type(message))
        if last is not None and 0 <= stamp - last < self._settings.period * 1e9:
            return False
        self._drawn[type(message)] = stamp
        return True

    def _on_world(self, message: WorldState) -> None:
        if self._is_due(message):
            self._markers.publish(MarkerArray(markers=world_markers(message, self._field.ball_radius)))

    def _on_motion(self, message: MotionState) -> None:
        if self._is_due(message):
            self._markers.publish(MarkerArray(markers=motion_markers(message, self._feet)))

    def _on_features(self, message: Features) -> None:
        if self._is_due(message):
            self._markers.publish(MarkerArray(markers=feature_markers(message)))


if __name__ == "__main__":
    give_way()
    run(MarkersNode)
