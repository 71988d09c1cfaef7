"""What the field site keeps so that a forced outcome that comes late, doubled or repeated is never taken twice.

A command to force an outcome says how many transitions the control station had seen. It is in time if the state of that
outcome has been on the active path ever since then, a loop of the state on itself aside, and the outcome itself has not
been taken since. A control station to which the link gave a transition twice counts too far: then a command is known
again by its bytes, edge and count.
"""

from __future__ import annotations

from dataclasses import replace

from teleop_sim.machines.declare import Machine
from teleop_sim.machines.net import Configuration
from teleop_sim.machines.sync import COUNTS, Snapshot


class Ledger:
    """Counts the transitions that were told, and since which of them each node has been on the active path.

    Not modelled: more than 32767 transitions between what a control station had seen and the arrival of its command.

    Attributes:
        machine: what runs.
        count: transitions told; on the link modulo ``COUNTS``.

    """

    def __init__(self, machine: Machine) -> None:
        self.machine, self.count = machine, 0
        self._configuration = machine.net.begin()
        self._since: dict[int, int] = {}
        self._taken: dict[int, int] = {}
        self._offered: set[tuple[int, int]] = set()
        self._forced: set[tuple[int, int]] = set()
        self._note(Configuration(()), self._configuration)

    def transition(self, edge: int) -> None:
        """The machine took this outcome."""
        net, before = self.machine.net, self._configuration
        self.count += 1
        self._configuration = net.move(before, edge).configuration
        self._taken[edge] = self.count
        done = {offer for offer in self._offered if offer[0] == edge}
        self._offered, self._forced = self._offered - done, self._forced | done
        self._note(before, self._configuration)

    def told_whole(self, snapshot: Snapshot, machine: Machine) -> Snapshot:
        """The snapshot as it is to be sent. A change that no transition told, of states or machine, counts as one."""
        if machine is not self.machine and machine.checksum != self.machine.checksum:
            self._taken, self._since, self._offered, self._forced = {}, {}, set(), set()
            self._change(Configuration(()), snapshot.configuration, machine)
        elif snapshot.configuration != self._configuration:
            self._change(self._configuration, snapshot.configuration, machine)
        return replace(snapshot, count=self.count % COUNTS)

    def late(self, edge: int, seen: int) -> str:
        """Why a command to force this outcome is not to be obeyed; empty if it is. See the module.

        Args:
            edge: place in the machine's table.
            seen: transitions that the control station had seen, modulo ``COUNTS``.

        """
        net = self.machine.net
        if edge >= len(net.edges):
            return f"the machine has no outcome {edge}"
        state, since = net.edges[edge].state, self._since.get(net.source[edge])
        age = (self.count - seen) % COUNTS
        # More than half the range behind is ahead: the control station counted too far.
        known = self.count - age if age < COUNTS // 2 else self.count
        if since is None:
            return f"{state} is not active"
        if since > known:
            return f"it meant an earlier visit of {state}"
        if self._taken.get(edge, 0) > known or (edge, seen) in self._forced:
            return f"{state} {net.edges[edge].event} has been taken since"
        return ""

    def forced(self, edge: int, seen: int) -> None:
        """The executive was told to take the outcome by a command with these numbers; it may still refuse.

        Only when it has taken it, the same command will be late.
        """
        self._offered.add((edge, seen))

    def _change(self, before: Configuration, after: Configuration, machine: Machine) -> None:
        self.count += 1
        self.machine, self._configuration = machine, after
        self._note(before, after)

    def _note(self, before: Configuration, after: Configuration) -> None:
        was, now = _path(self.machine, before), _path(self.machine, after)
        self._since = {n: self._since.get(n, self.count) if n in was else self.count for n in now}


def _path(machine: Machine, configuration: Configuration) -> tuple[int, ...]:
    """Active nodes and the containers around them."""
    net = machine.net
    return tuple(sorted({n for a in configuration.active for n in (a, *net.containers(a))}))
