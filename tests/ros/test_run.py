"""How a node runs."""

from __future__ import annotations

import gc

import pytest

from tulip_ros.run import ComponentNode, run

pytestmark = [pytest.mark.ros, pytest.mark.usefixtures("ros_domain")]


def test_what_a_node_was_made_of_is_not_looked_through_by_each_garbage_collection() -> None:
    kept: list[int] = []

    def advance(node: ComponentNode, spin: object) -> None:
        kept.append(len(gc.get_objects()))
        raise KeyboardInterrupt

    before = len(gc.get_objects())
    try:
        with pytest.raises(SystemExit):
            run(lambda: ComponentNode("node"), advance, arguments=["test"])
        assert gc.get_freeze_count() > 0.9 * before
    finally:
        gc.unfreeze()
    assert kept[0] < 0.1 * before
