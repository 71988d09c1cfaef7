"""What a link does to a list of messages: when each arrives, or why it does not. See docs/link.md.

No robot, no operator, no scenario: a pure function from messages and settings to rows, and their CSV.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Sequence
from dataclasses import astuple, dataclass, fields
from functools import partial
from typing import Protocol

import numpy as np
import simpy

from teleop_sim.channel.feasible import refuse_undeliverable
from teleop_sim.channel.link import Direction
from teleop_sim.channel.message import DirectionName
from teleop_sim.channel.settings import DirectionSettings
from teleop_sim.core.errors import BadInput, Problem, unknown_name
from teleop_sim.core.records import PacketEnded, Record

COLUMNS = ("time", "topic", "bytes", "priority")
"""Of a message list; the last may be left out."""

BYTES_MAX = 1_000_000_000
PRIORITY_MAX = 1_000_000


@dataclass(frozen=True, slots=True)
class Offer:
    """A message to be sent: when [s], its topic, its payload's size [bytes], its priority (the higher goes first)."""

    time_s: float
    topic: str
    bytes: int
    priority: int = 0


@dataclass(frozen=True, slots=True)
class TraceRow:
    """What became of a message. The five waits [s] add up to ``arrived_s - sent_s`` where it arrived.

    Attributes:
        id: number of the message in order of time, from 0.
        topic: as offered.
        bytes: of its payload.
        sent_s: when it was offered.
        arrived_s: when its last bit arrived; None: it did not.
        outcome: delivered, dropped or in_flight.
        reason: of a drop.
        queue_s: light time with other packets ahead.
        serialisation_s: its bits over the rate.
        blackout_s: dark time up to its last bit out.
        propagation_s: one-way delay with jitter.
        retransmission_s: time in which its bits went out in vain.

    """

    id: int
    topic: str
    bytes: int
    sent_s: float
    arrived_s: float | None
    outcome: str
    reason: str
    queue_s: float
    serialisation_s: float
    blackout_s: float
    propagation_s: float
    retransmission_s: float


HEADER = tuple(f.name for f in fields(TraceRow))


def trace(
    offers: Iterable[Offer],
    settings: DirectionSettings,
    rng: np.random.Generator,
    way: DirectionName = "up",
    until_s: float = math.inf,
) -> tuple[TraceRow, ...]:
    """Send messages over one direction and say what became of each, in order of id.

    Args:
        offers: in any order; those of one instant are sent in the order given.
        settings: of the direction; its blackouts are as given, nothing is drawn.
        rng: of loss and jitter.
        way: name of the direction in records.
        until_s: when to stop, above zero; what is on its way then is ``in_flight``. ``inf``: when nothing happens
            any more.

    Raises:
        BadInput: the link cannot deliver anything.

    """
    refuse_undeliverable(settings, math.inf, way)
    ended: list[PacketEnded] = []

    def note(record: Record) -> None:
        if isinstance(record, PacketEnded):
            ended.append(record)

    env = simpy.Environment()
    link = Direction(env, way, settings, lambda _: None, note, rng)
    schedule_offers(env, link.send, sorted(offers, key=lambda offer: offer.time_s), until_s)
    env.run(None if math.isinf(until_s) else until_s)
    link.close()
    return tuple(_row(record) for record in sorted(ended, key=lambda record: record.packet))


class Send(Protocol):
    """Takes a message: a direction's ``send`` or an endpoint's."""

    def __call__(self, topic: str, payload: bytes, *, priority: int) -> object:
        """Take it now."""


def schedule_offers(env: simpy.Environment, send: Send, offers: Sequence[Offer], until_s: float) -> None:
    """Send the messages, given in order of time, each at its time; those from ``until_s`` on are left out."""
    payloads = {size: bytes(size) for size in {offer.bytes for offer in offers}}

    def sends(offer: Offer, _: simpy.Event) -> None:
        send(offer.topic, payloads[offer.bytes], priority=offer.priority)

    for offer in offers:
        if offer.time_s < until_s:
            # One timeout each from zero: a chain of differences would round the times.
            env.timeout(offer.time_s).callbacks.append(partial(sends, offer))


