"""What a machine at work can say to the control station."""

from __future__ import annotations

from typing import Protocol


class Voice(Protocol):
    """What the executive tells the operator; the field site makes messages of it.

    Nodes are told by their number (``Net.nodes``), edges by their place in the machine's table.
    """

    def transition(self, edge: int) -> None:
        """An outcome was taken. Open requests of what is left by it are over."""

    def mode(self, mode: str) -> None:
        """The mode changed."""

    def level(self, level: int) -> None:
        """The autonomy level changed."""

    def request(self, request: int, kind: str, node: int, edge: int) -> None:
        """Something is asked; ``kind`` is one of ``sync.REQUEST_KINDS``, ``edge`` is -1 if none is suggested."""

    def withdrawn(self, request: int) -> None:
        """A request is over although its state is not left."""

    def paused(self, paused: bool) -> None:
        """The machine was paused, or resumed."""

    def locked(self, node: int, locked: bool) -> None:
        """A state was locked, or unlocked."""

    def snapshot(self) -> None:
        """Something changed that none of the others can tell: the whole state of the machine is to be told."""

    def line(self, text: str) -> None:
        """A line for the operator to read."""
