"""The components of one robot, one after the other, as their messages flow.

A line reads the recording for itself, and says for each message that a component reads or wrote what they all say to
it. So it can run in a process of its own, or in two, one behind the other, while another one compares and writes.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import NamedTuple

from tulip_ros.log_file import Log
from tulip_sim.recompute.beside import Beside, may_fork
from tulip_sim.recompute.decisions import HeadStage, StrategyStage
from tulip_sim.recompute.decoding import COMPRESSED, decoding_ahead
from tulip_sim.recompute.heard import Heard, Made, Stage
from tulip_sim.recompute.vision import VisionStage


class Said(NamedTuple):
    """What components say to one message, in the order of the data flow.

    Attributes:
        messages: Said.
        shortcomings: What could not be computed, by reason; told once, at the end.
    """

    messages: Sequence[Made]
    shortcomings: Mapping[str, int]


SILENCE = Said((), {})


class Line:
    """Stages of one robot, in processes beside this one where that is possible."""

    def __init__(self, path: Path, names: Mapping[str, str], stages: Sequence[Stage], beside: bool = True) -> None:
        """Begin.

        Args:
            path: Of the recording.
            names: Full names of the topics that the stages read or write, with their names inside the robot.
            stages: In the order of the data flow.
            beside: Use other processes if there are cores for them.
        """
        self._processes: list[Beside[Said]] = []
        said: Iterator[Said] | None = None
        # OpenCV's threads do not survive a fork, and vision alone takes longer than all the others.
        together = not (beside and may_fork()) or any(isinstance(stage, VisionStage) for stage in stages)
        replaced = frozenset().union(*(stage.writes for stage in stages))
        for group in [stages] if together else _groups(stages):
            said = _said(path, names, group, replaced, said)
            if not together:
                said = Beside(said)
                self._processes.append(said)
        self._said = said

    def take(self) -> Sequence[Made]:
        """Return what the stages say to the next message of their topics, or at the end of the recording."""
        return self._next().messages

    def shortcomings(self) -> Mapping[str, int]:
        """Return what could not be computed, by reason; call it last."""
        return self._next().shortcomings

    def close(self) -> None:
        """End the processes."""
        for process in self._processes:
            process.close()

    def _next(self) -> Said:
        return next(self._said) if self._said is not None else SILENCE


def _groups(stages: Sequence[Stage]) -> list[list[Stage]]:
    """Return the stages by process: strategy and head together take as long as the world model."""
    decisions: list[Stage] = [stage for stage in stages if isinstance(stage, StrategyStage | HeadStage)]
    return [group for group in ([stage for stage in stages if stage not in decisions], decisions) if group]


def _said(
    path: Path,
    names: Mapping[str, str],
    stages: Sequence[Stage],
    replaced: Collection[str],
    earlier: Iterator[Said] | None,
) -> Iterator[Said]:
    """Yield what stages say, and those before them, to each message and at the end; then what fell short."""
    with Log(path) as log:
        messages: Iterator[Heard] = (Heard(names[each.topic.name], each, log) for each in log.records(list(names)))
        if any(isinstance(stage, VisionStage) and stage.pictures == COMPRESSED for stage in stages):
            messages = decoding_ahead(messages)
        for heard in chain(messages, [None]):
            made: Sequence[Made] = next(earlier).messages if earlier is not None else ()
            for stage in stages:
                made = _through(stage, heard, replaced, made)
            yield Said(made, {}) if made else SILENCE
    shortcomings = dict(next(earlier).shortcomings) if earlier is not None else {}
    for stage in stages:
        shortcomings.update(stage.shortcomings())
    yield Said((), shortcomings)


def _through(stage: Stage, heard: Heard | None, replaced: Collection[str], earlier: Sequence[Made]) -> Sequence[Made]:
    """Return what the stages before said, each with the stage's answers behind it, and what it says to a message.

    Args:
        stage: Hears all that.
        heard: The message, or None at the end.
        replaced: Names of the topics that are computed anew: nobody hears them as they were recorded.
        earlier: What the stages before said.
    """
    said: list[Made] = []
    for made in earlier:
        said.append(made)
        if made.name in stage.reads:
            said += stage.hear(made)
    if heard is None:
        said += stage.finish()
    elif heard.name in stage.told_by:
        said += stage.answer(heard)
    elif heard.name in stage.reads and heard.name not in replaced:
        said += stage.hear(heard)
    return said
