"""Pictures decoded beside what is computed anew."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest

from tulip_ros.log_file import LoggedTopic, Record
from tulip_sim.recompute.decoding import AHEAD, COMPRESSED, decoded, decoding_ahead
from tulip_sim.recompute.heard import Heard


def heard(name: str, number: int, data: bytes = b"") -> Heard:
    message = SimpleNamespace(format="png", data=data)
    log: Any = SimpleNamespace(decode=lambda record: message)
    return Heard(name, Record(LoggedTopic(f"/{name}", "", "", 0), number, number, number, b""), log)


def picture(number: int) -> np.ndarray:
    return np.full((4, 6, 3), number, np.uint8)


def recorded() -> list[Heard]:
    names = ["odometry", COMPRESSED, "odometry", "odometry", COMPRESSED, COMPRESSED, COMPRESSED, "odometry"]
    return [
        heard(name, number, cv2.imencode(".png", picture(number))[1].tobytes()) for number, name in enumerate(names)
    ]


def test_messages_come_in_their_order_and_pictures_are_what_was_recorded() -> None:
    found = list(decoding_ahead(recorded()))
    assert [each.record.sequence for each in found] == list(range(8))
    for each in found:
        if each.name == COMPRESSED:
            assert np.array_equal(decoded(each), picture(each.record.sequence))
        else:
            assert each.picture is None


def test_picture_is_begun_before_the_messages_ahead_of_it_are_taken() -> None:
    taken: list[int] = []

    def messages() -> Any:
        for each in recorded():
            taken.append(each.record.sequence)
            yield each

    ahead = decoding_ahead(messages())
    next(ahead)  # no picture yet: nothing waits
    assert taken == [0]
    assert next(ahead).name == COMPRESSED
    assert taken[-1] == [1, 4, 5][AHEAD]


def test_data_that_are_no_picture_are_refused_when_the_picture_is_asked_for() -> None:
    (bad,) = decoding_ahead([heard(COMPRESSED, 0, b"no picture")])
    with pytest.raises(ValueError, match="no picture; expected JPEG or PNG"):
        decoded(bad)
