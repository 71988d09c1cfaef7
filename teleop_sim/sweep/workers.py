"""Who carries out the jobs of a sweep: this process, processes on this machine, or a Dask cluster (``cluster.py``).

A crew is given jobs and calls back with each one done. Whoever does them, the results are the same; a crew only decides
when. A worker that is killed is replaced, and its job is given out again: what it had finished is in the journal.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections import Counter, deque
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, replace
from typing import Final, Protocol

from teleop_sim.sweep.replicate import Job, JobDone, run_job

TRIES: Final = 3
"""So often a job is given out whose worker dies each time (assumed): then it is the job that kills."""

TICK_S: Final = 0.5
"""Between two looks at how far the workers are (assumed)."""


@dataclass(frozen=True)
class JobLost:
    """A job that could not be done, and why."""

    replicate: int
    cause: str


Tell = Callable[[JobDone | JobLost], None]
Tick = Callable[[], None]


class Crew(Protocol):
    """Carries out jobs."""

    @property
    def workers(self) -> int:
        """How many jobs at once, as far as is known."""
        ...

    def carry_out(self, jobs: Sequence[Job], tell: Tell, tick: Tick) -> None:
        """Do all jobs; ``tell`` of each one that is done or lost, in any order; ``tick`` now and then."""
        ...


@dataclass(frozen=True)
class Here:
    """Does one job after the other in this process."""

    workers: int = 1

    def carry_out(self, jobs: Sequence[Job], tell: Tell, tick: Tick) -> None:
        """See ``Crew``."""
        for job in jobs:
            tell(run_job(job))
            tick()


@dataclass(frozen=True)
class Processes:
    """Processes on this machine."""

    workers: int

    def carry_out(self, jobs: Sequence[Job], tell: Tell, tick: Tick) -> None:
        """See ``Crew``."""
        waiting, tried = deque(replace(job, parent=os.getpid()) for job in jobs), Counter[int]()
        while waiting:
            # A killed process breaks its pool. A new one goes on.
            waiting = _Pool(self.workers, waiting, tried, tell, tick).empty()


class _Pool:
    """One pool of processes, until all is done or one of them is killed."""

    def __init__(self, workers: int, waiting: deque[Job], tried: Counter[int], tell: Tell, tick: Tick) -> None:
        self._workers, self._waiting, self._tried, self._tell, self._tick = workers, waiting, tried, tell, tick
        # Forked processes would share locks of threads that they do not have.
        spawn = multiprocessing.get_context("spawn")
        self._pool = ProcessPoolExecutor(min(workers, len(waiting)), mp_context=spawn, initializer=_leave_signals)
        self._under_way: dict[Future[JobDone], Job] = {}

    def empty(self) -> deque[Job]:
        """Work; what is left was under way when a process was killed, or waits still."""
        try:
            while (self._waiting or self._under_way) and self._step():
                self._tick()
        except BaseException:
            _end_children()
            raise
        finally:
            self._pool.shutdown(wait=True, cancel_futures=True)
        return self._left()

    def _step(self) -> bool:
        """Give out work and collect what is done; false: the pool is broken."""
        try:
            while self._waiting and len(self._under_way) < self._workers:
                self._under_way[self._pool.submit(run_job, self._waiting[0])] = self._waiting[0]
                self._waiting.popleft()
        except BrokenProcessPool:
            return False
        done, _ = wait(self._under_way, timeout=TICK_S, return_when=FIRST_COMPLETED)
        broken = False
        for future in done:
            if isinstance(future.exception(), BrokenProcessPool):
                broken = True
                continue
            job = self._under_way.pop(future)
            error = future.exception()
            self._tell(future.result() if error is None else JobLost(job.replicate, _words(error)))
        return not broken

    def _left(self) -> deque[Job]:
        left: list[Job] = []
        for job in self._under_way.values():
            self._tried[job.replicate] += 1
            if self._tried[job.replicate] < TRIES:
                left.append(job)
            else:
                self._tell(JobLost(job.replicate, f"{TRIES} processes died over it; the machine may lack memory"))
        return deque([*left, *self._waiting])


def _leave_signals() -> None:
    """Ctrl-C goes to every process of a terminal; the parent's word ends its workers."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)


def _end_children() -> None:
    for child in multiprocessing.active_children():
        child.terminate()


def _words(error: BaseException) -> str:
    return f"{type(error).__name__}: {error}"
