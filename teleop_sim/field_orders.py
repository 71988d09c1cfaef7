"""What has arrived at the field site, and who is to obey it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np

from teleop_sim.channel import messages as msg
from teleop_sim.channel import vocabulary as chat
from teleop_sim.core.errors import TeleopError
from teleop_sim.machines.executive import Executive
from teleop_sim.machines.ledger import Ledger
from teleop_sim.machines.modify import unpack_patch
from teleop_sim.robot.commands import Look, Nudge, Posture

HEAD_MOVE_S = 2.0
"""A head movement that the operator commands: what WPI's task code asks for in its sweeps."""

Direct = Look | Nudge | Posture


class Hands(Protocol):
    """What the field site does with the robot when an operator says so."""

    def stop(self, text: str) -> None:
        """Bring the robot to rest; the program goes on with what it then finds."""

    def direct(self, text: str, command: Direct) -> None:
        """A movement that the operator commands himself; only while no program acts."""

    def view(self) -> None:
        """Send a picture as soon as the robot is at rest."""

    def note(self, effect: str, command: str, note: str) -> None:
        """Write down what became of a command."""


class Orders:
    """Hands each message to the executive, or to the robot. What is no command leaves a record and nothing else."""

    def __init__(
        self,
        executive: Executive,
        ledger: Ledger,
        hands: Hands,
        things: Callable[[msg.Message], bool] | None = None,
    ) -> None:
        self._executive, self._ledger, self._hands, self._things = executive, ledger, hands, things

    def receive(self, payload: bytes) -> None:
        """Obey a message that has arrived."""
        match msg.decode_payload(payload):
            case msg.Confirm(request=request):
                self._executive.confirm(request)
            case msg.Reject(request=request) | msg.HandBack(request=request):
                self._executive.reject(request)
            case msg.Answer(request=request, data=data):
                self._executive.answer(request, data)
            case msg.StopAll():
                self._hands.stop("stop all")
            case msg.AskView():
                self._hands.view()
            case msg.Chat(text=text):
                self._chat(text)
            case other:
                self._supervise(other)

    def _supervise(self, message: msg.Message) -> None:
        """What an operator does to the machine as a whole, or to a state of it."""
        executive = self._executive
        match message:
            case msg.SetLevel(level=level):
                executive.set_level(level)
            case msg.Force(edge=edge, seen=seen):
                self._force(edge, seen)
            case msg.Lock(node=node):
                self._of_node(node, executive.lock)
            case msg.Unlock(node=node):
                self._of_node(node, executive.unlock)
            case msg.TakeOver(node=node):
                self._of_node(node, executive.take_over)
            case msg.Pause():
                executive.pause()
            case msg.Resume():
                executive.resume()
            case msg.Preempt():
                executive.preempt()
            case msg.Attach(behaviour=behaviour):
                executive.attach(behaviour)
            case msg.SyncRequest():
                executive.attach(executive.machine.checksum)
            case msg.Modify(data=data):
                self._modify(data)
            case other:
                if self._things is None or not self._things(other):
                    self._hands.note("ignored", str(other), "not a command")

    def _of_node(self, node: int, act: Callable[[str], None]) -> None:
        nodes = self._executive.machine.net.nodes
        act(nodes[node].path if 0 < node < len(nodes) else f"number {node}")

    def _force(self, edge: int, seen: int) -> None:
        late = self._ledger.late(edge, seen)
        if late:
            self._hands.note("ignored", f"force {edge}", late)
            return
        self._ledger.forced(edge, seen)
        outcome = self._executive.machine.table[edge]
        self._executive.force(outcome.event, outcome.state)

    def _modify(self, data: bytes) -> None:
        try:
            patch = unpack_patch(data)
        except TeleopError as problem:
            self._hands.note("ignored", "modify", str(problem).splitlines()[0])
            return
        self._executive.modify(patch)

    def _chat(self, text: str) -> None:
        try:
            command = chat.parse_chat(text)
        except msg.BadMessage as problem:
            self._hands.note("ignored", text, str(problem))
            return
        match command:
            case chat.Event(name=name):
                self._executive.force(name)
            # This neck has no roll.
            case chat.MoveHead(pitch_deg=pitch, yaw_deg=yaw):
                self._hands.direct(text, Look(float(np.radians(pitch)), float(np.radians(yaw)), HEAD_MOVE_S))
            case chat.NudgeHand(side=side, frame=frame, x_m=x, y_m=y, z_m=z):
                self._hands.direct(text, Nudge(side, (x, y, z), frame))
            case _:
                self._hands.stop(text)
