"""What a machine at work can say to the operator."""

from __future__ import annotations

from typing import Protocol


class Voice(Protocol):
    """What the executive tells the operator; the field site makes messages of it."""

    def transition(self, edge: int, state: str, event: str, next_state: str) -> None:
        """An outcome was taken; ``edge`` is its place in the machine's table."""

    def mode(self, mode: str) -> None:
        """The mode changed."""

    def level(self, level: int) -> None:
        """The autonomy level changed."""

    def request(self, request: int, kind: str, state: str, event: str) -> None:
        """``confirm`` a suggested event, or ``manual`` help (event empty)."""

    def line(self, text: str) -> None:
        """A line for the operator to read."""
