"""The executive's words as messages, and the heartbeat that lets the control station notice what it has missed."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Any, Literal, cast

import simpy

from teleop_sim.channel import messages as msg
from teleop_sim.machines.declare import Machine
from teleop_sim.machines.executive import Executive
from teleop_sim.machines.ledger import Ledger
from teleop_sim.machines.sync import Snapshot

Tell = Callable[[msg.Message, str], None]
Beat = Literal["state", "hash"]


class SiteVoice:
    """A ``Voice`` that speaks in messages. ``listen_to`` says whose voice it is, before it says anything.

    Attributes:
        ledger: of what it has told.

    """

    def __init__(self, env: simpy.Environment, tell: Tell) -> None:
        self._env, self._tell = env, tell

    def listen_to(self, executive: Executive) -> None:
        """What is told of nodes and edges is about this executive's machine."""
        self._executive = executive
        self.ledger = Ledger(executive.machine)

    def transition(self, edge: int) -> None:
        """``MirrorUpdate``."""
        self.ledger.transition(edge)
        taken = self._machine.table[edge]
        self._tell(msg.MirrorUpdate(edge), f"{taken.state} {taken.event} {taken.next_state}".strip())

    def mode(self, mode: str) -> None:
        """``ModeIs``."""
        self._tell(msg.ModeIs(msg.MODES.index(mode)), mode)

    def level(self, level: int) -> None:
        """``LevelIs``."""
        self._tell(msg.LevelIs(level), f"level {level}")

    def request(self, request: int, kind: str, node: int, edge: int) -> None:
        """``Request``."""
        machine = self._machine
        event = machine.table[edge].event if edge >= 0 else ""
        text = f"{kind} {machine.net.nodes[node].path} {event}".strip()
        self._tell(msg.Request(request, cast(msg.RequestKind, kind), node, edge), text)

    def withdrawn(self, request: int) -> None:
        """``Withdrawn``."""
        self._tell(msg.Withdrawn(request), f"withdrawn {request}")

    def paused(self, paused: bool) -> None:
        """``PausedIs``."""
        self._tell(msg.PausedIs(int(paused)), "paused" if paused else "resumed")

    def locked(self, node: int, locked: bool) -> None:
        """``LockedIs``."""
        path = self._machine.net.nodes[node].path
        self._tell(msg.LockedIs(node, int(locked)), f"{'locked' if locked else 'unlocked'} {path}")

    def snapshot(self) -> None:
        """``SyncState``."""
        self._tell(msg.SyncState(self._whole().pack()), f"state {self._executive.state}")

    def line(self, text: str) -> None:
        """``LogLine``."""
        self._tell(msg.LogLine(float(self._env.now), text), text)

    def beat(self, every_s: float, what: Beat = "state") -> Generator[simpy.Event, Any, None]:
        """Process: tell every ``every_s``, for as long as the clock runs, what the control station should know.

        ``state``: all of it (``SyncState``), so that a mirror that has missed something is in step when it arrives.
        ``hash``: its hash (``SyncHash``, shorter); such a mirror asks for the rest, one round trip later.
        """
        while True:
            yield self._env.timeout(every_s)
            if what == "state":
                self.snapshot()
                continue
            now = self._whole()
            self._tell(msg.SyncHash(now.behaviour, now.hash), "heartbeat")

    def _whole(self) -> Snapshot:
        return self.ledger.told_whole(self._executive.snapshot(), self._machine)

    @property
    def _machine(self) -> Machine:
        return self._executive.machine
