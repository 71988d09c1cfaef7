"""Packets that wait for the radio: who goes first, and who goes away when there is no room.

A packet of which bits have gone out is under way: put back between two fragments, it keeps its place ahead of the
others of its urgency, takes no room, and is neither dropped nor superseded. At most one packet of an urgency is under
way, because those of one urgency take turns whole.

A new discipline is one class and one line in ``DISCIPLINES``.
"""

from __future__ import annotations

import heapq
from abc import ABC, abstractmethod
from collections import OrderedDict, deque
from collections.abc import Iterator
from typing import Any, Generic, Literal, Protocol, TypeVar

from teleop_sim.channel.drops import QUEUE_FULL, SUPERSEDED

Drop = Literal["tail", "head"]
DROPS: tuple[Drop, ...] = ("tail", "head")
"""Who goes when a packet comes and the queue is full: the newest or the oldest."""


class Queued(Protocol):
    """What a queue needs to know of a packet."""

    @property
    def topic(self) -> str:
        """What it is about; ``newest`` keeps one packet of each."""

    @property
    def priority(self) -> int:
        """How urgent it is; greater goes first under ``priority``."""

    @property
    def keep(self) -> bool:
        """Whether ``newest`` lets it be: it neither supersedes nor is superseded."""


T = TypeVar("T", bound=Queued)


class Waiting(ABC, Generic[T]):
    """A queue in front of one radio.

    Attributes:
        limit: packets that may wait, besides the one under way; 0 means no limit.
        drop: ``tail`` or ``head``.

    """

    def __init__(self, limit: int = 0, drop: Drop = "tail") -> None:
        self.limit = limit
        self.drop = drop

    @abstractmethod
    def push(self, item: T) -> tuple[T, str] | None:
        """Let a packet wait. What had to go for it and why, if anything: another packet or itself."""

    @abstractmethod
    def put_back(self, item: T) -> None:
        """A packet under way waits for its next turn."""

    @abstractmethod
    def pop(self) -> T:
        """Who goes next.

        Raises:
            IndexError: nobody waits.

        """

    @abstractmethod
    def __iter__(self) -> Iterator[T]:
        """All who wait."""

    @abstractmethod
    def __len__(self) -> int:
        """How many wait, those under way included."""


class Priority(Waiting[T]):
    """Strict priority: the most urgent goes first, among equals the first come.

    Between two fragments a more urgent packet goes ahead (preemption at fragment boundaries). When there is no room,
    the least urgent goes, the newcomer included: the newest of them with ``tail``, the oldest with ``head``.
    """

    ranked = True

    def __init__(self, limit: int = 0, drop: Drop = "tail") -> None:
        super().__init__(limit, drop)
        self._classes: dict[int, deque[T]] = {}
        self._under_way: dict[int, T] = {}
        # Negated urgencies that may have someone; one whose class has emptied is cleared away when it comes up.
        self._urgencies: list[int] = []
        self._fresh = 0

    def urgency(self, item: T) -> int:
        """Greater goes first."""
        return item.priority if self.ranked else 0

    def push(self, item: T) -> tuple[T, str] | None:
        """See ``Waiting``."""
        urgency = self.urgency(item)
        line = self._classes.get(urgency)
        if line is None:
            line = self._classes[urgency] = deque()
            heapq.heappush(self._urgencies, -urgency)
        line.append(item)
        self._fresh += 1
        return self._make_room() if 0 < self.limit < self._fresh else None

    def _make_room(self) -> tuple[T, str]:
        line = self._classes[min(urgency for urgency, line in self._classes.items() if line)]
        self._fresh -= 1
        return (line.pop() if self.drop == "tail" else line.popleft()), QUEUE_FULL

    def put_back(self, item: T) -> None:
        """See ``Waiting``."""
        urgency = self.urgency(item)
        if urgency not in self._classes:
            self._classes[urgency] = deque()
            heapq.heappush(self._urgencies, -urgency)
        self._under_way[urgency] = item

    def pop(self) -> T:
        """See ``Waiting``."""
        while True:
            urgency = -self._urgencies[0]
            if urgency in self._under_way:
                return self._under_way.pop(urgency)
            if line := self._classes[urgency]:
                self._fresh -= 1
                return line.popleft()
            heapq.heappop(self._urgencies)
            del self._classes[urgency]

    def __iter__(self) -> Iterator[T]:
        """See ``Waiting``."""
        yield from self._under_way.values()
        for line in self._classes.values():
            yield from line

    def __len__(self) -> int:
        """See ``Waiting``."""
        return self._fresh + len(self._under_way)


class Fifo(Priority[T]):
    """First come, first served, whatever the priorities."""

    ranked = False


class Newest(Waiting[T]):
    """Newest state wins: a packet takes the place in line of the one of its topic that waits, which is superseded.

    The place is kept so that a topic that is sent often still gets its turn. Priorities do not count. A packet to be
    kept stands in line for itself.
    """

    def __init__(self, limit: int = 0, drop: Drop = "tail") -> None:
        super().__init__(limit, drop)
        self._line: OrderedDict[str | int, T] = OrderedDict()
        self._pushed = 0
        self._under_way: list[T] = []

    def push(self, item: T) -> tuple[T, str] | None:
        """See ``Waiting``."""
        self._pushed += 1
        key = self._pushed if item.keep else item.topic
        older = self._line.get(key)
        self._line[key] = item
        if older is not None:
            return older, SUPERSEDED
        if 0 < self.limit < len(self._line):
            return self._line.popitem(last=self.drop == "tail")[1], QUEUE_FULL
        return None

    def put_back(self, item: T) -> None:
        """See ``Waiting``."""
        self._under_way.append(item)

    def pop(self) -> T:
        """See ``Waiting``."""
        if self._under_way:
            return self._under_way.pop()
        if not self._line:
            raise IndexError
        return self._line.popitem(last=False)[1]

    def __iter__(self) -> Iterator[T]:
        """See ``Waiting``."""
        yield from self._under_way
        yield from self._line.values()

    def __len__(self) -> int:
        """See ``Waiting``."""
        return len(self._under_way) + len(self._line)


Discipline = Literal["fifo", "priority", "newest"]
DISCIPLINES: dict[str, type[Waiting[Any]]] = {"fifo": Fifo, "priority": Priority, "newest": Newest}
"""Name in settings to queue."""
