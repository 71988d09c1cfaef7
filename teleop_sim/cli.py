"""The command line's front door: streams, signals and the exit code; ``cli_commands`` holds the commands.

Exit codes: 0 done, 1 the task failed or ran out of time, 2 bad input, 130 interrupted. Nothing heavy is imported before
an interruption (Ctrl-C or a termination signal) can be turned into its exit code.
"""

from __future__ import annotations

import signal
import sys
from typing import NoReturn

INTERRUPTED = 130


def main() -> NoReturn:
    """Run the command line and exit."""
    try:
        if signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
            # Schedulers end a job this way: it finishes its log as after Ctrl-C.
            signal.signal(signal.SIGTERM, signal.default_int_handler)
        code = _commands()
    except KeyboardInterrupt:
        code = INTERRUPTED
    # Only the interpreter's end is left; a second Ctrl-C would print a traceback from inside it.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    sys.exit(code)


def _commands() -> int | str | None:
    from teleop_sim.cli_start import start_quickly

    start_quickly()
    from teleop_sim.cli_io import flush, prepare

    prepare()
    from teleop_sim.cli_commands import app

    code: int | str | None = 0
    try:
        app(prog_name="teleop-sim")
    except SystemExit as end:
        code = end.code
    flush()
    return code
