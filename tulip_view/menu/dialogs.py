"""Questions of the menu: a choice among few, and pushes. The emergency stop is one key away here, too; see `app`."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar, TypeVar

from rich.text import Text
from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.events import Key
from textual.screen import ModalScreen
from textual.widgets import OptionList, Static

T = TypeVar("T")

SIZE, STEP, LEAST, MOST = 4.0, 0.5, 0.5, 15.0  # [N s] of a push
STYLE = """
    {name} {{ align: center middle; background: transparent; }}
    {name} > Vertical {{ width: 64; height: auto; border: round $foreground; background: $surface; padding: 0 1; }}
    {name} OptionList {{ border: none; background: $surface; height: auto; max-height: 12; padding: 0; }}
    {name} OptionList > .option-list--option-highlighted,
    {name} OptionList:focus > .option-list--option-highlighted {{
        color: $surface; background: $foreground; text-style: bold underline;
    }}
"""


class Question(ModalScreen[T]):
    """A question that can be left. Keys that come after its end are too late."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape", "leave", "leave")]

    def end(self, answer: T | None = None) -> None:
        """End with an answer, or with none."""
        if self.is_current:
            self.dismiss(answer)

    def action_leave(self) -> None:
        """End without an answer."""
        self.end()


class Choice(Question[str]):
    """A choice by number, or by arrow keys and Enter; Escape leaves without."""

    CSS = STYLE.format(name="Choice")

    def __init__(self, title: str, options: tuple[str, ...]) -> None:
        """Make it.

        Args:
            title: What is to be chosen.
            options: Nine at most.
        """
        super().__init__()
        self._title, self._options = title, options

    def compose(self) -> ComposeResult:
        """Return its parts."""
        with Vertical() as frame:
            frame.border_title, frame.border_subtitle = self._title, "number, or ↑ ↓ and Enter; Esc leaves"
            yield OptionList(*(Text(f"{number} {name}") for number, name in enumerate(self._options, 1)))

    def on_key(self, event: Key) -> None:
        """Take a number."""
        if event.character is not None and event.character in "123456789"[: len(self._options)]:
            event.stop()
            self.end(self._options[int(event.character) - 1])

    @on(OptionList.OptionSelected)
    def take(self, event: OptionList.OptionSelected) -> None:
        """Take what was chosen by Enter."""
        self.end(self._options[event.option_index])


class Pushes(Question[None]):
    """Pushes by arrow keys, as many as wanted, of a size that + and - change; Escape leaves."""

    CSS = STYLE.format(name="Pushes")
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("p", "leave", "leave"),
        Binding("up", "push('forward')", "forward"),
        Binding("down", "push('backward')", "backward"),
        Binding("left", "push('to the left')", "to the left"),
        Binding("right", "push('to the right')", "to the right"),
        Binding("plus,equals_sign", "change(1)", "harder"),
        Binding("minus", "change(-1)", "softer"),
    ]

    def __init__(self, push: Callable[[str, float], None]) -> None:
        """Make it.

        Args:
            push: Pushes in one of the directions of `PUSHES` by so much [N s].
        """
        super().__init__()
        self._push, self._impulse = push, SIZE
        self._words = Static()

    def compose(self) -> ComposeResult:
        """Return its parts."""
        with Vertical() as frame:
            frame.border_title, frame.border_subtitle = "Push the simulated robot's trunk", "Esc leaves"
            yield self._words

    def on_mount(self) -> None:
        """Show the size."""
        self._show()

    def action_push(self, direction: str) -> None:
        """Push."""
        if self.is_current:
            self._push(direction, self._impulse)

    def action_change(self, sign: int) -> None:
        """Change the size of the next pushes."""
        self._impulse = max(LEAST, min(MOST, self._impulse + sign * STEP))
        self._show()

    def _show(self) -> None:
        size = (f"{self._impulse:.1f} N s", "bold")
        keys = "↑ forward  ↓ backward  ← left  → right, as it sees them\n"
        self._words.update(Text.assemble(keys, "+ harder  - softer: ", size))
