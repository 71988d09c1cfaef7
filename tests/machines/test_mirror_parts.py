"""The mirror message by message, snapshots as bytes, and what the field site knows of commands that come late."""

from __future__ import annotations

import pickle
from dataclasses import replace
from zlib import crc32

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teleop_sim.channel import messages
from teleop_sim.machines.declare import Machine
from teleop_sim.machines.elements import PARKED, Concurrence, Edge, Group, Rule, State
from teleop_sim.machines.engine import MODES
from teleop_sim.machines.ledger import Ledger
from teleop_sim.machines.mirror import Mirror
from teleop_sim.machines.net import Configuration
from teleop_sim.machines.relocate import put
from teleop_sim.machines.sync import COUNTS, REQUEST_KINDS, Asked, BadSnapshot, Snapshot, unpack_snapshot


def machine() -> Machine:
    """Look; then walk and scan at once; then grasp in two steps, again and again if it slips."""
    both = Concurrence(
        "Both",
        (State("Walk", "walk"), State("Scan", "scan")),
        (Edge("Walk", "there", PARKED, 0), Edge("Scan", "seen", PARKED, 0), Edge("Scan", "blind", PARKED, 2)),
        ("ready", "lost"),
        "all",
        (Rule("lost", (("Scan", "blind"),)),),
        "ready",
    )
    grasp = Group(
        "Grasp",
        "Reach",
        (State("Reach", "reach"), State("Close", "close")),
        (
            Edge("Reach", "near", "Close", 0),
            Edge("Close", "held", "done", 1),
            Edge("Close", "slip", "Reach", 0, "retry"),
        ),
        ("done",),
    )
    edges = (
        Edge("Look", "clear", "Both", 0),
        Edge("Look", "again", "Look", 0, "retry"),
        Edge("Both", "ready", "Grasp", -1),
        Edge("Both", "lost", "Look", -1),
        Edge("Grasp", "done", "Look", 1),
        Edge("Look", "enough", "end", 3, "command", "operator"),
    )
    return Machine("m", "Look", (State("Look", "look"), both, grasp), edges, outcomes=("end",))


M = machine()
NODE = M.net.by_path


def at(*paths: str, parked: tuple[tuple[str, str], ...] = ()) -> Configuration:
    return Configuration(tuple(sorted(NODE[p] for p in paths)), tuple(sorted(M.edge_index(*e) for e in parked)))


@pytest.fixture
def mirror() -> Mirror:
    return Mirror(M, 1)


def take(target: Mirror | Ledger, *outcomes: tuple[str, str]) -> None:
    for path, event in outcomes:
        target.transition(M.edge_index(path, event))


# Mirror --------------------------------------------------------------------------------------------------------------


def test_states_at_work_at_once_show_as_such(mirror):
    assert mirror.state == "Look"
    take(mirror, ("Look", "clear"))
    assert mirror.states == ("Both/Walk", "Both/Scan")
    take(mirror, ("Both/Walk", "there"))
    assert mirror.state == "Both/Scan"
    take(mirror, ("Both/Scan", "seen"))
    assert mirror.state == "Both"
    take(mirror, ("Both", "ready"))
    assert (mirror.state, mirror.seen, mirror.in_step) == ("Grasp/Reach", 4, True)


def test_an_ended_machine_shows_its_outcome(mirror):
    take(mirror, ("Look", "enough"))
    assert (mirror.states, mirror.state) == ((), "end")


def test_a_request_is_over_when_its_state_is_left_and_others_stay(mirror):
    take(mirror, ("Look", "clear"))
    mirror.request(1, "confirm", NODE["Both/Walk"], M.edge_index("Both/Walk", "there"))
    mirror.request(2, "manual", NODE["Both/Scan"], -1)
    assert [a.request for a in mirror.asked] == [1, 2]
    take(mirror, ("Both/Walk", "there"))
    assert mirror.asked == (Asked(2, "manual", NODE["Both/Scan"]),)
    # It comes again: a copy that was held up.
    mirror.request(1, "confirm", NODE["Both/Walk"], M.edge_index("Both/Walk", "there"))
    assert [a.request for a in mirror.asked] == [2]
    mirror.withdrawn(2)
    assert mirror.asked == ()
    assert mirror.in_step


def test_a_loop_ends_the_requests_of_the_visit_before(mirror):
    mirror.request(1, "confirm", NODE["Look"], M.edge_index("Look", "again"))
    take(mirror, ("Look", "again"))
    assert mirror.asked == ()


def test_a_state_asks_one_thing_at_a_time(mirror):
    mirror.request(1, "confirm", NODE["Look"], M.edge_index("Look", "again"))
    mirror.request(2, "act", NODE["Look"], -1)
    assert [a.request for a in mirror.asked] == [2]


