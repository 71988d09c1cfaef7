"""A template server: which templates have been put where, as one value at each site.

Every instance has a *stamp* that grows with each change. Servers are merged entry by entry, and of two entries the one
with the greater stamp counts (of equal stamps the one with the greater bytes). That is commutative, associative and
idempotent, so changes and whole states may be lost, doubled and reordered: two sites that have merged the same entries,
in any order, hold the same. What was lost shows in the next hash, and one exchange of whole states mends it.

Stamps of the control station are even, of the field site odd, so that none is given twice; so are the numbers of the
instances that a site inserts. What is removed stays as an entry without a place, so that a late message cannot bring it
back.

Source of the method: Shapiro et al., Conflict-Free Replicated Data Types, SSS 2011, LNCS 6976, 386-400 (state-based
last-writer-wins registers); Lamport, Commun. ACM 21 (1978), 558-565 (stamps). Two servers kept in step through the
link, and their reset: Romay et al., section 3.2.2.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Literal
from zlib import crc32

from teleop_sim.core.errors import BadInput, Problem
from teleop_sim.templates.poses import Pose, Triple

SiteName = Literal["station", "field"]
Frame = Literal["odometry", "left", "right"]

FRAMES: tuple[Frame, ...] = ("odometry", "left", "right")
"""What an instance's pose is given in: the odometry frame, or the hand that it is attached to."""

STEP_M = 0.001
STEP_RAD = math.pi / 32767
"""Poses are held as messages carry them, so that both sites hold the same bits (``channel/quantise.py``)."""

INSTANCES, STAMPS = 256, 65536
GONE = -1
"""Template of an entry that was removed."""

_ENTRY = struct.Struct(">BHhB6d")


HERE = Pose()
"""Where its frame is."""

_REACH = (32767 * STEP_M, math.pi)


@dataclass(frozen=True, slots=True)
class Entry:
    """One instance of a template.

    Attributes:
        instance: its number, 0 to 255.
        stamp: of its last change, 0 to 65535.
        template: type of the template (``Template.type_id``), or ``GONE``.
        frame: that its pose is given in.
        pose: of the template, on the grid that messages carry.

    """

    instance: int
    stamp: int
    template: int
    frame: Frame = "odometry"
    pose: Pose = HERE

    @property
    def key(self) -> tuple[int, bytes]:
        """Of two entries of an instance the one with the greater key counts."""
        return self.stamp, self.packed

    @property
    def packed(self) -> bytes:
        """One encoding, for comparing and hashing; what crosses the link is shorter."""
        numbers = (*self.pose.position_m, *self.pose.rotation_rad)
        return _ENTRY.pack(self.instance, self.stamp, self.template, FRAMES.index(self.frame), *numbers)


@dataclass(frozen=True)
class Server:
    """All instances at one site. A value: every change gives a new one and the entry to tell the other site.

    Attributes:
        site: whose changes these are.
        entries: by number, also of those that were removed.

    """

    site: SiteName
    entries: tuple[Entry, ...] = ()

    @property
    def placed(self) -> tuple[Entry, ...]:
        """The instances that there are, by number."""
        return tuple(e for e in self.entries if e.template != GONE)

    @property
    def hash(self) -> int:
        """32 bits over everything: what a heartbeat tells."""
        return crc32(b"".join(e.packed for e in self.entries))

    def entry(self, instance: int) -> Entry:
        """An instance that there is.

        Raises:
            BadInput: there is none with this number.

        """
        for found in self.placed:
            if found.instance == instance:
                return found
        known = ", ".join(str(e.instance) for e in self.placed) or "none"
        raise BadInput((Problem(f"template instance {instance}", "there is none", f"Known: {known}."),))

    def insert(self, template: int, pose: Pose) -> tuple[Server, Entry]:
        """Put a new instance of a template somewhere in the odometry frame.

        Raises:
            BadInput: all of this site's 128 numbers are in use, or a pose that cannot be told.

        """
        numbers = {e.instance: e for e in self.entries}
        mine = range(0 if self.site == "station" else 1, INSTANCES, 2)
        spare = [n for n in mine if n not in numbers] or [n for n in mine if numbers[n].template == GONE]
        if not spare:
            raise BadInput((Problem("templates", f"{len(mine)} of the {self.site}'s are in use", "Remove one."),))
        before = numbers.get(spare[0])
        return self._with(Entry(spare[0], self._stamp(before), template, "odometry", snapped(pose)))

    def move(self, instance: int, pose: Pose) -> tuple[Server, Entry]:
        """Put an instance somewhere else in the frame that it is in."""
        old = self.entry(instance)
        return self._with(replace(old, stamp=self._stamp(old), pose=snapped(pose)))

    def attach(self, instance: int, hand: Literal["left", "right"], pose: Pose) -> tuple[Server, Entry]:
        """Fix an instance to a hand; from now on its pose is the one in the hand's frame."""
        old = self.entry(instance)
        return self._with(replace(old, stamp=self._stamp(old), frame=hand, pose=snapped(pose)))

    def detach(self, instance: int, pose: Pose) -> tuple[Server, Entry]:
        """Let a hand's instance be where it is, in the odometry frame."""
        old = self.entry(instance)
        return self._with(replace(old, stamp=self._stamp(old), frame="odometry", pose=snapped(pose)))

    def remove(self, instance: int) -> tuple[Server, Entry]:
        """Take an instance away."""
        old = self.entry(instance)
        return self._with(Entry(instance, self._stamp(old), GONE))

    def clear(self) -> tuple[Server, tuple[Entry, ...]]:
        """Take all away: the reset."""
        server, told = self, list[Entry]()
        for entry in self.placed:
            server, gone = server.remove(entry.instance)
            told.append(gone)
        return server, tuple(told)

    def merge(self, entries: Iterable[Entry]) -> Server:
        """Take in what the other site has told: one change, or all of its entries."""
        best = {e.instance: e for e in self.entries}
        for entry in entries:
            old = best.get(entry.instance)
            if old is None or entry.key > old.key:
                best[entry.instance] = entry
        return replace(self, entries=tuple(best[n] for n in sorted(best)))

    def _with(self, entry: Entry) -> tuple[Server, Entry]:
        return self.merge((entry,)), entry

    def _stamp(self, before: Entry | None) -> int:
        """The least one of this site's above the last."""
        parity = 0 if self.site == "station" else 1
        least = before.stamp + 1 if before else 0
        stamp = least + (least + parity) % 2
        if stamp >= STAMPS:
            problem = Problem(f"template instance {least}", "was changed too often", f"At most {STAMPS // 2} times.")
            raise BadInput((problem,))
        return stamp


def snapped(pose: Pose) -> Pose:
    """The nearest pose on the grid that messages carry: 1 mm and 96 microradians.

    Raises:
        BadInput: a place beyond 32.767 m, a component of the turn beyond pi, or one that is not finite.

    """
    for values, reach in zip((pose.position_m, pose.rotation_rad), _REACH, strict=True):
        if not all(abs(v) <= reach for v in values):
            raise BadInput((Problem("template's pose", f"{values} cannot be told", f"At most ±{reach:.5g} fits."),))
    return Pose(_on(pose.position_m, STEP_M), _on(pose.rotation_rad, STEP_RAD))


def _on(values: Triple, step: float) -> Triple:
    x, y, z = (round(v / step) * step for v in values)
    return (x, y, z)
