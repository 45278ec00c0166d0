"""The referee's packets: those of 2013 as they were written, every version there and back, and a flood of bad ones.

Which packets of the flood are valid is judged here from a few places of bytes, not by the codec.
"""

from __future__ import annotations

import json
import os
import random
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tulip_sim.bench.runner import Bench, Row
from tulip_sim.referee_packets import write_packet
from tulip_sim.situation import PlayerSituation, Removal, Situation, TeamSituation
from tulip_strategy.game_controller import Packet, TeamColour, decode, encode
from tulip_strategy.game_input import GameInput, GameInputParameters
from tulip_strategy.interface import GamePhase

GOLDEN = Path(__file__).parents[2] / "tests" / "data" / "gamecontroller_v7_packets.json"
SIZES = {7: 116, 8: 158, 12: 688, 18: 118, 19: 198, 20: 158}  # [B]
HEADS = {7: b"RGme\7\0\0\0", 12: b"RGme\x0c\0", **{version: b"RGme" + bytes([version]) for version in (8, 18, 19, 20)}}
"""Magic and version."""
STATE_AT = {7: 9, 8: 7, 12: 9, 18: 10, 19: 10, 20: 10}  # byte
LAST_STATE = {7: 4, 8: 4, 12: 4, 18: 5, 19: 5, 20: 5}
NUMBERS_AT = {7: (20, 68), 8: (18, 88), 12: (24, 356), 18: (18, 68), 19: (18, 108), 20: (18, 88)}  # bytes
OWN, OTHER, STRANGERS = 25, 12, (3, 4)  # team numbers
ROUND_TRIPS = 50_000  # a version
FLOOD = 1_000_000
BLOCK = 10_000  # packets made ahead, so that making them is not timed
SEED = 1
PERIOD = 1_000_000  # [ns] between packets of the flood: a thousand a second
LONGEST = 800  # [B] of a random datagram


def is_valid(data: bytes) -> bool:
    """Tell whether a packet is one of a known version, for the own team, in a known state."""
    version = data[4] if len(data) > 4 else 0
    if version not in SIZES or len(data) != SIZES[version] or not data.startswith(HEADS[version]):
        return False
    return data[STATE_AT[version]] <= LAST_STATE[version] and OWN in [data[at] for at in NUMBERS_AT[version]]


def good_packets() -> list[bytes]:
    """Return packets of all versions and phases, with and without a penalty, for the own team and for strangers."""
    packets = []
    for version in SIZES:
        for phase in GamePhase:
            for removal in (Removal.NONE, Removal.INACTIVE):
                for numbers in ((OWN, OTHER), (OTHER, OWN), STRANGERS):
                    players = (PlayerSituation(removal, 30),)
                    first, second = (
                        TeamSituation(number, colour, 2, players)
                        for number, colour in zip(numbers, (TeamColour.CYAN, TeamColour.MAGENTA), strict=True)
                    )
                    packets.append(write_packet(Situation(phase, True, 0, 100, 10, (first, second)), version))
    return packets


def flood(rng: random.Random) -> Iterator[bytes]:
    """Yield packets without end: good ones, mutated ones, cut ones, and bytes that only begin well, or not even so."""
    good, versions = good_packets(), list(SIZES)
    while True:
        data = bytearray(rng.choice(good))
        match rng.randrange(8):
            case 0:
                pass
            case 1 | 2 | 3:
                for _ in range(rng.randint(1, 8)):
                    data[rng.randrange(len(data))] = rng.randrange(256)
            case 4:
                data = (
                    data[: rng.randrange(len(data))] if rng.random() < 0.5 else data + rng.randbytes(rng.randint(1, 40))
                )
            case 5 | 6:
                version = rng.choice(versions)
                data = bytearray(HEADS[version] + rng.randbytes(SIZES[version] - len(HEADS[version])))
                data[STATE_AT[version]] = rng.randrange(8)
                data[rng.choice(NUMBERS_AT[version])] = rng.choice((OWN, OTHER))
            case _:
                data = bytearray(rng.randbytes(rng.randrange(LONGEST)))
        yield bytes(data)


def measure(part: str, argument: int) -> Row:
    """Run one part."""
    if part == "golden":
        return {"part": part, **_golden()}
    if part == "round trip":
        return {"part": part, "version": argument, **_round_trip(argument)}
    return {"part": part, "seed": SEED, **_flood(argument)}


def _golden() -> Row:
    packets = json.loads(GOLDEN.read_text())["packets"]
    as_put_in = same_bytes = 0
    for golden in packets:
        data = bytes.fromhex(golden["hex"])
        packet = decode(data)
        if isinstance(packet, Packet):
            as_put_in += _holds(packet, golden)
            same_bytes += encode(packet) == data
    return {"packets": len(packets), "as put in": as_put_in, "same bytes": same_bytes}


