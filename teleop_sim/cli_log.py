"""``teleop-sim log``: what a log is, whether it is as it should be, logs written anew. Arguments and printing only."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from teleop_sim.cli_errors import BAD_INPUT, errors_shown
from teleop_sim.cli_io import say, warn
from teleop_sim.core.errors import TeleopError
from teleop_sim.core.units import format_time, parse_time_s

if TYPE_CHECKING:
    from teleop_sim.log.info import LogInfo
    from teleop_sim.log.repair import Rewritten

log_app = typer.Typer(no_args_is_help=True, help="Show, check, recover and cut logs.")

_Log = Annotated[Path, typer.Argument(help="A log, such as runs/src-dish_seed1.mcap; or a .part.", metavar="LOG")]
_Out = Annotated[Path, typer.Option("--out", "-o", help="File to write.", metavar="FILE")]
_Force = Annotated[bool, typer.Option("--force", help="Write over FILE if it is there.")]


@log_app.command("info")
def info_command(
    log: _Log, as_json: Annotated[bool, typer.Option("--json", help="As one JSON object.")] = False
) -> None:
    """Tell what was run in LOG, how it ended, and what is in the file."""
    with errors_shown():
        from dataclasses import asdict

        from teleop_sim.log.info import log_info

        found = log_info(log)
        if as_json:
            say(json.dumps(_plain(asdict(found)), allow_nan=False))
            return
        for line in _info_lines(found):
            say(line)


@log_app.command("check")
def check_command(
    logs: Annotated[list[Path], typer.Argument(help="Logs.", metavar="LOG...")],
) -> None:
    """Check the structure of LOGS: list everything that is wrong with its byte; exit code 2 if anything is."""
    bad = False
    with errors_shown():
        from teleop_sim.log.check import check

        for log in logs:
            try:
                found = check(log)
            except TeleopError as error:
                bad = True
                warn(str(error))
                continue
            for problem in found.problems:
                warn(str(problem))
            bad = bad or bool(found.problems)
            if not found.problems:
                say(f"{log}: good ({found.messages} messages, {_chunks(found.chunks)}, {found.size_bytes} bytes)")
        if bad:
            raise typer.Exit(BAD_INPUT)


@log_app.command("recover")
def recover_command(log: _Log, out: _Out, force: _Force = False) -> None:
    """Write a whole log from all whole chunks of LOG, which is cut off, damaged or a .part; LOG stays as it is."""
    with errors_shown():
        from teleop_sim.log.repair import recover

        done = recover(log, out, force)
        say(_written(done))
        for line in _left_out(done):
            say(line)


@log_app.command("cut")
def cut_command(
    log: _Log,
    out: _Out,
    start: Annotated[str, typer.Option("--from", help="First time, such as 60s or 1.5min.", metavar="TIME")] = "0s",
    end: Annotated[str | None, typer.Option("--to", help="Last time; left out: the log's end.", metavar="TIME")] = None,
    force: _Force = False,
) -> None:
    """Write the part of LOG from one simulated time to another, with what is needed to make sense of it.

    That is: what was run, the joints' names, disturbances, blackouts so far, and the scene. Times stay as they are.
    """
    with errors_shown():
        from teleop_sim.log.repair import cut

        to_s = math.inf if end is None else parse_time_s(end, "--to")
        done = cut(log, out, parse_time_s(start, "--from"), to_s, force)
        say(_written(done))
        for line in _left_out(done):
            say(line)


def _written(done: Rewritten) -> str:
    until = "" if done.last_s is None else f" up to {done.last_s:.3f} s of simulated time"
    end = "" if done.ended else "; the run's end is not among them"
    return f"wrote {done.out}: {done.messages} messages of {_chunks(done.chunks)}{until}{end}"


def _chunks(count: int) -> str:
    return "1 chunk" if count == 1 else f"{count} chunks"


def _left_out(done: Rewritten) -> list[str]:
    told = []
    if done.lost_chunks:
        told.append(f"{done.lost_chunks} damaged chunks were passed over")
    if done.lost_bytes:
        told.append(f"{done.lost_bytes} bytes made no sense")
    if done.orphans:
        told.append(f"{done.orphans} messages are left out: no whole chunk says what they are")
    return told


def _info_lines(found: LogInfo) -> list[str]:
    run = found.run
    state = "whole" if found.whole else "cut off or damaged"
    what = f"{run['scenario']} seed {run['seed']} replicate {run['replicate']}" if run["scenario"] else "not known"
    lines = [
        f"run:      {what}",
        f"ended:    {_how(found)}",
        f"versions: {run['versions'] or 'not known'}",
        f"file:     {found.size_bytes} bytes, {_chunks(found.chunks)}, {state}",
        "",
    ]
    rows = [("topic", "messages", "bytes", "first s", "last s")]
    rows += [(t.topic, str(t.messages), str(t.bytes), f"{t.first_s:.3f}", f"{t.last_s:.3f}") for t in found.topics]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for name, *numbers in rows:
        cells = (f"{cell:>{width}}" for cell, width in zip(numbers, widths[1:], strict=True))
        lines.append("  ".join((f"{name:{widths[0]}}", *cells)))
    return lines


def _how(found: LogInfo) -> str:
    if found.interrupted:
        return f"interrupted at {found.end_s:.3f} s"
    if found.run["outcome"] == "completed":
        return f"completed in {format_time(found.run['completion_time_s'])}"
    return f"{found.run['outcome']} at {found.end_s:.3f} s: {found.run['cause']}"


def _plain(value: Any) -> Any:
    """JSON has no NaN."""
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, dict):
        return {name: _plain(inner) for name, inner in value.items()}
    return [_plain(inner) for inner in value] if isinstance(value, list | tuple) else value
