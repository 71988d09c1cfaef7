"""Every error class keeps its fields through pickle and through SimPy. New classes are found by themselves."""

import importlib
import inspect
import pickle
import pkgutil
from typing import Any, get_type_hints

import pytest
import simpy

import teleop_sim
from teleop_sim.core.errors import BadInput, Problem, TeleopError, UnknownName, unknown_name

EXAMPLES: dict[Any, Any] = {
    str: "up",
    int: 3,
    float: 2.5,
    tuple[str, ...]: ("up", "down"),
    tuple[Problem, ...]: (Problem("a.toml:1:2: seed", "'x' is not a whole number", "Give one."), Problem("b", "c")),
}
"""A value for each type that a field of an error may have."""


def subclasses(base: type) -> list[type]:
    return [base, *(c for sub in base.__subclasses__() for c in subclasses(sub))]


def error_classes() -> list[type[TeleopError]]:
    for module in pkgutil.walk_packages(teleop_sim.__path__, "teleop_sim."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)
    found = {c for c in subclasses(TeleopError) if c.__module__.startswith("teleop_sim")}
    return sorted(found, key=lambda c: c.__qualname__)


def parameters(cls: type[TeleopError]) -> list[inspect.Parameter]:
    return list(inspect.signature(cls.__init__).parameters.values())[1:]


def example(cls: type[TeleopError]) -> TeleopError:
    hints = get_type_hints(cls.__init__)
    return cls(*(EXAMPLES[hints[p.name]] for p in parameters(cls) if p.kind is p.POSITIONAL_OR_KEYWORD))


@pytest.mark.parametrize("cls", error_classes(), ids=lambda c: c.__qualname__)
def test_every_error_is_made_again_from_its_args(cls):
    error = example(cls)
    assert not [p.name for p in parameters(cls) if p.kind is p.KEYWORD_ONLY], "keyword-only fields vanish"
    for again in (type(error)(*error.args), pickle.loads(pickle.dumps(error))):
        assert type(again) is cls
        assert again.args == error.args
        assert str(again) == str(error)


@pytest.mark.parametrize("cls", error_classes(), ids=lambda c: c.__qualname__)
def test_every_error_comes_whole_through_a_failed_process(cls):
    error, env = example(cls), simpy.Environment()

    def fails():
        yield env.timeout(1.0)
        raise error

    def waits():
        try:
            yield env.process(fails())
        except cls as caught:
            return caught

    caught = env.run(env.process(waits()))
    assert type(caught) is cls
    assert caught.args == error.args
    assert str(caught) == str(error)


def test_bad_input_is_a_value_error_and_lists_every_problem_in_order():
    problems = (Problem("a", "is wrong", "Mend it."), Problem("b", "is missing"))
    error = BadInput(problems)
    assert isinstance(error, ValueError)
    assert error.problems == problems
    assert str(error) == "a: is wrong\n  Mend it.\nb: is missing"


def test_an_unknown_name_says_what_was_probably_meant_and_what_is_known():
    error = UnknownName("a.toml: robot", "valkyre", ("atlas", "valkyrie"))
    assert error.problems == (unknown_name("a.toml: robot", "valkyre", ("atlas", "valkyrie")),)
    assert "Did you mean 'valkyrie'? Known: atlas, valkyrie." in str(error)
    assert "Did you mean" not in str(UnknownName("x", "qqq", ("atlas",)))
