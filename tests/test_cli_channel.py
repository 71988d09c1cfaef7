"""``teleop-sim channel``: presets listed and shown, messages traced, input refused."""

import csv
import io
from pathlib import Path

import pytest
from typer.testing import CliRunner

from teleop_sim.channel.delivery import DELIVERIES
from teleop_sim.channel.presets import PRESETS
from teleop_sim.channel.trace import HEADER
from teleop_sim.cli_commands import app

MESSAGES = "time,topic,bytes,priority\n0,walk,18,0\n0.5,stop,1,5\n20,confirm,3,1\n"


def call(*args: str, given: str | bytes = "") -> tuple[int, str, str]:
    result = CliRunner().invoke(app, ("channel", *args), prog_name="teleop-sim", input=given)
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, result.stdout, result.stderr


def rows_of(*args: str, given: str = MESSAGES) -> list[dict[str, str]]:
    code, out, err = call("trace", "-", *args, given=given)
    assert (code, err) == (0, "")
    return list(csv.DictReader(io.StringIO(out)))


def refusal(*args: str, given: str | bytes = MESSAGES) -> str:
    code, out, err = call("trace", "-", *args, given=given)
    assert (code, out) == (2, "")
    return err


def test_list_has_a_line_for_each_preset() -> None:
    code, out, err = call("list")
    assert (code, err) == (0, "")
    head, *lines = out.splitlines()
    assert head.split() == ["name", "uplink", "downlink", "delay", "source"]
    assert [line.split()[0] for line in lines] == list(PRESETS)
    assert all(made.source in line for line, made in zip(lines, PRESETS.values(), strict=True))


@pytest.mark.parametrize("name", sorted(PRESETS))
def test_show_tells_everything_about_a_preset(name: str) -> None:
    code, out, err = call("show", name)
    assert (code, err) == (0, "")
    made = PRESETS[name]
    for words in (made.title, made.source, made.status, made.clock, made.on_dark, made.note, *made.assumed):
        assert words in out
    assert all(f"{way}:\n" in out for way in made.ways)
    assert all(f"{fact}: {value}" in out for fact, value in made.facts.items())


def test_show_guesses_what_was_meant() -> None:
    code, out, err = call("show", "drc-final")
    assert (code, out) == (2, "")
    assert "Did you mean 'drc-finals-2015'?" in err


def test_a_trace_over_a_preset_is_csv_in_closed_form(tmp_path: Path) -> None:
    file = tmp_path / "m.csv"
    file.write_text(MESSAGES)
    code, out, err = call("trace", str(file), "--preset", "src-task1-hardest")
    assert (code, err) == (0, "")
    assert out.splitlines() == [
        ",".join(HEADER),
        # 8 * 18 / 64 = 2.25 s and 10 s; the stop waits for it, 8 / 64 = 0.125 s.
        "0,walk,18,0,12.25,delivered,,0,2.25,0,10,0",
        "1,stop,1,0.5,12.375,delivered,,1.75,0.125,0,10,0",
        "2,confirm,3,20,30.375,delivered,,0,0.375,0,10,0",
    ]


def test_a_link_of_options_is_the_preset_of_the_same_figures() -> None:
    assert rows_of("--uplink", "64bps", "--latency", "10s") == rows_of("--preset", "src-task1-hardest")
    assert rows_of("--preset", "moon", "--uplink", "64bps", "--latency", "10s") == rows_of(
        "--uplink", "64bps", "--latency", "10s"
    )


def test_options_do_what_they_say() -> None:
    plain = ("--uplink", "8bps")
    assert [row["arrived_s"] for row in rows_of(*plain)] == ["18", "19", "23"]
    assert rows_of(*plain, "--header", "2")[0]["serialisation_s"] == "20"
    assert rows_of(*plain, "--blackout", "3s-13s")[0]["blackout_s"] == "10"
    assert rows_of(*plain, "--blackout", "3s-")[0]["arrived_s"] == ""
    assert rows_of(*plain, "--mtu", "6", "--discipline", "priority")[1]["arrived_s"] == "7"
    assert rows_of(*plain, "--budget", "150")[1]["reason"] == "budget"
    assert {row["reason"] for row in rows_of(*plain, "--loss", "0.999999")} == {"lost"}
    assert rows_of(*plain, "--until", "18500ms")[1]["outcome"] == "in_flight"
    assert rows_of("--downlink", "8bps") == rows_of(*plain)
    assert rows_of("--preset", "src-task1-hardest", "--real-time-factor", "0.5")[0]["arrived_s"] == "6.125"
    late = float(rows_of(*plain, "--jitter", "2s")[0]["propagation_s"])
    assert 0.0 < late < 2.0


