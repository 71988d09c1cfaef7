"""The commands: arguments, exit codes, progress; nothing else.

Exit codes: 0 done, 1 the task failed or ran out of time, 2 bad input, 130 interrupted. Heavy modules are imported
inside the commands, so that ``--help`` and shell completion answer at once.
"""

from __future__ import annotations

import shlex
import signal
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from teleop_sim.cli_channel import channel_app
from teleop_sim.cli_complete import (
    complete_autonomy,
    complete_delivery,
    complete_layer,
    complete_pacing,
    complete_policy,
    complete_preset,
    complete_robot,
)
from teleop_sim.cli_errors import BAD_INPUT, DONE, FAILED, INTERRUPTED, errors_shown
from teleop_sim.cli_io import say, warn
from teleop_sim.cli_machines import machines_app
from teleop_sim.cli_sweep import decide, sensitivity, sweep
from teleop_sim.core.errors import TeleopError

if TYPE_CHECKING:
    from teleop_sim.run import RunResult
    from teleop_sim.scenarios.schema import Scenario

app = typer.Typer(
    name="teleop-sim",
    help="Simulate low-bandwidth, high-latency teleoperation, with physics under it.",
    epilog="Exit codes: 0 done, 1 the task failed or ran out of time, 2 bad input, 130 interrupted.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
scenarios_app = typer.Typer(no_args_is_help=True, help="List, show and check scenarios.")
app.add_typer(scenarios_app, name="scenarios")
app.add_typer(channel_app, name="channel")
app.add_typer(machines_app, name="machines")
app.command()(sweep)
app.command()(decide)
app.command()(sensitivity)


def _complete_scenario(incomplete: str) -> list[str]:
    from teleop_sim.scenarios.library import list_scenarios

    return [name for name in list_scenarios() if name.startswith(incomplete)]


def _version(wanted: bool) -> None:
    if wanted:
        import teleop_sim

        say(f"teleop-sim {teleop_sim.__version__}")
        raise typer.Exit(DONE)


@app.callback()
def _all(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    pass


@app.command()
def run(
    scenario: Annotated[
        str, typer.Argument(help="Name or path of a scenario.", autocompletion=_complete_scenario, metavar="SCENARIO")
    ],
    preset: Annotated[
        str | None,
        typer.Option(
            help="A link by name, in place of the scenario's; see channel list.",
            metavar="NAME",
            autocompletion=complete_preset,
        ),
    ] = None,
    uplink: Annotated[str | None, typer.Option(help="Rate to the robot, such as 380bps.", metavar="RATE")] = None,
    downlink: Annotated[str | None, typer.Option(help="Rate back, such as 380kbps.", metavar="RATE")] = None,
    latency: Annotated[
        str | None, typer.Option(help="One-way delay of both directions, such as 10s.", metavar="TIME")
    ] = None,
    loss: Annotated[
        str | None, typer.Option(help="Probability that a packet is lost, in both directions.", metavar="SHARE")
    ] = None,
    header: Annotated[
        str | None,
        typer.Option(help="Header of each packet in bytes; tcp brings its own: 0.", metavar="N"),
    ] = None,
    delivery: Annotated[
        str | None,
        typer.Option(
            help="How messages get across: best_effort, stop_and_wait, selective_repeat, custody, ...",
            metavar="NAME",
            autocompletion=complete_delivery,
        ),
    ] = None,
    robot: Annotated[
        str | None,
        typer.Option(help="atlas, thormang3 or valkyrie.", metavar="NAME", autocompletion=complete_robot),
    ] = None,
    autonomy: Annotated[
        str | None,
        typer.Option(help="off, low, high or full.", metavar="LEVEL", autocompletion=complete_autonomy),
    ] = None,
    layer: Annotated[
        str | None,
        typer.Option(
            help="Who works at the door or valve: behaviour or template (people only).",
            metavar="NAME",
            autocompletion=complete_layer,
        ),
    ] = None,
    pacing: Annotated[
        str | None,
        typer.Option(help="wpi (with its fixed waits) or eager.", metavar="NAME", autocompletion=complete_pacing),
    ] = None,
    policy: Annotated[
        str | None,
        typer.Option(
            help="What the crew has agreed on: supervise, step_down, adaptive, verify or collaborate.",
            metavar="NAME",
            autocompletion=complete_policy,
        ),
    ] = None,
    team: Annotated[str | None, typer.Option(help="People at the control station, 1 to 4.", metavar="N")] = None,
    expertise: Annotated[
        str | None, typer.Option(help="A factor on their times, such as 0.7; 1 is average.", metavar="FACTOR")
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            help="Any key of a scenario file, such as disturbances.pushes.force_n=20; again for more.",
            metavar="KEY=VALUE",
        ),
    ] = None,
    seed: Annotated[str | None, typer.Option(help="Fixes all chance, such as 1.", metavar="N")] = None,
    time_limit: Annotated[
        str | None, typer.Option(help="Simulated time after which the run ends, such as 30min.", metavar="TIME")
    ] = None,
    out: Annotated[Path, typer.Option(help="Directory for the log.", metavar="DIR")] = Path("runs"),
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Show no progress.")] = False,
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


@app.command()
def report(
    log: Annotated[Path, typer.Argument(help="A log, such as runs/src-dish_seed1.mcap.", metavar="LOG")],
    out: Annotated[
        Path | None, typer.Option(help="Directory for the files; left out: beside the log.", metavar="DIR")
    ] = None,
) -> None:
    """Write a timeline picture and the table of states of LOG, and print the table."""
    with errors_shown():
        from teleop_sim.cli_show import print_report

        print_report(log, out)


@scenarios_app.command("list")
def list_command() -> None:
    """List the scenarios that come with teleop-sim."""
    with errors_shown():
        from teleop_sim.scenarios.files import list_scenarios, load_scenario

        width = max(map(len, list_scenarios()), default=0)
        for name in list_scenarios():
            say(f"{name:{width}}  {load_scenario(name).question}")


@scenarios_app.command("show")
def show_command(
    name: Annotated[
        str | None,
        typer.Argument(help="Name or path of a scenario.", autocompletion=_complete_scenario, metavar="NAME"),
    ] = None,
    schema: Annotated[bool, typer.Option("--schema", help="Print the JSON Schema of scenario files instead.")] = False,
) -> None:
    """Print a scenario's file, comments and all: a start for one's own."""
    with errors_shown():
        from teleop_sim.scenarios.library import find_scenario, list_scenarios

        if schema:
            import json

            from teleop_sim.scenarios.files import json_schema

            say(json.dumps(json_schema(), indent=2))
        elif name is None:
            warn(f"scenarios show: no name was given\n  Known: {', '.join(list_scenarios())}.")
            raise typer.Exit(BAD_INPUT)
        else:
            say(find_scenario(name).read_text(encoding="utf-8").rstrip("\n"))


@scenarios_app.command("check")
def check_command(files: Annotated[list[str], typer.Argument(help="Scenario files.", metavar="FILE...")]) -> None:
    """Check scenario files without running them; every problem is printed with its place."""
    bad = False
    with errors_shown():
        from teleop_sim.scenarios.files import load_scenario

        for file in files:
            try:
                load_scenario(file)
                say(f"{file}: ok")
            except TeleopError as error:
                bad = True
                warn(str(error))
    raise typer.Exit(BAD_INPUT if bad else DONE)
