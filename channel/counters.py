"""What became of the packets (or messages) of each topic, counted from their records. Memory: one entry a topic."""

from __future__ import annotations

from dataclasses import dataclass, field

from teleop_sim.core.records import MessageEnded, PacketEnded, Record

WAITS = ("queue_s", "serialisation_s", "blackout_s", "propagation_s", "retransmission_s")
"""Fields of a packet's record that add up to ``arrived_s - sent_s``, and of a message's to ``delivered_s - sent_s``."""


@dataclass(slots=True)
class TopicCounts:
    """Packets, or messages, of one topic. ``offered == delivered + sum(dropped.values()) + in_flight`` always.

    Attributes:
        delivered: packets that arrived whole.
        delivered_bits: theirs, with headers.
        dropped: packets by reason, see ``drops.py``.
        in_flight: packets that were on their way when the run ended.
        queue_s: summed over the packets delivered, as are the other waits.
        serialisation_s: bits going out.
        blackout_s: dark until the last bit was out.
        propagation_s: in the air, and held back for order.
        retransmission_s: bits that went out in vain.

    """

    delivered: int = 0
    delivered_bits: int = 0
    dropped: dict[str, int] = field(default_factory=dict)
    in_flight: int = 0
    queue_s: float = 0.0
    serialisation_s: float = 0.0
    blackout_s: float = 0.0
    propagation_s: float = 0.0
    retransmission_s: float = 0.0

    @property
    def offered(self) -> int:
        """Packets whose fate is known; after ``close`` all that were sent."""
        return self.delivered + sum(self.dropped.values()) + self.in_flight

    def add(self, packet: PacketEnded) -> None:
        """Count one packet that has ended."""
        self._count(packet, packet.size_bits)

    def add_message(self, message: MessageEnded) -> None:
        """Count one message that has ended; its bits are those of the payload."""
        self._count(message, 8 * message.payload_bytes)

    def _count(self, ended: PacketEnded | MessageEnded, bits: int) -> None:
        if ended.outcome == "delivered":
            self.delivered += 1
            self.delivered_bits += bits
            self.queue_s += ended.queue_s
            self.serialisation_s += ended.serialisation_s
            self.blackout_s += ended.blackout_s
            self.propagation_s += ended.propagation_s
            self.retransmission_s += ended.retransmission_s
        elif ended.outcome == "dropped":
            self.dropped[ended.reason] = self.dropped.get(ended.reason, 0) + 1
        else:
            self.in_flight += 1


@dataclass(slots=True)
class Counters:
    """Counts by topic, of one direction. An ``Emit``: give it records, it takes those of packets.

    Attributes:
        by_topic: in the order in which topics first ended.

    """

    by_topic: dict[str, TopicCounts] = field(default_factory=dict)

    def __call__(self, record: Record) -> None:
        """Take a record."""
        if isinstance(record, PacketEnded):
            self._of(record.topic).add(record)

    def count_message(self, message: MessageEnded) -> None:
        """Take the end of a message; packets and messages belong into counters of their own."""
        self._of(message.topic).add_message(message)

    def _of(self, topic: str) -> TopicCounts:
        counts = self.by_topic.get(topic)
        if counts is None:
            counts = self.by_topic[topic] = TopicCounts()
        return counts

    @property
    def total(self) -> TopicCounts:
        """All topics together."""
        total = TopicCounts()
        for counts in self.by_topic.values():
            total.delivered += counts.delivered
            total.delivered_bits += counts.delivered_bits
            total.in_flight += counts.in_flight
            for reason, count in counts.dropped.items():
                total.dropped[reason] = total.dropped.get(reason, 0) + count
            for wait in WAITS:
                setattr(total, wait, getattr(total, wait) + getattr(counts, wait))
        return total
