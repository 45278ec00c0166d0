"""Every reader of what comes from outside, given what is nearly right: `bench.py fuzz` in small."""

from __future__ import annotations

import random
import signal
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tulip_view.fuzz import campaign
from tulip_view.fuzz.campaign import Result, made, read
from tulip_view.fuzz.inputs import KINDS, Kind, WrongError

EXAMPLES = 60
kinds = pytest.mark.parametrize("kind", KINDS, ids=[kind.name for kind in KINDS])
bounded = settings(derandomize=True, max_examples=EXAMPLES, suppress_health_check=[HealthCheck.function_scoped_fixture])


@kinds
def test_whole_inputs_are_read(kind: Kind, tmp_path: Path) -> None:
    result = Result()
    for number, data in enumerate(kind.samples()):
        read(kind, number, data, tmp_path, result)
    assert not result.examples
    assert result.accepted > 0 or not kind.samples()


@kinds
def test_damaged_inputs_are_taken_or_refused_in_words(kind: Kind, tmp_path: Path) -> None:
    result = Result()

    @bounded
    @given(st.integers(0, 2**32))
    def holds(number: int) -> None:
        read(kind, number, made(kind, number), tmp_path, result)
        assert not result.examples

    holds()
    assert result.accepted + result.refused.total() >= EXAMPLES


@kinds
def test_any_bytes_are_taken_or_refused_in_words(kind: Kind, tmp_path: Path) -> None:
    result = Result()

    @bounded
    @given(st.binary(max_size=200))
    def holds(data: bytes) -> None:
        read(kind, 0, data, tmp_path, result)
        assert not result.examples

    holds()


def sick(data: bytes, folder: Path) -> str:
    """Do what the first letter says."""
    match data:
        case b"key":
            raise KeyError("x")
        case b"wrong":
            raise WrongError("NaN")
        case b"refuse":
            raise ValueError("as it should be")
        case b"die":
            signal.raise_signal(signal.SIGKILL)
        case b"grow":
            bytearray(2**40)
        case b"hang":
            while True:
                pass
    (folder / "left").write_bytes(data)
    return "reason" if data == b"reason" else ""


ACTS = (b"key", b"wrong", b"refuse", b"die", b"grow", b"hang", b"reason", b"take", b"take", b"take")


def act(rng: random.Random) -> bytes:
    return rng.choice(ACTS)


def test_a_campaign_tells_every_kind_of_defect_and_goes_on_after_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(campaign, "LONGEST", 0.2)
    monkeypatch.setattr(campaign, "STEP", 7)
    count = 40
    done = Counter(act(random.Random(number)) for number in range(count))
    assert set(done) == set(ACTS)
    result = campaign.run(Kind("sick", act, sick, (ValueError,)), count)
    assert result.accepted == done[b"take"]
    assert result.refused == {"ValueError": done[b"refuse"], "reason": done[b"reason"]}
    assert result.defects == {
        "KeyError": done[b"key"],
        "WrongError": done[b"wrong"],
        "MemoryError": done[b"grow"],
        "hang": done[b"hang"],
        f"process ended ({-signal.SIGKILL})": done[b"die"],
    }
    assert [act(random.Random(number)) for number, words in result.examples if words.startswith("KeyError")] == [
        b"key" for _, words in result.examples if words.startswith("KeyError")
    ]