def test_what_does_not_fit_shows_at_once_and_the_newest_message_is_believed(mirror):
    take(mirror, ("Grasp/Close", "slip"))
    assert (mirror.state, mirror.in_step, mirror.wants_sync, mirror.gaps) == ("Grasp/Reach", False, True, 1)
    assert "Grasp/Close" in mirror.doubt
    assert "Look" in mirror.doubt
    mirror.request(1, "manual", NODE["Both/Scan"], -1)
    assert (mirror.states, mirror.gaps) == (("Both/Walk", "Both/Scan"), 2)


@pytest.mark.parametrize(
    "wrong",
    [
        lambda m: m.transition(len(M.table)),
        lambda m: m.request(1, "manual", 0, -1),
        lambda m: m.request(1, "manual", len(M.net.nodes), -1),
        lambda m: m.request(1, "confirm", NODE["Look"], M.edge_index("Grasp", "done")),
        lambda m: m.request(1, "confirm", NODE["Look"], len(M.table)),
        lambda m: m.sync(b"no snapshot"),
        lambda m: m.sync(Snapshot(M.checksum, Configuration((99,)), 1).pack()),
        lambda m: m.sync(Snapshot(M.checksum, at("Look"), 1, asked=(Asked(1, "confirm", 1, 99),)).pack()),
    ],
)
def test_what_cannot_be_changes_nothing_but_the_doubt(mirror, wrong):
    before = mirror.snapshot
    wrong(mirror)
    assert (mirror.snapshot, mirror.in_step, mirror.gaps) == (before, False, 1)


def test_a_lost_message_shows_with_the_heartbeat_whatever_it_was():
    told = Snapshot(M.checksum, at("Look"), 1)
    lost = (
        replace(told, level=2), replace(told, mode="manual"), replace(told, paused=True), replace(told, locked=(1,)),
        replace(told, asked=(Asked(1, "data", NODE["Look"]),)), replace(told, configuration=at("Grasp/Close")),
        # A loop leads nowhere new.
        replace(told, count=1),
    )  # fmt: skip
    for truth in lost:
        mirror = Mirror(M, 1)
        mirror.heartbeat(told.behaviour, told.hash)
        assert mirror.in_step
        for _ in range(2):
            mirror.heartbeat(truth.behaviour, truth.hash)
        assert (mirror.in_step, mirror.wants_sync, mirror.gaps) == (False, True, 1)
        mirror.sync(truth.pack())
        assert (mirror.snapshot, mirror.in_step, mirror.doubt) == (truth, True, "")
        mirror.heartbeat(truth.behaviour, truth.hash)
        assert mirror.in_step


def test_everything_told_is_what_the_hash_is_about(mirror):
    mirror.mode_is("manual")
    mirror.level_is(3)
    mirror.paused_is(True)
    for node, locked in ((3, True), (1, True), (3, True), (2, True), (2, False)):
        mirror.locked_is(node, locked)
    truth = Snapshot(M.checksum, at("Look"), 3, "manual", True, (1, 3))
    mirror.heartbeat(truth.behaviour, truth.hash)
    assert (mirror.mode, mirror.level, mirror.in_step) == ("manual", 3, True)


def test_one_that_joins_late_knows_nothing_until_the_whole_state_comes():
    mirror = Mirror(M, 0, late=True)
    assert (mirror.in_step, mirror.wants_sync, mirror.gaps) == (False, True, 0)
    mirror.sync(Snapshot(M.checksum, at("Grasp/Close"), 3, "auto", count=77).pack())
    assert (mirror.state, mirror.level, mirror.mode, mirror.seen) == ("Grasp/Close", 3, "auto", 77)
    assert mirror.in_step


def test_a_machine_that_is_not_known_here_is_named_until_it_is_learnt(mirror):
    other = replace(M, data=(("speed", 2),))
    assert other.checksum != M.checksum
    truth = Snapshot(other.checksum, at("Both/Walk", "Both/Scan"), 1)
    for _ in range(2):
        mirror.heartbeat(truth.behaviour, truth.hash)
        mirror.sync(truth.pack())
    assert (mirror.stranger, mirror.wants_sync, mirror.gaps) == (other.checksum, False, 1)
    assert f"{other.checksum:08x}" in mirror.doubt
    take(mirror, ("Look", "clear"))
    mirror.request(1, "manual", NODE["Look"], -1)
    assert (mirror.state, mirror.asked) == ("Look", ())
    mirror.learn(other)
    assert (mirror.stranger, mirror.wants_sync) == (None, True)
    mirror.sync(truth.pack())
    assert (mirror.machine, mirror.snapshot, mirror.in_step) == (other, truth, True)


