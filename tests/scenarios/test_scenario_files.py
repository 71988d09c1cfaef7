"""Scenario files: what is refused, where the error points, and that a scenario survives being written and read."""

import math
import tomllib
from collections.abc import Mapping
from itertools import accumulate
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teleop_sim.channel.dark import DARK_MODELS
from teleop_sim.channel.delivery import DELIVERIES
from teleop_sim.channel.jitter import JITTERS
from teleop_sim.channel.loss import LOSS_MODELS
from teleop_sim.channel.presets import PRESETS
from teleop_sim.channel.queueing import DISCIPLINES
from teleop_sim.core.errors import BadInput
from teleop_sim.scenarios.complaints import keys_of
from teleop_sim.scenarios.files import json_schema, list_scenarios, load_scenario, read_scenario, scenario_to_toml
from teleop_sim.scenarios.links import link_problems
from teleop_sim.scenarios.names import AUTONOMY, PACINGS
from teleop_sim.scenarios.schema import Scenario

GOOD = """\
schema = 1
name = "good"
[link.up]
rate_bps = 380.0
delay_s = 10.0
[link.down]
rate_bps = 380_000
delay_s = 10
"""


def problems(text: str, **overrides: object) -> list[str]:
    """``where: what`` of every problem of a text."""
    with pytest.raises(BadInput) as refused:
        read_scenario(text, "a.toml", "a", {key.replace("__", "."): value for key, value in overrides.items()})
    return [f"{p.where}: {p.what}" for p in refused.value.problems]


def one_problem(text: str) -> str:
    found = problems(text)
    assert len(found) == 1, found
    return found[0]


@pytest.mark.parametrize("name", list_scenarios())
def test_every_shipped_scenario_loads_and_is_called_after_its_file(name: str) -> None:
    scenario = load_scenario(name)
    assert scenario.name == name
    assert scenario.question
    assert read_scenario(scenario_to_toml(scenario), "again") == scenario


@pytest.mark.parametrize("name", list_scenarios())
def test_every_number_of_a_shipped_scenario_has_a_source(name: str) -> None:
    link = load_scenario(name).link
    for direction in (link.up, link.down):
        assert "assumed" not in (direction.rate_source, direction.delay_source, direction.header_source)


def test_src_dish_is_the_paper_s_hard_case() -> None:
    scenario = load_scenario("src-dish")
    # WPI paper, section VII: at most 380 bit/s, 20 s there and back; SRC task 1 ends after 30 min.
    assert (scenario.link.up.rate_bps, scenario.link.up.delay_s) == (380.0, 10.0)
    assert (scenario.link.down.rate_bps, scenario.link.down.delay_s) == (380e3, 10.0)
    assert (scenario.time_limit_s, scenario.pacing, scenario.autonomy) == (1800.0, "wpi", "full")


