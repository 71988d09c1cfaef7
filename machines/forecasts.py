"""What is to be expected of a machine, as figures with bounds; ``markov`` makes it."""

from __future__ import annotations

from dataclasses import dataclass

from teleop_sim.machines.situations import End


@dataclass(frozen=True, slots=True)
class Figure:
    """A number that is known to lie between two; they are equal where it is exact."""

    low: float
    high: float

    @property
    def value(self) -> float:
        """The middle."""
        return 0.5 * (self.low + self.high) if self.high > self.low else self.low

    @property
    def error(self) -> float:
        """How far the middle may be off."""
        return 0.5 * (self.high - self.low) if self.high > self.low else 0.0

    def __str__(self) -> str:
        return f"{self.value:.6g}" + (f" ± {self.error:.2g}" if self.error else "")


@dataclass(frozen=True)
class Forecast:
    """What is to be expected of a machine.

    Attributes:
        machine: its name.
        level: of autonomy.
        situations: that were followed.
        cut: chance of a way that leaves them; 0: all figures are exact.
        time_s: mean time until it ends, whichever way, or until nobody answers [s].
        sd_s: standard deviation of that time [s]; NaN if it may go on for ever.
        waits_s: of the mean time, with people only being waited for [s].
        completed: chance that the task is executed.
        completed_s: mean time of those that are [s]; NaN if none is.
        manual: chance that it is ever in manual mode, or an event is ever forced.
        ends: chance of each way to end, likeliest first; a fall is ``not recoverable``.
        visits: mean number of times that each state is left, self-loops counted, by path.
        time_in_s: mean time in each state [s], by path.

    """

    machine: str
    level: int
    situations: int
    cut: float
    time_s: Figure
    sd_s: Figure
    waits_s: Figure
    completed: Figure
    completed_s: Figure
    manual: Figure
    ends: tuple[tuple[End, Figure], ...]
    visits: dict[str, Figure]
    time_in_s: dict[str, Figure]

    @property
    def not_completed(self) -> Figure:
        """Chance that it ends otherwise: it does not recover."""
        return Figure(1.0 - self.completed.high, 1.0 - self.completed.low)

    def chance_of(self, end: str) -> Figure:
        """Chance of an end or outcome by its name, completed or not."""
        found = [figure for (name, _), figure in self.ends if name == end]
        return Figure(sum(f.low for f in found), min(1.0, sum(f.high for f in found)))

    def __str__(self) -> str:
        exact = "exact" if not self.cut else f"ways left out: {self.cut:.2g}"
        ends = (f"  {end.name:30s} {'completed' if end.completed else 'failed':10s} {f}" for end, f in self.ends)
        states = (
            f"  {path:44s} {figure!s:>24s} {self.time_in_s[path]!s:>24s}"
            for path, figure in self.visits.items()
            if figure.high
        )
        lines = (
            f"{self.machine} at level {self.level}: {self.situations} situations, {exact}",
            f"time         {self.time_s} s, standard deviation {self.sd_s} s",
            f"  waiting    {self.waits_s} s for people",
            f"completed    {self.completed}, in the mean after {self.completed_s} s",
            f"ever manual  {self.manual}",
            "ends",
            *ends,
            f"  {'state':44s} {'visits':>24s} {'seconds':>24s}",
            *states,
        )
        return "\n".join(lines)
