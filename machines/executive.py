"""Runs a machine on the clock: starts programs, guards outcomes, keeps counts, asks and obeys the operator.

It knows no robot and no link, takes no time of its own and polls nothing. What wins when two things meet is a table in
docs/machine.md: a fall over everything, then preempting; what leaves more over what leaves less; a pause and a lock
over every outcome that is not decided yet; a person over the level and over a program of the same instant; else the
first to arrive.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from teleop_sim.core.records import Released
from teleop_sim.machines.declare import Machine
from teleop_sim.machines.engine import check_level
from teleop_sim.machines.running import Result, Running
from teleop_sim.machines.sync import Asked, Snapshot
from teleop_sim.machines.visits import Answer, Pending, Signal, Start, Visit

if TYPE_CHECKING:
    from teleop_sim.machines.modify import Patch

__all__ = ["Executive", "Pending", "Result", "Signal", "Start"]

_WANTED = {"confirm": "a yes or no", "manual": "an event", "decide": "an event", "data": "data", "act": "an action"}


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
        visit = self._open(request)
        if visit is None or visit.pending is None:
            self._ignore(f"confirm {request}", "no such request is open")
        elif not visit.pending.event:
            self._ignore(f"confirm {request}", f"nothing is suggested: it asks for {_WANTED[visit.pending.kind]}")
        else:
            self._accept(visit, Answer("confirmed"), f"confirm {request}", visit.pending.event)

    def reject(self, request: int) -> None:
        """Refuse the suggested outcome: the state begins anew. Of an action in lieu of a state: hand back."""
        visit = self._open(request)
        if visit is None or visit.pending is None:
            self._ignore(f"reject {request}", "no such request is open")
        elif not visit.pending.event and visit.pending.kind != "act":
            self._ignore(f"reject {request}", f"nothing is suggested: it asks for {_WANTED[visit.pending.kind]}")
        else:
            self._accept(visit, Answer("rejected"), f"reject {request}")

    def answer(self, request: int, data: object) -> None:
        """Give the data that a program has asked for."""
        visit = self._open(request)
        if visit is None or visit.pending is None:
            self._ignore(f"answer {request}", "no such request is open")
        elif (why := self._holds.refusal(visit.path)) is not None:
            self._ignore(f"answer {request}", why)
        elif not self._requests.give(visit, data):
            self._ignore(f"answer {request}", f"not data is asked for, but {_WANTED[visit.pending.kind]}")
        else:
            self.round_trips += 1
            self._release(request, f"answer {request}", "answered", visit.path)

    # Acts

    def force(self, event: str, path: str = "") -> None:
        """Take a declared outcome of an active state or container, whatever its programs do or suggest.

        Args:
            event: the outcome.
            path: whose; empty: the first active state that has it, or else the innermost container.

        """
        name = f"{path} {event}".strip()
        found = next((p for p in self._on_path() if path in ("", p) and self.machine.has_edge(p, event)), None)
        if not self._works(name):
            return
        if found is None:
            self._ignore(name, f"not declared for {self.state}")
        elif found in self._visits:
            self._accept(self._visits[found], Answer("forced", event), name, event)
        elif self._holds.leaving(found):
            self._ignore(name, "already decided")
        elif (why := self._holds.refusal(found, event)) is not None:
            self._ignore(name, why)
        else:
            self._release(0, name, "forced", found)
            self._begin(self._engine.net.by_path[found], None, forced=event)
            self._modes.show()

    def take_over(self, path: str) -> None:
        """The operator acts in lieu of an active state, until he forces an outcome or hands back by ``reject``."""
        command, visit = f"take over {path}", self._visits.get(path)
        if not self._works(command):
            return
        if visit is None or visit.state is None:
            self._ignore(command, f"not at work: the machine is in {self.state}")
        elif visit.pending is not None and visit.pending.kind in ("act", "manual"):
            self._ignore(command, "already in the operator's hands")
        else:
            self._accept(visit, Answer("taken_over"), command)

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
        """No outcome of this state or container, and none that leaves it, is taken until it is unlocked."""
        command = f"lock {path}"
        if not self._works(command) or not self._known(path, command):
            return
        if path in self._holds.locks:
            self._ignore(command, "is locked already")
        elif (leaving := self._holds.too_late(path)) is not None:
            self._ignore(command, f"too late: {leaving} is decided")
        else:
            self._holds.locks |= {path}
            self._release(0, command, "locked", "")
            self._voice.locked(self._engine.net.by_path[path], True)

    def unlock(self, path: str) -> None:
        """End a lock; what was held up is guarded anew."""
        command = f"unlock {path}"
        if not self._works(command) or not self._known(path, command):
            return
        if path not in self._holds.locks:
            self._ignore(command, "is not locked")
            return
        self._holds.locks -= {path}
        self._release(0, command, "unlocked", "")
        self._voice.locked(self._engine.net.by_path[path], False)
        self._holds.release()

    def pause(self) -> None:
        """Bring the robot to rest; nothing works and nothing passes until ``resume``."""
        if not self._works("pause"):
            return
        if self._holds.paused:
            self._ignore("pause", "is paused already")
            return
        self._holds.paused = True
        self._release(0, "pause", "paused", "")
        self._voice.paused(True)
        self._holds.suspend()

    def resume(self) -> None:
        """Go on: interrupted states begin anew, held outcomes are guarded anew."""
        if not self._works("resume"):
            return
        if not self._holds.paused:
            self._ignore("resume", "is not paused")
            return
        self._holds.paused = False
        self._release(0, "resume", "resumed", "")
        self._voice.paused(False)
        self._holds.release()

    # Ends

    def preempt(self) -> None:
        """Bring the robot to rest and end the machine."""
        if self._works("preempt"):
            self._ending.preempted = f"preempted by the operator in {self.state}"
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
        """Change the machine while it runs, if the patch was made for it and nothing vanishes that is at work."""
        # Late: few runs change their machine.
        from teleop_sim.machines.renewal import renewed

        if not self._works("modify"):
            return
        changed = renewed(self.machine, patch, self._engine.configuration, tuple(self._visits.values()))
        if isinstance(changed, str):
            self._ignore("modify", changed)
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

    # Helpers

    def _open(self, request: int) -> Visit | None:
        """The visit whose request this is, if it is not decided."""
        open_now = (v for v in self._visits.values() if v.pending is not None and not v.decided)
        return next((v for v in open_now if v.pending is not None and v.pending.request == request), None)

    def _on_path(self) -> Iterator[str]:
        """Active states, then the containers around them, inner first."""
        net, active = self._engine.net, self._engine.configuration.active
        yield from (net.nodes[n].path for n in active)
        yield from (net.nodes[c].path for n in active for c in net.containers(n))

    def _accept(self, visit: Visit, answer: Answer, command: str, event: str = "") -> None:
        """Hand an answer to a visit, unless something is against it; with the event that is to be taken, if any."""
        why = "already decided" if visit.decided else self._holds.refusal(visit.path, event)
        if why is not None:
            self._ignore(command, why)
            return
        takes = answer.kind == "taken_over"
        answered = visit.pending is not None and not takes
        self.round_trips += answered
        request = visit.pending.request if visit.pending is not None and answered else 0
        self._release(request, command, "answered" if answered else "taken over" if takes else "forced", visit.path)
        visit.wake(answer)

    def _works(self, command: str) -> bool:
        """Does the machine run? If not, the command is ignored."""
        works = self.running and not self._ended.triggered
        if not works:
            self._ignore(command, "the machine has ended" if self._ended.triggered else "the machine does not run yet")
        return works

    def _known(self, path: str, command: str) -> bool:
        known = bool(path) and path in self._engine.net.by_path
        if not known:
            self._ignore(command, f"the machine has no state {path}")
        return known

    def _ignore(self, command: str, note: str) -> None:
        self._release(0, command, "ignored", note)
        self._voice.line(f"ignored {command}: {note}")

    def _release(self, request: int, command: str, effect: str, note: str) -> None:
        self._emit(Released(float(self._env.now), request, command, effect, note))
