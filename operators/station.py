"""The control station's software between downlink and person: keeps the mirror in step, and asks when it is not.

It is no person: it asks at once, takes nobody's time, and writes no record but its packets. It asks anew on every
heartbeat that does not fit, and when nothing came for ``wait_s``, then for twice that, and so on: a dark link fills no
queue.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Any

import simpy

from teleop_sim.channel.messages import (
    MODES,
    Attach,
    LevelIs,
    LockedIs,
    Message,
    MirrorUpdate,
    ModeIs,
    PausedIs,
    Request,
    SyncHash,
    SyncRequest,
    SyncState,
    Withdrawn,
    decode_payload,
    encode_message,
)
from teleop_sim.machines.mirror import Mirror

Send = Callable[[str, bytes, str], None]


class Station:
    """Decodes what arrives, shows it to the mirror, and asks for the whole state when the mirror is out of step.

    Args:
        env: the clock.
        mirror: the machine's copy.
        send: to the uplink.
        wait_s: after which an unanswered request for the whole state is sent again: heartbeat and round trip; zero:
            only on a message that shows the mirror out of step.

    """

    def __init__(self, env: simpy.Environment, mirror: Mirror, send: Send, wait_s: float) -> None:
        self.mirror = mirror
        self._env, self._send, self._wait_s = env, send, wait_s
        self._asked, self._due_s = 0, 0.0
        self._heard: tuple[bytes, Message | None] = b"", None

    def begin(self) -> None:
        """A station that joins late says so and asks for everything."""
        if self.mirror.wants_sync:
            self._ask(Attach(self.mirror.machine.checksum), self._wait_s)

    def receive(self, payload: bytes) -> Message:
        """Take what the downlink delivered."""
        message = self._decoded(payload)
        tell(self.mirror, message)
        if not self.mirror.wants_sync:
            self._asked = 0
        elif type(message) is SyncHash or not self._asked or float(self._env.now) >= self._due_s:
            self._ask(SyncRequest(), self._wait_s)
        return message

    def _decoded(self, payload: bytes) -> Message:
        """Heartbeats mostly repeat themselves: the same bytes hold the same message."""
        if payload != self._heard[0] or (message := self._heard[1]) is None:
            message = decode_payload(payload)
            if type(message) is SyncState:
                self._heard = payload, message
        return message

    def _ask(self, message: Message, wait_s: float) -> None:
        topic, payload = encode_message(message)
        self._asked += 1
        self._due_s = float(self._env.now) + wait_s
        self._send(topic, payload, f"out of step: {self.mirror.doubt}")
        if wait_s > 0.0:
            self._env.process(self._again(message, wait_s, self._due_s))

    def _again(self, message: Message, wait_s: float, due_s: float) -> Generator[simpy.Event, object, None]:
        yield self._env.timeout(wait_s)
        # A later request has a later time of its own.
        if self.mirror.wants_sync and self._due_s == due_s:
            self._ask(message, 2.0 * wait_s)


def tell(mirror: Mirror, message: Message) -> None:
    """Show a message to the mirror; of those that say nothing about the machine it takes none."""
    show = _SHOWN.get(type(message))
    if show is not None:
        show(mirror, message)


_SHOWN: dict[type[Message], Callable[[Mirror, Any], None]] = {
    MirrorUpdate: lambda mirror, m: mirror.transition(m.edge),
    ModeIs: lambda mirror, m: mirror.mode_is(MODES[m.mode]),
    LevelIs: lambda mirror, m: mirror.level_is(m.level),
    Request: lambda mirror, m: mirror.request(m.request, m.kind, m.node, m.edge),
    Withdrawn: lambda mirror, m: mirror.withdrawn(m.request),
    PausedIs: lambda mirror, m: mirror.paused_is(bool(m.paused)),
    LockedIs: lambda mirror, m: mirror.locked_is(m.node, bool(m.locked)),
    SyncHash: lambda mirror, m: mirror.heartbeat(m.behaviour, m.crc32),
    SyncState: lambda mirror, m: mirror.sync(m.data),
}
"""By the type itself: a station hears much, and asking a message what it is costs more than showing it."""
