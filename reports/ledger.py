"""What became of the packets of a run, by direction and topic: counts, reasons of drops, and where they waited.

The counts are those of the link itself (``channel/counters.py``), taken again from the log's records. Where a delivery
repeats, every copy is a packet and so is every acknowledgement; what became of the messages is a ledger of its own.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from io import StringIO
from typing import TYPE_CHECKING

from teleop_sim.channel.counters import WAITS, Counters, TopicCounts
from teleop_sim.core.records import MessageEnded, PacketEnded, Record

if TYPE_CHECKING:
    from rich.table import Table

ALL = "all"
"""Topic of a direction's sum."""


@dataclass(frozen=True)
class LedgerRow:
    """One topic of one direction, or all of it. ``offered == delivered + dropped + in_flight``."""

    direction: str
    topic: str
    counts: TopicCounts

    @property
    def dropped(self) -> int:
        """Packets that were dropped, whatever the reason."""
        return sum(self.counts.dropped.values())

    @property
    def reasons(self) -> str:
        """Such as ``lost 3, queue_full 1``; the most frequent first."""
        ordered = sorted(self.counts.dropped.items(), key=lambda item: (-item[1], item[0]))
        return ", ".join(f"{reason} {count}" for reason, count in ordered)

    def mean_s(self, wait: str) -> float:
        """Mean over the delivered packets of one of ``WAITS`` [s]; zero if there are none."""
        total_s: float = getattr(self.counts, wait)
        return total_s / self.counts.delivered if self.counts.delivered else 0.0


def ledger(records: Iterable[Record]) -> list[LedgerRow]:
    """A row a topic, in the order of the names, and a sum for each direction that carried anything."""
    counted = {"up": Counters(), "down": Counters()}
    for record in records:
        if isinstance(record, PacketEnded):
            counted[record.direction](record)
    return _rows(counted)


def message_ledger(records: Iterable[Record]) -> list[LedgerRow]:
    """As ``ledger``, of the messages whose delivery repeats or acknowledges; no rows where there are none."""
    counted = {"up": Counters(), "down": Counters()}
    for record in records:
        if isinstance(record, MessageEnded):
            counted[record.direction].count_message(record)
    return _rows(counted)


def _rows(counted: dict[str, Counters]) -> list[LedgerRow]:
    rows: list[LedgerRow] = []
    for name, counters in counted.items():
        rows += [LedgerRow(name, topic, counts) for topic, counts in sorted(counters.by_topic.items())]
        if counters.by_topic:
            rows.append(LedgerRow(name, ALL, counters.total))
    return rows


def ledger_csv(rows: Sequence[LedgerRow]) -> str:
    """A ledger as CSV; waits are sums over what was delivered [s]."""
    out = StringIO()
    writer = csv.writer(out, lineterminator="\n")
    counts = ("offered", "delivered", "dropped", "in_flight", "delivered_bits", "reasons")
    writer.writerow(["direction", "topic", *counts, *WAITS])
    for row in rows:
        c = row.counts
        shown = (c.offered, c.delivered, row.dropped, c.in_flight, c.delivered_bits, row.reasons)
        writer.writerow([row.direction, row.topic, *shown, *(getattr(c, wait) for wait in WAITS)])
    return out.getvalue()


HEADINGS = ("Link", "Topic", "offered", "arrived", "dropped", "queue s", "dark s", "sending s", "again s", "in air s")
_SHOWN_WAITS = ("queue_s", "blackout_s", "serialisation_s", "retransmission_s", "propagation_s")
NARROW = 5
NOTE = "Waits: mean of the packets that arrived. Every copy and every acknowledgement is a packet."
MESSAGES_NOTE = "Waits: mean of the messages that arrived; again: copies in vain. Best effort is not counted here."


def _cells(row: LedgerRow) -> tuple[str, ...]:
    counts = (row.counts.offered, row.counts.delivered, row.reasons or "-")
    return (row.direction, row.topic, *map(str, counts), *(f"{row.mean_s(wait):.3f}" for wait in _SHOWN_WAITS))


def ledger_markdown(rows: Sequence[LedgerRow], note: str = NOTE) -> str:
    """A ledger as Markdown."""
    lines = ["| " + " | ".join(HEADINGS) + " |", "|---|---|" + "---:|" * (len(HEADINGS) - 2)]
    lines += ["| " + " | ".join(_cells(row)) + " |" for row in rows]
    return "\n".join([*lines, "", note, ""])


def rich_ledger(rows: Sequence[LedgerRow], narrow: bool = False, messages: bool = False) -> Table:
    """The ledger for a terminal; ``narrow``: counts only; ``messages``: it is that of the messages."""
    from rich.table import Table

    title, note = ("Messages by topic", MESSAGES_NOTE) if messages else ("Packets by topic", NOTE)
    table = Table(title=title, caption=note, caption_justify="left")
    shown = NARROW if narrow else len(HEADINGS)
    for i, heading in enumerate(HEADINGS[:shown]):
        table.add_column(heading, justify="right" if i > 1 else "left", no_wrap=True)
    for row in rows:
        table.add_row(*_cells(row)[:shown], end_section=row.topic == ALL)
    return table
