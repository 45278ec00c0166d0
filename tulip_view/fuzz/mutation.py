"""Damages bytes and texts so that they stay near to what a reader expects."""

from __future__ import annotations

import math
import random
import re
import struct
from collections.abc import Sequence

NUMBERS = tuple(
    struct.pack(f"{order}{letter}", value)
    for order in "<>"
    for letter, values in {
        "B": (0, 1, 0x7F, 0xFF),
        "H": (0, 1, 0x7FFF, 0xFFFF),
        "I": (0, 1, 100, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF),
        "Q": (0, 1, 2**31, 2**40, 2**62, 2**63 - 1, 2**63, 2**64 - 1),
        "f": (math.nan, math.inf, -math.inf, 3e38),
        "d": (math.nan, math.inf, -math.inf, 1e308, -0.0),
    }.items()
    for value in values
)
"""Those at the edges of their types."""
VALUES = (
    *("", "~", "null", "true", "[]", "{}", "[[]]", "'x'", "-", "?", ":", "a: b", "[1, 2, 3, 4]", "{a: 1}"),
    *(
        "0",
        "-1",
        "1e-3",
        "1e400",
        "-1e308",
        "5e-324",
        ".nan",
        ".inf",
        "-.inf",
        "0x7fffffffffffffff",
        "1" * 30,
        "9" * 5000,
    ),
    *(
        "2013-06-24",
        "2013-99-99",
        "23:59:59",
        "1:1:1",
        "0o17",
        "0b1",
        "<<",
        "=",
        "yes",
        "\x07",
        '"\\0"',
        '"\\ud800"',
        "\N{SNOWMAN}",
    ),
    *(
        "!!int x",
        "!!float x",
        "!!bool x",
        "!!timestamp x",
        "!!binary x",
        "!!set {a}",
        "!!omap [a: 1]",
        "!!str",
        "!unknown x",
    ),
    *("!!python/object/apply:os.system [exit]", "!!python/name:os.system", "!!python/tuple [1]"),
    *(
        "&a [*a]",
        "&a {b: *a}",
        "*a",
        "&a 1",
        "[&a 1, *a]",
        "{<<: *a}",
        "{<<: [1]}",
        "{a: 1, a: 2}",
        "{[a]: 1}",
        "{1: a}",
    ),
    *(
        "[" * 60,
        "[" * 5000,
        "{a: " * 60,
        "- " * 60,
        "x" * 10000,
        "../../etc/passwd",
        "/dev/zero",
        "a/" * 5000,
        "|\n x",
        "%YAML 9",
    ),
)
"""What may stand in place of a value or a key of YAML."""
BOMB = "\n".join(
    ["l0: &l0 [lol, lol, lol, lol, lol, lol, lol, lol, lol]"]
    + [f"l{level}: &l{level} [{', '.join([f'*l{level - 1}'] * 9)}]" for level in range(1, 10)]
)
"""A thousand million values in ten lines."""
MERGES = "\n".join(
    ["m0: &m0 {x: 1}"]
    + [f"m{level}: &m{level} {{<<: [{', '.join([f'*m{level - 1}'] * 9)}]}}" for level in range(1, 10)]
)
"""The same with mappings that take over others."""
TOKEN = re.compile(r"[^\s:,\[\]{}#-][^\n:,\[\]{}#]*")
"""A word of YAML."""


def damaged(rng: random.Random, samples: Sequence[bytes]) -> bytes:
    """Return one of some whole inputs with one, two or four damages, or rarely nothing of it but random bytes."""
    if rng.random() < 0.03:
        return rng.randbytes(rng.randrange(300))
    data = bytearray(rng.choice(samples))
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        data = _damaged_once(rng, data, samples)
    return bytes(data)


def damaged_text(rng: random.Random, samples: Sequence[bytes]) -> bytes:
    """Return one of some YAML texts with one, two or four damages, most of which leave it YAML."""
    text = rng.choice(samples).decode()
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        text = _damaged_text_once(rng, text)
    data = text.encode("utf-8", "surrogatepass")
    return damaged(rng, [data, *samples]) if rng.random() < 0.15 else data


def _damaged_once(rng: random.Random, data: bytearray, samples: Sequence[bytes]) -> bytearray:
    place, length = rng.randrange(len(data) + 1), rng.choice((1, 2, 4, 8, 30, 300))
    match rng.randrange(10):
        case 0:
            for _ in range(rng.randint(1, 8)):
                if data:
                    data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
        case 1 | 2 | 3:
            number = rng.choice(NUMBERS)
            data[place : place + len(number)] = number
        case 4:
            del data[place : place + length]
        case 5:
            del data[place:]
        case 6:
            data[place:place] = rng.randbytes(length)
        case 7:
            data[place:place] = data[place : place + length] * rng.choice((1, 2, 100))
        case 8:
            other = rng.choice(samples)
            data[place:] = other[rng.randrange(len(other) + 1) :]
        case _:
            data[place : place + length] = rng.randbytes(length)
    return data


def _damaged_text_once(rng: random.Random, text: str) -> str:
    lines = text.split("\n")
    line = rng.randrange(len(lines))
    match rng.randrange(12):
        case 0:
            del lines[line]
        case 1:
            lines.insert(line, lines[rng.randrange(len(lines))])
        case 2:
            lines[line] = " " * rng.randint(1, 6) + lines[line]
        case 3:
            lines[line] = lines[line].lstrip() if rng.random() < 0.5 else "\t" + lines[line]
        case 4:
            lines.insert(rng.choice((0, line)), rng.choice((BOMB, MERGES, "---", "...", "\ufeff", "\ud800", "\x00")))
        case 5:
            lines = lines[:line]
        case _:
            words = list(TOKEN.finditer(text))
            if words:
                word = rng.choice(words)
                return text[: word.start()] + rng.choice(VALUES) + text[word.end() :]
    return "\n".join(lines)
