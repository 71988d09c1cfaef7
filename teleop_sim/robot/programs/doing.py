"""What the programs of a task share: doing commands, filling up least times, remembering where the robot is."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import Any

from teleop_sim.machines.declare import FELL
from teleop_sim.robot.commands import CircularAffordance, Command, PlanarPose, Release, Side, Walk
from teleop_sim.robot.commands import Step as Stride
from teleop_sim.robot.programs.pacing import Pacing
from teleop_sim.robot.programs.places import after
from teleop_sim.robot.programs.steps import Memory, Program, ProgramOf, Reply, Say, Step, Wait
from teleop_sim.robot.templates import CrankStand

Part = Generator[Step, Any, Any]
"""A piece of a program, used with ``yield from``."""

GOAL_M = 0.1
"""A walk has reached its goal within this distance (WPI: src_task_common, isGoalReached)."""

LINE_CHARS = 120
"""Longest line of the state log: WPI's had 40 to 120 characters."""

START: PlanarPose = (0.0, 0.0, 0.0)
"""Where the robot was switched on."""


class _Down(Exception):
    """The robot fell: ends the program from any depth. It never leaves this file."""


@dataclass
class Doing:
    """One run of a state's program.

    Attributes:
        state: whose program it is.
        memory: of the field computer.
        pacing: the waits.
        stand: where this robot stands at a crank.
        spent_s: time that commands took since the last ``fill``.

    """

    state: str
    memory: Memory
    pacing: Pacing
    stand: CrankStand
    spent_s: float = 0.0

    def do(self, command: Command) -> Generator[Step, Any, Reply]:
        """Carry out a command and remember where it leads."""
        known = self.memory.facts.get("pose")
        reply: Reply = yield command
        self.spent_s += reply.duration_s
        if reply.outcome == "fell":
            raise _Down
        if self.memory.facts.get("pose") is known and reply.outcome == "reached":
            # Nobody measured the feet: go by the goal. Walks are to fixed places, so errors do not add up.
            self._reckon(command)
        return reply

    def _reckon(self, command: Command) -> None:
        if isinstance(command, Walk):
            self.memory.facts["pose"] = command.path[-1]
        elif isinstance(command, Stride):
            self.memory.facts["pose"] = after(self.here, command)

    def fill(self, least_s: float, why: str) -> Part:
        """Wait until ``least_s`` have gone by since the last fill or the start."""
        missing_s = least_s - self.spent_s
        self.spent_s = 0.0
        yield from self.pause(missing_s, why)

    def pause(self, seconds: float, why: str) -> Part:
        """Wait, if there is anything to wait for."""
        if seconds > 0.0:
            yield Wait(seconds, why)

    def say(self, text: str) -> Part:
        """A line of the state log, as WPI's: the state, then what is known."""
        yield Say(f"{self.state}: {text}"[:LINE_CHARS])

    def walk(self, path: tuple[PlanarPose, ...], start_s: float) -> Generator[Step, Any, bool]:
        """Walk, round what was seen, at least as long as WPI slept when it had sent footsteps. Was the goal reached?"""
        reply = yield from self.do(Walk(path, tuple(self.memory.facts.get("clouds", {}).values())))
        yield from self.fill(start_s, "walk starts")
        reached = reply.outcome == "reached" and (reply.data is None or float(reply.data) <= GOAL_M)
        if reached:
            self.memory.facts["visited"] = (*self.visited, *path)
        return reached

    def retry(self, event: str, why: str) -> Generator[Step, Any, str]:
        """The attempt failed: say so, sleep as WPI did, return the event."""
        tries = self.memory.facts[f"tries.{self.state}"] = self.tries + 1
        yield from self.say(f"{why} (attempt {tries}), {event}")
        yield from self.pause(self.pacing.retry_wait_s(self.state, tries), "retry")
        return event

    def done(self, event: str, text: str, slept_s: float = 0.0) -> Generator[Step, Any, str]:
        """The state succeeded: say so, sleep what WPI did and ``slept_s`` has not yet covered, return the event."""
        self.memory.facts[f"tries.{self.state}"] = 0
        yield from self.say(f"{text}, {event}")
        yield from self.pause(self.pacing.success_sleep_s.get(self.state, 0.0) - slept_s, "settle")
        return event

    @property
    def tries(self) -> int:
        """Attempts of this state that failed since it last succeeded."""
        return int(self.memory.facts.get(f"tries.{self.state}", 0))

    @property
    def here(self) -> PlanarPose:
        """Where the robot stands: middle of the feet, odometry frame."""
        pose: PlanarPose = self.memory.facts.get("pose", START)
        return pose

    @property
    def visited(self) -> tuple[PlanarPose, ...]:
        """Where the robot has stood, oldest first; the start is always among them."""
        places: tuple[PlanarPose, ...] = self.memory.facts.get("visited", (START,))
        return places

    @property
    def holding(self) -> tuple[Side, CircularAffordance] | None:
        """The hand that is at a handle, and the handle."""
        held: tuple[Side, CircularAffordance] | None = self.memory.facts.get("holding")
        return held

    def let_go(self) -> Part:
        """Take a hand off its handle, if one is there: no foot may move before that, not even when this is stopped."""
        while self.holding is not None:
            reply = yield from self.do(Release(*self.holding))
            if reply.outcome != "stopped":
                self.memory.facts["holding"] = None


def program_of(state: str, body: Callable[[Doing], Program], pacing: Pacing, stand: CrankStand) -> ProgramOf:
    """The program of a state: its body with a ``Doing`` of its own; a fall ends it with ``!fell``."""

    def program(memory: Memory) -> Program:
        try:
            return (yield from body(Doing(state, memory, pacing, stand)))
        except _Down:
            return FELL

    return program
