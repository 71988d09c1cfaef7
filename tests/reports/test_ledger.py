"""The ledger of packets: it counts what the log holds, and what the link itself has counted."""

import csv

import numpy as np
import pytest
import simpy

from teleop_sim.channel.counters import WAITS
from teleop_sim.channel.link import Direction, DirectionSettings
from teleop_sim.channel.loss import Bernoulli
from teleop_sim.core.records import MessageEnded, PacketEnded, Record, RunEnded
from teleop_sim.reports.formats.csv import csv as csv_bytes
from teleop_sim.reports.formats.markdown import markdown
from teleop_sim.reports.ledger import ALL, ledger, message_ledger
from teleop_sim.reports.run_ledger import MESSAGES_NOTE, NOTE, rows_sheet
from teleop_sim.reports.terminal import rich_ledger


def traffic() -> tuple[list[Record], dict[str, Direction]]:
    """Some packets both ways over links that lose, overflow and end before all is there."""
    env, seen = simpy.Environment(), list[Record]()
    settings = DirectionSettings(1000.0, 1.0, loss=Bernoulli(0.3), queue_limit=4)
    ways = {
        name: Direction(env, name, settings, lambda _: None, seen.append, np.random.default_rng(i))
        for i, name in enumerate(("up", "down"))
    }

    def talk(direction: Direction, topics: tuple[str, ...]):
        for i in range(60):
            direction.send(topics[i % len(topics)], bytes(20 + i))
            yield env.timeout(0.1)

    env.process(talk(ways["up"], ("chat",)))
    env.process(talk(ways["down"], ("mirror", "log", "image")))
    env.run(until=12.0)
    for direction in ways.values():
        direction.close()
    return seen, ways


def test_the_ledger_is_what_the_link_counted() -> None:
    records, ways = traffic()
    rows = {(row.direction, row.topic): row for row in ledger(records)}
    assert list(rows) == [
        ("up", "chat"), ("up", ALL), ("down", "image"), ("down", "log"), ("down", "mirror"), ("down", ALL),
    ]  # fmt: skip
    for name, direction in ways.items():
        assert rows[name, ALL].counts == direction.counters.total
        assert rows[name, ALL].counts.offered == direction.sent
        for topic, counts in direction.counters.by_topic.items():
            assert rows[name, topic].counts == counts
    total = rows["down", ALL]
    assert total.dropped + total.counts.delivered + total.counts.in_flight == total.counts.offered
    assert {reason.split()[0].rstrip(",") for reason in total.reasons.split(", ")} == {"lost", "queue_full"}
    assert total.mean_s("propagation_s") == pytest.approx(1.0)


def test_the_files_say_the_same() -> None:
    records, _ = traffic()
    rows = ledger(records)
    sheet = rows_sheet(rows, "packets", "bits", NOTE)
    data, text = csv_bytes(sheet), markdown(sheet)
    assert data is not None
    assert text is not None
    read = list(csv.DictReader(data.decode().splitlines()))
    assert len(read) == len(rows) == text.decode().count("\n|") - 1
    for line, row in zip(read, rows, strict=True):
        assert int(line["offered"]) == int(line["delivered"]) + int(line["dropped"]) + int(line["in_flight"])
        assert (line["topic"], line["reasons"]) == (row.topic, row.reasons)
        assert [float(line[f"mean_{wait}"]) for wait in WAITS] == [row.mean_s(wait) for wait in WAITS]
    for direction in ("up", "down"):
        shares = [float(line["share_pct"]) for line in read if line["direction"] == direction and line["topic"] != ALL]
        assert sum(shares) == pytest.approx(100.0)
    assert rich_ledger(rows).row_count == rich_ledger(rows, narrow=True).row_count == len(rows)


def test_a_run_without_packets_has_an_empty_ledger() -> None:
    assert ledger([RunEnded(1.0, "censored", "", 1.0, 0, 0)]) == []
    assert rows_sheet([], "packets", "bits", "").rows == ()


def test_packets_of_the_log_alone_are_enough(make_run) -> None:
    records = list(make_run(ask=True))
    counted = sum(isinstance(r, PacketEnded) for r in records)
    assert sum(row.counts.offered for row in ledger(records) if row.topic == ALL) == counted > 0


def message(number: int, outcome: str, reason: str = "", topic: str = "chat", again_s: float = 0.0) -> MessageEnded:
    end_s = 12.0 + again_s if outcome == "delivered" else float("nan")
    waits = (1.0, 0.0, 1.0, 10.0, again_s)
    return MessageEnded(50.0, "up", number, topic, 18, 0.0, end_s, *waits, 2, outcome, reason, "")


def test_messages_have_a_ledger_of_their_own_where_they_are_logged(make_run) -> None:
    ends = [
        message(0, "delivered", again_s=24.0),
        message(1, "delivered"),
        message(2, "dropped", "gave_up"),
        message(3, "dropped", "no_connection", "stop"),
        message(4, "in_flight"),
    ]
    plain = list(make_run())
    assert message_ledger(plain) == []
    records = [*plain, *ends]
    assert ledger(records) == ledger(plain)
    rows = message_ledger(records)
    assert [
        (row.topic, row.counts.offered, row.counts.delivered, row.reasons, row.counts.in_flight) for row in rows
    ] == [
        ("chat", 4, 2, "gave_up 1", 1),
        ("stop", 1, 0, "no_connection 1", 0),
        (ALL, 5, 2, "gave_up 1, no_connection 1", 1),
    ]
    assert (rows[0].mean_s("retransmission_s"), rows[0].mean_s("propagation_s")) == (12.0, 10.0)
    assert rows[0].counts.delivered_bits == 2 * 8 * 18
    assert rows_sheet(rows, "messages", "bits", MESSAGES_NOTE).note == MESSAGES_NOTE
    assert rich_ledger(rows, messages=True).title == "Messages by topic"
