"""The episode memo: what has been computed once is remembered, bit for bit.

An episode is a function of the robot in its world, the command, the state, the name of its noise and where it is cut.
Under common random numbers many cells of a sweep ask for the same ones: other links and other levels of autonomy give
the robot mostly the same commands. ``Fresh`` computes; ``Memo`` asks its memory first. Nothing else tells them apart:
a run's log has the same bytes with either (docs/physics.md, *Memo*).

Not for several threads, and not shared between processes.
"""

from __future__ import annotations

import math
from collections import Counter, OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any, Literal
from weakref import ref

import numpy as np

from teleop_sim.core.fingerprint import fingerprint
from teleop_sim.core.streams import stream
from teleop_sim.robot.body import Body, RobotState
from teleop_sim.robot.commands import Command, Detect, Stop, Walk
from teleop_sim.robot.episode import Episode, NoiseKey, perform
from teleop_sim.robot.spec import RobotSpec
from teleop_sim.world.digest import plant_digest
from teleop_sim.world.disturbances import CALM, Disturbances
from teleop_sim.world.plant import Plant, Scenery

LIMIT_BYTES = 256 * 2**20
"""Default: some thirty different runs of the dish task (measured: 9 MB each)."""

BODIES = 2
"""So many robots in their worlds are kept beside that, 20 MB each (measured), most of it MuJoCo's own arena."""

Kind = Literal["episode", "look", "body"]


@dataclass(frozen=True)
class Sight:
    """Something seen by a robot at rest, and how it is made.

    Attributes:
        name: of the noise's stream.
        make: from the body, loaded, and the stream; a function of a module. Its result is never changed.
        options: whatever else ``make`` depends on; values that ``core.fingerprint`` understands.
    """

    name: str
    make: Callable[[Body, np.random.Generator], Any]
    options: tuple[object, ...] = ()


class Fresh:
    """Computes everything anew, each time."""

    def body(self, spec: RobotSpec, scenery: Scenery, disturbances: Disturbances = CALM) -> Body:
        """The robot in its world; scratch. Its stopwatch is at zero."""
        return Body(spec, Plant(spec.model, scenery, disturbances=disturbances))

    def perform(
        self,
        body: Body,
        command: Command,
        state: RobotState,
        key: NoiseKey,
        until_s: float = math.inf,
        start_s: float = 0.0,
    ) -> Episode:
        """Carry out a command: see ``robot.episode.perform``."""
        return perform(body, command, state, key, until_s, start_s)

    def stood(self, _body: Body, state: RobotState, _seconds: float, /) -> RobotState:
        """The robot after standing for so long: frozen (``robot.stepped`` steps instead)."""
        return state

    def look(self, body: Body, state: RobotState, sight: Sight, seed: int, replicate: int, now_s: float) -> Any:
        """What a robot at rest in a state sees. ``now_s``: the clock's time, which changes nothing."""
        body.load(state, now_s)
        return sight.make(body, stream(seed, replicate, sight.name))


class _Digests:
    """Digests by which object it is: who comes again is not looked through again. Keeps nothing alive."""

    def __init__(self) -> None:
        self._known: dict[int, tuple[ref[Any], bytes]] = {}

    def of(self, value: Any, make: Callable[[], bytes] | None = None) -> bytes:
        """The digest of a value that never changes; ``make`` it, or its fingerprint, the first time."""
        place = id(value)
        entry = self._known.get(place)
        # A place in memory is given away again, but not while its first owner lives.
        if entry is not None and entry[0]() is value:
            return entry[1]
        digest = fingerprint(value) if make is None else make()
        self._known[place] = (ref(value, lambda _: self._known.pop(place, None)), digest)
        return digest


@dataclass(frozen=True)
class Tally:
    """What a memo has done so far. ``spared_s``: simulated time of motion that was not stepped again."""

    episodes_found: int
    episodes_made: int
    looks_found: int
    looks_made: int
    bodies_found: int
    bodies_made: int
    evicted: int
    entries: int
    used_bytes: int
    limit_bytes: int
    spared_s: float

    def __str__(self) -> str:
        asked = self.episodes_found + self.episodes_made
        share = self.episodes_found / asked if asked else 0.0
        return (
            f"{self.episodes_found} of {asked} episodes remembered ({share:.0%}), "
            f"{self.used_bytes / 2**20:.0f} of {self.limit_bytes / 2**20:.0f} MB, {self.evicted} evicted"
        )