def _holds(packet: Packet, golden: dict[str, Any]) -> bool:
    """Tell whether a packet of 2013 says what was put into it."""
    names = {"kick_off": "kick_off_colour"}
    fields = packet.fields()
    head = all(
        fields[name] == golden[names.get(name, name)]
        for name in (
            "players_per_team",
            "state",
            "first_half",
            "kick_off",
            "secondary_state",
            "drop_in_team",
            "drop_in_time",
            "seconds_remaining",
            "sub_time",
        )
    )
    teams = all(
        [team.number, team.colour, team.goal_colour, team.score]
        == [expected["number"], expected["colour"], expected["goal_colour"], expected["score"]]
        and all(
            [player.penalty, player.seconds] == known
            for player, known in zip(team.players, expected["players_penalty_seconds"], strict=False)
        )
        for team, expected in zip(packet.teams, golden["teams"], strict=True)
    )
    return head and teams and list(packet.penalty_shots) == golden["penalty_shots"]


def _round_trip(version: int) -> Row:
    rng = random.Random(version)
    head, size = HEADS[version], SIZES[version]
    accepted = same = 0
    for _ in range(ROUND_TRIPS):
        data = bytearray(head + rng.randbytes(size - len(head)))
        data[STATE_AT[version]] = rng.randint(0, LAST_STATE[version])
        packet = decode(bytes(data))
        if isinstance(packet, Packet):
            accepted += 1
            same += encode(packet) == data
    return {"packets": ROUND_TRIPS, "accepted": accepted, "same bytes": same}


def _flood(count: int) -> Row:
    game = GameInput(GameInputParameters(team_number=OWN))
    source = flood(random.Random(SEED))
    faults: Counter[str] = Counter()
    taken = raised = changed = wrongly_taken = wrongly_rejected = 0
    stamp, busy, early = 0, 0.0, 0.0
    for block in range(0, count, BLOCK):
        packets = [next(source) for _ in range(min(BLOCK, count - block))]
        verdicts = [is_valid(data) for data in packets]
        begin = time.perf_counter()
        for data, valid in zip(packets, verdicts, strict=True):
            stamp += PERIOD
            before = game.state(stamp)
            try:
                rejected = game.receive(data, stamp)
            except Exception:  # whatever it is: none may come
                raised += 1
                continue
            if rejected is None:
                taken += 1
                wrongly_taken += not valid
            else:
                faults[rejected.fault.value] += 1
                wrongly_rejected += valid
                changed += game.state(stamp) != before
        busy += time.perf_counter() - begin
        if not early and block + BLOCK >= count // 10:
            early = _memory()
    return {
        "packets": count,
        "taken": taken,
        **{f"rejected ({fault})": number for fault, number in sorted(faults.items())},
        "exceptions": raised,
        "states changed by a rejected one": changed,
        "taken but invalid": wrongly_taken,
        "rejected but valid": wrongly_rejected,
        "memory after a tenth [MB]": round(early, 1),
        "memory at the end [MB]": round(_memory(), 1),
        "packets a second": round(count / busy),
    }


def _memory() -> float:
    """Return the resident memory of this process [MB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def summarize(rows: list[Row]) -> list[str]:
    """Return what came out of the three parts."""
    golden = next(row for row in rows if row["part"] == "golden")
    trips = [row for row in rows if row["part"] == "round trip"]
    wave = next(row for row in rows if row["part"] == "flood")
    rejected = {name: number for name, number in wave.items() if name.startswith("rejected (")}
    return [
        f"Packets written by the referee program of 2013: {golden['as put in']} of {golden['packets']} decode to what"
        f" was put in, {golden['same bytes']} encode back to the same bytes.",
        "",
        "| version | random packets | accepted | same bytes after decode and encode |",
        "| --- | --- | --- | --- |",
        *(f"| {row['version']} | {row['packets']} | {row['accepted']} | {row['same bytes']} |" for row in trips),
        "",
        f"A flood of {wave['packets']} good, mutated, cut and random packets of all versions through decoding and game"
        f" input, one process: {wave['taken']} taken, {sum(rejected.values())} rejected"
        f" ({', '.join(f'{name[10:-1]} {number}' for name, number in rejected.items())}).",
        "",
        "| | |",
        "| --- | --- |",
        f"| exceptions | {wave['exceptions']} |",
        f"| game states changed by a rejected packet | {wave['states changed by a rejected one']} |",
        f"| taken, but not valid by their bytes | {wave['taken but invalid']} |",
        f"| rejected, but valid by their bytes | {wave['rejected but valid']} |",
        f"| memory after a tenth, at the end | {wave['memory after a tenth [MB]']:.1f} MB,"
        f" {wave['memory at the end [MB]']:.1f} MB |",
        f"| speed, with the comparison of states | {wave['packets a second']} packets/s |",
    ]


BENCH = Bench(
    "referee",
    "The referee's packets",
    [("golden", 0), *(("round trip", version) for version in SIZES), ("flood", FLOOD)],
    measure,
    summarize,
    workers=1,
)
