"""Node "head": head_command and joint_states in, commands to the two head joints out."""

from __future__ import annotations

import numpy as np
from sensor_msgs.msg import JointState

from tulip_description.robot import HEAD_JOINTS, load_robot
from tulip_motion.head import HeadMovement, HeadParameters
from tulip_motion.interface import HeadCommand, HeadMode
from tulip_motion.messages import head_command_from_message, joint_command_to_message
from tulip_msgs.msg import HeadCommand as HeadCommandMessage
from tulip_ros import topics
from tulip_ros.emergency_stop import StopLink
from tulip_ros.run import ComponentNode, run
from tulip_ros.time import stamp_of

PERIOD = 20_000_000  # [ns] between two commands: 50 Hz is fast for a head


class HeadNode(ComponentNode):
    """Turns messages into calls of head movement and its answers into messages."""

    def __init__(self) -> None:
        """Make the core and connect it."""
        super().__init__("head")
        self._settings = self.load(HeadParameters())
        self.begin_anew()
        self._publisher = self.sender(topics.HEAD_JOINT_COMMAND)
        self._emergency_stop = StopLink(self, "head")
        self.listen(topics.HEAD_COMMAND, self._on_command)
        self.listen(topics.JOINT_STATES, self._on_joints)

    def begin_anew(self) -> None:
        """Make the core, which holds still until the first command."""
        self._head = HeadMovement(self._settings, load_robot())
        self._command = HeadCommand(0, HeadMode.HOLD)
        self._last = -PERIOD  # stamp of the joint state answered last [ns]

    def _on_command(self, message: HeadCommandMessage) -> None:
        self._command = head_command_from_message(message)

    def _on_joints(self, message: JointState) -> None:
        stamp = stamp_of(message)
        if 0 <= stamp - self._last < PERIOD:
            return
        self._last = stamp
        positions = dict(zip(message.name, message.position, strict=True))
        missing = [name for name in HEAD_JOINTS if name not in positions]
        if missing:
            self.health.count(
                "joint states without head",
                f"joint_states lacks {', '.join(missing)}; expected the 14 joints of the playing robot",
            )
            return
        angles = np.array([positions[name] for name in HEAD_JOINTS])
        if self._emergency_stop.engaged:
            order = self._head.limp(stamp, angles)
        else:
            order = self._head.update(stamp, self._command, angles)
        self._publisher.publish(joint_command_to_message(order))


def main() -> None:
    """Run the node."""
    run(HeadNode)


if __name__ == "__main__":
    main()
