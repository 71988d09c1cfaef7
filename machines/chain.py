"""The situations of a machine, laid out as an absorbing Markov chain: all of them, or the likeliest."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from teleop_sim.core.errors import BadInput, Problem
from teleop_sim.machines.remembered import NOTHING, Counted, Memory
from teleop_sim.machines.situations import Branch, End, Situation, Ways


@dataclass(frozen=True)
class Outline:
    """All situations when counters are not followed, and what may follow each.

    Attributes:
        situations: the first is where the machine begins.
        place: of each among them.
        branches: by situation; an option leads to a situation of the outline or to an end.
        reach: by situation, the states that may be at work there or later.

    """

    situations: tuple[Situation, ...]
    place: dict[Situation, int]
    branches: tuple[tuple[Branch, ...], ...]
    reach: tuple[frozenset[int], ...]


@dataclass(frozen=True)
class Step:
    """One step of the chain.

    Attributes:
        source: number of the situation it leaves.
        target: number of the situation it leads to, or -1.
        end: how it ends, if the target is -1.
        branch: what happened; its only option is the one taken.

    """

    source: int
    target: int
    end: End | None
    branch: Branch


@dataclass(frozen=True)
class Chain:
    """Situations with their counters.

    Attributes:
        followed: how many are followed; their numbers come first.
        steps: from those that are followed.
        cut: place in the outline of each that is reached and not followed further, by its number less ``followed``.

    """

    followed: int
    steps: tuple[Step, ...]
    cut: tuple[int, ...]


def outline(ways: Ways, most: int) -> Outline:
    """Every situation whatever the counters.

    Args:
        ways: with counters that are not followed.
        most: situations there may be.

    Raises:
        BadInput: more than ``most``; states that are reached and whose programs the table does not know.

    """
    begin = ways.begin()
    place, situations = {begin: 0}, [begin]
    found: list[tuple[Branch, ...]] = []
    missing: dict[str, None] = {}
    while len(found) < len(situations):
        now = situations[len(found)]
        missing.update(dict.fromkeys(ways.missing(now)))
        found.append(ways.branches(now))
        for target in _targets(found[-1]):
            if place.setdefault(target, len(situations)) == len(situations):
                situations.append(target)
        if len(situations) > most:
            what = f"more than {most} situations even without counters"
            hint = "Give concurrent states fewer or more equal times, or allow more situations."
            raise BadInput((Problem(f"machine {ways.machine.name}", what, hint),))
    if missing:
        at = f"chances of machine {ways.machine.name}"
        raise BadInput(
            tuple(Problem(f"{at}: {path}", "the state can be reached", "Say what it returns.") for path in missing)
        )
    return Outline(tuple(situations), place, tuple(found), _reach(situations, place, found))


def _targets(branches: Iterable[Branch]) -> list[Situation]:
    return [o.target for b in branches for o in b.options if isinstance(o.target, Situation)]


def _reach(
    situations: list[Situation], place: dict[Situation, int], found: list[tuple[Branch, ...]]
) -> tuple[frozenset[int], ...]:
    reach = [sum(1 << n for n in dict.fromkeys(now.configuration.active)) for now in situations]
    targets = [tuple(dict.fromkeys(place[target] for target in _targets(branches))) for branches in found]
    grown = True
    while grown:
        grown = False
        for i in reversed(range(len(reach))):
            more = reach[i]
            for target in targets[i]:
                more |= reach[target]
            grown, reach[i] = grown or more != reach[i], more
    return tuple(frozenset(n for n in range(bits.bit_length()) if bits >> n & 1) for bits in reach)


def expand(ways: Ways, counted: Counted, whole: Outline, most: int) -> Chain:
    """Situations with their counters, those with the likeliest single way to them first.

    Counters of states that cannot come any more are forgotten: nothing depends on them.

    Args:
        ways: with ``counted``.
        counted: what follows the counters.
        whole: the machine's outline.
        most: situations that are followed.

    """
    shorten = _forgetful(whole, counted)
    begin = shorten(ways.begin())
    number, waiting, situations = {begin: 0}, [(-1.0, 0)], [begin]
    followed: dict[int, int] = {}
    steps: list[tuple[int, int, End | None, Branch]] = []
    while waiting and len(followed) < most:
        likely, here = heapq.heappop(waiting)
        if here in followed:
            continue
        followed[here] = len(followed)
        for branch in ways.branches(situations[here]):
            (option,) = branch.options
            if isinstance(option.target, End):
                steps.append((here, -1, option.target, branch))
                continue
            target = shorten(option.target)
            there = number.setdefault(target, len(situations))
            if there == len(situations):
                situations.append(target)
            if there not in followed:
                heapq.heappush(waiting, (likely * branch.chance, there))
            steps.append((here, there, None, branch))
    rest = tuple(i for i in range(len(situations)) if i not in followed)
    order = followed | {i: len(followed) + k for k, i in enumerate(rest)}
    return Chain(
        len(followed),
        tuple(Step(order[a], order[b] if b >= 0 else -1, end, branch) for a, b, end, branch in steps),
        tuple(whole.place[situations[i]._replace(memory=NOTHING)] for i in rest),
    )


def _forgetful(whole: Outline, counted: Counted) -> Callable[[Situation], Situation]:
    """What forgets the counters of states that cannot come any more."""

    def shorten(now: Situation) -> Situation:
        if now.memory == NOTHING:
            return now
        reach = whole.reach[whole.place[now._replace(memory=NOTHING)]]
        filled = tuple(pair for pair in now.memory.filled if counted.row_nodes[pair[0]] in reach)
        return now._replace(memory=Memory(filled, tuple(n for n in now.memory.escalated if n in reach)))

    return shorten
