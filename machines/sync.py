"""Everything that executive and mirror must agree on, as a value with one encoding. A heartbeat tells its hash."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from zlib import crc32

from teleop_sim.core.errors import TeleopError
from teleop_sim.machines.engine import MODES
from teleop_sim.machines.net import Configuration

COUNTS = 65536
"""Transitions are counted modulo this."""

REQUEST_KINDS = ("confirm", "manual", "decide", "data", "act")
"""What an operator may be asked: to let an outcome pass; for an event; for a decision; for data; to act instead."""


class BadSnapshot(TeleopError, ValueError):
    """Bytes that are no snapshot."""

    def __init__(self, what: str) -> None:
        super().__init__(what)

    def __str__(self) -> str:
        return f"snapshot: {self.args[0]}\n  Both sites must hold the same version of the simulator."


@dataclass(frozen=True, slots=True, order=True)
class Asked:
    """An open request.

    Attributes:
        request: its number.
        kind: one of ``REQUEST_KINDS``.
        node: number of the state or container that asks (``Net.nodes``).
        edge: place of the suggested outcome in the table, or -1.

    """

    request: int
    kind: str
    node: int
    edge: int = -1


@dataclass(frozen=True, slots=True)
class Snapshot:
    """The state of a machine as the control station shows it.

    Attributes:
        behaviour: checksum of the machine.
        configuration: active states.
        level: of autonomy.
        mode: one of ``engine.MODES``.
        paused: nothing works and nothing passes.
        locked: numbers of locked nodes, ascending.
        asked: open requests, by number.
        count: transitions told so far, modulo ``COUNTS``; so that one that is lost shows even if it led nowhere new.

    """

    behaviour: int
    configuration: Configuration
    level: int
    mode: str = "normal"
    paused: bool = False
    locked: tuple[int, ...] = ()
    asked: tuple[Asked, ...] = ()
    count: int = 0

    def pack(self) -> bytes:
        """One encoding: checksum (4 bytes), flags (1), count (2), outcome, active, parked, locked, asked.

        Flags: level (2 bits), mode (2), paused, wide. The outcome stands after its length (one byte), numbers after
        their count; all of these have one byte, or two each where one of them is above 255 (wide).
        """
        now, outcome = self.configuration, self.configuration.outcome.encode()
        asked = [n for a in self.asked for n in (a.request, REQUEST_KINDS.index(a.kind), a.node, a.edge + 1)]
        lists = (now.active, now.parked, self.locked, asked)
        numbers = [n for some in lists for n in (len(some), *some)]
        wide = max(numbers) > _NARROW
        flags = self.level | MODES.index(self.mode) << 2 | self.paused << 4 | wide << 5
        head = _HEAD.pack(self.behaviour, flags, self.count, len(outcome))
        return head + outcome + struct.pack(f">{len(numbers)}{'H' if wide else 'B'}", *numbers)

    @property
    def hash(self) -> int:
        """32 bits over all of it."""
        return crc32(self.pack())


def unpack_snapshot(data: bytes) -> Snapshot:
    """Inverse of ``Snapshot.pack``.

    Raises:
        BadSnapshot: the bytes are none.

    """
    try:
        behaviour, flags, count, size = _HEAD.unpack_from(data)
        outcome, rest = data[_HEAD.size : _HEAD.size + size].decode(), data[_HEAD.size + size :]
        wide = bool(flags >> 5)
        numbers = struct.unpack(f">{len(rest) // (1 + wide)}{'H' if wide else 'B'}", rest)
        active, parked, locked, asked = _lists(numbers, 4)
        requests = tuple(
            Asked(asked[i], REQUEST_KINDS[asked[i + 1]], asked[i + 2], asked[i + 3] - 1)
            for i in range(0, len(asked), 4)
        )
        now, mode = Configuration(active, parked, outcome), MODES[flags >> 2 & 3]
        found = Snapshot(behaviour, now, flags & 3, mode, bool(flags >> 4 & 1), locked, requests, count)
        if found.pack() == data:
            return found
    except (struct.error, IndexError, UnicodeDecodeError) as problem:
        raise BadSnapshot(f"{len(data)} bytes: {problem}") from None
    raise BadSnapshot(f"{len(data)} bytes that no snapshot packs to")


_HEAD = struct.Struct(">IBHB")
_NARROW = 255


def _lists(numbers: tuple[int, ...], count: int) -> list[tuple[int, ...]]:
    """So many lists, each after its length, and nothing after them."""
    lists = []
    for _ in range(count):
        size, numbers = numbers[0], numbers[1:]
        lists.append(numbers[:size])
        numbers = numbers[size:]
    return lists
