"""One person at the control station: sees only what arrived, acts only by sending.

Law: with the same generator, the time from the arrival of request n to its answer does not depend on the link. So every
request has random draws of its own, keyed by its number, and everything else gives way the moment it arrives.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Generator
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import cast

import numpy as np
import simpy

from teleop_sim.channel.messages import (
    Chat,
    Confirm,
    Image,
    LogLine,
    Message,
    Reject,
    Request,
    RequestKind,
    encode_message,
)
from teleop_sim.core.records import Emit, Judged, OperatorActed
from teleop_sim.machines.mirror import Mirror
from teleop_sim.operators.belief import Belief
from teleop_sim.operators.policies import Policy, Supervise
from teleop_sim.operators.station import Station
from teleop_sim.operators.timing import OperatorTiming, words_in
from teleop_sim.operators.verification import CRITERION, Judgement, judge

Send = Callable[[str, bytes, str], None]
Process = Generator[simpy.Event, object, None]


@dataclass(frozen=True)
class Briefing:
    """What the control station is told about the link when the run starts.

    Attributes:
        round_trip_s: nominal.
        uplink_bps: nominal.
        heartbeat_s: silence after which the field site tells its hash; zero: it does not.

    """

    round_trip_s: float
    uplink_bps: float
    heartbeat_s: float = 0.0


@dataclass(frozen=True)
class Unanswered:
    """A command whose effect has not been seen. At ``due_s`` the operator sends it again."""

    request: Request
    messages: tuple[Message, ...]
    wait_s: float
    due_s: float
    repeats: int = 0


class Purpose(IntEnum):
    """First number of the key of a random stream."""

    ANSWER = 1
    REPEAT = 2
    READ = 3
    JUDGE = 4


class Supervisor:
    """Serves one thing at a time: manual requests, confirmations, repeats, then reading. See ``docs/operator.md``."""

    def __init__(
        self,
        env: simpy.Environment,
        mirror: Mirror,
        send: Send,
        timing: OperatorTiming,
        rng: np.random.Generator,
        emit: Emit,
        briefing: Briefing,
        policy: Policy | None = None,
        role: str = "supervisor",
        criterion: float = CRITERION,
    ) -> None:
        self._env, self._send, self._timing, self._emit = env, send, timing, emit
        self._briefing, self._role, self._criterion = briefing, role, criterion
        self._policy: Policy = policy or Supervise()
        self._key = tuple(int(k) for k in rng.integers(2**32, size=4))
        self._reading_rng = self._draws(Purpose.READ)
        self.belief = Belief(mirror)
        self._station = Station(env, mirror, send, briefing.heartbeat_s + briefing.round_trip_s)
        self._requests: list[Request] = []
        self._asked: dict[int, Request] = {}
        self._given: dict[int, tuple[Message, ...]] = {}
        self._serving = 0
        self._unread: deque[LogLine | Image] = deque(maxlen=timing.screen_lines)
        self._unanswered: dict[int, Unanswered] = {}
        self._news = env.event()
        self._called = env.event()

    def receive(self, payload: bytes) -> None:
        """Take what the downlink delivered. The mirror's display changes at once; the rest waits for attention."""
        message = self._station.receive(payload)
        self.belief.take(message)
        self._close()
        for asked in self.belief.mirror.asked:
            if asked.request not in self._asked:
                self._open(Request(asked.request, cast(RequestKind, asked.kind), asked.node, asked.edge))
        self._weigh()
        if isinstance(message, LogLine | Image):
            self._unread.append(message)
        _trigger(self._news)

    def run(self) -> Process:
        """Process: never ends."""
        self._station.begin()
        while True:
            if self._requests:
                yield from self._answer(self._next_request())
            elif late := self._overdue():
                yield from self._repeat(late)
            elif self._unread:
                yield from self._read(self._unread.popleft())
            else:
                yield from self._wait()

    def _open(self, request: Request) -> None:
        """A request that the mirror shows, whether it came by itself or with the whole state."""
        self._asked[request.request] = request
        if request.request not in self._given and request.request != self._serving:
            self._requests.append(request)
        _trigger(self._called)

    def _close(self) -> None:
        """Forget the requests that the mirror shows no more."""
        shown = {asked.request for asked in self.belief.mirror.asked}
        self._asked = {n: r for n, r in self._asked.items() if n in shown}
        self._requests = [r for r in self._requests if r.request in self._asked]

    def _weigh(self) -> None:
        """Wait for the effect of the answers to those open requests at whose states the machine still is.

        If it is elsewhere they are over, even if no transition was seen; the whole state may tell that they are not.
        """
        standing = {n: r for n, r in self._asked.items() if self.belief.is_at(r)}
        self._unanswered = {n: u for n, u in self._unanswered.items() if n in standing}
        for number, request in standing.items():
            if self._given.get(number) and number not in self._unanswered and number != self._serving:
                self._expect(request, self._given[number])

    def _next_request(self) -> Request:
        first = min(self._requests, key=lambda r: (r.kind != "manual", r.request))
        self._requests.remove(first)
        return first

    def _overdue(self) -> Unanswered | None:
        late = [u for u in self._unanswered.values() if u.due_s <= self._env.now]
        return min(late, key=lambda u: u.due_s) if late else None

    def _wait(self) -> Process:
        self._news = self._env.event()
        due_s = min((u.due_s for u in self._unanswered.values()), default=None)
        if due_s is None:
            yield self._news
        else:
            yield self._news | self._env.timeout(due_s - self._env.now)

    def _answer(self, request: Request) -> Process:
        self._serving = request.request
        rng = self._draws(Purpose.ANSWER, request.request)
        question = self.belief.question(request)
        words = words_in(question)
        mean_s = self._timing.judge_s(words) if request.kind == "confirm" else self._timing.plan_s(words)
        compares = self._policy.verifies and self.belief.shown(request) is not None
        mean_s += self._timing.read_image_s() if compares else 0.0
        start_s = self._env.now
        yield self._env.timeout(self._timing.sample_s(mean_s, rng))
        self._record(start_s, "decide", request.request, question)
        messages: tuple[Message, ...] = ()
        if request.request in self._asked:
            if self._policy.verifies and request.edge >= 0:
                self._compare(request)
            messages = self._given[request.request] = self._policy.answer(self.belief, request)
        if request.kind == "manual" and messages:
            self.belief.note_help()
        if any(isinstance(message, Reject) for message in messages):
            self.belief.note_refusal(request)
        for message in messages:
            start_s = self._env.now
            yield self._env.timeout(self._timing.sample_s(self._sending_s(message), rng))
            self._submit(start_s, request, message, "")
        self._serving = 0
        self._weigh()

    def _compare(self, request: Request) -> None:
        """Lay the marks of a claim over its picture, both as they arrived, and judge."""
        shown = self.belief.shown(request)
        if shown is None:
            return
        (image, marks), rng = shown, self._draws(Purpose.JUDGE, request.request)
        if image in self._unread:
            self._unread.remove(image)
        judgement = judge(image.pixels(), marks.places, self._criterion, rng)
        self.belief.note_judgement(request, judgement)
        event = self.belief.machine.table[request.edge].event
        self._emit(judged_record(float(self._env.now), request.request, event, marks.picture, judgement))

    def _repeat(self, late: Unanswered) -> Process:
        rng = self._draws(Purpose.REPEAT, late.request.request, late.repeats)
        start_s = self._env.now
        duration_s = self._timing.sample_s(self._timing.repeat_s(), rng)
        if (yield from self._interruptible(duration_s)) or late.request.request not in self._unanswered:
            self._record(start_s, "decide", late.request.request, "dropped: send again")
            return
        self._submit(start_s, late.request, late.messages[-1], "again: ")
        wait_s = late.wait_s * self._timing.patience_growth
        self._unanswered[late.request.request] = replace(
            late, wait_s=wait_s, due_s=self._env.now + wait_s, repeats=late.repeats + 1
        )

    def _read(self, item: LogLine | Image) -> Process:
        is_line = isinstance(item, LogLine)
        text = item.text if isinstance(item, LogLine) else "picture"
        mean_s = self._timing.read_line_s(words_in(text)) if is_line else self._timing.read_image_s()
        start_s = self._env.now
        dropped = yield from self._interruptible(self._timing.sample_s(mean_s, self._reading_rng))
        self._record(start_s, "read", 0, f"dropped: {text}" if dropped else text)

    def _interruptible(self, duration_s: float) -> Generator[simpy.Event, object, bool]:
        """Work that a request ends at once. Returns whether it was ended."""
        self._called = self._env.event()
        done = self._env.timeout(duration_s)
        yield self._called | done
        return not done.processed

    def _submit(self, start_s: float, request: Request, message: Message, note: str) -> None:
        topic, payload = encode_message(message)
        text = note + describe(message, self.belief.question(request))
        self._send(topic, payload, text)
        self._record(start_s, "send", request.request, text)

    def _expect(self, request: Request, messages: tuple[Message, ...]) -> None:
        bits = sum(8 * len(encode_message(m)[1]) for m in messages)
        wait_s = self._briefing.round_trip_s + bits / self._briefing.uplink_bps + self._timing.patience_s
        self._unanswered[request.request] = Unanswered(request, messages, wait_s, self._env.now + wait_s)

    def _sending_s(self, message: Message) -> float:
        return self._timing.type_s(message.text) if isinstance(message, Chat) else self._timing.press_s()

    def _record(self, start_s: float, kind: str, request: int, text: str) -> None:
        self._emit(OperatorActed(float(self._env.now), float(start_s), self._role, kind, request, text))

    def _draws(self, purpose: Purpose, *numbers: int) -> np.random.Generator:
        """A stream of its own, so that no act shifts the times of another."""
        return np.random.default_rng([*self._key, int(purpose), *numbers])


def describe(message: Message, question: str) -> str:
    """What a message sent by the operator says, for readers of the log."""
    match message:
        case Confirm():
            return f"confirm: {question}"
        case Reject():
            return f"reject: {question}"
        case Chat(text=text):
            return text
        case _:
            return str(message)


def judged_record(now_s: float, request: int, event: str, picture: int, judgement: Judgement | None) -> Judged:
    """What was made of a claim; None: the picture does not show it."""
    if judgement is None:
        nothing = math.nan
        return Judged(
            now_s, request, event, picture, "", nothing, nothing, nothing, nothing, nothing, verdict="unseen"
        )  # fmt: skip
    found, verdict = judgement.found, "rejected" if judgement.rejected else "accepted"
    return Judged(
        now_s, request, event, picture, found.what, found.offset_px, found.sigma_px, found.d_prime,
        judgement.evidence, judgement.criterion, verdict,
    )  # fmt: skip


def _trigger(event: simpy.Event) -> None:
    if not event.triggered:
        event.succeed()
