"""Whether a recomputation is as it was, or inside the bounds that a user gives; and the table that shows it."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence

from tulip_ros.errors import BadInputError, unknown
from tulip_sim.recompute.run import Outcome

UNMATCHED = "unmatched"
MOST = ("position", "heading", "ball", "latency")
LEAST = ("ball_recall",)
"""Figures against the truth that must not be higher, or lower, than their bound."""
SHAPE = re.compile(r"(?:(?P<topic>[\w/]+):)?(?P<name>[a-z_ ]+)=(?P<value>\S+)$")

Bounds = Mapping[tuple[str, str], float]
"""By topic, without its namespace ("" for every one, "truth" for the truth), and quantity, without its unit."""


def bounds_of(texts: Sequence[str]) -> dict[tuple[str, str], float]:
    """Return bounds from a command line.

    Args:
        texts: As in "position=0.02" (of every topic that has one), "world_state:ball=0.1", "truth:ball_recall=0.9".

    Raises:
        BadInputError: if one is no bound.
    """
    bounds = {}
    for text in texts:
        match = SHAPE.match(text)
        try:
            value = float(match["value"]) if match else math.nan
        except ValueError:
            value = math.nan
        if match is None or not (math.isfinite(value) and value >= 0.0):
            raise BadInputError(
                f"Bound is {text!r}; expected TOPIC:QUANTITY=NUMBER, as in world_state:position=0.02"
                " or truth:ball_recall=0.9."
            )
        if match["topic"] == "truth" and match["name"] not in (*MOST, *LEAST):
            raise unknown("figure against the truth", match["name"], (*MOST, *LEAST))
        bounds[match["topic"] or "", match["name"]] = value
    return bounds


def violations(outcome: Outcome, bounds: Bounds) -> list[str]:
    """Return what is not as it was and not inside the bounds, in words; nothing if all is well.

    A topic whose messages differ must have a bound, on the root mean square of at least one of its quantities; without
    a bound of its own every message must also have its counterpart.

    Raises:
        BadInputError: if a bound is for something that was not compared.
    """
    found, used = [], set()
    for full, difference in outcome.differences.items():
        own = {}
        names = [name.partition(" [")[0] for name in difference.largest] + [UNMATCHED]
        for (topic, name), value in bounds.items():
            if topic != "truth" and (not topic or full.endswith(f"/{topic}")):
                used.add((topic, name))
                if name in names:
                    own[name] = value
        if difference.is_none:
            continue
        if not own:
            found.append(f"{full}: {difference.recorded - difference.equal} of {difference.recorded} messages differ")
        if difference.unmatched > own.get(UNMATCHED, 0.0):
            found.append(f"{full}: {difference.unmatched:.1%} of the messages have no counterpart")
        for quantity in difference.largest:
            name = quantity.partition(" [")[0]
            if name in own and difference.rms(quantity) > own[name]:
                found.append(f"{full}: {quantity} differs by {difference.rms(quantity):.4g} (RMS); bound {own[name]:g}")
    for (topic, name), value in bounds.items():
        if topic != "truth":
            continue
        for namespace, (_, judgement) in outcome.judgements.items():
            figure = getattr(judgement, name)
            used.add((topic, name))
            wrong = not figure >= value if name in LEAST else not figure <= value
            if wrong:  # also where it is not known
                found.append(f"{namespace or 'truth'}: {name} is {figure:.4g}; bound {value:g}")
    for topic, name in bounds:
        if (topic, name) not in used:
            known = ", ".join(outcome.differences)
            what = "no ground truth is recorded" if topic == "truth" else f"expected one of {known}"
            raise BadInputError(f"Bound {topic}:{name} is for nothing that was compared; {what}.")
    return found


def rows(outcome: Outcome) -> list[tuple[str, ...]]:
    """Return the table of differences: topic, recorded, recomputed, equal, quantity, largest and RMS difference."""
    table: list[tuple[str, ...]] = []
    for name, each in outcome.differences.items():
        begin = (name, str(each.recorded), str(each.recomputed), str(each.equal))
        if not each.largest:
            table.append((*begin, "", "", ""))
        for quantity, largest in each.largest.items():
            table.append((*begin, quantity, f"{largest:.4g}", f"{each.rms(quantity):.4g}"))
            begin = ("", "", "", "")
    return table


HEADINGS = ("topic", "recorded", "recomputed", "equal", "quantity", "largest", "RMS")


def truth_rows(outcome: Outcome) -> list[tuple[str, ...]]:
    """Return the table against the truth: robot, figure with unit, as recorded and as recomputed."""
    units = {"position": "m", "heading": "rad", "ball": "m", "ball_recall": "share", "latency": "s"}
    table: list[tuple[str, ...]] = []
    for namespace, (recorded, recomputed) in outcome.judgements.items():
        for name, unit in units.items():
            before, after = getattr(recorded, name), getattr(recomputed, name)
            if not (math.isnan(before) and math.isnan(after)):
                table.append((namespace, f"{name} [{unit}]", _number(before), _number(after)))
    return table


def _number(value: float) -> str:
    return "not recomputed" if math.isnan(value) else f"{value:.4g}"
