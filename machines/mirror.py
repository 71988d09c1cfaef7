"""The control station's copy of a machine, kept in step by what arrives and by nothing else.

Messages may be lost, doubled or reordered. What does not fit shows at once; what does not show then, by the next
heartbeat, which tells the hash of everything (``Snapshot``). Until a hash fits again, or the whole state has come, the
mirror is out of step: it then takes the newest message for the truth, and ``wants_sync``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from teleop_sim.machines.declare import Machine
from teleop_sim.machines.net import TOP, Configuration, Net
from teleop_sim.machines.relocate import put
from teleop_sim.machines.sync import COUNTS, Asked, BadSnapshot, Snapshot, unpack_snapshot


class Mirror:
    """Follows a machine by what its executive tells (``voice.py``), under the numbers that it tells.

    Args:
        machine: both sites hold the same.
        level: autonomy level at the start, 0 to 3.
        late: the mirror joins a machine that may be anywhere: it knows nothing until the whole state has come.

    Attributes:
        machine: the version that runs, as far as known.
        snapshot: everything that is known of it.
        in_step: everything that arrived fits together.
        doubt: why not; empty in step.
        gaps: how often something did not fit.
        stranger: checksum of a machine that runs at the field site and is not known here; else None.

    """

    def __init__(self, machine: Machine, level: int, late: bool = False) -> None:
        self.machine = machine
        self.snapshot = Snapshot(machine.checksum, machine.net.begin(), level)
        self.in_step, self.gaps = not late, 0
        self.doubt = "nothing has arrived yet" if late else ""
        self.stranger: int | None = None
        self._known = {machine.checksum: machine}
        self._over: set[int] = set()
        self._packed: tuple[Snapshot | None, bytes] = None, b""

    # What it shows

    @property
    def states(self) -> tuple[str, ...]:
        """Paths of the active states; a container among them has ended inside and waits to be left."""
        return tuple(self.machine.net.nodes[n].path for n in self.snapshot.configuration.active)

    @property
    def state(self) -> str:
        """The same, joined by `` + ``; of a machine that has ended: its outcome."""
        return " + ".join(self.states) or self.snapshot.configuration.outcome

    @property
    def mode(self) -> str:
        """``normal``, ``auto``, ``manual`` or ``not_recoverable``."""
        return self.snapshot.mode

    @property
    def level(self) -> int:
        """Autonomy level, 0 to 3."""
        return self.snapshot.level

    @property
    def asked(self) -> tuple[Asked, ...]:
        """Open requests, by number."""
        return self.snapshot.asked

    @property
    def seen(self) -> int:
        """How many transitions were seen, modulo ``COUNTS``: what a command to force an outcome names."""
        return self.snapshot.count

    @property
    def wants_sync(self) -> bool:
        """Out of step, in a way that the whole state would mend."""
        return not self.in_step and self.stranger is None

    # What has arrived

    def transition(self, edge: int) -> None:
        """The field site took the outcome at this place of the table. Requests of what is left or entered are over."""
        net, now = self.machine.net, self.snapshot
        if self.stranger is not None:
            return
        if not 0 <= edge < len(net.edges):
            self._lose(f"transition {edge} is not in the table of {self.machine.name}")
            return
        taken = net.edges[edge]
        move = net.move(self._expect(net.source[edge], taken.event), edge)
        # One of a state that is entered must be of an earlier visit.
        asked = tuple(a for a in now.asked if a.node not in move.left and a.node not in move.entered)
        self._over |= {a.request for a in now.asked} - {a.request for a in asked}
        count = (now.count + 1) % COUNTS
        self.snapshot = replace(now, configuration=move.configuration, asked=asked, count=count)

    def request(self, request: int, kind: str, node: int, edge: int) -> None:
        """The field site asks; see ``Asked``. A state asks one thing at a time: what it asked before is over."""
        net = self.machine.net
        if self.stranger is not None or request in self._over:
            return
        if not TOP < node < len(net.nodes) or (edge >= 0 and (edge >= len(net.edges) or net.source[edge] != node)):
            self._lose(f"request {request} asks for outcome {edge} of node {node}, which {self.machine.name} lacks")
            return
        configuration = self._expect(node, f"request {request}")
        rest = tuple(a for a in self.asked if a.node != node and a.request != request)
        self._over |= {a.request for a in self.asked if a.node == node and a.request != request}
        asked = tuple(sorted((*rest, Asked(request, kind, node, edge))))
        self.snapshot = replace(self.snapshot, configuration=configuration, asked=asked)

    def withdrawn(self, request: int) -> None:
        """A request is over although its state was not left."""
        self._over.add(request)
        self.snapshot = replace(self.snapshot, asked=tuple(a for a in self.asked if a.request != request))

    def mode_is(self, mode: str) -> None:
        """The machine's mode changed."""
        self.snapshot = replace(self.snapshot, mode=mode)

    def level_is(self, level: int) -> None:
        """The autonomy level at the field site."""
        self.snapshot = replace(self.snapshot, level=level)

    def paused_is(self, paused: bool) -> None:
        """The machine was paused, or goes on."""
        self.snapshot = replace(self.snapshot, paused=paused)

    def locked_is(self, node: int, locked: bool) -> None:
        """A state or container was locked, or unlocked."""
        others = {n for n in self.snapshot.locked if n != node}
        self.snapshot = replace(self.snapshot, locked=tuple(sorted(others | {node} if locked else others)))

    def heartbeat(self, behaviour: int, crc32: int) -> None:
        """The field site's machine and the hash of its state: is all as shown here?"""
        if behaviour not in self._known:
            self._meet(behaviour)
        elif (behaviour, crc32) == (self.snapshot.behaviour, self.snapshot.hash):
            self._fits()
        elif self.in_step or self.stranger is not None:
            self.stranger = None
            self._lose("the field site's state has another hash")

    def sync(self, data: bytes) -> None:
        """The whole state: take it as it is. See ``Snapshot.pack``."""
        if data and data == self._sound_bytes():  # as heartbeats mostly are
            self._over -= {a.request for a in self.asked}
            self._fits()
            return
        try:
            found = unpack_snapshot(data)
        except BadSnapshot as problem:
            self._lose(str(problem).splitlines()[0])
            return
        if found.behaviour not in self._known:
            self._meet(found.behaviour)
            return
        machine = self._known[found.behaviour]
        if not _fits(machine.net, found):
            self._lose(f"a state that {machine.name} cannot have")
            return
        still = {a.request for a in found.asked}
        self._over = (self._over | {a.request for a in self.asked}) - still
        self.machine, self.snapshot = machine, found
        self._fits()

    def learn(self, machine: Machine) -> None:
        """Know another version of the machine, such as one that this station has asked the field site to change to."""
        self._known[machine.checksum] = machine
        if self.stranger == machine.checksum:
            self.stranger = None
            self._lose(f"{machine.name} became known here while it ran")

    # Helpers

    def _sound_bytes(self) -> bytes:
        """What the present snapshot packs to; nothing if it holds numbers that the machine lacks."""
        now = self.snapshot
        if self._packed[0] is not now:
            # All else was looked at as it came.
            sound = all(0 <= node < len(self.machine.net.nodes) for node in now.locked)
            self._packed = now, now.pack() if sound else b""
        return self._packed[1]

    def _expect(self, node: int, by: str) -> Configuration:
        """The configuration in which the node is active: the mirrored one, unless something was lost on the way."""
        net, now = self.machine.net, self.snapshot.configuration
        if net.on_path(now, node):
            return now
        self._lose(f"{by} comes from {net.nodes[node].path}, but the mirror was in {self.state}")
        return put(net, now, node)

    def _meet(self, behaviour: int) -> None:
        if self.stranger != behaviour:
            self.stranger = behaviour
            self._lose(f"the field site runs machine {behaviour:08x}, which is not known here")

    def _fits(self) -> None:
        self.in_step, self.doubt, self.stranger = True, "", None

    def _lose(self, doubt: str) -> None:
        self.in_step, self.doubt = False, doubt
        self.gaps += 1


def _fits(net: Net, found: Snapshot) -> bool:
    """Are all numbers ones of the machine?"""

    def below(numbers: Sequence[int], most: int) -> bool:
        return not numbers or (min(numbers) >= 0 and max(numbers) < most)

    now = found.configuration
    return (
        below((*now.active, *found.locked, *[a.node for a in found.asked]), len(net.nodes))
        and below(now.parked, len(net.edges))
        and below([a.edge + 1 for a in found.asked], len(net.edges) + 1)
    )
