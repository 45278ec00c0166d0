"""The small text menu of the user input: asks, and passes the wish on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from rich.console import Console
from rich.prompt import FloatPrompt, Prompt
from rich.table import Table

from tulip_strategy.interface import UserRequest
from tulip_strategy.user_input import SIDES

Velocity = tuple[float, float, float]


@dataclass(frozen=True)
class Wish:
    """What the user chose, as the arguments of `UserInput.ask`."""

    request: UserRequest
    strategy: str = ""
    velocity: Velocity = (0.0, 0.0, 0.0)
    argument: str = ""


Send = Callable[[Wish], tuple[bool, str]]
"""Passes a wish to the robot; returns whether it was taken, and a message."""
Record = Callable[[bool], tuple[bool, str]]
"""Begins (True) or ends a recording; returns whether that was done, and where it is or why not."""

ENTRIES: tuple[tuple[str, str, UserRequest], ...] = (
    ("s", "start: obey the referee and play", UserRequest.PLAY),
    ("x", "stop: stand, whatever the referee says", UserRequest.STOP),
    ("u", "stand up straight", UserRequest.STAND),
    ("w", "walk test", UserRequest.WALK_TEST),
    ("k", "kick test", UserRequest.KICK_TEST),
    ("l", "limp: legs without stiffness", UserRequest.LIMP),
)
RECORDING: tuple[tuple[str, str, bool], ...] = (
    ("r", "begin a recording", True),
    ("e", "end the recording", False),
)
CHOOSE, QUIT = "c", "q"


class Menu:
    """Shows the choices and sends what the user picks, until the user quits or the input ends."""

    def __init__(self, console: Console, send: Send, record: Record, strategies: tuple[str, ...]) -> None:
        self._console = console
        self._send = send
        self._record = record
        self._strategies = strategies

    def run(self) -> None:
        """Ask until the user quits; the robot keeps its last command then."""
        self._show()
        keys = [key for key, *_ in (*ENTRIES, *RECORDING)] + [CHOOSE, QUIT]
        recording = {key: begin for key, _, begin in RECORDING}
        while True:
            try:
                key = Prompt.ask("Wish", console=self._console, choices=keys, show_choices=True)
                if key == QUIT:
                    return
                if key in recording:
                    accepted, message = self._record(recording[key])
                else:
                    accepted, message = self._send(self._wish(key))
            except (EOFError, KeyboardInterrupt):
                self._console.print()
                return
            self._console.print("[green]taken[/green]" if accepted else "[red]refused[/red]", end="")
            self._console.print(f": {message}" if message else "", markup=False, highlight=False, soft_wrap=True)

    def _show(self) -> None:
        table = Table(show_header=False, box=None)
        for key, words, _ in (*ENTRIES, *RECORDING):
            table.add_row(key, words)
        table.add_row(CHOOSE, "choose a strategy and start")
        table.add_row(QUIT, "quit the menu; the last wish holds")
        self._console.print(table)

    def _wish(self, key: str) -> Wish:
        if key == CHOOSE:
            name = Prompt.ask("Strategy", console=self._console, choices=list(self._strategies))
            return Wish(UserRequest.PLAY, strategy=name)
        request = next(request for entry, _, request in ENTRIES if entry == key)
        if request is UserRequest.WALK_TEST:
            forward, left, turning = (
                FloatPrompt.ask(words, console=self._console, default=0.0)
                for words in ("Forward [m/s]", "To the left [m/s]", "Turning to the left [rad/s]")
            )
            return Wish(request, velocity=(forward, left, turning))
        if request is UserRequest.KICK_TEST:
            return Wish(
                request, argument=Prompt.ask("Foot", console=self._console, choices=list(SIDES), default="right")
            )
        return Wish(request)
