"""At door and valve, too, a crew fed with noise of the same message sizes does the same whatever the world is like.

Noise are the clouds, poses of hands, outcomes of steps, pictures and lines.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from teleop_sim import load_scenario
from teleop_sim.channel.messages import (
    OUTCOMES,
    FootstepPlan,
    HandCloud,
    HandPose,
    Image,
    LevelIs,
    LogLine,
    MirrorUpdate,
    ModeIs,
    Request,
    StepDone,
    SyncState,
    TemplateHash,
    VoxelCloud,
    Withdrawn,
    decode_payload,
)
from teleop_sim.core.records import EpisodeEnded, Judged, Layer, OperatorActed, PacketEnded, Record
from teleop_sim.run import _Bench, _Watch

WORLDS: tuple[dict[str, object], ...] = (
    {},
    {"place_jitter_m": 0.3, "place_jitter_rad": 0.4, "surface_friction": 0.1, "ghosts": 5},
)
"""As shipped; and displaced, turned, slippery and haunted. The map of the course that people have is the same."""

OF_MACHINE = LevelIs | MirrorUpdate | ModeIs | Request | SyncState | Withdrawn

CREWS = {
    "one alone at the door": ("drc-door-lab-operator", {}),
    "three with a behaviour": ("drc-door-lab-behaviour", {"operator.slip_rate": 0.1, "operator.workload": True}),
    "four at the Finals": ("drc-door-day2", {}),
}


class Overheard(_Bench):
    """A run whose downlink is written down. With ``instead``, those bytes arrive at the station and nothing else."""

    def __init__(self, crew: str, world: int, instead: list[tuple[float, bytes]] | None = None) -> None:
        self.records: list[Record] = []
        self.arrivals: list[tuple[float, bytes]] = []
        self._instead = instead
        name, changes = CREWS[crew]
        changes = {"time_limit_s": 300.0, **changes, **{f"door.{key}": value for key, value in WORLDS[world].items()}}
        scenario = load_scenario(name, changes)
        super().__init__(scenario, 3, 0, _Watch(scenario, self.records.append, None), lambda: 0.0)
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

    def behaviour(self, until_s: float) -> list[object]:
        """What the crew did, and what left it."""
        acts = [r for r in self.records if isinstance(r, OperatorActed | Layer | Judged) and r.t_s <= until_s]
        up = (r for r in self.records if isinstance(r, PacketEnded) and r.direction == "up" and r.sent_s <= until_s)
        return [*acts, *((r.sent_s, r.payload_bytes, r.text) for r in up)]

    def ends_s(self) -> float:
        return self.records[-1].t_s

    def physics(self) -> list[object]:
        return [(r.skill, r.command, r.physics_s) for r in self.records if isinstance(r, EpisodeEnded)]


def noise_like(payload: bytes, rng: np.random.Generator) -> bytes:
    """A message of the same kind and size that says something at random."""
    match decode_payload(payload):
        case LogLine(text=text):
            letters = rng.integers(97, 123, len(text.encode()))
            made = LogLine(float(rng.integers(10**6)), "".join(map(chr, letters)))
        case Image():
            scan = payload.index(b"\xff\xda") + 14
            return payload[:scan] + rng.integers(0, 255, len(payload) - scan - 2, np.uint8).tobytes() + payload[-2:]
        case StepDone(step=step):
            made = StepDone(step, OUTCOMES[int(rng.integers(8))], float(rng.uniform(0.0, 1.0)))
        case HandPose(side=side):
            x, y, z = (float(v) for v in rng.uniform(0.2, 1.0, 3))
            made = HandPose(side, (x, y, z), (0.0, 0.0, 0.0))
        case HandCloud() as hand:
            x, y, z = (v + float(d) for v, d in zip(hand.expected_m, rng.uniform(-0.1, 0.1, 3), strict=True))
            made = replace(hand, expected_m=(x, y, z))
        case VoxelCloud() as cloud:
            # Something that a template can be laid on, somewhere else.
            shift = (int(v) for v in rng.integers(-3, 4, 3))
            made = replace(cloud, origin=tuple(a + b for a, b in zip(cloud.origin, shift, strict=True)))
        case FootstepPlan(part=part, parts=parts, steps=steps):
            made = FootstepPlan(part, parts, tuple((float(rng.uniform(0, 3)), 0.0, 0.0) for _ in steps))
        case TemplateHash():
            made = TemplateHash(int(rng.integers(2**32)))
        case other:
            # What the machine asks and where it is stays as it was told once: else nobody would order anything.
            assert isinstance(other, OF_MACHINE), f"no noise for {other}"
            return payload
    assert len(made.encode()) == len(payload)
    return made.encode()


@cache
def heard(crew: str, world: int) -> Overheard:
    return Overheard(crew, world)


@pytest.mark.parametrize("crew", sorted(CREWS))
def test_behaviour_does_not_depend_on_a_world_that_is_not_told(crew):
    rng, told = np.random.default_rng(5), heard(crew, 0)
    noise = [(t_s, noise_like(payload, rng)) for t_s, payload in told.arrivals]
    first, second = (Overheard(crew, world, noise) for world in (0, 1))
    # One of the runs may be over sooner; until then people cannot know in which world they are.
    until_s = min(first.ends_s(), second.ends_s())
    assert first.behaviour(until_s) == second.behaviour(until_s)
    assert any(isinstance(act, OperatorActed) and act.kind == "send" for act in first.behaviour(until_s))
    assert first.arrivals != second.arrivals


@pytest.mark.parametrize("crew", sorted(CREWS))
def test_what_is_told_does_matter(crew):
    assert heard(crew, 0).behaviour(1e9) != heard(crew, 1).behaviour(1e9)
    assert heard(crew, 0).physics() != heard(crew, 1).physics()
