"""What became of the packets of a run, by direction and topic: counts, reasons of drops, and where they waited.

The counts are those of the link itself (``channel/counters.py``), taken again from the log's records. Where a delivery
repeats, every copy is a packet and so is every acknowledgement; what became of the messages is a ledger of its own.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from teleop_sim.channel.counters import Counters, TopicCounts
from teleop_sim.core.records import MessageEnded, PacketEnded, Record

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
