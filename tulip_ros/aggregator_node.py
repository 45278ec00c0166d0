"""Node "aggregator": diagnostics of all nodes in, diagnostics_agg out. The launcher does the same by itself."""

from __future__ import annotations

from dataclasses import dataclass

from tulip_ros.monitor import Monitor
from tulip_ros.nodes import AGGREGATOR, DRIVER, ROBOT
from tulip_ros.run import ComponentNode, run


@dataclass(frozen=True)
class AggregatorParameters:
    """What is looked after."""

    expected: tuple[str, ...] = (DRIVER, *ROBOT)  # nodes that should be there
    namespaces: tuple[str, ...] = ("",)  # of the robots, below the node's own


class AggregatorNode(ComponentNode):
    """Sums up."""

    def __init__(self) -> None:
        """Connect."""
        super().__init__(AGGREGATOR)
        p = self.load(AggregatorParameters())
        self.monitor = Monitor(self, p.expected, p.namespaces)


if __name__ == "__main__":
    run(AggregatorNode)
