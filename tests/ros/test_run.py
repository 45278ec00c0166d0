"""How a node runs."""

from __future__ import annotations

import gc
from time import monotonic, sleep

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


def test_a_node_collects_its_garbage_again_and_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tulip_ros.run.COLLECTION", 0.05)
    begun: list[int] = []
    end = monotonic() + 10.0

    def advance(node: ComponentNode, spin: object) -> None:
        sleep(0.01)
        if len(begun) >= 4 or monotonic() > end:
            raise KeyboardInterrupt

    def note(phase: str, details: dict[str, int]) -> None:
        if phase == "start" and details["generation"] == 2:
            begun.append(details["collected"])

    gc.callbacks.append(note)
    try:
        with pytest.raises(SystemExit):
            run(lambda: ComponentNode("node"), advance, arguments=["test"])
    finally:
        gc.callbacks.remove(note)
        gc.unfreeze()
    assert len(begun) >= 4
