"""Two template servers over a link that loses, doubles and reorders until it returns: then they agree."""

from __future__ import annotations

import numpy as np
import pytest
import simpy
from hypothesis import given, settings
from hypothesis import strategies as st

from teleop_sim.channel.messages import decode_payload
from teleop_sim.channel.quantise import POSITION, ROTATION
from teleop_sim.channel.template_ends import FieldTemplates, StationTemplates
from teleop_sim.channel.template_messages import (
    TemplateMove,
    TemplateRemove,
    TemplateState,
    TemplateSync,
    change_message,
    pack_entries,
    unpack_entries,
)
from teleop_sim.core.errors import BadInput
from teleop_sim.templates.poses import Pose
from teleop_sim.templates.server import GONE, STEP_M, STEP_RAD, Entry, Server, snapped

EPS_S = 1e-6


def some_pose(rng):
    return Pose(tuple(rng.uniform(-3.0, 3.0, 3).tolist()), tuple(rng.uniform(-1.5, 1.5, 3).tolist()))


def whim(server: Server, rng) -> tuple[str, Server, Entry]:
    """Any change that a site can make."""
    there = server.placed
    kind = str(rng.choice(["insert", "move", "attach", "detach", "remove"])) if there else "insert"
    if kind == "insert":
        return (kind, *server.insert(int(rng.integers(40)), some_pose(rng)))
    chosen = there[int(rng.integers(len(there)))].instance
    if kind == "remove":
        return (kind, *server.remove(chosen))
    if kind == "attach":
        return (kind, *server.attach(chosen, "left" if rng.random() < 0.5 else "right", some_pose(rng)))
    return (kind, *getattr(server, kind)(chosen, some_pose(rng)))


class Sites:
    """Both sites and the two directions between them, on one clock."""

    def __init__(self, seed, delay_s, heartbeat_s, returns_s, lose, double):
        self.env, self.rng = simpy.Environment(), np.random.default_rng(seed)
        self.delay_s, self.returns_s, self.lose, self.double = delay_s, returns_s, lose, double
        self.station, self.field = StationTemplates(2.0 * delay_s), FieldTemplates()
        self.sent: list[bytes] = []
        self.env.process(self.beat(heartbeat_s))
        self.env.process(self.person())
        self.env.process(self.behaviour())

    def carry(self, message, deliver):
        payload, bad = message.encode(), self.env.now < self.returns_s
        self.sent.append(payload)
        lost, doubled, *held = self.rng.random(4)
        copies = 1 if not bad else 0 if lost < self.lose else 2 if doubled < self.double else 1
        for copy in range(copies):
            # Held up, but not past what is sent when the link has returned.
            late_s = min(5.0 * held[copy], self.returns_s - self.env.now) if bad else 0.0
            arrival = self.env.timeout(self.delay_s + late_s)
            arrival.callbacks.append(lambda _: deliver(decode_payload(payload)))

    def up(self, message):
        def deliver(arrived):
            answer = self.field.receive(arrived)
            if answer is not None:
                self.down(answer)

        self.carry(message, deliver)

    def down(self, message):
        def deliver(arrived):
            question = self.station.receive(arrived, self.env.now)
            if question is not None:
                self.up(question)

        self.carry(message, deliver)

    def beat(self, every_s):
        while True:
            yield self.env.timeout(every_s)
            self.down(self.field.heartbeat())

    def person(self):
        while True:
            yield self.env.timeout(self.rng.exponential(6.0))
            if self.env.now >= self.returns_s:
                return
            kind, server, entry = whim(self.station.server, self.rng)
            self.station.server = server
            self.up(change_message(kind, entry))

    def behaviour(self):
        while True:
            yield self.env.timeout(self.rng.exponential(9.0))
            if self.env.now >= self.returns_s:
                return
            _, server, _ = whim(self.field.server, self.rng)
            self.down(self.field.changed(server))


@settings(deadline=None, max_examples=60)
@given(
    seed=st.integers(0, 2**32 - 1),
    delay_s=st.sampled_from((0.0, 0.3, 2.0, 10.0)),
    heartbeat_s=st.sampled_from((0.7, 5.0, 20.0)),
    returns_s=st.floats(0.0, 120.0),
    lose=st.sampled_from((0.0, 0.2, 0.6, 1.0)),
    double=st.sampled_from((0.0, 0.3)),
)
def test_both_sites_agree_when_the_link_has_returned(seed, delay_s, heartbeat_s, returns_s, lose, double):
    sites = Sites(seed, delay_s, heartbeat_s, returns_s, lose, double)
    # Until nothing can be under way a round trip, a heartbeat that then comes, a question and its answer.
    sites.env.run(until=returns_s + heartbeat_s + 5.0 * delay_s + EPS_S)
    assert sites.station.server.entries == sites.field.server.entries
    # And the next heartbeat finds it so, and asks nothing.
    before = len(sites.sent)
    sites.env.run(until=sites.env.now + heartbeat_s + delay_s + EPS_S)
    assert sites.station.in_step
    assert all(payload[:1] == b"\xb0" for payload in sites.sent[before:])


