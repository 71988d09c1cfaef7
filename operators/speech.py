"""Talk between two people in the control room: it takes both, it takes time, and something urgent breaks it off.

Who is broken off begins again where he was, and says a few words twice. The words are Cogulator's (``timing.toml``).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, Protocol

import simpy

from teleop_sim.operators.acts import Process

AGAIN_S: Final = 1.2
"""Said twice after an interruption: three words of 0.4 s (assumed)."""


class Talker(Protocol):
    """Somebody who can be talked to."""

    talks: list[Talk]

    def wake(self) -> None:
        """There is something to talk about."""


class Talk:
    """One thing that one person has to tell another. It begins when both attend, and then calls ``then``.

    Args:
        env: the clock.
        people: who speaks and who listens.
        text: what is said.
        duration_s: how long it takes.
        request: that it is about; 0: none.
        then: what follows when it has been said.

    Two people who have several things to tell each other take them in the order in which they came up, so nobody waits
    for somebody who waits for him.

    """

    def __init__(
        self,
        env: simpy.Environment,
        people: tuple[Talker, Talker],
        text: str,
        duration_s: float,
        request: int,
        then: Callable[[], None],
    ) -> None:
        self._env, self._people, self._then = env, people, then
        self.text, self.request, self.left_s = text, request, duration_s
        self._over, self.began_s = env.event(), -1.0
        self._here: list[Talker] = []

    @property
    def speaker(self) -> Talker:
        """Who has something to say."""
        return self._people[0]

    def propose(self) -> None:
        """Put it on both people's minds."""
        for person in self._people:
            person.talks.append(self)
        for person in self._people:
            person.wake()

    def join(self, person: Talker) -> simpy.Event:
        """One of the two attends; the event comes when it is over, with whether everything was said."""
        if not self._here:
            self.began_s = -1.0
        self._here.append(person)
        if len(self._here) == len(self._people):
            self.began_s = float(self._env.now)
            self._env.process(self._speak(self._over))
        return self._over

    def leave(self, person: Talker) -> None:
        """One of the two is called away: if they were talking, both stop."""
        self._here.remove(person)
        if self.began_s >= 0.0:
            self.left_s += AGAIN_S - (float(self._env.now) - self.began_s)
            self._end(said=False)

    def cancel(self) -> None:
        """There is nothing to tell any more."""
        for person in self._people:
            if self in person.talks:
                person.talks.remove(self)
        if self._here:
            self._end(said=False)

    def _speak(self, over: simpy.Event) -> Process:
        yield self._env.timeout(self.left_s)
        if over is self._over:
            for person in self._people:
                person.talks.remove(self)
            self._end(said=True)
            self._then()

    def _end(self, said: bool) -> None:
        over, self._over, self._here = self._over, self._env.event(), []
        over.succeed(said)
