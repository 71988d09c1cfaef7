"""Everything that executive and mirror must agree on, as a value with one encoding. A heartbeat tells its hash."""

from __future__ import annotations

import struct
from collections.abc import Iterable
from dataclasses import dataclass
from zlib import crc32

from teleop_sim.core.errors import TeleopError
from teleop_sim.machines.elements import Autonomy
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
        """One encoding: checksum (4 bytes), level, mode, paused, count (2), outcome, active, parked, locked, asked.

        The outcome stands after its length (one byte), numbers of two bytes each after their count (two).
        """
        now, outcome = self.configuration, self.configuration.outcome.encode()
        mode = MODES.index(self.mode)
        head = _HEAD.pack(self.behaviour, self.level, mode, self.paused, self.count, len(outcome))
        asked = (n for a in self.asked for n in (a.request, REQUEST_KINDS.index(a.kind), a.node, a.edge + 1))
        return head + outcome + b"".join(map(_numbers, (now.active, now.parked, self.locked, asked)))

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
        behaviour, level, mode, paused, count, size = _HEAD.unpack_from(data)
        outcome, rest = data[_HEAD.size : _HEAD.size + size].decode(), data[_HEAD.size + size :]
        (active, parked, locked, asked), rest = _lists(rest, 4)
        requests = tuple(
            Asked(asked[i], REQUEST_KINDS[asked[i + 1]], asked[i + 2], asked[i + 3] - 1)
            for i in range(0, len(asked), 4)
        )
        now = Configuration(active, parked, outcome)
        found = Snapshot(behaviour, now, level, MODES[mode], bool(paused), locked, requests, count)
    except (struct.error, IndexError, UnicodeDecodeError) as problem:
        raise BadSnapshot(f"{len(data)} bytes: {problem}") from None
    if rest or level > max(Autonomy) or found.pack() != data:
        raise BadSnapshot(f"{len(data)} bytes that no snapshot packs to")
    return found


_HEAD = struct.Struct(">IBBBHB")


def _lists(data: bytes, count: int) -> tuple[list[tuple[int, ...]], bytes]:
    lists = []
    for _ in range(count):
        (size,) = struct.unpack_from(">H", data)
        lists.append(struct.unpack_from(f">{size}H", data, 2))
        data = data[2 + 2 * size :]
    return lists, data


def _numbers(numbers: Iterable[int]) -> bytes:
    made = tuple(numbers)
    return struct.pack(f">{len(made) + 1}H", len(made), *made)
