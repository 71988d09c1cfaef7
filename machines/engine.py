"""The bare engine: a machine, its configuration, its variables and its level. No clock, no programs, no messages."""

from __future__ import annotations

from teleop_sim.core.errors import BadInput, Problem
from teleop_sim.machines.counts import Variables
from teleop_sim.machines.declare import Machine
from teleop_sim.machines.elements import Autonomy
from teleop_sim.machines.net import Configuration, Move

MODES = ("normal", "auto", "manual", "not_recoverable")
"""From good to bad; several states at work are in the worst of their modes."""


class Engine:
    """δ, F, U and the guard of a running machine.

    Attributes:
        machine, net: what runs.
        level: autonomy level, 0 to 3.
        configuration: active states.
        variables: D.

    """

    def __init__(self, machine: Machine, level: int) -> None:
        check_level(level)
        self.machine, self.net, self.level = machine, machine.net, level
        self.configuration: Configuration = machine.net.begin()
        self.variables = Variables(machine)

    def trigger(self, path: str, signal: str) -> int:
        """F: number of the edge that a signal becomes. Raises as ``Variables.trigger``."""
        return self.variables.trigger(path, signal)

    def passes(self, edge: int) -> bool:
        """The guard at the present level."""
        return self.net.edges[edge].passes(self.level)

    def take(self, edge: int, signal: str = "") -> Move:
        """δ and U: take an edge whose node is on the active path."""
        self.variables.update(self.net.edges[edge], signal)
        move = self.net.move(self.configuration, edge)
        self.configuration = move.configuration
        return move

    def again(self, container: int) -> Move:
        """Enter a container anew that has ended inside."""
        move = self.net.again(self.configuration, container)
        self.configuration = move.configuration
        return move

    def signal(self, path: str, signal: str) -> tuple[int, ...]:
        """Take what a program's signal leads to, with all container outcomes that pass then; the edges' numbers.

        Empty if the outcome is only suggested at this level.
        """
        edge, taken = self.trigger(path, signal), []
        while edge >= 0 and self.passes(edge):
            taken.append(edge)
            edge, signal = self.take(edge, signal).raised, ""
        return tuple(taken)

    def mode(self) -> str:
        """The worst mode of the active states."""
        paths = (self.net.nodes[n].path for n in self.configuration.active)
        return max((self.variables.mode(path) for path in paths), key=MODES.index, default="normal")

    def over(self) -> bool:
        """Has the machine ended?"""
        now = self.configuration
        return bool(now.outcome) or any(self.net.nodes[n].path in self.machine.ends for n in now.active)

    def renew(self, machine: Machine) -> None:
        """Go on with a changed machine, in which every active state is still there."""
        net, nodes = machine.net, self.net.nodes
        active = tuple(sorted(net.by_path[nodes[n].path] for n in self.configuration.active))
        parked = (self.net.edges[e] for e in self.configuration.parked)
        numbers = tuple(sorted(net.by_event[e.state, e.event] for e in parked))
        self.configuration = Configuration(active, numbers, self.configuration.outcome)
        self.machine, self.net = machine, net
        self.variables.renew(machine)


def check_level(level: int) -> None:
    """Raise ``BadInput`` unless the level is 0 to 3."""
    if level not in tuple(Autonomy):
        raise BadInput((Problem("autonomy level", f"{level!r}", "Give 0 to 3 (off, low, high, full)."),))
