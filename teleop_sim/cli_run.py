"""``teleop-sim run``: one run, watched, and how it went.

Heavy modules are imported inside, so that ``--help`` and shell completion answer at once.
"""

from __future__ import annotations

import shlex
import signal
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from teleop_sim.cli_complete import (
    complete_autonomy,
    complete_delivery,
    complete_layer,
    complete_pacing,
    complete_policy,
    complete_preset,
    complete_robot,
    complete_scenario,
)
from teleop_sim.cli_errors import DONE, FAILED, INTERRUPTED, errors_shown
from teleop_sim.cli_io import say, warn

if TYPE_CHECKING:
    from collections.abc import Callable

    from teleop_sim.run import RunResult
    from teleop_sim.scenarios.schema import Scenario


def _option(words: str, metavar: str, complete: Callable[[str], list[str]] | None = None) -> Any:
    return typer.Option(help=words, metavar=metavar, autocompletion=complete)


_Text = str | None
_Scenario = Annotated[
    str, typer.Argument(help="Name or path of a scenario.", autocompletion=complete_scenario, metavar="SCENARIO")
]
_Preset = Annotated[
    _Text, _option("A link by name, in place of the scenario's; see channel list.", "NAME", complete_preset)
]
_Uplink = Annotated[_Text, _option("Rate to the robot, such as 380bps.", "RATE")]
_Downlink = Annotated[_Text, _option("Rate back, such as 380kbps.", "RATE")]
_Latency = Annotated[_Text, _option("One-way delay of both directions, such as 10s.", "TIME")]
_Loss = Annotated[_Text, _option("Probability that a packet is lost, in both directions.", "SHARE")]
_Header = Annotated[_Text, _option("Header of each packet in bytes; tcp brings its own: 0.", "N")]
_Delivery = Annotated[
    _Text,
    _option(
        "How messages get across: best_effort, stop_and_wait, selective_repeat, custody, ...", "NAME", complete_delivery
    ),
]
_Robot = Annotated[_Text, _option("atlas, thormang3 or valkyrie.", "NAME", complete_robot)]
_Autonomy = Annotated[_Text, _option("off, low, high or full.", "LEVEL", complete_autonomy)]
_Layer = Annotated[
    _Text, _option("Who works at the door or valve: behaviour or template (people only).", "NAME", complete_layer)
]
_Pacing = Annotated[_Text, _option("wpi (with its fixed waits) or eager.", "NAME", complete_pacing)]
_Policy = Annotated[
    _Text,
    _option(
        "What the crew has agreed on: supervise, step_down, adaptive, verify or collaborate.", "NAME", complete_policy
    ),
]
_Team = Annotated[_Text, _option("People at the control station, 1 to 4.", "N")]
_Expertise = Annotated[_Text, _option("A factor on their times, such as 0.7; 1 is average.", "FACTOR")]
_Set = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        help="Any key of a scenario file, such as disturbances.pushes.force_n=20; again for more.",
        metavar="KEY=VALUE",
    ),
]
_Seed = Annotated[_Text, _option("Fixes all chance, such as 1.", "N")]
_TimeLimit = Annotated[_Text, _option("Simulated time after which the run ends, such as 30min.", "TIME")]
_Out = Annotated[Path, _option("Directory for the log.", "DIR")]
_AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
_Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Show no progress.")]


def run(
    scenario: _Scenario,
    preset: _Preset = None,
    uplink: _Uplink = None,
    downlink: _Downlink = None,
    latency: _Latency = None,
    loss: _Loss = None,
    header: _Header = None,
    delivery: _Delivery = None,
    robot: _Robot = None,
    autonomy: _Autonomy = None,
    layer: _Layer = None,
    pacing: _Pacing = None,
    policy: _Policy = None,
    team: _Team = None,
    expertise: _Expertise = None,
    settings: _Set = None,
    seed: _Seed = None,
    time_limit: _TimeLimit = None,
    out: _Out = Path("runs"),
    as_json: _AsJson = False,
    quiet: _Quiet = False,
) -> None:
    """Run SCENARIO once, write its log to DIR/<scenario>_seed<N>.mcap and print how it went.

    An option that is left out is as the scenario says. An older log of the same name is replaced.
    """
    given = {
        "--preset": preset,
        "--loss": loss,
        "--delivery": delivery,
        "--header": header,
        "--uplink": uplink,
        "--downlink": downlink,
        "--latency": latency,
        "--robot": robot,
        "--autonomy": autonomy,
        "--layer": layer,
        "--pacing": pacing,
        "--policy": policy,
        "--team": team,
        "--expertise": expertise,
        "--seed": seed,
        "--time-limit": time_limit,
    }
    with errors_shown():
        from teleop_sim.cli_options import scenario_from

        chosen = scenario_from(scenario, given, out, settings or ())
        result = _watched_run(chosen, out, quiet)
        _print_result(result, as_json)
    raise typer.Exit(DONE if result.outcome == "completed" else FAILED)


def _watched_run(chosen: Scenario, out: Path, quiet: bool) -> RunResult:
    from teleop_sim.cli_options import log_path
    from teleop_sim.cli_progress import watch
    from teleop_sim.run import run_scenario

    log = log_path(out, chosen)
    older = _written(log)
    try:
        with watch(f"{chosen.name} seed {chosen.seed}", quiet) as progress:
            return run_scenario(chosen, chosen.seed, out, progress=progress)
    except KeyboardInterrupt:
        # What is left to do is short, and a second Ctrl-C would only hide where the log is.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        warn(_interrupted(log, older))
        raise typer.Exit(INTERRUPTED) from None


def _interrupted(log: Path, older: int | None) -> str:
    part = log.with_name(log.name + ".part")
    finished = _written(log) != older
    if not finished and not part.exists():
        return "interrupted before anything was logged"
    return (
        f"interrupted: {log if finished else part} reads up to the interruption and says that it was interrupted\n"
        f"  next: teleop-sim report {shlex.quote(str(log if finished else part))}"
    )


def _written(path: Path) -> int | None:
    """What changes when a file is replaced; None: there is none."""
    return path.stat().st_ino if path.exists() else None


def _print_result(result: RunResult, as_json: bool) -> None:
    from teleop_sim.cli_show import print_summary, result_json

    if as_json:
        say(result_json(result))
    else:
        print_summary(result)
