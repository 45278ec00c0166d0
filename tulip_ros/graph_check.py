"""What is wrong with a running graph, out of facts about it; no graph is needed here.

`tulip_ros.graph_doctor` collects the facts.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from tulip_ros import topics
from tulip_ros.aggregation import Report
from tulip_ros.finding import Level
from tulip_ros.nodes import DRIVER, ROBOT
from tulip_ros.topics import Topic

STAND_INS: dict[str, frozenset[str]] = {"perception": frozenset({"vision"}), "identify": frozenset(ROBOT)}
"""Nodes that need not be there while another one is: perception replaces vision, an experiment moves alone."""
SLOW = 0.3  # times real time, below which somebody should know that the machine is too busy
RATE_SHARE = 0.7  # of the expected rate, below which a topic is too rare


class Diagnosis(NamedTuple):
    """One thing found: how bad it is, what it is about, and what is wrong and how to mend it."""

    level: Level
    part: str
    words: str


@dataclass(frozen=True)
class Endpoint:
    """A publisher or a subscription of a topic.

    Attributes:
        node: Full name of its node, as in "/striker/motion".
        type_name: As ROS writes it.
        reliable: Asks for, or offers, that nothing is lost.
        latched: Asks for, or offers, the last message of before.
    """

    node: str
    type_name: str
    reliable: bool = True
    latched: bool = False


@dataclass(frozen=True)
class GraphFacts:
    """What can be seen of a graph from outside.

    Attributes:
        nodes: Full names of all nodes; a name that is there twice is given twice.
        publishers: Of each topic, by its full name.
        subscribers: The same.
        rates: Messages a second of the wall clock, of topics that were listened to.
        pace: How fast the graph's time went, in seconds for one second of the wall clock; None without /clock.
        reports: What each node said about itself last, by full name.
        version: Of this program.
    """

    nodes: tuple[str, ...]
    publishers: Mapping[str, tuple[Endpoint, ...]] = field(default_factory=dict)
    subscribers: Mapping[str, tuple[Endpoint, ...]] = field(default_factory=dict)
    rates: Mapping[str, float] = field(default_factory=dict)
    pace: float | None = None
    reports: Mapping[str, Report] = field(default_factory=dict)
    version: str = ""


def check(facts: GraphFacts) -> list[Diagnosis]:
    """Return everything found, in the order in which to mend it."""
    if not robots(facts):
        names = f"; other nodes are there: {', '.join(sorted(set(facts.nodes)))}" if facts.nodes else ""
        return [Diagnosis(Level.OK, "nodes", f"no robot runs here{names}")]
    checks = (_twins, _nodes, _clock, _types, _senders, _qualities, _rates, _reports, _versions)
    return [diagnosis for each in checks for diagnosis in each(facts)]


def robots(facts: GraphFacts) -> tuple[str, ...]:
    """Return the namespaces of robots, as in "" or "/striker"; a driver that serves several belongs to none."""
    spaces = {name.rpartition("/")[0] for name in facts.nodes if _base(name) in ROBOT}
    lonely = {name.rpartition("/")[0] for name in facts.nodes if _base(name) == DRIVER}
    return tuple(sorted(spaces or lonely))


def declared(facts: GraphFacts) -> dict[str, Topic]:
    """Return the project's topics of all robots here, by full name."""
    found = {}
    for space in robots(facts):
        for topic in topics.TOPICS:
            inside = topic.within(space.strip("/"))
            found[inside.name if inside.name.startswith("/") else f"/{inside.name}"] = inside
    return found


def _base(name: str) -> str:
    return name.rpartition("/")[2]


def _twins(facts: GraphFacts) -> Iterator[Diagnosis]:
    for name, count in sorted(Counter(facts.nodes).items()):
        if count > 1:
            yield Diagnosis(
                Level.ERROR,
                "nodes",
                f"{count} nodes are called {name}, they disturb each other: end all but one"
                f" (`pgrep -af {_base(name)}_node` lists the processes), or give each graph its own ROS_DOMAIN_ID",
            )


def _nodes(facts: GraphFacts) -> Iterator[Diagnosis]:
    for space in robots(facts):
        here = {_base(name) for name in facts.nodes if name.rpartition("/")[0] == space}
        replaced = frozenset[str]().union(*(STAND_INS[name] for name in STAND_INS.keys() & here))
        missing = [name for name in ROBOT if name not in here | replaced]
        for name in missing:
            yield Diagnosis(Level.ERROR, "nodes", f"{space}/{name} is missing: look into its log and start it again")
        if not facts.publishers.get(f"{space}/{topics.JOINT_STATES.name}"):
            yield Diagnosis(
                Level.ERROR, "nodes", f"{space}/{DRIVER} is missing, nobody sends joint_states: start a driver"
            )
        elif not missing:
            yield Diagnosis(Level.OK, "nodes", f"all of robot {space or '/'} are up")


