"""The emergency stop, the user's wish and the game in words, for all who show them."""

from __future__ import annotations

from typing import Any

from tulip_ros.emergency_stop import word_from_message
from tulip_strategy.interface import UserRequest
from tulip_view.columns import PHASES, SECONDARY, SET_PLAYS, name_of

REQUESTS = {request.value: request.name.lower().replace("_", " ") for request in UserRequest}


def stop_words(message: Any) -> str:
    """Return what somebody said of the emergency stop.

    Args:
        message: Of the emergency stop.
    """
    return str(word_from_message(message))


def wish_words(command: Any) -> str:
    """Return what a user command asks for.

    Args:
        command: Message, or what was made from it.
    """
    words = name_of(REQUESTS, command.request)
    if command.request == UserRequest.PLAY:
        return f"{words} {command.strategy}"
    return f"{words} {command.argument}" if command.request == UserRequest.KICK_TEST else words


def game_words(state: Any) -> str:
    """Return how the game is.

    Args:
        state: Message of the game's state.
    """
    parts = [name_of(PHASES, state.phase), f"{state.own_score} : {state.opponent_score}"]
    parts += [f"{state.seconds_remaining} s left"]
    parts += [name_of(SECONDARY, state.secondary_state)] if state.secondary_state else []
    parts += [name_of(SET_PLAYS, state.set_play)] if state.set_play else []
    parts += [f"penalty {state.penalty}"] if state.penalty else []
    parts += ["stopped"] if state.stopped else []
    parts += ["stale"] if state.stale else []
    return ", ".join(parts).replace("_", " ")


def doing_words(decision: Any) -> str:
    """Return what strategy does at present: the leaf of the tree's active path.

    Args:
        decision: Message of strategy's decision.
    """
    return str(decision.tree.rsplit(" > ", 1)[-1])
