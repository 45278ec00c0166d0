"""Work in a process of its own, and a recording computed anew in several."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from tulip_ros.cdr import without_gaps
from tulip_ros.log_file import Log
from tulip_ros.log_index import DamagedLogError
from tulip_sim.recompute import line
from tulip_sim.recompute.beside import BATCH, Beside
from tulip_sim.recompute.run import recompute

pytestmark = pytest.mark.sim

RECORDINGS = Path(__file__).parent.parent / "data" / "recordings"


def test_items_come_in_their_order_from_another_process_however_many() -> None:
    for count in (0, 1, BATCH, 3 * BATCH + 1):
        items = Beside((os.getpid(), number) for number in range(count))
        found = list(items)
        assert [number for _, number in found] == list(range(count))
        assert os.getpid() not in {process for process, _ in found}
        items.close()


def test_one_process_reads_what_another_one_makes() -> None:
    first = Beside(iter(range(1000)))
    second = Beside(number * number for number in first)
    assert list(second) == [number * number for number in range(1000)]
    for each in (second, first):
        each.close()


def test_an_error_in_the_other_process_is_raised_here_after_the_items_before() -> None:
    def items() -> Iterator[int]:
        yield from range(BATCH)
        raise DamagedLogError(Path("run"), "is cut")

    beside = Beside(items())
    assert [next(beside) for _ in range(BATCH)] == list(range(BATCH))
    with pytest.raises(DamagedLogError, match=r"Recording run is cut\. Mend it first"):
        next(beside)
    beside.close()


def test_a_killed_process_is_noticed_and_an_endless_one_ends_with_its_reader() -> None:
    def endless() -> Iterator[int]:
        while True:
            yield os.getpid()

    beside = Beside(endless())
    process = next(beside)
    os.kill(process, signal.SIGKILL)
    with pytest.raises(EOFError):
        while True:
            next(beside)
    beside.close()
    other = Beside(endless())
    process = next(other)
    other.close()
    with pytest.raises(ProcessLookupError):
        os.kill(process, 0)


@pytest.mark.parametrize("components", [["worldmodel"], ["worldmodel", "strategy"]])
def test_several_processes_compute_the_same_as_one(
    components: list[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(line, "may_fork", lambda: True)  # whatever this machine and the tests before have
    outcomes, written = [], []
    for beside in (False, True):
        with Log(RECORDINGS / "walk") as log:
            outcomes.append(recompute(log, components, tmp_path / f"{beside}", beside=beside))
        with Log(tmp_path / f"{beside}") as log:
            # The serializer leaves gaps between numbers as the memory was.
            written.append([(r.topic.name, r.log_time, without_gaps(r.topic.type_name, r.data)) for r in log.records()])
    assert outcomes[0] == outcomes[1]
    assert written[0] == written[1]
    assert sum(each.recomputed for each in outcomes[0].differences.values()) > 100