def test_a_known_change_of_the_machine_comes_with_the_whole_state(mirror):
    other = replace(M, data=(("speed", 2),))
    mirror.learn(other)
    truth = Snapshot(other.checksum, at("Look"), 1)
    mirror.heartbeat(truth.behaviour, truth.hash)
    assert mirror.wants_sync
    mirror.sync(truth.pack())
    assert mirror.machine is other


# Guesses -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("before", "path", "after"),
    [
        (at("Look"), "Look", at("Look")),
        (at("Look"), "Grasp/Close", at("Grasp/Close")),
        (at("Grasp/Reach"), "Grasp/Close", at("Grasp/Close")),
        (at("Grasp"), "Grasp/Close", at("Grasp/Close")),
        (at("Look"), "Both/Scan", at("Both/Walk", "Both/Scan")),
        (at("Both"), "Both/Scan", at("Both/Walk", "Both/Scan")),
        # The other child stays parked.
        (at("Both/Scan", parked=(("Both/Walk", "there"),)), "Both/Walk", at("Both/Walk", "Both/Scan")),
        (at("Both/Walk", parked=(("Both/Scan", "seen"),)), "Both", at("Both/Walk", parked=(("Both/Scan", "seen"),))),
        (Configuration((), (), "end"), "Grasp", at("Grasp/Reach")),
    ],
)
def test_a_guess_keeps_what_it_can(before, path, after):
    assert put(M.net, before, NODE[path]) == after


@given(data=st.data())
def test_a_guess_has_the_state_at_work_and_one_child_a_group(random_machines, data):
    m = data.draw(random_machines.machines())
    now, rng = m.net.begin(), np.random.default_rng(data.draw(st.integers(0, 99)))
    for _ in range(20):
        node = int(rng.integers(1, len(m.net.nodes)))
        now = put(m.net, now, node)
        assert m.net.on_path(now, node)
        assert put(m.net, now, node) == now
        for group in (n for n in m.net.nodes if isinstance(n.element, Group)):
            children = {
                n for a in now.active for n in (a, *m.net.containers(a)) if m.net.nodes[n].parent == group.number
            }
            assert len(children) <= 1
        # A guess is good enough to go on from.
        edges = [e for e, source in enumerate(m.net.source) if source == node]
        if edges:
            now = m.net.move(now, int(rng.choice(edges))).configuration


# Snapshots -----------------------------------------------------------------------------------------------------------

uint16 = st.integers(0, 258) | st.integers(0, 65535)
numbers = st.lists(uint16, max_size=4).map(tuple)
requests = st.builds(Asked, uint16, st.sampled_from(REQUEST_KINDS), uint16, st.integers(-1, 65534))
snapshots = st.builds(
    Snapshot,
    st.integers(0, 2**32 - 1),
    st.builds(Configuration, numbers, numbers, st.text(max_size=20)),
    st.integers(0, 3),
    st.sampled_from(MODES),
    st.booleans(),
    numbers,
    st.lists(requests, max_size=3).map(tuple),
    uint16,
)


@given(snapshots)
def test_a_snapshot_comes_back(snapshot):
    assert unpack_snapshot(snapshot.pack()) == snapshot
    assert snapshot.hash == crc32(snapshot.pack())


@given(snapshots, st.data())
def test_other_bytes_are_bad_or_another_snapshot(snapshot, data):
    payload = bytearray(snapshot.pack())
    cut = data.draw(st.integers(0, len(payload) - 1))
    with pytest.raises(BadSnapshot, match="same version") as bad:
        unpack_snapshot(bytes(payload[:cut]))
    assert pickle.loads(pickle.dumps(bad.value)).args == bad.value.args
    payload[cut] ^= data.draw(st.integers(1, 255))
    try:
        other = unpack_snapshot(bytes(payload))
    except BadSnapshot:
        return
    assert other != snapshot
    assert other.pack() == bytes(payload)


def test_the_bytes_of_a_snapshot_are_those_written_down():
    snapshot = Snapshot(
        0xCBF43926, Configuration((1,), (2,), "ok"), 3, "manual", True, (4,), (Asked(5, "act", 6),), 258
    )
    # Checksum; level 3, mode 2 and paused in the flags; count, outcome; active, parked, locked, asked, each counted.
    by_hand = "cbf43926 1b 0102 02 6f6b 01 01 01 02 01 04 04 05 04 06 00"
    assert snapshot.pack().hex() == by_hand.replace(" ", "")
    wide = replace(snapshot, locked=(256,), asked=())
    by_hand = "cbf43926 3b 0102 02 6f6b 0001 0001 0001 0002 0001 0100 0000"
    assert wide.pack().hex() == by_hand.replace(" ", "")


