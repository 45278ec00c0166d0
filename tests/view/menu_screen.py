"""What a person sees of the menu and does at it, in textual's pilot: no terminal, but the real screen and keys."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable

from textual.pilot import Pilot

from tulip_view.menu.app import Menu
from tulip_view.menu.sight import Robot

PATIENCE = 120.0  # [s] for a machine that is busy with other things
LOOK = 0.05  # [s]


class Screen:
    """The menu on a screen of 80 by 24."""

    def __init__(self, app: Menu, pilot: Pilot[None]) -> None:
        self.app, self._pilot = app, pilot

    @property
    def text(self) -> str:
        """All lines as they stand there, without colours."""
        size = self.app.size
        lines = self.app.screen._compositor.render_strips()
        assert len(lines) == size.height
        return "\n".join(line.text for line in lines)

    async def press(self, *keys: str) -> None:
        await self._pilot.press(*keys)
        self.app.refresh_sight()
        await self._pilot.pause()

    async def until(self, holds: Callable[[], object]) -> None:
        end = time.monotonic() + PATIENCE
        while not holds():
            assert time.monotonic() < end, self.text
            await asyncio.sleep(LOOK)

    async def until_text(self, *words: str) -> None:
        """Wait for words, wherever lines and columns break them."""
        await self.until(lambda: all(each in " ".join(self.text.split()) for each in words))


def use_menu(robot: Robot, use: Callable[[Screen], Awaitable[None]], size: tuple[int, int] = (80, 24)) -> None:
    """Open the menu and use it."""

    async def run() -> None:
        app = Menu(robot)
        async with app.run_test(size=size) as pilot:
            await pilot.pause()
            await use(Screen(app, pilot))

    asyncio.run(run())
