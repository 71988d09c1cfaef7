"""The control station's copy of a machine, kept in step by what arrives and by nothing else."""

from __future__ import annotations

from dataclasses import dataclass

from teleop_sim.machines.declare import Machine


@dataclass(frozen=True)
class Asked:
    """A request that has arrived and is not yet known to be over. ``event`` is empty for kind ``manual``."""

    request: int
    kind: str
    state: str
    event: str


class Mirror:
    """Follows transitions by their place in the machine's table.

    Each transition names the state that it leaves. If that is not the mirrored one, something was lost on the way: the
    mirror says so (``in_step`` false, ``doubt`` why), and takes the newest message for the truth.

    Not modelled: repair on purpose (a sync message); a lost mode, level or request shows only when the next one comes.

    Attributes:
        machine: both sites hold the same.
        state: present state, as far as known.
        mode: ``normal``, ``auto``, ``manual`` or ``not_recoverable``.
        level: autonomy level, 0 to 3.
        asked: the open request, if any.
        in_step: everything that arrived fits together.
        doubt: why not; empty in step.
        gaps: how often it did not fit.

    """

    def __init__(self, machine: Machine, level: int) -> None:
        self.machine, self.level = machine, level
        self.state = machine.start
        self.mode = "normal"
        self.asked: Asked | None = None
        self.in_step = True
        self.doubt = ""
        self.gaps = 0

    def apply(self, edge: int) -> None:
        """The field site took the outcome at this place of the table. Requests of the state that was left are over."""
        if not 0 <= edge < len(self.machine.edges):
            self._lose(f"transition {edge} is not in the table of {self.machine.name}")
            return
        taken = self.machine.edges[edge]
        self._expect(taken.state, taken.event)
        self.state, self.asked = taken.next_state, None

    def mode_is(self, mode: str) -> None:
        """The machine's mode changed."""
        self.mode = mode

    def level_is(self, level: int) -> None:
        """The autonomy level at the field site."""
        self.level = level

    def request(self, request: int, kind: str, state: str, event: str) -> None:
        """The field site asks: ``confirm`` an event of a state, or ``manual`` help (event empty)."""
        if event and not self.machine.has_edge(state, event):
            self._lose(f"request {request} asks for {event}, which {state} does not have")
            return
        self._expect(state, f"request {request}")
        self.state, self.asked = state, Asked(request, kind, state, event)

    def _expect(self, state: str, by: str) -> None:
        if state == self.state:
            self.in_step, self.doubt = True, ""
        else:
            self._lose(f"{by} comes from {state}, but the mirror was in {self.state}")

    def _lose(self, doubt: str) -> None:
        self.in_step, self.doubt = False, doubt
        self.gaps += 1
