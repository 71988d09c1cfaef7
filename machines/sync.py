"""Everything that executive and mirror must agree on, as a value with one encoding; its hash is what a heartbeat tells."""

from __future__ import annotations

import struct
from collections.abc import Iterable
from dataclasses import dataclass
from zlib import crc32

from teleop_sim.core.errors import TeleopError
from teleop_sim.machines.engine import MODES
from teleop_sim.machines.net import Configuration

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
        node: number of the state that asks.
        edge: number of the suggested edge, or -1.

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

    """

    behaviour: int
    configuration: Configuration
    level: int
    mode: str = "normal"
    paused: bool = False
    locked: tuple[int, ...] = ()
    asked: tuple[Asked, ...] = ()

    def pack(self) -> bytes:
        """One encoding: checksum (4 bytes), level, mode, paused, outcome, then numbers of two bytes after their count."""
        now = self.configuration
        outcome = now.outcome.encode()
        head = struct.pack(">IBBBB", self.behaviour, self.level, MODES.index(self.mode), self.paused, len(outcome))
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
        behaviour, level, mode, paused, size = struct.unpack_from(">IBBBB", data)
        outcome, rest = data[8 : 8 + size].decode(), data[8 + size :]
        lists = []
        for _ in range(4):
            (count,) = struct.unpack_from(">H", rest)
            lists.append(struct.unpack_from(f">{count}H", rest, 2))
            rest = rest[2 + 2 * count :]
        active, parked, locked, asked = lists
        if rest or len(asked) % 4:
            raise BadSnapshot(f"{len(data)} bytes do not come out even")
        requests = tuple(
            Asked(asked[i], REQUEST_KINDS[asked[i + 1]], asked[i + 2], asked[i + 3] - 1)
            for i in range(0, len(asked), 4)
        )
        return Snapshot(
            behaviour, Configuration(active, parked, outcome), level, MODES[mode], bool(paused), locked, requests
        )
    except (struct.error, IndexError, UnicodeDecodeError) as problem:
        raise BadSnapshot(f"{len(data)} bytes: {problem}") from None


def _numbers(numbers: Iterable[int]) -> bytes:
    made = tuple(numbers)
    return struct.pack(f">{len(made) + 1}H", len(made), *made)
