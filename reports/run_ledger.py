"""What became of packets and messages, by direction and topic, as tables."""

from __future__ import annotations

from collections.abc import Sequence

from teleop_sim.reports.ledger import ALL, LedgerRow, ledger, message_ledger
from teleop_sim.reports.parts import Cell, Column, Sheet
from teleop_sim.reports.run_view import Run

WAITS = {
    "queue_s": "queueing",
    "blackout_s": "blackout",
    "serialisation_s": "sending bits",
    "retransmission_s": "sending again",
    "propagation_s": "in the air",
}
"""Where a packet waits, in the order in which it does."""
_GROUP = "mean wait of those that arrived [s]"
NOTE = "Waits: mean of the packets that arrived. Every copy and every acknowledgement is a packet."
MESSAGES_NOTE = "Waits: mean of the messages that arrived; again: copies in vain. Best effort is not counted here."


def ledger_sheet(run: Run) -> Sheet | None:
    """Packets by direction and topic; None where nothing was sent."""
    rows = ledger(run.records)
    return rows_sheet(rows, "packets", "bits, with headers", NOTE) if rows else None


def messages_sheet(run: Run) -> Sheet | None:
    """Messages by direction and topic where a delivery acknowledges; None where none does."""
    rows = message_ledger(run.records)
    return rows_sheet(rows, "messages", "bits of payload", MESSAGES_NOTE) if rows else None


def rows_sheet(rows: Sequence[LedgerRow], what: str, bits: str, note: str) -> Sheet:
    """A ledger's rows. ``what``: packets or messages. ``bits``: which of theirs are counted."""
    columns = (
        Column("direction", "link"),
        Column("topic", "topic"),
        Column("offered", what, help="offered to the link"),
        Column("delivered", "arrived"),
        Column("dropped", "dropped"),
        Column("in_flight", "on their way", help="when the run ended"),
        Column("reasons", "why dropped"),
        Column("delivered_bits", "bits", help=f"{bits}, of those that arrived"),
        Column("share_pct", "share [%]", 1, help="of its direction's bits"),
        *(Column(f"mean_{name}", words, 3, _GROUP) for name, words in WAITS.items()),
    )
    whole = {row.direction: row.counts.delivered_bits for row in rows if row.topic == ALL}
    return Sheet(columns, tuple(_cells(row, whole[row.direction]) for row in rows), (), note)


def _cells(row: LedgerRow, whole_bits: int) -> tuple[Cell, ...]:
    c = row.counts
    share_pct = 100.0 * c.delivered_bits / whole_bits if whole_bits else None
    means = (row.mean_s(name) if c.delivered else None for name in WAITS)
    counts = (c.offered, c.delivered, row.dropped, c.in_flight, row.reasons, c.delivered_bits)
    return (row.direction, row.topic, *counts, share_pct, *means)
