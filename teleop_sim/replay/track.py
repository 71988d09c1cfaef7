"""Where everything was in a run, at any time, from the samples in its log.

The log has a sample every ``PERIOD_S`` while the robot moves, and one when it has come to rest. Between two of them
positions are drawn on a line. That is for display only: it is not what physics did in between. A robot that
waits is frozen, and stays where its last sample has it until one period before the next.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from teleop_sim.core.errors import LogDamaged
from teleop_sim.core.records import PlantNames, PlantSample
from teleop_sim.log.load import Log
from teleop_sim.onsite import SAMPLE_EVERY_TICKS
from teleop_sim.world.plant import TICK_S

PERIOD_S = SAMPLE_EVERY_TICKS * TICK_S
UPRIGHT_COS = math.cos(math.radians(45.0))
"""A pelvis tilted further has no heading of its own (assumed)."""
_SLACK_S = 1e-6


@dataclass(frozen=True)
class Posture:
    """Pelvis position [m] and quaternion w, x, y, z, (7,); joints [rad or m], (k,)."""

    pelvis: np.ndarray
    joints: np.ndarray


@dataclass(frozen=True, eq=False)
class Track:
    """All samples of a run.

    Attributes:
        names: of the joints.
        t_s: (n,), never falling. pelvis: (n, 7). joints: (n, k).

    """

    names: tuple[str, ...]
    t_s: np.ndarray
    pelvis: np.ndarray
    joints: np.ndarray

    @staticmethod
    def of(log: Log) -> Track:
        """The samples of a log.

        Raises:
            LogDamaged: there are none, or they do not fit the names of the joints.

        """
        named = [r.joints.split() for r in log.records("field/plant_names") if isinstance(r, PlantNames)]
        samples = [r for r in log.records("field/plant") if isinstance(r, PlantSample)]
        if not named or not samples:
            raise LogDamaged(str(log.path), "nothing moved in it: it has no samples of the plant to replay")
        names = tuple(named[-1])
        if any(len(s.pelvis) != 7 or len(s.joints) != len(names) for s in samples):
            raise LogDamaged(str(log.path), "a sample of the plant does not fit the names of its joints")
        pelvis = np.array([s.pelvis for s in samples])
        joints = np.array([s.joints for s in samples]).reshape(len(samples), len(names))
        return Track(names, np.array([s.t_s for s in samples]), pelvis, joints)

    def at(self, t_s: float) -> Posture:
        """Where everything was; before the first sample as in the first, after the last as in the last."""
        after = int(np.searchsorted(self.t_s, t_s, side="right"))
        before = max(after - 1, 0)
        if after >= len(self.t_s):
            return Posture(self.pelvis[before], self.joints[before])
        # What stood still began to move no earlier than one period before its first sample.
        end_s = self.t_s[after]
        start_s = max(self.t_s[before], end_s - PERIOD_S)
        share = (t_s - start_s) / (end_s - start_s) if start_s < t_s else 0.0
        if share <= 0.0:
            return Posture(self.pelvis[before], self.joints[before])
        joints = (1.0 - share) * self.joints[before] + share * self.joints[after]
        return Posture(_between(self.pelvis[before], self.pelvis[after], share), joints)

    def stirring(self, after_s: float = 0.0) -> list[tuple[float, float]]:
        """Stretches [s] in which anything moved, each prolonged by ``after_s`` and joined with what it meets."""
        change = np.any(self.pelvis[1:] != self.pelvis[:-1], axis=1) | np.any(
            self.joints[1:] != self.joints[:-1], axis=1
        )
        made: list[tuple[float, float]] = []
        for k in np.flatnonzero(change).tolist():
            end_s = float(self.t_s[k + 1])
            start_s = max(float(self.t_s[k]), end_s - PERIOD_S)
            if made and start_s <= made[-1][1] + _SLACK_S:
                made[-1] = (made[-1][0], end_s + after_s)
            else:
                made.append((start_s, end_s + after_s))
        return made

    def mean(self, from_s: float, to_s: float) -> tuple[float, float, float, float]:
        """Pelvis position [m] and heading [rad], on average over a stretch of time, as it is shown."""
        knots_s, way = self._way
        inner = knots_s[np.searchsorted(knots_s, from_s, side="right") : np.searchsorted(knots_s, to_s)]
        at_s = np.concatenate([[from_s], inner, [to_s]])
        values = [np.interp(at_s, knots_s, column) for column in way.T]
        x, y, z, heading = (float(np.trapezoid(column, at_s)) / (to_s - from_s) for column in values)
        return x, y, z, heading

    @cached_property
    def _way(self) -> tuple[np.ndarray, np.ndarray]:
        """Times (m,), between which the pelvis goes straight; its x, y, z and heading without jumps, (m, 4)."""
        way = np.column_stack([self.pelvis[:, :3], np.unwrap(self.headings_rad)])
        # What stood still began to move one period before its next sample.
        waited = np.flatnonzero(np.diff(self.t_s) > PERIOD_S + _SLACK_S)
        times_s = np.insert(self.t_s, waited + 1, self.t_s[waited + 1] - PERIOD_S)
        way = np.insert(way, waited + 1, way[waited], axis=0)
        last = np.append(np.diff(times_s) > 0.0, True)
        return times_s[last], way[last]

    @cached_property
    def headings_rad(self) -> np.ndarray:
        """Heading of the pelvis at each sample (n,); of a robot that is down, the last it had upright."""
        w, x, y, z = self.pelvis[:, 3:7].T
        heading = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        upright = 1 - 2 * (x * x + y * y) >= UPRIGHT_COS
        last = np.maximum.accumulate(np.where(upright, np.arange(len(w)), 0))
        found: np.ndarray = heading[last]
        return found


def _between(a: np.ndarray, b: np.ndarray, share: float) -> np.ndarray:
    """Positions on a line; quaternions on the shorter way, normalised: at 0.2 s apart nearly the great circle."""
    made = (1.0 - share) * a + share * (b if float(a[3:] @ b[3:]) >= 0.0 else np.concatenate([b[:3], -b[3:]]))
    made[3:] /= np.linalg.norm(made[3:])
    return made
