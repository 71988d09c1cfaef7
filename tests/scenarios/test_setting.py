"""Changes by dotted key: where they land, what they say of themselves, and what is refused."""

import copy
import math
from collections.abc import Mapping
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from teleop_sim.channel.loss import Bernoulli, GilbertElliott
from teleop_sim.core.errors import BadInput
from teleop_sim.scenarios.files import read_scenario
from teleop_sim.scenarios.link_schema import MODELS, Link, LinkDirection
from teleop_sim.scenarios.schema import Scenario
from teleop_sim.scenarios.setting import attempted, changed, read_setting, spread

GOOD: dict[str, Any] = {
    "schema": 1,
    "name": "good",
    "link": {"up": {"rate_bps": 380.0, "delay_s": 10.0}, "down": {"rate_bps": 380_000, "delay_s": 10}},
}
TEXT = """\
schema = 1
name = "good"
[link.up]
rate_bps = 380.0
delay_s = 10.0
[link.down]
rate_bps = 380_000
delay_s = 10
"""


def refused(changes: Mapping[str, object], tables: Mapping[str, Any] = GOOD) -> list[str]:
    with pytest.raises(BadInput) as error:
        changed(tables, changes)
    return [str(p).split("\n")[0] for p in error.value.problems]


def up(changes: Mapping[str, object]) -> LinkDirection:
    return Scenario.model_validate(changed(GOOD, changes)).link.up


def test_a_change_lands_at_its_key_and_the_tables_given_stay_as_they_were() -> None:
    before = copy.deepcopy(GOOD)
    made = changed(GOOD, {"link.up.rate_bps": 64.0, "operator.expertise": 2.0, "autonomy": "low"})
    assert made["link"]["up"] == {"rate_bps": 64.0, "rate_source": "given: override", "delay_s": 10.0}
    assert made["operator"] == {"expertise": 2.0, "expertise_source": "given: override"}
    assert made["autonomy"] == "low"
    assert before == GOOD


def test_what_is_changed_says_by_what() -> None:
    made = changed(GOOD, {"link.delay_s": 1.0}, {"link.delay_s": "--set link.delay_s"})
    assert {made["link"][way]["delay_source"] for way in ("up", "down")} == {"given: --set link.delay_s"}


def test_a_key_of_a_direction_given_to_the_link_means_both() -> None:
    assert spread({"link.delay_s": 3, "link.heartbeat_s": 5}) == {
        "link.up.delay_s": 3,
        "link.down.delay_s": 3,
        "link.heartbeat_s": 5,
    }
    both = spread({"link.loss.p": 0.1})
    assert list(both) == ["link.up.loss.p", "link.down.loss.p"]
    # What the link has itself is its own.
    assert spread({"link.delivery": "tcp"}) == {"link.delivery": "tcp"}


def test_a_probability_alone_is_a_bernoulli_loss() -> None:
    assert up({"link.up.loss.p": 0.05}).loss == Bernoulli(0.05)
    assert up({"link.up.loss.p": 0.05}).loss_source == "given: override"
    # The first model that has all keys, in any order of them.
    for keys in (("p_enter", "p_leave"), ("p_leave", "p_enter")):
        values = {"p_enter": 0.02, "p_leave": 0.25}
        assert up({f"link.up.loss.{key}": values[key] for key in keys}).loss == GilbertElliott(0.02, 0.25)


def test_a_model_that_is_there_stays_the_model() -> None:
    tables = changed(GOOD, {"link.up.loss": {"model": "gilbert_elliott", "p_enter": 0.02, "p_leave": 0.25}})
    made = Scenario.model_validate(changed(tables, {"link.up.loss.p_leave": 0.5}))
    assert made.link.up.loss == GilbertElliott(0.02, 0.5)
    named = changed(GOOD, {"link.delivery": "tcp"})
    assert changed(named, {"link.delivery.window": 8})["link"]["delivery"] == {"model": "tcp", "window": 8}


def test_every_key_whose_value_is_a_model_is_known() -> None:
    def modelled(part: type[Any]) -> set[str]:
        schema = part.model_json_schema()["properties"]
        return {key for key, value in schema.items() if '"model": {"const"' in str(value).replace("'", '"')}

    assert modelled(Link) | modelled(LinkDirection) == set(MODELS)


def test_places_in_lists_count_from_zero() -> None:
    tables = changed(GOOD, {"link.up.by_state": [{"state": "STATE_END", "rate_bps": 1e3}]})
    made = changed(tables, {"link.up.by_state[0].rate_bps": 64.0})
    assert made["link"]["up"]["by_state"][0] == {
        "state": "STATE_END",
        "rate_bps": 64.0,
        "rate_source": "given: override",
    }
    assert refused({"link.up.by_state[1].rate_bps": 64.0}, tables)[0].startswith(
        "link.up.by_state[1].rate_bps: there is no [1] in link.up.by_state, which is [{'state': 'STATE_END'"
    )


