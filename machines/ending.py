"""How a run of a machine ends."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from teleop_sim.machines.elements import Edge
from teleop_sim.machines.engine import Engine
from teleop_sim.machines.visits import Outcome


@dataclass(frozen=True)
class Result:
    """How the machine ended: ``completed`` or ``failed``, why, and how many requests were answered."""

    outcome: Literal["completed", "failed"]
    cause: str
    round_trips: int


@dataclass
class Ending:
    """What the end of a run is told from. A fall wins over preempting, and that over how the machine stands.

    Attributes:
        fallen: cause; None while the robot is up.
        preempted: by whom and where; empty if not.
        last: the outcome that was taken last, and its edge.
        gave_up: which state left its work to a person last, and why.

    """

    fallen: str | None = None
    preempted: str = ""
    last: tuple[Outcome, Edge] | None = None
    gave_up: str = ""

    def taken(self, outcome: Outcome, edge: Edge, engine: Engine) -> None:
        """Note an outcome."""
        self.last = (outcome, edge)
        if edge.kind == "failed" and engine.variables.is_manual(edge.next_state):
            self.gave_up = f" after {edge.state} {edge.event}" + f": {outcome.note}" * bool(outcome.note)

    def result(self, engine: Engine, round_trips: int) -> Result:
        """How it ended."""
        cause = self.fallen if self.fallen is not None else self.preempted
        if self.fallen is not None or self.preempted:
            return Result("failed", cause, round_trips)
        outcome = engine.configuration.outcome
        if outcome and outcome not in engine.machine.goals:
            return Result("failed", f"ended with {outcome}{self._why()}", round_trips)
        if outcome or self.last is None or self.last[1].kind != "command":
            return Result("completed", "", round_trips)
        return Result("failed", f"ended by the operator in {self.last[0].path}{self.gave_up}", round_trips)

    def _why(self) -> str:
        if self.last is None:
            return ""
        outcome, _ = self.last
        return f" from {outcome.path} {outcome.event}" + f": {outcome.note}" * bool(outcome.note)
