"""A person at the menu, in a process of its own: presses the keys of each line that comes, and tells what there is.

    python3 menu_seat.py [PEER]

The answer to a line is one of JSON, as in {"time": 1.2, "mode": "walk", "wish": "PLAY", "missing": "", "text": "..."}.
"""

from __future__ import annotations

import asyncio
import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "view"))
from menu_screen import Screen, use_menu

from tulip_ros import network
from tulip_view.menu.robot_link import linked


def main() -> None:
    network.join(sys.argv[1] if len(sys.argv) > 1 else "")
    with linked("") as robot:

        async def sit(screen: Screen) -> None:
            while line := await asyncio.to_thread(sys.stdin.readline):
                await screen.press(*line.split()[1:])
                sight = robot.look()
                wish = sight.command.request.name if sight.command is not None else ""
                seen = {"time": sight.time, "mode": sight.mode, "wish": wish, "missing": sight.missing}
                print(json.dumps({**seen, "doing": sight.doing, "text": screen.text}), flush=True)

        use_menu(robot, sit)


if __name__ == "__main__":
    main()