class Memo(Fresh):
    """Remembers what it has computed, least recently used first out.

    Args:
        limit_bytes: of the memory of episodes and looks; what is larger by itself is not kept. Zero keeps nothing.

    The model of a body must not be changed once it was asked about: its digest is taken at the first question.
    """

    def __init__(self, limit_bytes: int = LIMIT_BYTES) -> None:
        self.limit_bytes = limit_bytes
        self._kept: OrderedDict[bytes, tuple[Any, int]] = OrderedDict()
        self._bodies: OrderedDict[bytes, Body] = OrderedDict()
        self._digests = _Digests()
        self._found: Counter[Kind] = Counter()
        self._made: Counter[Kind] = Counter()
        self._used_bytes = 0
        self._evicted = 0
        self._spared_s = 0.0

    def body(self, spec: RobotSpec, scenery: Scenery, disturbances: Disturbances = CALM) -> Body:
        """See ``Fresh.body``. Runs one after the other share it: it is scratch, and holds nothing between commands."""
        # A robot has some thousand numbers, and all runs of a sweep have the same one.
        key = fingerprint(self._digests.of(spec), scenery, disturbances)
        body = self._bodies.get(key)
        if body is None:
            self._made["body"] += 1
            body = self._bodies[key] = super().body(spec, scenery, disturbances)
            if len(self._bodies) > BODIES:
                self._bodies.popitem(last=False)
        else:
            self._found["body"] += 1
            self._bodies.move_to_end(key)
        body.plant.stopwatch, body.plant.stepping_s = None, 0.0
        return body

    def perform(
        self,
        body: Body,
        command: Command,
        state: RobotState,
        key: NoiseKey,
        until_s: float = math.inf,
        start_s: float = 0.0,
    ) -> Episode:
        """See ``Fresh.perform``. ``start_s`` is not part of the question: it has no effect on what happens."""
        asked, begins = self._command_digest(command), self._digests.of(state)
        question = fingerprint("episode", self._digest(body), asked, begins, key, float(until_s))
        episode: Episode | None = self._recall("episode", question)
        if episode is not None:
            self._spared_s += episode.physics_s
            return replace(episode, command=command)
        episode = super().perform(body, command, state, key, until_s, start_s)
        # The command may hold a cloud. Who asks again brings it along.
        self._keep(question, replace(episode, command=Stop()))
        return episode

    def look(self, body: Body, state: RobotState, sight: Sight, seed: int, replicate: int, now_s: float) -> Any:
        """See ``Fresh.look``."""
        question = fingerprint("look", self._digest(body), self._digests.of(state), seed, replicate, sight)
        seen = self._recall("look", question)
        if seen is None:
            seen = super().look(body, state, sight, seed, replicate, now_s)
            self._keep(question, seen)
        return seen

    def tally(self) -> Tally:
        """What it has done so far; for progress lines."""
        found, made = self._found, self._made
        return Tally(
            episodes_found=found["episode"],
            episodes_made=made["episode"],
            looks_found=found["look"],
            looks_made=made["look"],
            bodies_found=found["body"],
            bodies_made=made["body"],
            evicted=self._evicted,
            entries=len(self._kept),
            used_bytes=self._used_bytes,
            limit_bytes=self.limit_bytes,
            spared_s=self._spared_s,
        )

    def _digest(self, body: Body) -> bytes:
        return self._digests.of(body, lambda: fingerprint(plant_digest(body.plant), self._digests.of(body.spec)))

    def _command_digest(self, command: Command) -> bytes:
        # A cloud has a megabyte, and one that is remembered is asked about again and again.
        if isinstance(command, Detect) and command.cloud is not None:
            return fingerprint(replace(command, cloud=None), self._digests.of(command.cloud))
        if isinstance(command, Walk) and command.clouds:
            return fingerprint(replace(command, clouds=()), *map(self._digests.of, command.clouds))
        return fingerprint(command)

    def _recall(self, kind: Kind, question: bytes) -> Any:
        entry = self._kept.get(question)
        if entry is None:
            self._made[kind] += 1
            return None
        self._found[kind] += 1
        self._kept.move_to_end(question)
        return entry[0]

    def _keep(self, question: bytes, answer: Any) -> None:
        size = size_bytes(answer)
        if size > self.limit_bytes:
            return
        freeze(answer)
        self._kept[question] = (answer, size)
        self._used_bytes += size
        while self._used_bytes > self.limit_bytes:
            _, (_, size) = self._kept.popitem(last=False)
            self._used_bytes -= size
            self._evicted += 1


OBJECT_BYTES = 100
"""Of a Python object, about (assumed; CPython's float takes 24 and 8 for its place in a tuple)."""


def size_bytes(value: object) -> int:
    """Memory of a value: arrays and bytes exactly, other objects at ``OBJECT_BYTES`` each.

    An array that is a view counts with all that it keeps alive. What two values share counts twice.
    """
    if isinstance(value, np.ndarray):
        base = value
        while isinstance(base.base, np.ndarray):
            base = base.base
        return OBJECT_BYTES + max(base.nbytes, value.nbytes)
    if isinstance(value, (bytes, str)):
        return OBJECT_BYTES + len(value)
    return OBJECT_BYTES + sum(size_bytes(part) for part in _parts(value))


def freeze(value: object) -> None:
    """Make every array in a value read-only: what is remembered must not change under those who got it before."""
    if isinstance(value, np.ndarray):
        value.flags.writeable = False
        return
    for part in _parts(value):
        freeze(part)


def _parts(value: object) -> tuple[object, ...]:
    if isinstance(value, (tuple, list)):
        return tuple(value)
    if isinstance(value, dict):
        return tuple(value.values())
    if is_dataclass(value) and not isinstance(value, type):
        return tuple(getattr(value, f.name) for f in fields(value))
    return ()
