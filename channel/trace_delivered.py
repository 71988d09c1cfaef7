"""What a delivery over both directions of a link does to a list of messages: a row a message. See docs/link.md."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import simpy

from teleop_sim.channel.blackouts import dark_between
from teleop_sim.channel.delivery import BestEffort, Delivery, Endpoint, connect
from teleop_sim.channel.fates import Fate
from teleop_sim.channel.feasible import refuse_undeliverable
from teleop_sim.channel.link import Direction, Receive
from teleop_sim.channel.message import DirectionName
from teleop_sim.channel.settings import DirectionSettings
from teleop_sim.channel.trace import Offer, TraceRow, schedule_offers
from teleop_sim.core.records import Emit, PacketEnded, Record

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

    The rows are as those of ``trace``, of messages rather than packets, with every time that the delivery adds:
    ``retransmission_s`` has the time from the first copy to the one that arrived; ``queue_s`` also the light time in
    which the sender kept the message back (a handshake, a full window), ``propagation_s`` also that in which the
    receiver did, for order. A message that was given up is ``dropped``, reason ``gave_up``.

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
    for name, (settings, _) in by_name.items():
        refuse_undeliverable(settings, math.inf, name)
    env = simpy.Environment()
    fates: list[Fate] = []
    packets: dict[int, PacketEnded] = {}

    def note(record: Record) -> None:
        if isinstance(record, PacketEnded) and record.direction == way:
            packets[record.packet] = record

    def make(name: DirectionName, receive: Receive, emit: Emit) -> Direction:
        settings, rng = by_name[name]
        return Direction(env, name, settings, receive, emit, rng)

    sender = Endpoint(env, delivery, lambda _: None, fates.append)
    answerer = Endpoint(env, BestEffort(), lambda _: None)
    link = connect(make, *((sender, answerer) if way == "up" else (answerer, sender)), note)
    schedule_offers(env, sender.send, sorted(offers, key=lambda offer: offer.time_s), until_s)
    env.run(None if math.isinf(until_s) else until_s)
    link.close()
    return tuple(_row(fate, packets.get(fate.packet), ways[0][0]) for fate in sorted(fates, key=lambda f: f.number))


def _row(fate: Fate, packet: PacketEnded | None, settings: DirectionSettings) -> TraceRow:
    """The waits add up to the time from the offer to the message's end."""
    dark_s = dark_between(fate.offered_s, fate.offered_s + fate.store_s, settings.blackouts)
    # A difference of times: rounding may leave a hair below zero.
    queue_s, blackout_s = max(0.0, fate.store_s - dark_s), dark_s
    serialisation_s, propagation_s, vain_s = 0.0, fate.order_s, fate.retransmission_s
    if packet is None or packet.outcome == "dropped" or fate.outcome == "gave_up":
        # Whatever was sent, was sent in vain.
        vain_s += fate.link_s
    else:
        queue_s += packet.queue_s
        blackout_s += packet.blackout_s
        serialisation_s += packet.serialisation_s
        propagation_s += packet.propagation_s
        vain_s += packet.retransmission_s
    return TraceRow(
        id=fate.number,
        topic=fate.topic,
        bytes=fate.payload_bytes,
        sent_s=fate.offered_s,
        arrived_s=fate.ended_s if fate.outcome == "delivered" else None,
        outcome="dropped" if fate.outcome == "gave_up" else fate.outcome,
        reason=fate.reason,
        queue_s=queue_s,
        serialisation_s=serialisation_s,
        blackout_s=blackout_s,
        propagation_s=propagation_s,
        retransmission_s=vain_s,
    )
