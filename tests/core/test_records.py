"""What every record promises the log and its readers."""

import dataclasses
import re
from typing import get_type_hints

import pytest

from teleop_sim.core.records import RECORDS, Record
from teleop_sim.log.meanings import UNITS


def fields(cls: type[Record]) -> dict[str, object]:
    hints = get_type_hints(cls)
    return {f.name: hints[f.name] for f in dataclasses.fields(cls)}


def test_every_record_class_has_a_topic_of_its_own():
    declared = [cls for cls in Record.__subclasses__() if cls.__module__ == Record.__module__]
    # A second class under one topic would push the first one out.
    assert sorted(c.__name__ for c in RECORDS.values()) == sorted(c.__name__ for c in declared)
    for topic in RECORDS:
        assert re.fullmatch(r"[a-z]+/[a-z_]+", topic)


@pytest.mark.parametrize("topic", sorted(RECORDS))
def test_every_record_is_a_value_with_a_time_first_and_says_what_it_is(topic):
    cls = RECORDS[topic]
    kinds = fields(cls)
    assert next(iter(kinds)) == "t_s"
    assert cls.__doc__
    assert not cls.__doc__.startswith(f"{cls.__name__}(")  # made by dataclass, not written
    made = cls(*[0.0 if kind is float else None for kind in kinds.values()])
    assert made == dataclasses.replace(made)
    with pytest.raises(dataclasses.FrozenInstanceError):
        made.t_s = 1.0


@pytest.mark.parametrize("topic", sorted(RECORDS))
def test_every_number_with_a_dimension_names_its_unit(topic):
    floats = [name for name, kind in fields(RECORDS[topic]).items() if kind is float]
    assert [name for name in floats if not name.endswith(tuple(UNITS))] == []