@given(st.integers(0, 2**32 - 1), st.integers(1, 30))
def test_merging_knows_no_order_and_no_number(seed, count):
    rng = np.random.default_rng(seed)
    sites, told = [Server("station"), Server("field")], []
    for _ in range(count):
        which = int(rng.integers(2))
        _, sites[which], entry = whim(sites[which], rng)
        told.append(entry)
        if rng.random() < 0.3:
            sites[1 - which] = sites[1 - which].merge((entry,))
    whole = Server("field").merge(told)
    for _ in range(3):
        order = [*rng.permutation(len(told)), *rng.integers(0, len(told), 5)]
        again = Server("field")
        for place in order:
            again = again.merge((told[place],))
        assert (again.entries, again.hash) == (whole.entries, whole.hash)
    assert sites[0].merge(sites[1].entries).entries == sites[1].merge(sites[0].entries).entries == whole.entries


@given(st.integers(0, 2**32 - 1))
def test_what_is_told_is_what_is_held(seed):
    rng = np.random.default_rng(seed)
    server = Server("station")
    for _ in range(5):
        kind, server, entry = whim(server, rng)
        message = change_message(kind, entry)
        assert decode_payload(message.encode()).entries == (entry,)
        assert unpack_entries(pack_entries(server.entries, "test"), "test") == server.entries


def test_the_grid_is_the_one_of_messages():
    assert (POSITION.step, ROTATION.step) == (STEP_M, STEP_RAD)
    assert snapped(Pose((32.767, 0.0004, 0.0006), (0.0, 0.0, 0.0))).position_m == (32767 * STEP_M, 0.0, STEP_M)
    with pytest.raises(BadInput, match=r"32\.767"):
        snapped(Pose((33.0, 0.0, 0.0)))


def test_a_removed_instance_stays_away_and_its_number_comes_back_last():
    server, door = Server("station").insert(8, Pose((1.0, 0.0, 1.0)))
    server, gone = server.remove(door.instance)
    assert server.merge((door,)).placed == ()
    server, valve = server.insert(29, Pose())
    assert valve.instance == 2
    for _ in range(126):
        server, _ = server.insert(8, Pose())
    server, again = server.insert(29, Pose())
    assert (again.instance, again.template) == (door.instance, 29)
    assert again.stamp > gone.stamp
    with pytest.raises(BadInput, match="Remove one"):
        server.insert(8, Pose())


def test_a_later_change_wins_whatever_arrives_last():
    station, door = Server("station").insert(8, Pose((1.0, 0.0, 1.0)))
    field = Server("field").merge((door,))
    field, held = field.attach(door.instance, "right", Pose((0.0, 0.1, 0.0)))
    station, moved = station.move(door.instance, Pose((1.1, 0.0, 1.0)))
    # The station's stamp 2 is above the field's 1: the same at both sites.
    assert (held.stamp, moved.stamp) == (1, 2)
    assert station.merge((held,)).entries == field.merge((moved,)).entries == (moved,)
    station, gone = station.clear()
    assert (station.placed, [e.template for e in gone]) == ((), [GONE])


def test_what_crosses_is_small():
    station = StationTemplates(20.0)
    inserted = station.insert(29, Pose((1.2, 0.0, 1.1), (0.0, 0.0, 0.3)), 0.0)
    moved = station.move(inserted.instance, Pose((1.25, 0.0, 1.1), (0.0, 0.0, 0.3)), 1.0)
    assert isinstance(moved, TemplateMove)
    # 17 bytes at 64 bit/s: 2.1 s; one instance whole: 18.
    assert len(moved.encode()) == 17
    assert len(FieldTemplates().heartbeat().encode()) == 5
    assert len(TemplateSync(pack_entries(station.server.entries, "test")).encode()) == 18
    gone = station.remove(inserted.instance, 2.0)
    assert isinstance(gone, TemplateRemove)


def test_a_station_that_joins_late_asks_for_everything():
    field = FieldTemplates()
    field.server, _ = field.server.insert(8, Pose((1.0, 0.0, 1.0)))
    station = StationTemplates(20.0)
    question = station.receive(field.heartbeat(), 5.0)
    assert (question, station.in_step) == (TemplateSync(b""), False)
    answer = field.receive(question)
    assert isinstance(answer, TemplateState)
    # An older heartbeat within a round trip asks nothing again.
    assert station.receive(field.heartbeat(), 6.0) is None
    assert station.receive(answer, 25.0) is None
    assert station.receive(field.heartbeat(), 26.0) is None
    assert station.in_step
    assert station.server.entries == field.server.entries