def test_a_delivery_uses_the_way_back_and_tells_what_it_repeats() -> None:
    alone = "time,topic,bytes\n0,walk,18\n"
    both = ("--uplink", "64bps", "--downlink", "50kbps", "--latency", "10s")
    # Frames of 18 + 3 bytes; 12.25 s are those of 18.
    arrived = {name: rows_of(*both, "--delivery", name, given=alone)[0]["arrived_s"] for name in DELIVERIES}
    assert arrived["best_effort"] == "12.25"
    assert {arrived[name] for name in ("stop_and_wait", "selective_repeat", "custody")} == {"12.625"}
    # A SYN of 40 bytes, 5 s up; its answer, 6.4 ms down, comes at 25.0064 s. Till then four more SYN have gone out.
    # Then the ACK, 5 s, and the data, 58 bytes in 7.25 s.
    assert arrived["tcp"] == "47.2564"
    lossy = rows_of(*both, "--delivery", "stop_and_wait", "--loss", "0.5", "--seed", "1")
    assert {row["outcome"] for row in lossy} == {"delivered"}
    assert max(float(row["retransmission_s"]) for row in lossy) > 20.0


def test_a_delivery_over_a_preset_takes_both_of_its_ways() -> None:
    rows = rows_of("--preset", "src-task1-hardest", "--delivery", "custody", "--blackout", "1s-100s")
    assert [row["outcome"] for row in rows] == ["delivered"] * 3
    assert float(rows[0]["blackout_s"]) == pytest.approx(99.0)
    assert rows_of("--preset", "src-task1-hardest", "--delivery", "best_effort") == rows_of(
        "--preset", "src-task1-hardest"
    )


def test_a_delivery_that_never_gives_up_ends_with_the_trace() -> None:
    (row,) = rows_of(
        "--preset", "src-task1-hardest", "--budget", "100", "--delivery", "custody", given="time,topic,bytes\n0,a,18\n"
    )
    assert (row["outcome"], row["arrived_s"]) == ("in_flight", "")


def test_the_seed_decides() -> None:
    many = "time,topic,bytes\n" + "".join(f"{10 * i},a,5\n" for i in range(40))
    asked = ("--preset", "drc-finals-2015", "--direction", "burst")
    assert rows_of(*asked, "--seed", "4", given=many) == rows_of(*asked, "--seed", "4", given=many)
    assert rows_of(*asked, "--seed", "4", given=many) != rows_of(*asked, "--seed", "5", given=many)


