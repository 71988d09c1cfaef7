"""What tests of machines share."""

import importlib.util
import shutil
import sys
from pathlib import Path
from types import ModuleType

import pytest


def _load(name: str) -> ModuleType:
    """A module beside this one, which no import finds: tests are no package."""
    spec = importlib.util.spec_from_file_location(name, Path(__file__).with_name(f"{name}.py"))
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


# Now, so that the tests here can import it.
_load("scripted_site")


@pytest.fixture(scope="session")
def dot() -> None:
    """Tests that draw pictures need Graphviz; one that lacks it fails."""
    assert shutil.which("dot"), "Graphviz draws the pictures: run make setup, or install the package graphviz"


@pytest.fixture(scope="session")
def random_machines() -> ModuleType:
    """``random_machines.py``."""
    return _load("random_machines")
