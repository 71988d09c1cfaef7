"""The commands: arguments, exit codes, progress; nothing else.

Exit codes: 0 done, 1 the task failed or ran out of time, 2 bad input, 130 interrupted. Heavy modules are imported
inside the commands, so that ``--help`` and shell completion answer at once.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from teleop_sim.cli_channel import channel_app
from teleop_sim.cli_complete import complete_scenario
from teleop_sim.cli_errors import BAD_INPUT, DONE, errors_shown
from teleop_sim.cli_io import say, warn
from teleop_sim.cli_log import log_app
from teleop_sim.cli_machines import machines_app
from teleop_sim.cli_replay import replay
from teleop_sim.cli_report import report
from teleop_sim.cli_run import run
from teleop_sim.cli_sweep import decide, sensitivity, sweep
from teleop_sim.core.errors import TeleopError

if TYPE_CHECKING:
    pass

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
app.add_typer(log_app, name="log")
app.command()(run)
app.command()(report)
app.command()(replay)
app.command()(sweep)
app.command()(decide)
app.command()(sensitivity)


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
        typer.Argument(help="Name or path of a scenario.", autocompletion=complete_scenario, metavar="NAME"),
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
