"""Progress of a run on standard error: one live picture on a terminal, plain lines elsewhere."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from teleop_sim.cli_io import warn
from teleop_sim.core.units import format_time

if TYPE_CHECKING:
    from teleop_sim.run import Progress

_STARTING = "starting; the first run after an installation compiles for half a minute"

Watch = Callable[["Progress"], None]


@contextmanager
def watch(title: str, quiet: bool) -> Iterator[Watch | None]:
    """What to hand to ``run`` as its ``progress``; None if nothing is to be shown."""
    if quiet:
        yield None
    elif sys.stderr.isatty():
        with _live(title) as show:
            yield show
    else:
        warn(f"{title}: {_STARTING}")
        yield PlainLines(title, warn)


class PlainLines:
    """One line whenever state, mode or note changes."""

    def __init__(self, title: str, write: Callable[[str], None]) -> None:
        self._title = title
        self._write = write
        self._last: tuple[str, str, str] | None = None

    def __call__(self, now: Progress) -> None:
        """Write a line if there is something new."""
        if self._last is None:
            self._write(f"{self._title}: up to {format_time(now.time_limit_s)} of simulated time")
        seen = (now.state, now.mode, now.note)
        if seen != self._last:
            self._last = seen
            self._write(plain_line(now))


def plain_line(now: Progress) -> str:
    """Clock, state, mode, use of the link, note."""
    use = f"up {_percent(now.up_use)} down {_percent(now.down_use)}"
    # Of a state in a machine in a machine its own name: the line stays one.
    state = now.state.rpartition("/")[2]
    return f"{now.t_s:9.1f} s  {state:28} {now.mode:8} {use}  {now.note}".rstrip()


@contextmanager
def _live(title: str) -> Iterator[Watch]:
    from rich.console import Console
    from rich.live import Live
    from rich.text import Text

    # Its thread draws eight times a second, however often the run reports.
    with Live(
        Text(f"{title}: {_STARTING}"), console=Console(stderr=True), refresh_per_second=8, transient=True
    ) as live:
        yield lambda now: live.update(Text(live_text(title, now)))


def live_text(title: str, now: Progress) -> str:
    """The clock, the state and its mode, the link, and what is going on if the run says."""
    up, down = (f"{_bar(use)} {_percent(use)}" for use in (now.up_use, now.down_use))
    lines = [
        f"{title}   {now.t_s:8.1f} s of simulated time, limit {format_time(now.time_limit_s)}",
        f"  state  {now.state} ({now.mode})",
        f"  link   up {up}   down {down}",
    ]
    return "\n".join([*lines, f"  now    {now.note}"] if now.note else lines)


def _bar(share: float) -> str:
    full = round(10 * min(1.0, max(0.0, share)))
    return "█" * full + "░" * (10 - full)


def _percent(share: float) -> str:
    return f"{100 * share:4.1f} %"
