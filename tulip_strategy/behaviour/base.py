"""The kinds of leaves of the tree."""

from __future__ import annotations

from collections.abc import Callable

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from tulip_strategy.behaviour.context import Context


class Leaf(Behaviour):  # type: ignore[misc]  # py_trees comes without types here
    """A behaviour that reads and writes the shared context."""

    def __init__(self, name: str, context: Context) -> None:
        super().__init__(name)
        self.context = context


class Condition(Leaf):
    """Succeeds while a test of the context holds."""

    def __init__(self, name: str, context: Context, test: Callable[[Context], bool]) -> None:
        super().__init__(name, context)
        self._test = test

    def update(self) -> Status:
        """Test."""
        return Status.SUCCESS if self._test(self.context) else Status.FAILURE


class Act(Leaf):
    """Does one thing at every tick, without an end of its own."""

    def __init__(self, name: str, context: Context, act: Callable[[Context], None]) -> None:
        super().__init__(name, context)
        self._act = act

    def update(self) -> Status:
        """Do it."""
        self._act(self.context)
        return Status.RUNNING


class Do(Leaf):
    """Does one thing and succeeds, for what comes after it."""

    def __init__(self, name: str, context: Context, act: Callable[[Context], None]) -> None:
        super().__init__(name, context)
        self._act = act

    def update(self) -> Status:
        """Do it."""
        self._act(self.context)
        return Status.SUCCESS


class ForSeconds(Leaf):
    """Does one thing for a time, then succeeds.

    A duration that is zero or less succeeds at once.
    """

    def __init__(
        self, name: str, context: Context, duration: Callable[[Context], float], act: Callable[[Context], None]
    ) -> None:
        super().__init__(name, context)
        self._duration = duration
        self._act = act
        self._begun = 0
        self._seconds = 0.0

    def initialise(self) -> None:
        """Note the time."""
        self._begun = self.context.stamp
        self._seconds = self._duration(self.context)

    def update(self) -> Status:
        """Do it while there is time."""
        if self.context.seconds_since(self._begun) >= self._seconds:
            return Status.SUCCESS
        self._act(self.context)
        return Status.RUNNING