def test_a_file_is_called_after_its_stem_unless_it_gives_a_name(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(GOOD.replace('name = "good"\n', ""))
    assert load_scenario(file).name == "mine"
    file.write_text(GOOD)
    assert load_scenario(file).name == "good"


@pytest.mark.parametrize(
    ("line", "error"),
    [
        ("rate_bps = 0", "a.toml:4:1: link.up.rate_bps: 0 is not above 0"),
        ("rate_bps = -380.0", "a.toml:4:1: link.up.rate_bps: -380.0 is not above 0"),
        ("rate_bps = nan", "a.toml:4:1: link.up.rate_bps: nan is not finite"),
        ("rate_bps = inf", "a.toml:4:1: link.up.rate_bps: inf is not finite"),
        ('rate_bps = "380"', "a.toml:4:1: link.up.rate_bps: '380' is not a number"),
        ("rate_bps = true", "a.toml:4:1: link.up.rate_bps: true is not a number"),
        ("rate_bps = 1979-05-27", "a.toml:4:1: link.up.rate_bps: 1979-05-27 is not a number"),
        ("rate_bsp = 3", "a.toml:4:1: link.up.rate_bsp: unknown key"),
        ("rate_bps = ", "a.toml:4:12: is not TOML: invalid value"),
        ("rate_bps = 380.0\nheader_bytes = 1.5", "a.toml:5:1: link.up.header_bytes: 1.5 is not a whole number"),
        ("rate_bps = 380.0\nrate_bps = 64.0", "a.toml:5:1: link.up.rate_bps: was given before, at line 4"),
        ("rate_bps = 380.0\nblackouts = 60", "a.toml:5:1: link.up.blackouts: 60 is not a list"),
        (
            "rate_bps = 380.0\nblackouts = [[1, 2],\n  [60, 30]]",
            "a.toml:6:3: link.up.blackouts[1]: a blackout from 60.0 s to 30.0 s ends no later than it starts",
        ),
        (
            "rate_bps = 380.0\nblackouts = [[1, 5], [4, inf]]",
            "a.toml:5:1: link.up.blackouts: [4.0, inf] starts before [1.0, 5.0] has ended",
        ),
        (
            "rate_bps = 380.0\nblackouts = [[-1, 5]]",
            "a.toml:5:14: link.up.blackouts[0]: a blackout cannot start at -1.0 s",
        ),
    ],
)
def test_a_wrong_line_of_the_link_is_named_with_line_and_column(line: str, error: str) -> None:
    found = problems(GOOD.replace("rate_bps = 380.0", line))
    assert error in found
    # An unknown key leaves the one that was meant missing.
    assert [f for f in found if f != error and "rate_bps: is missing" not in f] == []


@pytest.mark.parametrize(
    ("line", "error"),
    [
        ('robot = "valkyri"', "a.toml:1:1: robot: unknown name 'valkyri'"),
        ('task = "src-dich"', "a.toml:1:1: task: unknown name 'src-dich'"),
        ('pacing = "wip"', "a.toml:1:1: pacing: unknown name 'wip'"),
        ('autonomy = "ful"', "a.toml:1:1: autonomy: unknown name 'ful'"),
        ("autonomy = 3", "a.toml:1:1: autonomy: 3 is not a text"),
        ("time_limit_s = 0", "a.toml:1:1: time_limit_s: 0 is not above 0"),
        ("time_limit_s = nan", "a.toml:1:1: time_limit_s: nan is not finite"),
        ("seed = -1", "a.toml:1:1: seed: -1 is below 0"),
        ("seed = 1.0", "a.toml:1:1: seed: 1.0 is not a whole number"),
        ("world = 3", "a.toml:1:1: world: 3 is not a table"),
        ("world = { layout = 6 }", "a.toml:1:11: world.layout: 6 is no layout of the world"),
        ('operator.policy = "supervize"', "a.toml:1:10: operator.policy: unknown name 'supervize'"),
        ('"sead" = 1', "a.toml:1:1: sead: unknown key"),
    ],
)
def test_a_wrong_first_line_is_named(line: str, error: str) -> None:
    assert one_problem(f"{line}\n{GOOD}") == error


def test_a_schema_of_the_future_is_refused() -> None:
    assert one_problem(GOOD.replace("schema = 1", "schema = 2")) == "a.toml:1:1: schema: 2 is not 1"


def test_a_name_that_could_leave_the_output_directory_is_refused() -> None:
    assert one_problem(GOOD.replace('"good"', '"../good"')) == "a.toml:2:1: name: '../good' is not a name"


def test_unknown_names_and_keys_come_with_what_was_probably_meant() -> None:
    with pytest.raises(BadInput) as refused:
        read_scenario(f'robot = "valkyri"\nquestoin = ""\n{GOOD}', "a.toml")
    hints = [p.hint for p in refused.value.problems]
    assert hints[0].startswith("Did you mean 'valkyrie'?")
    assert hints[1].startswith("Did you mean 'question'?")


def test_all_problems_of_a_file_come_at_once_in_its_order() -> None:
    text = (
        f'seed = -1\nrobot = "x"\nfoo = 1\n{GOOD.replace("rate_bps = 380.0", "rate_bps = 0").replace("= 10.0", "= -1")}'
    )
    lines = [int(line.split(":")[1]) for line in problems(text)]
    assert lines == [1, 2, 3, 7, 8]


def test_mistakes_of_toml_do_not_hide_the_others() -> None:
    found = problems(f"seed = \nrobot = x\n{GOOD}".replace("robot", "\nrobot").replace("= 10.0", "= -1"))
    assert [line.split(": ")[0] for line in found] == ["a.toml:1:8", "a.toml:3:9", "a.toml:8:1"]


def test_an_open_bracket_is_not_blamed_on_the_lines_after_it() -> None:
    assert one_problem(GOOD.replace("delay_s = 10.0", "blackouts = [[1, 2]")).startswith("a.toml:6:1: is not TOML")


def test_columns_count_characters_not_bytes() -> None:
    assert one_problem(f'question = {{ "ä" = 1 }}\n{GOOD}').startswith("a.toml:1:1: question")
    assert one_problem(f'"ääää" = 1\n{GOOD}').startswith("a.toml:1:1: ääää")
    assert one_problem(
        f"operator = {{ policy = 'supervise', 'ää' = 1, x = 2 }}\n{GOOD}".replace(", x = 2", "")
    ).startswith("a.toml:1:36: operator.ää")


def test_what_cannot_be_a_scenario_file(tmp_path: Path) -> None:
    latin = tmp_path / "latin.toml"
    latin.write_bytes(b'schema = 1\nquestion = "\xe4"\n')
    for given_path, message in (
        (latin, f"{latin}:2:13: byte 0xe4 is not UTF-8"),
        (tmp_path, f"{tmp_path}: is a directory"),
        (tmp_path / "none.toml", f"{tmp_path / 'none.toml'}: no such file"),
        ("src-dich", "scenario: unknown name 'src-dich'\n  Did you mean 'src-dish'?"),
        ("a\0b", "scenario: unknown name 'a\\x00b'"),
        ("x" * 5000, f"{'x' * 5000}: cannot be looked for: File name too long"),
        ("", "scenario: unknown name ''"),
    ):
        with pytest.raises(BadInput) as refused:
            load_scenario(given_path)
        assert str(refused.value).startswith(message)


def test_a_byte_order_mark_and_windows_line_ends_are_read(tmp_path: Path) -> None:
    file = tmp_path / "dos.toml"
    file.write_bytes(b"\xef\xbb\xbf" + GOOD.replace("\n", "\r\n").encode())
    assert load_scenario(file).name == "good"


def test_an_override_takes_the_file_s_place_and_says_so() -> None:
    scenario = read_scenario(GOOD, "a.toml", "", {"link.up.rate_bps": 64.0}, {"link.up.rate_bps": "--uplink"})
    assert (scenario.link.up.rate_bps, scenario.link.up.rate_source) == (64.0, "given: --uplink")
    assert scenario.link.down.rate_bps == 380e3


def test_a_wrong_override_is_named_by_its_label() -> None:
    with pytest.raises(BadInput) as refused:
        read_scenario(GOOD, "a.toml", "", {"link.up.delay_s": -1.0, "pacing": "x"}, {"link.up.delay_s": "--latency"})
    assert {p.where for p in refused.value.problems} == {"--latency", "pacing"}


def test_an_override_of_nothing_that_exists_is_refused() -> None:
    assert problems(GOOD, link__up__rat_bps=3.0) == ["link.up.rat_bps: unknown key"]
    assert problems(GOOD, lnk__up=3.0) == ["lnk.up: unknown key"]


def tables(models: Mapping[str, type[Any]]) -> st.SearchStrategy[dict[str, object]]:
    """A table that names one of the models, with the keys of its example (a delivery needs none)."""
    return st.sampled_from([{"model": name, **getattr(made, "example", {})} for name, made in models.items()])


TIMES = st.lists(st.floats(1e-3, 1e4), min_size=1, max_size=6).map(lambda gaps: [0.0, *accumulate(gaps)])

EXTRAS: dict[str, st.SearchStrategy[Any]] = {
    "on_dark": st.sampled_from(["pause", "restart", "lose"]),
    "on_dark_flight": st.sampled_from(["arrive", "lose"]),
    "rates": TIMES.map(lambda times: [[t, 100.0 + t] for t in times]),
    "delays": TIMES.map(lambda times: [[t, 1.0 + t] for t in times]),
    "loss": tables(LOSS_MODELS),
    "loss_source": st.text(),
    "jitter": tables(JITTERS),
    "reorder": st.booleans(),
    "queue_limit": st.integers(0, 9),
    "discipline": st.sampled_from(sorted(DISCIPLINES)),
    "drop": st.sampled_from(["tail", "head"]),
    "priorities": st.dictionaries(st.sampled_from(["mirror", "request", "ack"]), st.integers(-3, 3)),
    "budget_bits": st.integers(20_000, 10**9),
    "mtu_bytes": st.sampled_from([0, 1501, 9000]),
    "delivery": tables(DELIVERIES),
    "by_state": st.just([{"state": "STATE_END", "rate_bps": 64.0}]),
    "alternating": st.just(
        [{"for_s": 60.0, "rate_bps": 1e6, "delay_s": 0.05}, {"for_s": 9.0, "rate_bps": 1e3, "delay_s": 1}]
    ),
}


@st.composite
def windows(draw: st.DrawFn) -> list[list[float]]:
    times = list(accumulate(draw(st.lists(st.floats(1e-3, 1e4), max_size=6))))
    found = [list(pair) for pair in zip(times[::2], times[1::2], strict=False)]
    endless: bool = draw(st.booleans())
    if found and endless:
        found[-1][1] = math.inf
    return found


@st.composite
def directions(draw: st.DrawFn, whole: bool) -> dict[str, object]:
    needed = {
        "rate_bps": draw(st.floats(min_value=1e-3, max_value=1e12)),
        "delay_s": draw(st.floats(min_value=0.0, max_value=1e6)),
    }
    keys: set[str] = draw(st.sets(st.sampled_from(sorted(EXTRAS)), max_size=4))
    # What contradicts is refused; see the tests of links.
    keys -= {"rates", "delays", "by_state"} if "alternating" in keys or not whole else set()
    keys -= {"by_state"} if "rates" in keys else set()
    dark = {"dark": draw(tables(DARK_MODELS))} if draw(st.booleans()) else {"blackouts": draw(windows())}
    plain = {"delay_source": draw(st.text()), "header_bytes": draw(st.integers(0, 1500))}
    return (needed if whole else {}) | dark | plain | {key: draw(EXTRAS[key]) for key in sorted(keys)}


@st.composite
def links(draw: st.DrawFn) -> dict[str, object]:
    preset = draw(st.one_of(st.none(), st.sampled_from(sorted(PRESETS))))
    made: dict[str, object] = {"clock": draw(st.sampled_from(["wall", "simulated"]))}
    made |= {} if preset is None else {"preset": preset}
    made |= draw(st.sampled_from([{}, {"delivery": "custody"}, {"delivery": {"model": "stop_and_wait", "tries": 3}}]))
    return made | {name: draw(directions(preset is None)) for name in ("up", "down")}


@st.composite
def scenarios(draw: st.DrawFn) -> Scenario:
    return Scenario.model_validate(
        {
            "schema": 1,
            "name": draw(st.from_regex(r"\A[A-Za-z0-9][A-Za-z0-9._-]{0,20}\Z")),
            "question": draw(st.text()),
            "seed": draw(st.integers(0, 2**63 - 1)),
            "autonomy": draw(st.sampled_from(sorted(AUTONOMY))),
            "pacing": draw(st.sampled_from(sorted(PACINGS))),
            "time_limit_s": draw(st.floats(min_value=1e-6, max_value=1e4)),
            "world": {"layout": draw(st.sampled_from(["random", 1, 2, 3, 4, 5]))},
            "link": draw(links()),
        }
    )


@given(scenarios())
@settings(max_examples=100, deadline=None)
def test_a_scenario_survives_being_written_and_read(scenario: Scenario) -> None:
    text = scenario_to_toml(scenario)
    # Whether a link can deliver is asked of any scenario, not of its text.
    if asked := link_problems(scenario):
        with pytest.raises(BadInput) as refused:
            read_scenario(text, "again")
        assert {(p.what, p.hint) for p in refused.value.problems} == {(p.what, p.hint) for p in asked}
        return
    again = read_scenario(text, "again")
    assert again == scenario
    assert scenario_to_toml(again) == text


_KEYS = st.sampled_from(
    ["schema", "seed", "link", "up", "link.up", "rate_bps", "blackouts", "world", "autonomy", "", "x"]
)
_VALUES = st.sampled_from(
    ["1", "-1", "nan", "inf", '"a"', "[]", "[[1, 2], [2, nan]]", "{}", "{ up = 3 }", "[[", '"', "07:32:00"]
)
_LINES = st.one_of(
    st.builds("{} = {}".format, _KEYS, _VALUES),
    st.builds("[{}]".format, _KEYS),
    st.builds("[[{}]]".format, _KEYS),
    st.text(),
)


@given(st.one_of(st.text(), st.lists(_LINES, max_size=12).map("\n".join)))
@settings(max_examples=300, deadline=None)
def test_junk_gives_bad_input_and_nothing_else(text: str) -> None:
    with pytest.raises(BadInput) as refused:
        read_scenario(text, "junk.toml")
    assert all(p.where.startswith("junk.toml:") and p.what for p in refused.value.problems)


@given(st.binary())
@settings(max_examples=60, deadline=None)
def test_junk_files_give_bad_input_and_nothing_else(tmp_path_factory: pytest.TempPathFactory, data: bytes) -> None:
    file = tmp_path_factory.getbasetemp() / "junk.toml"
    file.write_bytes(data)
    with pytest.raises(BadInput):
        load_scenario(file)


@given(
    st.dictionaries(
        st.sampled_from(["seed", "link", "link.up", "link.up.rate_bps", "x", "", ".."]),
        st.one_of(st.none(), st.text(), st.floats(), st.integers(), st.lists(st.floats())),
        min_size=1,
    )
)
@settings(max_examples=100, deadline=None)
def test_junk_overrides_give_a_scenario_or_bad_input(overrides: dict[str, object]) -> None:
    try:
        scenario = read_scenario(GOOD, "a.toml", "", overrides)
    except BadInput:
        return
    assert isinstance(scenario, Scenario)


@pytest.mark.parametrize("junk", ["x = " + "[" * 5000, "a." * 3000 + "b = 1", "seed = " + "9" * 5000, "x = {" * 2000])
def test_hostile_text_is_refused(junk: str) -> None:
    assert problems(junk)


def test_the_json_schema_knows_every_key_and_wants_no_name() -> None:
    schema = json_schema()
    assert set(schema["properties"]) == set(keys_of(Scenario))
    assert set(schema["required"]) == {"schema", "link"}
    assert schema["additionalProperties"] is False
    assert schema["properties"]["autonomy"]["enum"] == ["off", "low", "high", "full"]


def test_canonical_toml_says_everything_so_that_a_log_repeats_its_run() -> None:
    written = tomllib.loads(scenario_to_toml(read_scenario(GOOD, "a.toml")))
    # A calm world has no word for its disturbances, nor a robot as it is for its hands, nor a dish for a door.
    assert set(written) == set(keys_of(Scenario)) - {"disturbances", "hand", "layer", "door", "valve", "onboard"}
    assert written["link"]["up"]["blackouts"] == []


def test_a_number_with_too_many_digits_is_found_by_its_line():
    with pytest.raises(BadInput, match=r"a\.toml:2:1: is not TOML: a whole number has too many digits"):
        read_scenario(f"schema = 1\nseed = {'9' * 5000}\n", "a.toml", "a")
