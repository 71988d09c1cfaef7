"""Who verifies: pictures that arrived decide, and nothing else does. Bytes go in, bytes come out; no link."""

import zlib
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
import simpy

from teleop_sim.channel.messages import (
    Attach,
    Confirm,
    Image,
    Marks,
    Message,
    PixelMark,
    Reject,
    Request,
    SyncRequest,
    Withdrawn,
    decode_payload,
    encode_image,
    encode_message,
)
from teleop_sim.core.records import Judged, OperatorActed, Record
from teleop_sim.machines.mirror import Mirror
from teleop_sim.machines.src_dish import src_dish
from teleop_sim.operators.acts import Briefing
from teleop_sim.operators.crew import Crew
from teleop_sim.operators.policies import GIVE_IN_AFTER
from teleop_sim.operators.registry import POLICIES
from teleop_sim.operators.timing import load_timing

DISH = src_dish()
STATE, EVENT = "STATE_FIX_HANDLE_DETECTION", "/FIXED_HANDLE"
EDGE = DISH.edge_index(STATE, EVENT)
TIMING = replace(load_timing(), spread=0.0)


@dataclass
class Room:
    """A crew of one on a clock, and what came of it."""

    policy: str = "verify"
    seed: int = 1
    env: simpy.Environment = field(default_factory=simpy.Environment)
    sent: list[tuple[float, Message]] = field(default_factory=list)
    records: list[Record] = field(default_factory=list)

    def __post_init__(self) -> None:
        briefing = Briefing(round_trip_s=2.0, uplink_bps=4000.0)
        rng, policy = np.random.default_rng(self.seed), POLICIES[self.policy]()
        mirror, emit = Mirror(DISH, 0), self.records.append
        self.person = Crew(self.env, mirror, self._send, TIMING, rng, emit, briefing, policy, criterion=5.0)
        self.env.process(self.person.run())

    def _send(self, _topic: str, payload: bytes, _text: str) -> None:
        message = decode_payload(payload)
        if not isinstance(message, SyncRequest | Attach):
            self.sent.append((float(self.env.now), message))

    def tell(self, *messages: Message) -> None:
        for message in messages:
            self.person.receive(encode_message(message)[1])

    def ask(self, number: int, *shown: Message) -> Message:
        """Ask to confirm after showing something; the answer."""
        self.tell(*shown, Request(number, "confirm", DISH.net.by_path[STATE], EDGE))
        self.env.run(self.env.now + 25.0)
        self.tell(Withdrawn(number))
        return self.sent[-1][1]

    def judged(self) -> list[Judged]:
        return [r for r in self.records if isinstance(r, Judged)]


def scene(knob: tuple[float, float]) -> Image:
    """A knob on a dark wheel, somewhere."""
    y, x = np.mgrid[0:170, 0:320] + 0.5
    grey = np.where(np.hypot(x - 150, y - 90) <= 40, 45.0, 110.0)
    grey[np.hypot(x - knob[0], y - knob[1]) <= 6] = 150.0
    return encode_image(grey.astype(np.uint8), 320, 170, 50)


def marks(image: Image, across: float = 140.0, down: float = 100.0) -> Marks:
    return Marks(EDGE, zlib.crc32(image.coded), (PixelMark("yaw_handle", across, down, 6.0, 6.0),))


GOOD, BAD = scene((140.0, 100.0)), scene((160.0, 80.0))


def test_a_claim_that_the_picture_bears_out_is_confirmed():
    room = Room()
    assert room.ask(1, GOOD, marks(GOOD)) == Confirm(1)
    (judged,) = room.judged()
    assert (judged.verdict, judged.event, judged.picture) == ("accepted", EVENT, zlib.crc32(GOOD.coded))


def test_a_claim_that_the_picture_belies_is_rejected():
    room = Room()
    assert room.ask(1, BAD, marks(BAD)) == Reject(1)
    (judged,) = room.judged()
    assert judged.verdict == "rejected"
    # 20 px across and 20 up: beyond the search for a knob of 6 px no more is known than that it is far.
    assert judged.offset_px == pytest.approx(20.0 * 2**0.5, abs=3.0)
    assert judged.d_prime_sd > judged.criterion_sd


def test_who_only_supervises_confirms_it_without_looking():
    room = Room(policy="supervise")
    assert room.ask(1, BAD, marks(BAD)) == Confirm(1)
    assert room.judged() == []


def test_looking_at_the_picture_takes_the_time_of_a_picture():
    with_it, without = Room(), Room()
    with_it.ask(1, GOOD, marks(GOOD))
    without.ask(1)
    assert with_it.sent[0][0] - without.sent[0][0] == pytest.approx(TIMING.read_image_s())


@pytest.mark.parametrize(
    "shown", [(), (BAD,), (marks(BAD),), (GOOD, marks(BAD))], ids=["nothing", "picture", "marks", "other"]
)
def test_without_the_picture_that_belongs_to_the_marks_nothing_is_judged(shown):
    room = Room()
    assert room.ask(1, *shown) == Confirm(1)
    assert room.judged() == []


def test_a_picture_serves_one_question():
    room = Room()
    assert room.ask(1, BAD, marks(BAD)) == Reject(1)
    assert room.ask(2) == Confirm(2)


def test_a_claim_refused_again_and_again_is_confirmed_in_the_end():
    room = Room()
    answers = [room.ask(n, BAD, marks(BAD)) for n in range(1, GIVE_IN_AFTER + 2)]
    assert answers == [*(Reject(n) for n in range(1, GIVE_IN_AFTER + 1)), Confirm(GIVE_IN_AFTER + 1)]


def test_the_picture_that_was_judged_is_not_looked_at_again():
    room = Room()
    room.ask(1, GOOD, marks(GOOD))
    assert [r.text for r in room.records if isinstance(r, OperatorActed) and r.kind == "read"] == []


def test_the_eye_s_noise_moves_no_time():
    """The latency law holds for who verifies: draws of a judgement are its own."""
    times = [Room(seed=s) for s in (3, 3)]
    times[0].ask(1, GOOD, marks(GOOD))
    times[1].ask(1, BAD, marks(BAD))
    assert times[0].sent[0][0] == times[1].sent[0][0]


def test_other_pixels_of_the_same_size_change_behaviour_only_through_what_they_show():
    """Noise in place of the site: what is done with it is a function of its bytes, whatever is true out there."""
    rng = np.random.default_rng(4)
    noise = encode_image(rng.integers(0, 255, (170, 320)).astype(np.uint8), 320, 170, 50)
    one, other = Room(), Room()
    assert one.ask(1, noise, marks(noise)) == other.ask(1, noise, marks(noise)) == Reject(1)
    assert one.judged() == other.judged()
