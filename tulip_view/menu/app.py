"""The menu's screen and keys. It knows a robot only by `Robot`."""

from __future__ import annotations

import asyncio
import signal
from collections.abc import Callable
from typing import ClassVar

from rich.console import RenderableType
from rich.text import Text
from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.widgets import Static

from tulip_strategy.behaviour.tree import STRATEGIES
from tulip_strategy.interface import UserRequest
from tulip_strategy.user_input import SIDES, Wish
from tulip_view.menu import panels
from tulip_view.menu.dialogs import Choice, Pushes
from tulip_view.menu.sight import Robot, Sight
from tulip_view.menu.speeds import STANDING, Speeds

LOOK = 0.2  # [s] between two looks at the robot
ALWAYS = ("emergency_stop", "quit")
BEGIN, END = "begin the experiment: the robot stands on one foot, then on the other", "end it: go home and stand"


class Menu(App[None]):
    """Shows a robot and sends what the user wants; the last wish holds when it ends, but for a walk test."""

    ENABLE_COMMAND_PALETTE = False
    CSS = """
        Static { height: auto; }
        #headline { max-height: 3; }
        #outcomes { height: 2; }
        #nodes { height: 5fr; border-top: solid $foreground; }
        #said { height: 2fr; border-top: solid $foreground; }
        #keys { text-style: bold; }
        VerticalScroll { scrollbar-size-vertical: 1; }
    """
    # All of them before whatever has the focus: so keys that come at once are obeyed in their order, nothing can keep
    # EMERGENCY STOP to itself, and no key that was pressed before it has an effect after it.
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding(keys, action, priority=True)
        for keys, action in (
            ("l,L", "emergency_stop"),
            ("o", "release"),
            ("ctrl+q,ctrl+c", "quit"),
            ("s", "wish('PLAY')"),
            ("x", "wish('STOP')"),
            ("u", "wish('STAND')"),
            ("d", "wish('LIMP')"),
            ("c", "choose_strategy"),
            ("w", "walk_test"),
            ("up", "walk(0, 1)"),
            ("down", "walk(0, -1)"),
            ("left", "walk(1, 1)"),
            ("right", "walk(1, -1)"),
            ("q", "walk(2, 1)"),
            ("e", "walk(2, -1)"),
            ("space", "stand_still"),
            ("k", "kick_test"),
            ("p", "pushes"),
            ("r", "record"),
            ("i", "identify"),
            ("pageup", "scroll_nodes(-1)"),
            ("pagedown", "scroll_nodes(1)"),
        )
    ]

    def __init__(self, robot: Robot) -> None:
        """Make it.

        Args:
            robot: What is shown and steered.
        """
        super().__init__()
        self._robot = robot
        self._sight = Sight()
        self._speeds = Speeds()
        self._hint = ""
        self._parts = {
            name: Static(id=name if name not in ("nodes", "said") else None)
            for name in ("headline", "state", "walk", "outcomes", "nodes", "said", "keys")
        }
        self._shown: dict[str, object] = {}
        self._table = VerticalScroll(self._parts["nodes"], id="nodes", can_focus=False)

    def compose(self) -> ComposeResult:
        """Return its parts, from top to bottom."""
        parts = self._parts
        yield from (parts[name] for name in ("headline", "state", "walk", "outcomes"))
        yield self._table
        yield VerticalScroll(parts["said"], id="said", can_focus=False)
        yield parts["keys"]

    def on_mount(self) -> None:
        """Begin to look; end properly, with the terminal as it was, when the system says so."""
        self._parts["keys"].update(Text("\n".join(panels.KEYS)))
        self.refresh_sight()
        self.set_interval(LOOK, self.refresh_sight)
        asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, self.exit)

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool:
        """Return whether a key does what it does here: while a question is open, it alone has the others."""
        return action in ALWAYS or len(self.screen_stack) == 1

    def refresh_sight(self) -> None:
        """Show what there is to see now."""
        before, now = self._sight, self._robot.look()
        self._sight = now
        if now.command is not None:
            self._speeds.hear(now.command)
        if now.outcomes and now.outcomes != before.outcomes:
            self._hint = ""
            if now.outcomes[0].verdict != "taken":
                self._speeds.forget()
        self._show()

    def _show(self) -> None:
        """Draw those parts anew in which there is something new."""
        sight, walk = self._sight, (self._speeds.wanted, self._speeds.in_walk_test)
        now = sight.time if sight.time is None else int(sight.time)
        state = sight.command, sight.game, sight.doing, sight.mode, sight.reason, now, sight.recording, sight.experiment
        self._update("headline", (sight.missing, sight.stop, sight.state, sight.sum), lambda: panels.headline(sight))
        self._update("state", state, lambda: panels.state(sight))
        self._update("walk", walk, lambda: panels.walk(*walk))
        self._update("outcomes", (sight.outcomes, self._hint), lambda: panels.outcomes(sight, self._hint))
        self._update("nodes", sight.nodes, lambda: panels.nodes(sight))
        self._update("said", sight.said, lambda: panels.said(sight))

    def _update(self, name: str, values: object, draw: Callable[[], RenderableType]) -> None:
        if name not in self._shown or self._shown[name] != values:
            self._shown[name] = values
            self._parts[name].update(draw())

    def action_emergency_stop(self) -> None:
        """Stop the robot, whatever is open."""
        self._speeds.leave()
        self._robot.emergency_stop("key l")
        while len(self.screen_stack) > 1:
            self.pop_screen()

    def action_release(self) -> None:
        """Release the emergency stop; the robot stays limp until the next wish."""
        self._robot.release()

    def action_wish(self, name: str) -> None:
        """Send a wish that needs nothing else."""
        self._send(Wish(UserRequest[name]))

    def action_choose_strategy(self) -> None:
        """Ask which strategy to play, and start it."""

        def start(name: str | None) -> None:
            if name is not None:
                self._send(Wish(UserRequest.PLAY, strategy=name))

        self.push_screen(Choice("Start with which strategy?", tuple(STRATEGIES)), start)

    def action_walk_test(self) -> None:
        """Begin the walk test, or go on with it, by stepping in place."""
        self.refresh_sight()  # a command from before is no answer to this one
        self._send_speeds(STANDING)

    def action_stand_still(self) -> None:
        """Step in place."""
        if self._walks():
            self._send_speeds(STANDING)

    def action_walk(self, axis: int, sign: int) -> None:
        """Walk or turn a step faster or slower."""
        if self._walks():
            self._send_speeds(self._speeds.change(axis, sign))

    def action_kick_test(self) -> None:
        """Ask with which foot, and kick."""

        def kick(foot: str | None) -> None:
            if foot is not None:
                self._send(Wish(UserRequest.KICK_TEST, argument=foot))

        self.push_screen(Choice("Kick with which foot?", SIDES), kick)

    def action_pushes(self) -> None:
        """Push the robot in the simulator."""
        self.push_screen(Pushes(self._robot.push))

    def action_record(self) -> None:
        """Begin a recording, or end the one that runs."""
        self._robot.record(begin=not self._sight.recording)

    def action_identify(self) -> None:
        """Ask whether to begin or to end the identification experiment."""

        def do(what: str | None) -> None:
            if what is not None:
                self._robot.identify(begin=what == BEGIN)

        self.push_screen(Choice("Identification", (BEGIN, END)), do)

    def action_scroll_nodes(self, sign: int) -> None:
        """Show the nodes that are out of sight."""
        self._table.scroll_relative(y=sign * max(1, self._table.size.height - 1), animate=False)

    def _walks(self) -> bool:
        """Return whether keys that make it walk shall do so, as of now; else say which key comes first."""
        self.refresh_sight()
        if not self._speeds.in_walk_test:
            self._hint = "press w for the walk test first: it walks by the arrow keys, q and e"
            self._show()
        return self._speeds.in_walk_test

    def _send_speeds(self, velocity: tuple[float, float, float]) -> None:
        self._robot.wish(Wish(UserRequest.WALK_TEST, velocity=self._speeds.send(velocity)))
        self._show()

    def _send(self, wish: Wish) -> None:
        self._speeds.leave()
        self._robot.wish(wish)
