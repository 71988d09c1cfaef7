"""Operators cannot cheat: fed with noise of the same message sizes, they do the same whatever the world is like."""

from functools import cache

import numpy as np
import pytest

from teleop_sim import load_scenario
from teleop_sim.channel.messages import (
    MODES,
    REQUEST_KINDS,
    Image,
    LevelIs,
    LogLine,
    Message,
    MirrorUpdate,
    ModeIs,
    Request,
    SyncHash,
    SyncState,
    Withdrawn,
    decode_payload,
)
from teleop_sim.core.records import EpisodeEnded, OperatorActed, PacketEnded, Record
from teleop_sim.machines.src_dish import src_dish
from teleop_sim.run import _Bench, _Watch

DISH = src_dish()
LIMIT_S = 130.0
WORLDS = (1, 2)


class Overheard(_Bench):
    """A run whose downlink is written down. With ``instead``, those bytes arrive at the station and nothing else."""

    def __init__(self, world: int, crew: dict[str, object], instead: list[tuple[float, bytes]] | None = None) -> None:
        self.records: list[Record] = []
        self.arrivals: list[tuple[float, bytes]] = []
        self._instead = instead
        changes = {"autonomy": "off", "time_limit_s": LIMIT_S, "world.layout": world, **crew}
        scenario = load_scenario("src-dish", {**changes, "link.up.delay_s": 2.0, "link.down.delay_s": 2.0})
        super().__init__(scenario, 12, 0, _Watch(scenario, self.records.append, None), lambda: 0.0)
        if instead is not None:
            self.env.process(self._replay(instead))
        self.run()

    def _to_station(self, payload: bytes) -> None:
        self.arrivals.append((float(self.env.now), payload))
        if self._instead is None:
            self.station.receive(payload)

    def _replay(self, arrivals):
        for t_s, payload in arrivals:
            yield self.env.timeout(t_s - self.env.now)
            self.station.receive(payload)

    def behaviour(self) -> list[object]:
        """What the crew did, and what left it."""
        up = (r for r in self.records if isinstance(r, PacketEnded) and r.direction == "up")
        sent = [(r.sent_s, r.payload_bytes, r.text) for r in up]
        return [*(r for r in self.records if isinstance(r, OperatorActed)), *sent]

    def physics(self) -> list[object]:
        return [(r.skill, r.command, r.physics_s) for r in self.records if isinstance(r, EpisodeEnded)]


def noise_like(payload: bytes, rng: np.random.Generator) -> bytes:
    """A message of the same kind and size that says something at random."""
    match decode_payload(payload):
        case MirrorUpdate():
            made: Message = MirrorUpdate(int(rng.integers(min(256, len(DISH.table)))))
        case ModeIs():
            made = ModeIs(int(rng.integers(len(MODES))))
        case LevelIs():
            made = LevelIs(int(rng.integers(4)))
        case Request(request=number):
            edge = int(rng.integers(min(255, len(DISH.table))))
            node = DISH.net.source[edge]
            made = Request(number, REQUEST_KINDS[int(rng.integers(2))], node, edge if rng.random() < 0.8 else -1)
        case Withdrawn():
            made = Withdrawn(int(rng.integers(10)))
        case LogLine(text=text):
            letters = rng.integers(97, 123, len(text.encode()))
            made = LogLine(float(rng.integers(10**6)), "".join(map(chr, letters)))
        case Image():
            scan = payload.index(b"\xff\xda") + 14
            return payload[:scan] + rng.integers(0, 255, len(payload) - scan - 2, np.uint8).tobytes() + payload[-2:]
        case SyncHash():
            made = SyncHash(DISH.checksum, int(rng.integers(2**32)))
        case SyncState(data=data):
            made = SyncState(rng.bytes(len(data)))
        case other:
            raise AssertionError(f"no noise for {other}")
    assert len(made.encode()) == len(payload)
    return made.encode()


CREWS = {
    "one": {},
    "four": {"operator.team": 4, "operator.policy": "adaptive", "operator.slip_rate": 0.1, "operator.workload": True},
}


@cache
def heard(crew: str, world: int) -> Overheard:
    return Overheard(world, CREWS[crew])


@pytest.mark.parametrize("crew", sorted(CREWS))
def test_behaviour_does_not_depend_on_a_world_that_is_not_told(crew):
    rng = np.random.default_rng(5)
    noise = [(t_s, noise_like(payload, rng)) for t_s, payload in heard(crew, WORLDS[0]).arrivals]
    first, second = (Overheard(world, CREWS[crew], noise) for world in WORLDS)
    # The worlds differ, and so does what the robots do and say; the crew cannot know.
    assert first.physics() != second.physics()
    assert first.arrivals != second.arrivals
    assert first.behaviour() == second.behaviour()
    assert any(isinstance(act, OperatorActed) and act.kind == "send" for act in first.behaviour())


def test_what_is_told_does_matter():
    assert heard("one", WORLDS[0]).behaviour() != heard("one", WORLDS[1]).behaviour()
