"""A recording, published by node replay and heard by a listener."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tulip_msgs.msg import WorldState
from tulip_ros import topics
from tulip_ros.errors import BadInputError
from tulip_ros.log_file import Log
from tulip_ros.replay import ReplayParameters
from tulip_ros.replay_node import ReplayNode
from tulip_ros.run import session
from tulip_ros.time import stamp_of

WALK = Path(__file__).parent.parent / "data" / "recordings" / "walk"


@pytest.mark.ros
def test_a_passage_is_published_as_it_was_recorded_and_a_step_passes_its_part(ros_domain: int):
    settings = ReplayParameters(str(WALK), start=5.0, duration=0.3, include=("/world_state",), paused=True, step=0.1)
    with Log(WALK) as log:
        begin = log.span[0] + 5 * 10**9
        expected = [stamp_of(log.decode(each)) for each in log.records(["/world_state"], begin, begin + 300_000_000)]
    heard: list[int] = []
    with session(lambda: ReplayNode(settings), ["test"]) as (node, spin):

        def note(message: WorldState) -> None:
            heard.append(stamp_of(message))

        topics.WORLD_STATE.subscribe_from(node, note)
        for _ in range(80):
            node.advance(spin)
        assert node.player.schedule is not None and node.player.schedule.paused
        few = len(heard)
        request: Any = topics.STEP_REPLAY.type
        answer = node.player._on_step(request.Request(), request.Response())
        assert answer.success and "paused at 0.1" in answer.message
        for _ in range(80):
            node.advance(spin)
        assert few < len(heard) < len(expected)
        node.player.resume()
        while not node.player.ended:
            node.advance(spin)
        for _ in range(10):
            spin(0.02)
    assert heard == expected


@pytest.mark.ros
def test_no_file_and_no_recording_are_refused(ros_domain: int, tmp_path: Path):
    for file, message in (("", "Parameter file is empty"), (str(tmp_path / "none"), "There is no recording")):
        with (
            pytest.raises(BadInputError, match=message),
            session(lambda file=file: ReplayNode(ReplayParameters(file)), ["test"]),
        ):
            pass
