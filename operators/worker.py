"""The hands of a person: what every act takes, what can break it off, what it leaves in the log."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator

import numpy as np
import simpy

from teleop_sim.channel.messages import (
    AskView,
    Chat,
    Confirm,
    Image,
    LogLine,
    Message,
    Reject,
    Request,
    ResetWorld,
    encode_message,
)
from teleop_sim.core.records import Emit, OperatorActed
from teleop_sim.operators.acts import Process, Purpose, Urgency, describe, either, judged_record, trigger
from teleop_sim.operators.desk import Desk
from teleop_sim.operators.human import Human, happens, slipped
from teleop_sim.operators.roles import Role
from teleop_sim.operators.speech import Talk, Talker
from teleop_sim.operators.timing import OperatorTiming, words_in
from teleop_sim.operators.workload import Load

NEWER = 0.9
"""A view that comes sooner after it was asked for than this share of the round trip was on its way before (assumed)."""


class Worker:
    """What takes time and what is sent; ``person.py`` says what is done when.

    Args:
        env: the clock.
        desk: what is shared.
        timing, human: how long this person takes, and what goes wrong.
        key: of the crew's random streams.
        emit: to the log.
        roles: what this person answers for.

    """

    def __init__(
        self,
        env: simpy.Environment,
        desk: Desk,
        timing: OperatorTiming,
        human: Human,
        key: tuple[int, ...],
        emit: Emit,
        roles: tuple[Role, ...],
    ) -> None:
        self._env, self._desk, self._timing, self._human, self._emit = env, desk, timing, human, emit
        self.belief, self.roles, self._key = desk.belief, roles, key
        self._load = Load(human.curve) if human.curve is not None else None
        self._asked: dict[int, Request] = {}
        self._unread: deque[LogLine | Image] = deque(maxlen=timing.screen_lines)
        self._submitted = 0
        self.talks: list[Talk] = []
        self._news = env.event()
        self._called, self._bar = env.event(), Urgency.HELP
        self._sent: tuple[Message, ...] = ()
        self._expected: Callable[[], bool] = bool
        self._acting: Role | None = None

    def wake(self) -> None:
        """Somebody wants to talk."""
        self._call(Urgency.TALK)
        trigger(self._news)

    def _send_all(self, request: Request, messages: tuple[Message, ...], rng: np.random.Generator) -> Process:
        for message in messages:
            start_s = self._env.now
            yield self._env.timeout(self._sample_s(self._sending_s(message), rng))
            self._submit(start_s, request, message, "")

    def _look_again(self, request: Request) -> Process:
        """What is on the screen is too old to decide on: ask for another view, wait and look at it."""
        rng, start_s = self._draws(Purpose.LOOK, request.request), self._env.now
        yield self._env.timeout(self._sample_s(self._timing.command_s(), rng))
        self._record(start_s, "decide", request.request, "too old to decide on")
        yield from self._await_view(request)
        start_s = self._env.now
        yield self._env.timeout(self._sample_s(self._timing.read_image_s(), rng))
        self._record(start_s, "read", request.request, "picture")

    def _await_view(self, request: Request) -> Process:
        """The console asks for a view; what was on its way before does not count."""
        asked_s, briefing = float(self._env.now), self._desk.briefing
        self._submit(asked_s, request, AskView(0), "")
        due_s = asked_s + briefing.round_trip_s + self._timing.patience_s
        while self.belief.seen_s < asked_s + NEWER * briefing.round_trip_s and self._env.now < due_s:
            self._news = self._env.event()
            yield either(self._news, self._env.timeout(due_s - self._env.now))

    def _compare(self, request: Request) -> None:
        """Lay the marks of a claim over its picture, both as they arrived, and judge."""
        shown = self.belief.shown(request)
        if shown is None or request.edge < 0:
            return
        (image, marks), rng = shown, self._draws(Purpose.JUDGE, request.request)
        if image in self._unread:
            self._unread.remove(image)
        judgement = self._desk.eyes.judge(image, marks.places, self._desk.criterion, rng)
        self.belief.note_judgement(request, judgement)
        event = self.belief.machine.table[request.edge].event
        self._emit(judged_record(float(self._env.now), request.request, event, marks.picture, judgement))

    def _talk_of(self, people: tuple[Talker, Talker], request: Request, text: str, then: Callable[[], None]) -> None:
        duration_s = self._timing.talk_s(words_in(text))
        Talk(self._env, people, text, duration_s, request.request, then).propose()

    def _talk(self, talk: Talk) -> Process:
        """Attend to a talk until it is over, or something urgent calls; waiting for the other one is no work."""
        over = talk.join(self)
        self._called, self._bar = self._env.event(), Urgency.TALK
        yield over | self._called
        began_s, text = talk.began_s, f"{'say' if talk.speaker is self else 'hear'}: {talk.text}"
        if not over.triggered:
            talk.leave(self)
        self._bar = Urgency.HELP
        if began_s >= 0.0:
            self._record(began_s, "talk", talk.request, text if over.value else f"interrupted: {text}")

    def _interruptible(self, duration_s: float, urgency: Urgency) -> Generator[simpy.Event, object, bool]:
        """Work that ends at once for anything more urgent. Returns whether it was ended."""
        self._called, self._bar = self._env.event(), urgency
        done = self._env.timeout(duration_s)
        yield either(self._called, done)
        self._bar = Urgency.HELP
        return not done.processed

    def _call(self, urgency: Urgency) -> None:
        if urgency < self._bar:
            trigger(self._called)

    def _submit(self, start_s: float, request: Request, message: Message, note: str) -> None:
        self._submitted += 1
        rate = self._rate(self._human.slip_rate)
        if rate > 0.0 and happens(rate, self._draws(Purpose.SLIP, self._submitted)):
            message, note = slipped(message), f"slip: {note}"
        topic, payload = encode_message(message)
        question = self.belief.question(request) if request.request else ""
        text = note + describe(message, question, self.belief.machine)
        self._desk.send(topic, payload, text)
        self.belief.note_sent(message, request.request, float(self._env.now))
        if type(message) is ResetWorld:
            self.belief.work.note_reset()
        self._record(start_s, "send", request.request, text)

    def _sending_s(self, message: Message) -> float:
        match message:
            case Chat(text=text):
                return self._timing.type_s(text)
            case Confirm() | Reject():
                return self._timing.press_s()
            case _:
                return self._timing.command_s()

    def _sample_s(self, mean_s: float, rng: np.random.Generator) -> float:
        slowing = self._load.slowing(float(self._env.now)) if self._load is not None else 1.0
        return self._timing.sample_s(mean_s * slowing, rng)

    def _rate(self, rate: float) -> float:
        return min(1.0, rate * (self._load.erring(float(self._env.now)) if self._load is not None else 1.0))

    def _record(self, start_s: float, kind: str, request: int, text: str) -> None:
        if self._load is not None:
            self._load.note(float(start_s), float(self._env.now))
        self._emit(OperatorActed(float(self._env.now), float(start_s), self._role(request), kind, request, text))

    def _role(self, request: int) -> Role:
        """The role in which something is done: whose request it is, else this person's first."""
        asked = self._asked.get(request)
        if self._acting is not None:
            return self._acting
        return self.roles[0] if asked is None else self._desk.role(asked)

    def _draws(self, purpose: Purpose, *numbers: int) -> np.random.Generator:
        """A stream of its own, so that no act shifts the times of another."""
        # An array of words is taken as it is; of a list numpy makes the same words, in twice the time.
        return np.random.default_rng(np.array((*self._key, purpose, *numbers), dtype=np.uint32))