def _clock(facts: GraphFacts) -> Iterator[Diagnosis]:
    senders = [endpoint.node for endpoint in facts.publishers.get(topics.CLOCK.name, ())]
    if len(senders) > 1:
        yield Diagnosis(
            Level.ERROR, "clock", f"{len(senders)} senders of /clock ({', '.join(sorted(senders))}): end all but one"
        )
    if not senders:
        yield Diagnosis(Level.OK, "clock", "nobody sends /clock: the graph follows the system's time")
    elif not facts.pace:
        yield Diagnosis(
            Level.ERROR,
            "clock",
            f"time stands still: look after {' and '.join(sorted(set(senders)))}, or let the paused replay go on",
        )
    elif facts.pace < SLOW:
        yield Diagnosis(
            Level.WARNING, "clock", f"time goes {facts.pace:.2f} times as fast as the wall clock: end other programs"
        )
    else:
        yield Diagnosis(Level.OK, "clock", f"time goes {facts.pace:.2f} times as fast as the wall clock")


def _types(facts: GraphFacts) -> Iterator[Diagnosis]:
    wanted = {name: topic.type_name for name, topic in declared(facts).items()}
    wrong = False
    for name in sorted({*facts.publishers, *facts.subscribers}):
        ends = (*facts.publishers.get(name, ()), *facts.subscribers.get(name, ()))
        expected = wanted.get(name) or Counter(end.type_name for end in ends).most_common(1)[0][0]
        for node, type_name in sorted({(end.node, end.type_name) for end in ends if end.type_name != expected}):
            wrong = True
            yield Diagnosis(
                Level.ERROR,
                "types",
                f"{node} uses {name} as {type_name}; expected {expected}: give its topic another name or type",
            )
    if not wrong:
        yield Diagnosis(Level.OK, "types", "every topic has one type")


def _senders(facts: GraphFacts) -> Iterator[Diagnosis]:
    for name, topic in sorted(declared(facts).items()):
        senders = sorted({endpoint.node for endpoint in facts.publishers.get(name, ())})
        if topic.rate and len(senders) > 1 and name != topics.CLOCK.name:
            yield Diagnosis(
                Level.ERROR, "senders", f"{name} has {len(senders)} senders ({', '.join(senders)}): end all but one"
            )


def _qualities(facts: GraphFacts) -> Iterator[Diagnosis]:
    wrong = False
    for name, senders in sorted(facts.publishers.items()):
        pairs = [(sender, ear) for sender in senders for ear in facts.subscribers.get(name, ())]
        for sender, ear in dict.fromkeys(pairs):
            lacks = [
                word
                for word, has, asks in (
                    ("reliable", sender.reliable, ear.reliable),
                    ("transient local", sender.latched, ear.latched),
                )
                if asks and not has
            ]
            if lacks:
                wrong = True
                yield Diagnosis(
                    Level.ERROR,
                    "quality of service",
                    f"{ear.node} gets nothing of {name}: it asks {sender.node} for {' and '.join(lacks)},"
                    " which that does not offer; ask for less",
                )
    if not wrong:
        yield Diagnosis(Level.OK, "quality of service", "every subscription fits its publishers")


def _rates(facts: GraphFacts) -> Iterator[Diagnosis]:
    pace = 1.0 if facts.pace is None else facts.pace
    known = declared(facts)
    measured = {name: rate for name, rate in facts.rates.items() if name in known and facts.publishers.get(name)}
    if pace == 0.0 or not measured:
        return  # told already
    rare = {name: rate for name, rate in measured.items() if rate < RATE_SHARE * known[name].rate * pace}
    for name, rate in sorted(rare.items()):
        senders = " and ".join(sorted({endpoint.node for endpoint in facts.publishers[name]}))
        yield Diagnosis(
            Level.WARNING,
            "rates",
            f"{name} comes {rate:.1f} times a second, expected {known[name].rate * pace:.1f}: look after {senders}",
        )
    if not rare:
        yield Diagnosis(Level.OK, "rates", f"{len(measured)} topics come as often as they should")


def _reports(facts: GraphFacts) -> Iterator[Diagnosis]:
    expected = {f"{space}/{name}" for space in robots(facts) for name in (DRIVER, *ROBOT)}
    wrong = False
    for name in sorted(expected & set(facts.nodes) - set(facts.reports)):
        wrong = True
        yield Diagnosis(Level.ERROR, name, "says nothing: it hangs; look into its log and start it again")
    for name, report in sorted(facts.reports.items(), key=lambda entry: -entry[1].level):
        if report.level > Level.OK:
            wrong = True
            yield Diagnosis(min(report.level, Level.ERROR), name, report.words)
    if not wrong:
        yield Diagnosis(Level.OK, "diagnostics", f"all {len(facts.reports)} nodes that report are well")


def _versions(facts: GraphFacts) -> Iterator[Diagnosis]:
    running = {report.values.get("version", "unknown") for report in facts.reports.values()}
    others = sorted(running - {facts.version})
    if others:
        yield Diagnosis(
            Level.WARNING,
            "versions",
            f"nodes of version {', '.join(others)} run, this is {facts.version}: start the graph again",
        )
    elif running:
        yield Diagnosis(Level.OK, "versions", f"all nodes are of {facts.version}")