@pytest.mark.parametrize(
    ("args", "words"),
    [
        ((), "no link was given"),
        (("--latency", "10s"), "no link was given"),
        (("--preset", "mon"), "--preset: unknown name 'mon'"),
        (("--uplink", "0bps"), "--uplink: a rate of 0bps delivers nothing"),
        (("--uplink", "8"), "--uplink: '8' is not understood"),
        (("--uplink", "8bps", "--direction", "down"), "--direction: no rate was given for down"),
        (("--uplink", "8bps", "--direction", "burst"), "--direction: unknown name 'burst'"),
        (("--preset", "moon", "--direction", "burst"), "--direction: unknown name 'burst'"),
        (("--uplink", "8bps", "--discipline", "prority"), "Did you mean 'priority'?"),
        (("--uplink", "8bps", "--loss", "2"), "--loss: '2' is no probability"),
        (("--uplink", "8bps", "--loss", "nan"), "--loss: 'nan' is no probability"),
        (("--uplink", "8bps", "--seed", "-1"), "--seed: '-1' is no whole number"),
        (("--uplink", "8bps", "--blackout", "5s"), "--blackout: '5s' is no stretch of time"),
        (("--uplink", "8bps", "--blackout", "9s-5s"), "--blackout: it ends at 5.0 s"),
        (("--uplink", "8bps", "--blackout", "0s-"), "it is dark all the time"),
        (("--uplink", "8bps", "--header", "10", "--budget", "80"), "--budget: a budget of 80"),
        (("--uplink", "8bps", "--header", "10", "--budget", "87"), "below one header and one byte (88 bits)"),
        (("--uplink", "8bps", "--header", "4", "--blackout", "4s-", "--on-dark", "lose"), "the longest light, 4 s"),
        (("--uplink", "8bps", "--real-time-factor", "0.16"), "--real-time-factor: it needs a preset"),
        (
            ("--preset", "src-task1-default", "--real-time-factor", "0"),
            "real_time_factor: a factor of 0.0 is impossible",
        ),
        (("--uplink", "8bps", "--plot", "a.gif"), "--plot: a.gif is no .svg or .png"),
        (("--uplink", "8bps", "--until", "0s"), "--until"),
        (("--uplink", "8bps", "--downlink", "8bps", "--delivery", "tpc"), "Did you mean 'tcp'?"),
        (("--uplink", "8bps", "--delivery", "tcp"), "--downlink: tcp is acknowledged, and there is no way back"),
        (("--downlink", "8bps", "--delivery", "custody"), "--uplink: custody is acknowledged"),
        (("--preset", "moon", "--header", "40", "--delivery", "tcp"), "would be charged twice"),
        (("--preset", "moon", "--mtu", "40", "--delivery", "tcp"), "fragments of 40 bytes hold no TCP segment"),
    ],
)
def test_bad_options_are_refused(args: tuple[str, ...], words: str) -> None:
    err = refusal(*args)
    assert words in err
    assert "internal error" not in err


def test_problems_of_list_and_options_are_told_together() -> None:
    err = refusal("--preset", "mon", "--latency", "x", given="time,topic,bytes\n-1,a,2\n0,a,x\n")
    for where in ("-:2: time", "-:3: bytes", "--preset: ", "--latency: "):
        assert where in err


def test_lists_that_cannot_be_read_are_refused(tmp_path: Path) -> None:
    assert "-:2: not UTF-8" in refusal("--uplink", "8bps", given=b"time,topic,bytes\n0,\xff,1\n")
    code, _, err = call("trace", str(tmp_path / "none.csv"), "--uplink", "8bps")
    assert (code, err) == (2, f"{tmp_path / 'none.csv'}: No such file or directory\n")
    assert call("trace", str(tmp_path), "--uplink", "8bps")[0] == 2


@pytest.mark.parametrize("suffix", ["svg", "png"])
def test_a_plot_is_written_and_csv_only_if_asked_for(tmp_path: Path, suffix: str) -> None:
    picture = tmp_path / f"a.{suffix}"
    asked = ("trace", "-", "--uplink", "64bps", "--plot", str(picture))
    assert call(*asked, given=MESSAGES) == (0, f"wrote {picture}\n", "")
    assert picture.stat().st_size > 1000
    assert call(*asked, "--csv", given=MESSAGES)[1].startswith("id,topic,")


def test_an_empty_list_gives_the_header() -> None:
    assert call("trace", "-", "--uplink", "8bps", given="time,topic,bytes\n") == (0, ",".join(HEADER) + "\n", "")


def test_a_latency_beside_a_preset_replaces_delays_in_turn_too(tmp_path: Path) -> None:
    """1000 bytes in a good minute and in a bad one: 8 ms and 80 ms, then 10 s both."""
    (tmp_path / "m.csv").write_text("time,topic,bytes,priority\n10,m,1000,0\n70,m,1000,0\n")
    code, out, _ = call("trace", str(tmp_path / "m.csv"), "--preset", "drc-trials-2013", "--latency", "10s")
    arrived = [float(line.split(",")[4]) for line in out.splitlines()[1:]]
    assert (code, arrived) == (0, pytest.approx([20.008, 80.08], abs=1e-9))