@pytest.mark.parametrize(
    ("key", "said"),
    [
        ("name.x", "name.x: name is 'good', not a table"),
        ("link.up.rate_bps.x", "link.up.rate_bps.x: link.up.rate_bps is 380.0, not a table"),
        ("link[0].x", "link[0].x: there is no [0] in link, which is {'up': {'rate_bps': 380.0, 'delay_s':..."),
        ("", ": is no key"),
        ("..", "..: is no key"),
    ],
)
def test_a_key_that_leads_nowhere_is_refused(key: str, said: str) -> None:
    assert refused({key: 1}) == [said]
    with pytest.raises(BadInput) as error:
        read_scenario(TEXT, "a.toml", "", {key: 1})
    assert said in str(error.value)


def test_what_can_be_changed_is_beside_what_cannot() -> None:
    made, problems = attempted(GOOD, {"name.x": 1, "seed": 7})
    assert (made["seed"], made["name"], len(problems)) == (7, "good", 1)


def test_all_that_is_wrong_with_changes_and_file_comes_at_once() -> None:
    with pytest.raises(BadInput) as error:
        read_scenario(TEXT, "a.toml", "", {"name.x": 1, "link.up.rate_bsp": 3.0, "robot": "x"})
    assert [p.where for p in error.value.problems] == ["name.x", "robot", "link.up.rate_bsp"]
    assert error.value.problems[2].hint.startswith("Did you mean 'rate_bps'?")


KEYS = st.sampled_from(
    ["seed", "autonomy", "link.up.rate_bps", "link.up.loss.p", "world.clutter", "operator.expertise"]
)


@given(st.dictionaries(KEYS, st.integers(), min_size=1))
def test_the_order_of_changes_does_not_matter(changes: dict[str, int]) -> None:
    backwards = dict(reversed(changes.items()))
    assert changed(GOOD, changes) == changed(GOOD, backwards)


@pytest.mark.parametrize(
    ("text", "key", "value"),
    [
        ("link.up.rate_bps=64bps", "link.up.rate_bps", 64.0),
        ("link.up.rate_bps=4kbps", "link.up.rate_bps", 4000.0),
        ("link.up.rate_bps=64", "link.up.rate_bps", 64),
        ("time_limit_s=30min", "time_limit_s", 1800.0),
        ("link.up.blackouts=[[1, inf]]", "link.up.blackouts", [[1, math.inf]]),
        ("world.floor_friction=[0.2,0.2]", "world.floor_friction", [0.2, 0.2]),
        ("world.layout=random", "world.layout", "random"),
        ("world.layout=3", "world.layout", 3),
        ("robot = thormang3", "robot", "thormang3"),
        ('robot="atlas"', "robot", "atlas"),
        ("link.delivery=selective_repeat", "link.delivery", "selective_repeat"),
        ('link.up.loss={ model = "none" }', "link.up.loss", {"model": "none"}),
        ("question=Does a = b?", "question", "Does a = b?"),
        ("link.up.reorder=true", "link.up.reorder", True),
        # Only keys say what a unit may be; a key that does not exist is told by the schema.
        ("link.up.rate_bsp=64bps", "link.up.rate_bsp", "64bps"),
        ("seed=1\nrobot=2", "seed", "1\nrobot=2"),
    ],
)
def test_a_setting_is_read_as_people_write_it(text: str, key: str, value: object) -> None:
    assert read_setting(text) == (key, value)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("link.up.rate_bps", "--set: 'link.up.rate_bps' sets nothing"),
        ("=3", "--set: '=3' sets nothing"),
        ("", "--set: '' sets nothing"),
        ("seed=", "--set seed: has no value"),
        ("world.clutter=[2", "--set world.clutter: '[2' is no value"),
        ("seed=" + "[" * 5000, "--set seed: '" + "[" * 36 + "... is no value"),
        ("link.up.rate_bps=64parsecs", "--set link.up.rate_bps: '64parsecs' is not understood"),
        ("link.up.delay_s=soon", "--set link.up.delay_s: 'soon' is not understood"),
    ],
)
def test_a_setting_that_says_nothing_is_refused(text: str, said: str) -> None:
    with pytest.raises(BadInput) as error:
        read_setting(text)
    assert str(error.value).split("\n")[0] == said
    assert error.value.problems[0].hint


@given(st.text(), st.text())
def test_any_setting_is_read_or_refused(key: str, value: str) -> None:
    try:
        found, _ = read_setting(f"{key}={value}")
    except BadInput:
        return
    assert found == key.partition("=")[0].strip()
