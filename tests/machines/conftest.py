"""What tests of machines share."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest


@pytest.fixture(scope="session")
def random_machines() -> ModuleType:
    """``random_machines.py``, which no import finds: tests are no package."""
    spec = importlib.util.spec_from_file_location("random_machines", Path(__file__).with_name("random_machines.py"))
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module
