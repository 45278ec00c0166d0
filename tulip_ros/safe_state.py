"""What is done when a node that the robot needs is given up: it stands still, and does not play on.

While motion control lives it is told to stop and stand, as by a person, through node user_input. Where nobody answers,
the node strategy is ended: motion control then stops walking by itself, since nobody tells it to walk. Without motion
control the driver has let the legs sink, since nobody commands them; the emergency stop keeps them so.

This module runs as a process of its own, `python -m tulip_ros.safe_state NAMESPACE stand` (or `limp`), so that the
launcher needs no ROS. It ends with 0 when the robot was told.
"""

from __future__ import annotations

import sys
from time import monotonic

from std_srvs.srv import Trigger

from tulip_ros import topics
from tulip_ros.asking import ANSWER, Asker, NotServedError
from tulip_ros.emergency_stop import StopLink
from tulip_ros.run import ComponentNode, session

SEARCH = 5.0  # [s] to find who serves it


def main() -> int:
    """Tell the robot to stand or to be limp; return the exit code."""
    namespace, wish = sys.argv[1:]
    with session(lambda: ComponentNode("safe_state", namespace=namespace), [], handle_signals=False) as (node, spin):
        if wish == "limp":
            stop, end = StopLink(node, "launcher"), monotonic() + SEARCH
            stop.engage("motion control has died again and again")
            while monotonic() < end:  # so that all have found this node, and heard it
                spin(0.05)
            return 0
        asker = Asker(node)
        client = asker.client(Trigger, topics.STOP.name)
        end = monotonic() + SEARCH
        while not client.service_is_ready() and monotonic() < end:
            spin(0.05)
        answer = asker.ask(client, Trigger.Request())
        end = monotonic() + ANSWER + 1.0
        while not answer.done() and monotonic() < end:
            spin(0.05)
        try:
            return 0 if answer.result(0.0).success else 1
        except (NotServedError, TimeoutError) as error:
            print(f"error: {error}", file=sys.stderr)
            return 1


if __name__ == "__main__":
    raise SystemExit(main())
