"""The keystroke-level model's own worked examples."""

from dataclasses import replace

import pytest

from teleop_sim.operators.timing import load_timing

AVERAGE = load_timing()
SKILLED = replace(AVERAGE, keystroke_s=0.20)


@pytest.mark.parametrize(
    ("acts", "time_s"),
    [
        # S. K. Card, T. P. Moran, A. Newell, Commun. ACM 23 (1980): replace one five-letter word by another, K = 0.2.
        # A line editor: line feed, S, new word, return, old word, return, return: 4 M + 15 K.
        ("MK MK KKKKK MK KKKKK MK K", 8.4),
        # A display editor: hand to the mouse, point, select, hand back, R, new word, escape: 2 M + 8 K + 2 H + P.
        ("H P K H MK KKKKK MK", 6.2),
    ],
)
def test_the_worked_examples_of_the_keystroke_level_model(acts, time_s):
    assert SKILLED.keystrokes_s(acts) == pytest.approx(time_s, abs=1e-9)


def test_the_average_typists_example():
    # A total of 10.33 s is known of a lecture's example with K = 0.28, but not its steps. With K once or six times
    # these are among the few sums that give it.
    assert AVERAGE.keystrokes_s("MMMMM PPP K") == pytest.approx(10.33, abs=1e-9)
    assert AVERAGE.keystrokes_s("MMMMM P HH KKKKKK") == pytest.approx(10.33, abs=1e-9)


def test_typing_a_command_is_a_sum_of_the_model_with_a_look_at_what_was_typed():
    typed = AVERAGE.keystrokes_s("M" + "K" * len("/RESTART") + "K")
    assert AVERAGE.type_s("/RESTART") == pytest.approx(typed + AVERAGE.verify_s)


def test_an_unknown_letter_is_no_act():
    with pytest.raises(KeyError):
        AVERAGE.keystrokes_s("MX")


def test_talk_takes_both_as_long_as_the_slower_of_saying_and_hearing():
    assert AVERAGE.talk_s(5) == pytest.approx(2.0)
    assert replace(AVERAGE, hear_per_word_s=0.6).talk_s(5) == pytest.approx(3.0)