def _row(record: PacketEnded) -> TraceRow:
    return TraceRow(
        id=record.packet,
        topic=record.topic,
        bytes=record.payload_bytes,
        sent_s=record.sent_s,
        arrived_s=record.arrived_s if math.isfinite(record.arrived_s) else None,
        outcome=record.outcome,
        reason=record.reason,
        queue_s=record.queue_s,
        serialisation_s=record.serialisation_s,
        blackout_s=record.blackout_s,
        propagation_s=record.propagation_s,
        retransmission_s=record.retransmission_s,
    )


def trace_csv(rows: Iterable[TraceRow]) -> str:
    """The rows as CSV: a header, a line each, times in seconds to 1e-9 s, an empty ``arrived_s`` for what did not."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(HEADER)
    writer.writerows([_cell(value) for value in astuple(row)] for row in rows)
    return out.getvalue()


def _cell(value: object) -> str:
    if isinstance(value, float):
        # Adding zero turns -0.0 into 0.0.
        return f"{round(value, 9) + 0.0:.9f}".rstrip("0").rstrip(".")
    return "" if value is None else str(value)


def read_offers(text: str, file: str) -> tuple[Offer, ...]:
    """Messages from CSV with the columns time [s], topic, bytes and, if it is there, priority; in any order.

    Raises:
        BadInput: every problem of the text, each as ``file:line: column``.

    """
    lines, problems = _lines(text, file)
    if not lines:
        raise BadInput((*problems, Problem(f"{file}:1", "no header", f"Begin with {','.join(COLUMNS)}.")))
    number, header = lines[0]
    names = [name.strip().removeprefix("\ufeff") for name in header]
    problems += _header_problems(names, f"{file}:{number}")
    if problems:
        raise BadInput(tuple(problems))
    offers: list[Offer] = []
    for number, cells in lines[1:]:
        offer = _offer(dict(zip(names, cells, strict=False)), len(cells) - len(names), f"{file}:{number}", problems)
        if offer is not None:
            offers.append(offer)
    if problems:
        raise BadInput(tuple(problems))
    return tuple(offers)


def _lines(text: str, file: str) -> tuple[list[tuple[int, list[str]]], list[Problem]]:
    """Lines that hold something, each with its number."""
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    found: list[tuple[int, list[str]]] = []
    try:
        for cells in reader:
            if any(cell.strip() for cell in cells):
                found.append((reader.line_num, cells))
    except csv.Error as error:
        return found, [Problem(f"{file}:{reader.line_num}", f"no CSV: {error}", "Close every quotation mark.")]
    return found, []


def _header_problems(names: Sequence[str], where: str) -> list[Problem]:
    found = [unknown_name(where, name, COLUMNS) for name in names if name not in COLUMNS]
    found += [Problem(f"{where}: {name}", "given twice", "Keep one.") for name in COLUMNS if names.count(name) > 1]
    missing = [name for name in COLUMNS[:3] if name not in names]
    hint = f"Begin with {','.join(COLUMNS)}."
    return found + [Problem(f"{where}: {name}", "no such column", hint) for name in missing]


def _offer(cells: dict[str, str], surplus: int, where: str, problems: list[Problem]) -> Offer | None:
    before = len(problems)
    if surplus > 0:
        problems.append(Problem(where, f"{surplus} more cells than the header has", "Quote text that holds a comma."))
    time_s = _number(cells.get("time", ""), f"{where}: time", problems)
    size = _whole(cells.get("bytes", ""), f"{where}: bytes", (0, BYTES_MAX), problems)
    level = cells.get("priority", "").strip() or "0"
    priority = _whole(level, f"{where}: priority", (-PRIORITY_MAX, PRIORITY_MAX), problems)
    topic = cells.get("topic", "").strip()
    if not topic:
        problems.append(Problem(f"{where}: topic", "it is empty", "Name what the message is."))
    return Offer(time_s, topic, size, priority) if len(problems) == before else None


def _number(text: str, where: str, problems: list[Problem]) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value >= 0.0):
        problems.append(Problem(where, f"{_shown(text)} is no time", "Give seconds, zero or more, such as 12.5."))
    return value


def _whole(text: str, where: str, limits: tuple[int, int], problems: list[Problem]) -> int:
    try:
        value = int(text)
    except ValueError:
        value = limits[0] - 1
    if not limits[0] <= value <= limits[1]:
        hint = f"Give a whole number from {limits[0]} to {limits[1]}."
        problems.append(Problem(where, f"{_shown(text)} cannot be used", hint))
    return value


def _shown(text: str) -> str:
    return repr(text if len(text) <= 40 else f"{text[:37]}...")
