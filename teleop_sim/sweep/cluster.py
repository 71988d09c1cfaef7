"""A sweep on a Dask cluster: an existing scheduler, or one of its own on this machine.

Workers must reach the sweep's directory under the same path, and have this program in the same version; both are asked
before anything is given out. Dask itself gives the work of a lost worker to another one.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from teleop_sim.core.errors import BadInput, Problem
from teleop_sim.sweep.replicate import Job, JobDone, run_job
from teleop_sim.sweep.versions import versions
from teleop_sim.sweep.workers import TICK_S, TRIES, JobLost, Tell, Tick

if TYPE_CHECKING:
    from distributed import Client

_ONE_AT_A_TIME = threading.Lock()
# A worker of several threads would run several jobs in one process; physics scratch and caches are not made for that.


@dataclass(frozen=True)
class Cluster:
    """Workers of a Dask scheduler.

    Attributes:
        address: such as ``tcp://host:8786``, or ``local`` for a cluster of ``workers`` processes on this machine.
        workers: of a local cluster; of another one the scheduler knows.

    """

    address: str
    workers: int = 1

    def carry_out(self, jobs: Sequence[Job], tell: Tell, tick: Tick) -> None:
        """See ``workers.Crew``.

        Raises:
            BadInput: no scheduler answers, or its workers lack the directory or this version.

        """
        distributed = _distributed()
        if self.address == "local":
            local = distributed.LocalCluster(
                n_workers=self.workers, threads_per_worker=1, processes=True, dashboard_address=None
            )
            with local, distributed.Client(local) as client:
                _give_out(client, jobs, tell, tick)
            return
        try:
            client = distributed.Client(self.address, timeout=10)
        except (OSError, ValueError) as error:
            hint = "Start one with: dask scheduler; or give --scheduler local."
            raise BadInput((Problem("--scheduler", f"{self.address} does not answer: {error}", hint),)) from None
        with client:
            _refuse_other_workers(client, jobs)
            _give_out(client, jobs, tell, tick)


def _distributed() -> Any:
    try:
        import distributed
    except ImportError:
        hint = "Install it: pip install 'teleop-sim[cluster]'."
        raise BadInput((Problem("--scheduler", "dask.distributed is not installed", hint),)) from None
    return distributed


def _refuse_other_workers(client: Client, jobs: Sequence[Job]) -> None:
    here, folder = versions(), jobs[0].folder if jobs else Path()
    problems = []
    for worker, (theirs, reached) in client.run(_what_is_here, folder).items():
        differ = [
            f"{name} {theirs.get(name)}, not {version}" for name, version in here.items() if theirs.get(name) != version
        ]
        if differ:
            what = f"worker {worker} has {'; '.join(differ)}"
            problems.append(Problem("--scheduler", what, "Results depend on versions: install the same ones there."))
        if not reached:
            what = f"worker {worker} does not see {folder}"
            problems.append(Problem("--out", what, "Give a directory that all workers share, by its full path."))
    if problems:
        raise BadInput(tuple(problems))


def _what_is_here(folder: Path) -> tuple[dict[str, str], bool]:
    return versions(), folder.is_dir()


def _run_alone(job: Job) -> JobDone:
    with _ONE_AT_A_TIME:
        return run_job(job)


def _give_out(client: Client, jobs: Sequence[Job], tell: Tell, tick: Tick) -> None:
    from distributed import TimeoutError as NotYet

    wait: Any = _distributed().wait
    cancel: Any = client.cancel
    left = {client.submit(_run_alone, job, pure=False, retries=TRIES - 1): job for job in jobs}
    try:
        while left:
            try:
                done = wait(list(left), timeout=TICK_S, return_when="FIRST_COMPLETED").done
            except NotYet:
                done = set()
            for future in done:
                job, error = left.pop(future), future.exception()
                tell(future.result() if error is None else JobLost(job.replicate, f"{type(error).__name__}: {error}"))
                future.release()
            tick()
    finally:
        cancel(list(left))
