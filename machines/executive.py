"""Runs a machine on the clock: starts programs, guards outcomes, keeps counts, asks and obeys the operator.

It knows no robot and no link, takes no time of its own and polls nothing. What wins when two things meet is a table in
docs/machine.md: a fall over everything, preempting over a pause, a pause over a lock, a lock over what is forced, that
over what is confirmed, and that over what the level lets pass; among equals the first to arrive.
"""

from __future__ import annotations

from collections.abc import Iterator

from teleop_sim.core.errors import TeleopError
from teleop_sim.core.records import Released
from teleop_sim.machines.declare import Machine
from teleop_sim.machines.engine import check_level
from teleop_sim.machines.running import Result, Running
from teleop_sim.machines.sync import Asked, Snapshot
from teleop_sim.machines.visits import Answer, Pending, Signal, Start, Visit

__all__ = ["Executive", "Pending", "Result", "Signal", "Start"]


class Executive(Running):
    """One run of one machine. ``run()`` is its process; the other public methods are commands that have arrived.

    Every command that arrives leaves one ``Released`` record; one that changes nothing has the effect ``ignored``, and
    the operator is told why.

    Args:
        env: the clock.
        machine: what to run.
        level: autonomy level, 0 to 3.
        start_program: starts the program of a state as a process whose value is a ``Signal``. When it is interrupted it
            must bring the robot to rest and end; of its value then only ``!fell`` is heeded.
        voice: to the operator.
        emit: to the log.

    Raises:
        BadInput: the level is not 0 to 3.

    """

    # Answers to requests

    def confirm(self, request: int) -> None:
        """Let the suggested outcome pass, if the request is open and suggests one."""
        visit = self._open(request, "confirm")
        if visit is not None and visit.pending is not None:
            if not visit.pending.event:
                self._ignore(f"confirm {request}", "nothing is suggested: an event is asked for")
            else:
                self._accept(visit, Answer("confirmed"), request, "confirm", "answered")

    def reject(self, request: int) -> None:
        """Refuse the suggested outcome: the state begins anew. Of an action in lieu of a state: hand back."""
        visit = self._open(request, "reject")
        if visit is not None and visit.pending is not None:
            if visit.pending.kind in ("manual", "data") or (not visit.pending.event and visit.pending.kind != "act"):
                self._ignore(f"reject {request}", "nothing is suggested: an event is asked for")
            else:
                self._accept(visit, Answer("rejected"), request, "reject", "answered")

    def answer(self, request: int, data: object) -> None:
        """Give the data that a program has asked for."""
        visit = self._open(request, "answer")
        if visit is None or visit.pending is None:
            return
        event = self._data.pop(request, None)
        if event is None:
            self._ignore(f"answer {request}", f"the request is of kind {visit.pending.kind}")
            return
        self.round_trips += 1
        self._release(request, "answer", "answered", visit.path)
        self._close(visit)
        event.succeed(data)

    # Acts

    def force(self, event: str, path: str = "") -> None:
        """Take a declared outcome of an active state or container, whatever its programs do or suggest.

        Args:
            event: the outcome.
            path: whose; empty: the first active state that has it, or else the innermost container.

        """
        name = f"{path} {event}".strip()
        if not self.running:
            self._ignore(name, "the machine is not running")
            return
        found = next((p for p in self._on_path() if path in ("", p) and self.machine.has_edge(p, event)), None)
        if found is None:
            self._ignore(name, f"not declared for {self.state}")
        elif (why := self._holds.refusal(found, event)) is None:
            self._force(found, event, name)
        else:
            self._ignore(name, why)

    def take_over(self, path: str) -> None:
        """The operator acts in lieu of an active state, until he forces an outcome or hands back by ``reject``."""
        visit = self._visits.get(path)
        if visit is None or visit.state is None or not self.running:
            self._ignore(f"take over {path}", f"not at work: the machine is in {self.state}")
        elif (why := self._holds.refusal(path)) is not None or visit.answer is not None or visit.over:
            self._ignore(f"take over {path}", why or "already decided")
        elif visit.pending is not None and visit.pending.kind in ("act", "manual"):
            self._ignore(f"take over {path}", "already in the operator's hands")
        else:
            self._accept(visit, Answer("taken_over"), 0, f"take over {path}", "taken over")

    def set_level(self, level: int) -> None:
        """Set the autonomy level. Suggested outcomes that the new level lets pass, pass.

        Raises:
            BadInput: the level is not 0 to 3.

        """
        check_level(level)
        self._engine.level = level
        self._release(0, f"level {level}", "level", "")
        self._voice.level(level)
        self._holds.release()

    # Holding

    def lock(self, path: str) -> None:
        """No outcome of this state or container is taken until it is unlocked."""
        if self._known(path, "lock") and self._changes(
            path not in self._holds.locks, f"lock {path}", "is locked already"
        ):
            self._holds.locks |= {path}
            self._release(0, f"lock {path}", "locked", "")
            self._voice.locked(self._engine.net.by_path[path], True)

    def unlock(self, path: str) -> None:
        """End a lock; what was held up is guarded anew."""
        if self._known(path, "unlock") and self._changes(path in self._holds.locks, f"unlock {path}", "is not locked"):
            self._holds.locks -= {path}
            self._release(0, f"unlock {path}", "unlocked", "")
            self._voice.locked(self._engine.net.by_path[path], False)
            self._holds.release()

    def pause(self) -> None:
        """Bring the robot to rest; nothing works and nothing passes until ``resume``."""
        if self._changes(not self._holds.paused, "pause", "is paused already"):
            self._holds.paused = True
            self._release(0, "pause", "paused", "")
            self._voice.paused(True)
            self._holds.suspend()

    def resume(self) -> None:
        """Go on: interrupted states begin anew, held outcomes are guarded anew."""
        if self._changes(self._holds.paused, "resume", "is not paused"):
            self._holds.paused = False
            self._release(0, "resume", "resumed", "")
            self._voice.paused(False)
            self._holds.release()

    # Ends

    def preempt(self) -> None:
        """Bring the robot to rest and end the machine."""
        if not self.running or self._fallen is not None or self._preempted:
            self._ignore("preempt", "the machine has ended")
            return
        self._preempted = f"preempted by the operator in {self.state}"
        self._release(0, "preempt", "preempted", self.state)
        self._end()

    def fell(self, cause: str) -> None:
        """The robot is down, whoever noticed: the machine cannot recover."""
        self._fall(cause)

    # Keeping the control station in step

    def snapshot(self) -> Snapshot:
        """All that the control station should know of the machine."""
        number = self._engine.net.by_path
        asked = (
            Asked(p.request, p.kind, number[p.path], self.machine.edge_index(p.path, p.event) if p.event else -1)
            for p in self.pendings
        )
        return Snapshot(
            self.machine.checksum,
            self._engine.configuration,
            self.level,
            self.mode,
            self._holds.paused,
            tuple(sorted(number[path] for path in self._holds.locks)),
            tuple(asked),
        )

    def attach(self, behaviour: int) -> None:
        """A control station joins, or joins again, with the machine of this checksum: tell it everything."""
        known = behaviour == self.machine.checksum
        self._release(0, "attach", "attached", "" if known else "with another version of the machine")
        if not known:
            self._voice.line(f"machine {self.machine.name} has checksum {self.machine.checksum:08x} here")
        self._voice.snapshot()

    def modify(self, patch: Patch) -> None:
        """Change the machine while it runs, if it is the one that the patch was made for and nothing active vanishes."""
        from teleop_sim.machines.modify import Patch, apply, vanishing

        try:
            changed = apply(self.machine, patch)
        except TeleopError as problem:
            self._ignore("modify", str(problem).splitlines()[0])
            return
        gone = vanishing(self.machine, changed, self._engine.configuration, tuple(self._needed()))
        if gone:
            self._ignore("modify", f"{', '.join(gone)} would vanish while at work")
            return
        self._renew(changed)
        self._release(0, "modify", "modified", f"{changed.checksum:08x}")
        self._voice.snapshot()
        self._holds.release()

    def _renew(self, changed: Machine) -> None:
        self._engine.renew(changed)
        self._keys.renew(changed)
        self._holds.locks = frozenset(path for path in self._holds.locks if path in changed.net.by_path)
        for visit in self._visits.values():
            visit.node = changed.net.by_path[visit.path]
            visit.state = None if visit.state is None else changed.leaf(visit.path)

    def _needed(self) -> Iterator[tuple[str, str]]:
        """Outcomes that are suggested, held or raised: (path, event)."""
        for visit in self._visits.values():
            if visit.pending is not None and visit.pending.event:
                yield visit.path, visit.pending.event
            if visit.held is not None:
                yield visit.path, visit.held.event
            if visit.answer is not None and visit.answer.kind == "forced":
                yield visit.path, visit.answer.event
            if visit.raised:
                yield visit.path, visit.raised

    # Helpers

    def _open(self, request: int, command: str) -> Visit | None:
        """The visit whose request this is, if it may be answered now; if not, say so in the log."""
        for visit in self._visits.values():
            if visit.pending is not None and visit.pending.request == request and visit.answer is None:
                why = self._holds.refusal(visit.path, visit.pending.event)
                if why is not None:
                    self._ignore(f"{command} {request}", why)
                    return None
                return visit
        self._ignore(f"{command} {request}", "no such request is open")
        return None

    def _on_path(self) -> Iterator[str]:
        """Active states, then the containers around them, inner first."""
        net, active = self._engine.net, self._engine.configuration.active
        yield from (net.nodes[n].path for n in active)
        yield from (net.nodes[c].path for n in active for c in net.containers(n))

    def _force(self, path: str, event: str, name: str) -> None:
        visit = self._visits.get(path)
        if visit is None:
            self._release(0, name, "forced", path)
            self._force_container(path, event)
        elif visit.pending is not None:
            self._accept(visit, Answer("forced", event), visit.pending.request, name, "answered")
        else:
            self._accept(visit, Answer("forced", event), 0, name, "forced")

    def _accept(self, visit: Visit, answer: Answer, request: int, command: str, effect: str) -> None:
        if visit.answer is not None or visit.over or self._fallen is not None:
            self._ignore(command, "already decided")
            return
        self.round_trips += effect == "answered"
        self._release(request, command, effect, visit.path)
        visit.wake(answer)

    def _known(self, path: str, command: str) -> bool:
        known = bool(path) and path in self._engine.net.by_path
        if not known:
            self._ignore(f"{command} {path}", f"the machine has no state {path}")
        return known

    def _changes(self, changes: bool, command: str, why: str) -> bool:
        if not self.running or self._fallen is not None:
            self._ignore(command, "the machine is not running")
            return False
        if not changes:
            self._ignore(command, why)
        return changes

    def _ignore(self, command: str, note: str) -> None:
        self._release(0, command, "ignored", note)
        self._voice.line(f"ignored {command}: {note}")

    def _release(self, request: int, command: str, effect: str, note: str) -> None:
        self._emit(Released(float(self._env.now), request, command, effect, note))
