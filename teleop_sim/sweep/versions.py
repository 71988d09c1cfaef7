"""What a result depends on beside the plan: versions, and this program's own files."""

from __future__ import annotations

import subprocess  # git is asked for its state, with fixed arguments
import sys
from functools import cache
from hashlib import blake2b
from importlib import metadata
from pathlib import Path
from typing import Final

LIBRARIES: Final = (
    "teleop-sim",
    "casadi",
    "coal",
    "mcap",
    "mujoco",
    "numba",
    "numpy",
    "pin",
    "pillow",
    "protobuf",
    "scipy",
    "simpy",
)
"""Whose version can change a byte of a log."""

_DATA: Final = (".csv", ".json", ".py", ".toml")


@cache
def versions() -> dict[str, str]:
    """Name to version: of Python, of the libraries that can change a byte, and ``code``, a digest of our own files."""
    found = {"python": ".".join(map(str, sys.version_info[:3]))}
    for name in LIBRARIES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "unknown"
    return found | {"code": code_digest()}


@cache
def code_digest() -> str:
    """Of the program's modules and data, in the order of their names: 16 hexadecimal digits."""
    root = Path(__file__).resolve().parent.parent
    digest = blake2b(digest_size=8)
    files = (path for folder in _folders(root) for path in folder.iterdir() if path.suffix in _DATA and path.is_file())
    for name, path in sorted((path.relative_to(root).as_posix(), path) for path in files):
        data = path.read_bytes()
        digest.update(f"{name} {len(data)}\n".encode() + data)
    return digest.hexdigest()


def _folders(root: Path) -> list[Path]:
    """The package's folders, those behind links too; Python's own caches are none."""
    found = [root]
    for folder in found:
        found += [p for p in folder.iterdir() if p.is_dir() and p.name != "__pycache__"]
    return found


@cache
def git_state() -> str:
    """Commit of the program's own repository, with ``+changes`` if files differ; empty if it is in none."""
    root = Path(__file__).resolve().parent.parent.parent
    try:
        commit = _git(root, "rev-parse", "HEAD")
        return commit + ("+changes" if _git(root, "status", "--porcelain", "--untracked-files=no") else "")
    except (OSError, subprocess.CalledProcessError, subprocess.TimeoutExpired):
        return ""


def _git(root: Path, *arguments: str) -> str:
    # An installed package may lie inside somebody else's repository.
    command = ["git", "-C", str(root), *arguments]
    if not (root / ".git").exists():
        raise OSError("no repository of its own")
    return subprocess.run(command, capture_output=True, check=True, text=True, timeout=10).stdout.strip()  # noqa: S603
