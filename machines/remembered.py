"""The counters of D as a value that can be compared and hashed, and two ways to follow them: exactly, or not at all."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

from teleop_sim.machines.counts import Variables
from teleop_sim.machines.declare import Machine
from teleop_sim.machines.elements import State


class Memory(NamedTuple):
    """What D holds that the future depends on.

    Attributes:
        filled: failures of each row, inner counter first, as (number of the row, failures); rows at zero are left out.
        escalated: numbers of states that gave up.

    """

    filled: tuple[tuple[int, tuple[int, ...]], ...] = ()
    escalated: tuple[int, ...] = ()


NOTHING = Memory()


class Counted:
    """Follows counters with the executive's own bookkeeping, ``Variables``, so that there is one set of rules."""

    def __init__(self, machine: Machine) -> None:
        self._net = machine.net
        self._variables = Variables(machine)
        leaves = ((n.path, n.element) for n in machine.net.nodes if isinstance(n.element, State))
        self._keys = tuple((path, row.signal) for path, leaf in leaves for row in leaf.rows)
        self._rows = {key: number for number, key in enumerate(self._keys)}
        self.row_nodes = tuple(machine.net.by_path[path] for path, _ in self._keys)
        self._manual = frozenset(
            n.number for n in machine.net.nodes if isinstance(n.element, State) and n.element.manual
        )

    def edges(self, memory: Memory, node: int, signal: str, /) -> tuple[int, ...]:
        """F: the one edge that a signal becomes."""
        self._load(memory)
        return (self._variables.trigger(self._net.nodes[node].path, signal),)

    def after(self, memory: Memory, edge: int, signal: str, /) -> Memory:
        """U: the counters when an edge has been taken."""
        self._load(memory)
        self._variables.update(self._net.edges[edge], signal)
        return self._dump()

    def manual(self, memory: Memory, node: int, /) -> bool:
        """Does a visit begin in manual mode?"""
        return node in self._manual or node in memory.escalated

    def _load(self, memory: Memory) -> None:
        v = self._variables
        v.counts = {self._keys[row]: list(filled) for row, filled in memory.filled}
        v.escalated = {self._net.nodes[node].path for node in memory.escalated}
        # Neither changes where the machine goes: forgetting both keeps the situations few.
        v.failures, v.succeeded = {}, set()

    def _dump(self) -> Memory:
        v, by_path = self._variables, self._net.by_path
        filled = sorted((self._rows[key], tuple(n)) for key, n in v.counts.items() if any(n))
        return Memory(tuple(filled), tuple(sorted(by_path[path] for path in v.escalated)))


class Uncounted:
    """Follows no counter: a signal may become whatever some state of its counters makes of it."""

    def __init__(self, machine: Machine) -> None:
        self._machine = machine

    @cached_property
    def _events(self) -> dict[tuple[int, str], tuple[str, ...]]:
        leaves = ((n.number, n.element) for n in self._machine.net.nodes if isinstance(n.element, State))
        # A counter with limit zero is never open.
        return {
            (node, row.signal): tuple(dict.fromkeys((*(c.event for c in row.counters if c.limit), row.failed)))
            for node, leaf in leaves
            for row in leaf.rows
        }

    def edges(self, _memory: Memory, node: int, signal: str, /) -> tuple[int, ...]:
        """F: all edges that a signal may become."""
        path = self._machine.net.nodes[node].path
        events = self._events.get((node, signal), (signal,))
        return tuple(self._machine.edge_index(path, event) for event in events)

    def after(self, memory: Memory, _edge: int, _signal: str, /) -> Memory:
        """Nothing is remembered."""
        return memory

    def manual(self, _memory: Memory, node: int, /) -> bool:
        """Nothing is known of a state but what it is declared to be."""
        leaf = self._machine.net.nodes[node].element
        return isinstance(leaf, State) and leaf.manual
