"""The scenarios that come with teleop-sim, by name. Light: shell completion uses it at every key press."""

from __future__ import annotations

from pathlib import Path

from teleop_sim.core.errors import BadInput, Problem, unknown_name

_HOME = Path(__file__).parent


def list_scenarios() -> tuple[str, ...]:
    """Names of the scenarios that come with teleop-sim, sorted."""
    return tuple(sorted(path.stem for path in _HOME.glob("*.toml")))


def find_scenario(name_or_path: str) -> Path:
    """The file of a scenario given by its name or by its path; a known name wins.

    Raises:
        BadInput: there is no such file and no such name, or it is a directory.

    """
    if name_or_path in list_scenarios():
        return _HOME / f"{name_or_path}.toml"
    path = Path(name_or_path)
    try:
        if path.is_file() or path.is_fifo():
            return path
        problem = _missing(name_or_path, path)
    except OSError as error:  # a name that is too long, a folder that may not be looked into
        problem = Problem(name_or_path, f"cannot be looked for: {error.strerror}", _known())
    raise BadInput((problem,))


def _missing(name_or_path: str, path: Path) -> Problem:
    if not name_or_path:
        return unknown_name("scenario", name_or_path, list_scenarios())
    if path.is_dir():
        return Problem(name_or_path, "is a directory", "Give a scenario file in it, or a scenario's name. " + _known())
    if path.exists():
        return Problem(name_or_path, "is not a regular file", "Save it to a .toml file first. " + _known())
    if path.suffix == ".toml" or len(path.parts) > 1:
        return Problem(name_or_path, "no such file", "Give a path to a scenario file, or a name. " + _known())
    return unknown_name("scenario", name_or_path, list_scenarios())


def _known() -> str:
    return f"Known names: {', '.join(list_scenarios())}."
