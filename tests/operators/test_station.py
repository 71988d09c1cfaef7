"""The station's software: asks for the whole state when the mirror is out of step, and only then."""

import pytest
import simpy

from teleop_sim.channel.messages import (
    Attach,
    LogLine,
    MirrorUpdate,
    PausedIs,
    SyncHash,
    SyncRequest,
    SyncState,
    decode_payload,
    encode_message,
)
from teleop_sim.machines.mirror import Mirror
from teleop_sim.machines.src_dish import src_dish
from teleop_sim.machines.sync import Snapshot
from teleop_sim.operators.station import Station

DISH = src_dish()
TRUTH = Snapshot(DISH.checksum, DISH.net.begin(), 2)
BEAT = SyncHash(TRUTH.behaviour, TRUTH.hash)
WAIT_S = 30.0


class Bench:
    """A station on a clock with a drawer for what it sends."""

    def __init__(self, level: int = 2, late: bool = False, wait_s: float = WAIT_S) -> None:
        self.env, self.sent = simpy.Environment(), []
        self.mirror = Mirror(DISH, level, late)
        self.station = Station(self.env, self.mirror, self._send, wait_s)
        self.station.begin()

    def _send(self, _topic: str, payload: bytes, text: str) -> None:
        assert text
        self.sent.append((float(self.env.now), decode_payload(payload)))

    def at(self, time_s: float, *messages) -> None:
        def deliver(_) -> None:
            for message in messages:
                assert self.station.receive(encode_message(message)[1]) == message

        self.env.timeout(time_s).callbacks.append(deliver)


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_in_step_it_is_silent(bench):
    bench.at(1.0, BEAT, LogLine(0.5, "all is well"))
    bench.at(2.0, PausedIs(1), PausedIs(0), BEAT)
    bench.env.run(1000.0)
    assert (bench.sent, bench.mirror.gaps) == ([], 0)


def test_a_heartbeat_that_does_not_fit_is_asked_about_at_once_and_each_time():
    bench = Bench(level=0)
    bench.at(5.0, BEAT)
    bench.at(15.0, BEAT, LogLine(14.0, "more"))
    bench.at(25.0, SyncState(TRUTH.pack()))
    bench.env.run(1000.0)
    assert bench.sent == [(5.0, SyncRequest()), (15.0, SyncRequest())]
    assert bench.mirror.snapshot == TRUTH


def test_in_the_dark_it_asks_ever_more_slowly(bench):
    bench.at(10.0, MirrorUpdate(DISH.edge_index("STATE_ERROR", "/RESTART")))
    bench.env.run(500.0)
    # 30 s, then twice as long each time: 10 + 30 (2^n - 1).
    assert bench.sent == [(t, SyncRequest()) for t in (10.0, 40.0, 100.0, 220.0, 460.0)]


def test_what_does_not_fit_while_an_answer_is_due_is_not_asked_about_again():
    bench = Bench(wait_s=0.0)
    slow = Bench()
    for each in (bench, slow):
        for time_s in (10.0, 20.0, 50.0):
            each.at(time_s, MirrorUpdate(DISH.edge_index("STATE_ERROR", "/RESTART")))
        each.env.run(60.0)
    assert [t for t, _ in slow.sent] == [10.0, 40.0]
    # Without a time to wait, whatever shows it out of step makes it ask.
    assert [t for t, _ in bench.sent] == [10.0, 20.0, 50.0]


def test_out_of_step_again_it_asks_again_at_once(bench):
    wrong = MirrorUpdate(DISH.edge_index("STATE_ERROR", "/RESTART"))
    bench.at(10.0, wrong)
    bench.at(20.0, SyncState(TRUTH.pack()))
    bench.at(21.0, wrong)
    bench.at(22.0, SyncState(TRUTH.pack()))
    bench.env.run(500.0)
    assert [t for t, _ in bench.sent] == [10.0, 21.0]


def test_one_that_joins_late_attaches():
    bench = Bench(late=True)
    bench.at(50.0, SyncState(TRUTH.pack()))
    bench.env.run(500.0)
    assert bench.sent == [(0.0, Attach(DISH.checksum)), (30.0, Attach(DISH.checksum))]
    assert bench.mirror.in_step


def test_a_machine_that_is_not_known_here_is_not_asked_about(bench):
    bench.at(10.0, SyncHash(DISH.checksum ^ 1, 0), MirrorUpdate(0), BEAT)
    bench.env.run(500.0)
    assert bench.sent == []
    assert bench.mirror.in_step
