"""What a delivery over both directions of a link does to a list of messages: a row a message. See docs/link.md."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import simpy

from teleop_sim.channel.delivery import BestEffort, Delivery, Endpoint, connect
from teleop_sim.channel.fates import Fate
from teleop_sim.channel.feasible import undeliverable
from teleop_sim.channel.link import Direction, Receive
from teleop_sim.channel.message import DirectionName
from teleop_sim.channel.message_ends import message_ended
from teleop_sim.channel.settings import DirectionSettings
from teleop_sim.channel.tcp import least_packet_bytes
from teleop_sim.channel.trace import Offer, TraceRow, schedule_offers
from teleop_sim.core.errors import BadInput, Problem
from teleop_sim.core.records import Emit, MessageEnded

Way = tuple[DirectionSettings, np.random.Generator]
"""A direction's settings and the random numbers of its loss and jitter."""


def trace_delivered(
    offers: Iterable[Offer],
    delivery: Delivery,
    ways: tuple[Way, Way],
    way: DirectionName = "up",
    until_s: float = math.inf,
) -> tuple[TraceRow, ...]:
    """Send messages by a delivery and say what became of each, in order of id.

    The rows are as those of ``trace``, of messages rather than packets, with every time that the delivery adds; see
    ``message_ends.py``. A message that was given up is ``dropped``, reason ``gave_up``, or ``no_connection`` where
    TCP's patience was over before its handshake.

    Args:
        offers: in any order; those of one instant are sent in the order given.
        delivery: of the side that sends; the other only answers.
        ways: the direction of the messages, and the way back.
        way: name of the first.
        until_s: when to stop, above zero; ``inf``: when nothing happens any more, which a delivery that never gives up
            may put off for ever.

    Raises:
        BadInput: a direction cannot deliver anything, or nothing of this delivery.
        BadMessage: a message that the delivery cannot carry.

    """
    back: DirectionName = "down" if way == "up" else "up"
    by_name = dict(zip((way, back), ways, strict=True))
    found: list[Problem] = []
    for name, own, other in ((way, delivery, BestEffort()), (back, BestEffort(), delivery)):
        found += undeliverable(by_name[name][0], math.inf, name, least_packet_bytes(own, other))
    if found:
        raise BadInput(tuple(found))
    env = simpy.Environment()
    ends: list[MessageEnded] = []

    def note(fate: Fate) -> None:
        ends.append(message_ended(fate, float(env.now), way, ways[0][0].blackouts))

    def make(name: DirectionName, receive: Receive, emit: Emit) -> Direction:
        settings, rng = by_name[name]
        return Direction(env, name, settings, receive, emit, rng)

    sender = Endpoint(env, delivery, lambda _: None, note)
    answerer = Endpoint(env, BestEffort(), lambda _: None)
    link = connect(make, *((sender, answerer) if way == "up" else (answerer, sender)), lambda _: None)
    schedule_offers(env, sender.send, sorted(offers, key=lambda offer: offer.time_s), until_s)
    env.run(None if math.isinf(until_s) else until_s)
    link.close()
    return tuple(_row(ended) for ended in sorted(ends, key=lambda ended: ended.number))


def _row(ended: MessageEnded) -> TraceRow:
    return TraceRow(
        id=ended.number,
        topic=ended.topic,
        bytes=ended.payload_bytes,
        sent_s=ended.sent_s,
        arrived_s=ended.delivered_s if ended.outcome == "delivered" else None,
        outcome=ended.outcome,
        reason=ended.reason,
        queue_s=ended.queue_s,
        serialisation_s=ended.serialisation_s,
        blackout_s=ended.blackout_s,
        propagation_s=ended.propagation_s,
        retransmission_s=ended.retransmission_s,
    )
