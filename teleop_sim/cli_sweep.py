"""``teleop-sim sweep``: many runs over links, levels of autonomy and whatever else. Arguments and printing only."""

from __future__ import annotations

import json
import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from teleop_sim.cli_errors import DONE, FAILED, INTERRUPTED, errors_shown
from teleop_sim.cli_io import say, warn
from teleop_sim.core.errors import BadInput, Problem

if TYPE_CHECKING:
    from teleop_sim.sweep.plan import Plan
    from teleop_sim.sweep.study import SweepProgress
    from teleop_sim.sweep.workers import Crew


def _option(words: str, metavar: str) -> Any:
    return typer.Option(help=words, metavar=metavar)


_Text = str | None
_Scenario = Annotated[_Text, typer.Argument(help="Name or path of a scenario.", metavar="SCENARIO")]
_Preset = Annotated[_Text, _option("Links by name, such as moon,mars-mean; see channel list.", "NAMES")]
_Uplink = Annotated[_Text, _option("Rates to the robot: 64bps,380bps or 64bps:4kbps:4:log.", "RATES")]
_Downlink = Annotated[_Text, _option("Rates back.", "RATES")]
_Latency = Annotated[_Text, _option("One-way delays: 0s,2s,10s or 0s:10s:6.", "TIMES")]
_Loss = Annotated[_Text, _option("Probabilities that a packet is lost, both ways.", "SHARES")]
_Delivery = Annotated[_Text, _option("How messages get across: best_effort,tcp, ...", "NAMES")]
_Autonomy = Annotated[_Text, _option("Of off,low,high,full.", "LEVELS")]
_Layer = Annotated[_Text, _option("Of behaviour,template: who works at the door or valve.", "NAMES")]
_Robot = Annotated[_Text, _option("Of valkyrie,atlas,thormang3.", "NAMES")]
_Pacing = Annotated[_Text, _option("Of wpi,eager.", "NAMES")]
_Policy = Annotated[_Text, _option("Of supervise,step_down,adaptive,verify,collaborate.", "NAMES")]
_Team = Annotated[_Text, _option("People at the control station, of 1,2,3,4.", "NUMBERS")]
_Expertise = Annotated[_Text, _option("Factors on their times: 0.7,1 or 0.5:2:4.", "FACTORS")]
_Set = Annotated[list[str] | None, typer.Option("--set", help="Any key of a scenario.", metavar="KEY=VALUES")]
_Runs = Annotated[_Text, _option("Replicates of each cell; with --until at most. Default: 20.", "N")]
_Seed = Annotated[_Text, _option("Fixes all chance; default: the scenario's.", "N")]
_Design = Annotated[str, _option("grid, lhs:N, sobol:N, morris:N, saltelli:N or a CSV file, a row a cell.", "NAME")]
_Detail = Annotated[str, _option("full (a log a run), events (without motion) or summary (no logs).", "LEVEL")]
_Until = Annotated[str, _option("Stop a cell when its 95 % interval is narrow, such as ci=5%.", "RULE")]
_Measure = Annotated[str, _option("For --until: time, success or score.", "NAME")]
_Deadline = Annotated[_Text, _option("For time and success; default: the time limit.", "TIME")]
_Out = Annotated[Path | None, _option("Directory of the sweep; default: runs/SCENARIO_sweep.", "DIR")]
_Resume = Annotated[Path | None, _option("Run what is missing in DIR.", "DIR")]
_Force = Annotated[bool, typer.Option("--force", help="With --resume: although versions or scenario have changed.")]
_Workers = Annotated[_Text, _option("Processes on this machine; default: one a core.", "N")]
_Scheduler = Annotated[_Text, _option("A Dask scheduler, such as tcp://host:8786, or local.", "ADDRESS")]
_NoMemo = Annotated[bool, typer.Option("--no-memo", help="Compute every run's physics anew. Results are the same.")]
_DryRun = Annotated[bool, typer.Option("--dry-run", help="Say how many runs and about how long; run nothing.")]
_AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
_Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Show no progress.")]


