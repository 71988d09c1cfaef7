"""Whatever ends a command early, as a message and an exit code."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

import typer

from teleop_sim.cli_io import warn
from teleop_sim.core.errors import TeleopError

DONE, FAILED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130


@contextmanager
def errors_shown() -> Iterator[None]:
    """Turn whatever ends a command early into a message and an exit code."""
    code = BAD_INPUT
    try:
        yield
    except typer.Exit:
        raise
    except TeleopError as error:
        warn(str(error))
    except UnicodeDecodeError as error:
        warn(f"not UTF-8: {error}")
    except OSError as error:
        warn(f"{error.filename or 'standard output'}: {error.strerror or error}")
    except MemoryError:
        warn("out of memory")
    except KeyboardInterrupt:
        warn("interrupted")
        code = INTERRUPTED
    except Exception as error:
        if _came_of_interruption(error):
            warn("interrupted")
            raise typer.Exit(INTERRUPTED) from None
        if os.environ.get("TELEOP_SIM_DEBUG"):
            raise
        what = f"{type(error).__name__}: {error}"
        warn(f"internal error: {what}\n  The fault is teleop-sim's. TELEOP_SIM_DEBUG=1 shows where it is.")
    else:
        return
    raise typer.Exit(code)


def _came_of_interruption(error: BaseException | None) -> bool:
    """A compiled module that is interrupted while it is imported turns that into an ImportError of its own."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None