def test_both_sites_and_the_link_number_kinds_alike():
    assert messages.REQUEST_KINDS == REQUEST_KINDS
    assert messages.MODES == MODES


# Late commands -------------------------------------------------------------------------------------------------------


@pytest.fixture
def ledger() -> Ledger:
    return Ledger(M)


def late(ledger: Ledger, path: str, event: str, seen: int) -> str:
    return ledger.late(M.edge_index(path, event), seen)


def force(ledger: Ledger, path: str, event: str, seen: int) -> str:
    """A command arrives, and if it is in time the machine obeys."""
    why = late(ledger, path, event, seen)
    if not why:
        ledger.forced(M.edge_index(path, event), seen)
        take(ledger, (path, event))
    return why


def test_a_command_is_obeyed_once_and_its_copies_are_late(ledger):
    assert force(ledger, "Look", "clear", 0) == ""
    assert "not active" in force(ledger, "Look", "clear", 0)
    take(ledger, ("Both", "lost"))
    assert "earlier visit" in force(ledger, "Look", "clear", 0)
    assert force(ledger, "Look", "clear", 2) == ""


def test_a_loop_is_forced_once_and_does_not_end_the_visit(ledger):
    assert force(ledger, "Look", "again", 0) == ""
    assert "since" in force(ledger, "Look", "again", 0)
    # The machine loops faster than the link is: another outcome of the state is still meant.
    assert force(ledger, "Look", "clear", 0) == ""


def test_a_command_from_a_station_that_counted_too_far_is_obeyed_once(ledger):
    assert force(ledger, "Look", "again", 1) == ""
    assert "since" in force(ledger, "Look", "again", 1)
    assert ledger.count == 1


def test_a_command_that_the_executive_refused_may_come_again(ledger):
    ledger.forced(M.edge_index("Look", "again"), 0)
    assert late(ledger, "Look", "again", 0) == ""


def test_a_command_for_what_is_not_there_says_so(ledger):
    assert "not active" in late(ledger, "Grasp/Close", "slip", 0)
    assert "no outcome 99" in ledger.late(99, 0)


def test_what_runs_beside_does_not_matter(ledger):
    take(ledger, ("Look", "clear"), ("Both/Walk", "there"))
    assert late(ledger, "Both/Scan", "seen", 1) == ""
    assert "earlier visit" in late(ledger, "Both/Scan", "seen", 0)


def test_counts_go_round(ledger):
    for _ in range(COUNTS + 3):
        take(ledger, ("Look", "again"))
    assert late(ledger, "Look", "clear", 3) == ""
    assert "since" in late(ledger, "Look", "again", 2)
    assert ledger.told_whole(Snapshot(M.checksum, at("Look"), 0), M).count == 3


def test_what_no_transition_tells_makes_earlier_commands_late(ledger):
    whole = Snapshot(M.checksum, at("Look"), 0)
    assert ledger.told_whole(whole, M).count == 0
    other = replace(M, data=(("speed", 2),))
    changed = replace(whole, behaviour=other.checksum)
    assert [ledger.told_whole(changed, other).count for _ in range(2)] == [1, 1]
    assert "earlier visit" in late(ledger, "Look", "clear", 0)
    assert late(ledger, "Look", "clear", 1) == ""
    again = replace(changed, configuration=at("Grasp/Reach"))
    assert ledger.told_whole(again, other).count == 2
    assert "earlier visit" in late(ledger, "Grasp/Reach", "near", 1)


def test_the_whole_state_of_a_mirror_in_step_changes_nothing_but_heals_doubt():
    mirror = Mirror(machine(), 1)
    mirror.request(3, "confirm", 1, 0)
    shown = mirror.snapshot
    mirror.heartbeat(shown.behaviour, shown.hash ^ 1)
    assert mirror.wants_sync
    mirror.sync(shown.pack())
    assert mirror.snapshot is shown
    assert mirror.in_step
    mirror.withdrawn(3)
    mirror.sync(replace(shown, asked=()).pack())
    mirror.request(3, "confirm", 1, 0)
    assert mirror.asked == ()


@pytest.mark.parametrize("data", [b"", b"\x00"])
def test_a_mirror_of_what_its_machine_lacks_takes_no_state_for_its_own(data):
    mirror = Mirror(machine(), 1)
    mirror.locked_is(200, True)
    mirror.sync(mirror.snapshot.pack())
    assert mirror.wants_sync
    mirror.sync(data)
    assert mirror.wants_sync
