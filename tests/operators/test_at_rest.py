"""People at rest are woken for what they have to do and nothing else; what each of them needs is looked up once."""

import numpy as np
import pytest
import simpy

from teleop_sim.channel.messages import LogLine, SyncRequest, SyncState
from teleop_sim.machines.mirror import Mirror
from teleop_sim.machines.src_dish import src_dish
from teleop_sim.machines.sync import Asked
from teleop_sim.operators.acts import Briefing, either
from teleop_sim.operators.adaptive import Adaptive
from teleop_sim.operators.belief import Belief
from teleop_sim.operators.crew import Crew
from teleop_sim.operators.desk import Desk
from teleop_sim.operators.policies import Supervise
from teleop_sim.operators.roles import role_of
from teleop_sim.operators.station import Station
from teleop_sim.operators.timing import load_timing

DISH = src_dish()
TOLD = Briefing(round_trip_s=20.0, uplink_bps=1e4, heartbeat_s=10.0)


@pytest.mark.parametrize(("first_s", "second_s"), [(1.0, 2.0), (2.0, 1.0), (1.0, 1.0)])
def test_either_comes_when_the_first_of_two_does_and_once(first_s, second_s):
    env, came_s = simpy.Environment(), []

    def wait():
        first, second = env.timeout(first_s), env.timeout(second_s)
        yield either(first, second)
        came_s.append((env.now, first.processed, second.processed))

    env.process(wait())
    env.run()
    # As simpy's own condition: one that comes at the same moment has been dealt with by then.
    assert came_s == [(1.0, first_s == 1.0, second_s == 1.0)]


def silent_from(heard_s: tuple[float, ...]) -> float:
    """When a crew begins to ask after a link that fell silent."""
    env, asked_s = simpy.Environment(), []

    def send(topic: str, _payload: bytes, _text: str) -> None:
        if topic == SyncRequest.topic:
            asked_s.append(float(env.now))

    mirror, rng = Mirror(DISH, 3), np.random.default_rng(1)
    crew = Crew(env, mirror, send, load_timing(), rng, lambda _: None, TOLD, Adaptive(), team=2)

    def play():
        for t_s in heard_s:
            yield env.timeout(t_s - env.now)
            crew.receive(SyncState(mirror.snapshot.pack()).encode())

    env.process(crew.run())
    env.process(play())
    env.run(heard_s[-1] + 70.0)
    return asked_s[0] - heard_s[-1]


def test_each_message_puts_silence_off():
    # The stream of the first advice is the same, so the time from the last message on is, but for rounding.
    alone_s = silent_from((25.0,))
    assert alone_s > Adaptive().beats * TOLD.heartbeat_s
    assert silent_from(tuple(np.arange(7.0, 400.0, 9.0))) == pytest.approx(alone_s, abs=1e-9)


def test_a_role_that_is_looked_up_is_the_role():
    desk = Desk(Belief(Mirror(DISH, 0)), lambda *_: None, TOLD, Supervise())
    kinds = ("confirm", "manual", "decide", "data", "act")
    for node in range(1, len(DISH.net.nodes)):
        for kind in kinds:
            request, role = desk.opened(Asked(7, kind, node, -1))
            assert (request.request, request.kind, request.node, request.edge) == (7, kind, node, -1)
            assert role == role_of(DISH, request) == desk.role(request)
            assert desk.opened(Asked(7, kind, node, -1))[0] is request


def test_the_same_heartbeat_again_is_the_same_message_and_another_is_not():
    mirror = Mirror(DISH, 0)
    station = Station(simpy.Environment(), mirror, lambda *_: None, 0.0)
    beat = SyncState(mirror.snapshot.pack()).encode()
    first = station.receive(beat)
    station.receive(LogLine(1.0, "in between").encode())
    assert station.receive(bytes(beat)) is first
    mirror.level_is(2)
    other = station.receive(SyncState(mirror.snapshot.pack()).encode())
    assert other != first
    assert mirror.level == 2
    # The old bytes again: the mirror goes where they say.
    station.receive(beat)
    assert mirror.level == 0
