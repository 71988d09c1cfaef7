"""What was found in a file: messages, by their places in its bytes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from teleop_sim.log.loops import Bytes, Longs

_UNSIGNED = 2**64 - 1


@dataclass(frozen=True)
class RawMessage:
    """One message as stored: topic, sequence number, time [ns], the file's schema id and the encoded record."""

    topic: str
    schema_id: int
    sequence: int
    time_ns: int
    data: bytes


@dataclass(frozen=True)
class Block:
    """Bytes of some chunks, and where the messages in them are.

    Attributes:
        data: the chunks' records.
        notes: five rows, a column a message: place of topic and schema in ``Scan.kinds``, time [ns] (unsigned),
            sequence, start and size of the encoded record.

    """

    data: Bytes
    notes: Longs

    @property
    def kinds(self) -> Longs:
        """Of each message, the place of its topic and schema in ``Scan.kinds``."""
        row: Longs = self.notes[0]
        return row

    @property
    def times_ns(self) -> Longs:
        """Of each message, its time [ns]."""
        row: Longs = self.notes[1]
        return row


@dataclass
class Scan:
    """What a file holds.

    Attributes:
        schemas: schema id to (name of the message type, its declaration).
        channels: channel id to (topic, schema id).
        kinds: the topics and schema ids that were asked for, by number.
        blocks: all messages of these that are whole, in file order.
        whole: the file's end was reached; otherwise it is cut or damaged after the last message.

    """

    schemas: dict[int, tuple[str, bytes]] = field(default_factory=dict)
    channels: dict[int, tuple[str, int]] = field(default_factory=dict)
    kinds: list[tuple[str, int]] = field(default_factory=list)
    blocks: list[Block] = field(default_factory=list)
    whole: bool = False

    @property
    def messages(self) -> Iterator[RawMessage]:
        """The messages one by one."""
        for block in self.blocks:
            for kind, time_ns, sequence, start, size in block.notes.T.tolist():
                data = block.data[start : start + size].tobytes()
                topic, schema_id = self.kinds[kind]
                yield RawMessage(topic, schema_id, sequence, time_ns & _UNSIGNED, data)
