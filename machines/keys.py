"""Keys of a running machine: one scope for each active container, filled when entered, written out when it ends."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from teleop_sim.machines.declare import Machine
from teleop_sim.machines.elements import State
from teleop_sim.machines.net import TOP, Configuration


class Keys:
    """What the programs of a machine have told each other.

    A container begins with its own data and what it reads from the container around; when it ends by itself, it writes
    to it. A container that is left by force writes nothing. What was never written reads as None.
    """

    def __init__(self, machine: Machine) -> None:
        self._machine = machine
        self._scopes: dict[str, dict[str, object]] = {"": self._begin(TOP, {})}

    def enter(self, states: Iterable[int]) -> None:
        """Open the scopes of all containers around these states that are not open."""
        net = self._machine.net
        for number in states:
            for container in reversed(tuple(net.containers(number))):
                node = net.nodes[container]
                if node.path not in self._scopes:
                    around = self._scopes[net.nodes[node.parent].path]
                    self._scopes[node.path] = self._begin(container, around)

    def ended(self, container: int) -> None:
        """The container has ended by itself: write what it promises to the container around."""
        net = self._machine.net
        node = net.nodes[container]
        inside, around = self._scopes[node.path], self._scopes[net.nodes[node.parent].path]
        around.update({outer: inside.get(own) for own, outer in node.element.writes})

    def drop(self, node: int) -> None:
        """The node is left, or begins anew: forget its scope and those inside it."""
        net = self._machine.net
        inside = (n.path for n in net.nodes[node : net.nodes[node].end])
        for path in inside:
            self._scopes.pop(path, None)

    def close(self, now: Configuration) -> None:
        """Forget the scopes of containers that are no longer active."""
        net = self._machine.net
        active = {net.nodes[c].path for n in now.active for c in (n, *net.containers(n))}
        active |= {net.nodes[c].path for e in now.parked for c in net.containers(net.source[e])}
        self._scopes = {path: scope for path, scope in self._scopes.items() if not path or path in active}

    def read(self, state: int) -> dict[str, object]:
        """What a state's program may read, by its own names."""
        node, scope = self._at(state)
        return {own: scope.get(key) for own, key in node.reads}

    def write(self, state: int, values: Mapping[str, object]) -> None:
        """What a state's program has found, by its own names; names that it does not declare are dropped."""
        node, scope = self._at(state)
        scope.update({key: values[own] for own, key in node.writes if own in values})

    def renew(self, machine: Machine) -> None:
        """Go on with a changed machine."""
        self._machine = machine

    def _at(self, state: int) -> tuple[State, dict[str, object]]:
        net = self._machine.net
        element = net.nodes[state].element
        assert isinstance(element, State)
        return element, self._scopes[net.nodes[net.nodes[state].parent].path]

    def _begin(self, container: int, around: Mapping[str, object]) -> dict[str, object]:
        element = self._machine.net.nodes[container].element
        if isinstance(element, State):
            return {}
        data = {key: self._machine.value(value) for key, value in element.data}
        return data | {own: around[outer] for own, outer in element.reads if around.get(outer) is not None}