def sweep(
    scenario: _Scenario = None,
    preset: _Preset = None,
    uplink: _Uplink = None,
    downlink: _Downlink = None,
    latency: _Latency = None,
    loss: _Loss = None,
    delivery: _Delivery = None,
    autonomy: _Autonomy = None,
    layer: _Layer = None,
    robot: _Robot = None,
    pacing: _Pacing = None,
    policy: _Policy = None,
    team: _Team = None,
    expertise: _Expertise = None,
    settings: _Set = None,
    runs: _Runs = None,
    seed: _Seed = None,
    design: _Design = "grid",
    detail: _Detail = "full",
    until: _Until = "",
    measure: _Measure = "time",
    deadline: _Deadline = None,
    out: _Out = None,
    resume: _Resume = None,
    force: _Force = False,
    workers: _Workers = None,
    scheduler: _Scheduler = None,
    no_memo: _NoMemo = False,
    dry_run: _DryRun = False,
    as_json: _AsJson = False,
    quiet: _Quiet = False,
) -> None:
    """Run SCENARIO many times, over all combinations of the values given, and print how each came out.

    Lists (64bps,380bps) and ranges (first:last:count, with :log for equal ratios) make factors. All cells of a
    replicate share their random numbers. A sweep that was killed goes on with --resume.
    """
    given = dict(locals())
    with errors_shown():
        from teleop_sim.cli_sweep_options import chosen_sweep

        plan, directory, crew = chosen_sweep(given)
        if dry_run:
            from teleop_sim.cli_sweep_show import dry_run_words

            say(dry_run_words(plan, crew.workers))
            return
        at = _watched(plan, directory, crew, not no_memo, quiet or as_json)
        _print(plan, directory, at, as_json)
        raise typer.Exit(FAILED if at.lost else DONE)


def _watched(plan: Plan, directory: Path, crew: Crew, memo: bool, quiet: bool) -> SweepProgress:
    from teleop_sim.cli_sweep_show import watch_sweep
    from teleop_sim.sweep.study import run_sweep

    try:
        with watch_sweep(plan, quiet) as watch:
            return run_sweep(plan, directory, crew, memo, watch)
    except KeyboardInterrupt:
        warn(f"interrupted; what is finished is kept\n  next: teleop-sim sweep --resume {shlex.quote(str(directory))}")
        raise typer.Exit(INTERRUPTED) from None


def _print(plan: Plan, directory: Path, at: SweepProgress, as_json: bool) -> None:
    from teleop_sim.cli_sweep_show import print_sweep, sweep_json

    if as_json:
        say(json.dumps(sweep_json(plan, directory, at), allow_nan=False))
    else:
        print_sweep(plan, directory, at)
    for lost in at.lost:
        warn(
            str(
                Problem(
                    f"replicate {lost.replicate}", lost.cause, f"teleop-sim sweep --resume {directory} tries again."
                )
            )
        )


def decide(
    directory: Annotated[Path, typer.Argument(help="Of a sweep.", metavar="DIR")],
    choose: Annotated[str, _option("The factor to choose: the others make the map.", "FACTOR")] = "autonomy",
    measure: Annotated[str, _option("time, success or score.", "NAME")] = "time",
    deadline: _Deadline = None,
    plot: Annotated[Path | None, _option("Draw the map: .svg or .png.", "FILE")] = None,
    as_csv: Annotated[bool, typer.Option("--csv", help="Print CSV.")] = False,
) -> None:
    """Print the decision map of a sweep: for each link the best level, by how much, and how sure."""
    with errors_shown():
        from teleop_sim.cli_sweep_show import decision_rows, print_decision
        from teleop_sim.reports.decision import SUFFIXES

        if plot is not None and plot.suffix.lower() not in SUFFIXES:
            raise BadInput((Problem("--plot", f"{plot} is no .svg or .png", "Name the file so."),))
        found = decision_rows(directory, choose, measure, deadline)
        if as_csv:
            say(found.map.to_csv(index=False).rstrip("\n"))
        else:
            print_decision(found)
        if plot is not None:
            from teleop_sim.reports.decision import draw_decision

            draw_decision(found.map, found.link, choose, found.measure, plot)
            say(f"wrote {plot}") if not as_csv else None


def sensitivity(
    directory: Annotated[Path, typer.Argument(help="Of a sweep with --design morris:N or saltelli:N.", metavar="DIR")],
    measure: Annotated[str, _option("time, success or score.", "NAME")] = "time",
    deadline: _Deadline = None,
) -> None:
    """Print how much each factor of a sweep matters, as CSV: elementary effects or Sobol indices."""
    with errors_shown():
        from teleop_sim.cli_sweep_options import seconds
        from teleop_sim.sweep.sensitivity import sensitivity as analysed

        say(analysed(directory, measure, seconds(deadline)).to_csv(index=False, float_format="%.6g").rstrip("\n"))
