"""What is made once for a record: made again for no one, gone with the record."""

import copy
import gc
import pickle
import weakref
from dataclasses import dataclass, replace

import pytest

from borecheck.core.once import MOST, once_per_pair, once_per_record, twin


@dataclass(frozen=True, eq=False)
class Record:
    """Like meshes, robots and scenes: frozen, told apart by identity."""

    name: str


class Value:
    """What can be referred to weakly."""

    def __init__(self, *of: object) -> None:
        self.of = of


@once_per_record
def value_of(record: Record, size: float = 0.0) -> Value:
    return Value(record.name, size)


@once_per_pair
def value_of_two(first: Record, second: Record, size: float = 0.0) -> Value:
    return Value(first.name, second.name, size)


@pytest.fixture(autouse=True)
def no_collector():
    """Nothing here may wait for the collector of circles."""
    gc.collect()
    gc.disable()
    yield
    gc.enable()


def test_the_same_record_gives_the_same_value():
    a, b = Record("a"), Record("a")
    assert value_of(a) is value_of(a)
    assert value_of(a) is not value_of(b)
    assert value_of(a, 1.0) is value_of(a, 1.0) is not value_of(a)
    assert value_of(a, size=2.0).of == ("a", 2.0)
    assert value_of_two(a, b) is value_of_two(a, b) is not value_of_two(b, a)


def test_a_value_dies_with_its_record():
    a = Record("a")
    value = weakref.ref(value_of(a))
    assert value() is not None
    del a
    assert value() is None


@pytest.mark.parametrize("which", [0, 1])
def test_a_value_of_two_dies_with_either(which):
    pair = [Record("a"), Record("b")]
    value = weakref.ref(value_of_two(*pair))
    assert value() is not None
    del pair[which]
    assert value() is None


def test_many_seconds_do_not_push_each_other_out():
    """A planner makes scenes in a loop; the first one's value stays."""
    robot, scenes = Record("r"), [Record(str(k)) for k in range(100)]
    values = [value_of_two(robot, scene) for scene in scenes]
    assert all(value_of_two(robot, s) is v for s, v in zip(scenes, values, strict=True))


def test_of_further_arguments_the_newest_are_kept():
    a = Record("a")
    first = weakref.ref(value_of(a, 0.0))
    values = [value_of(a, float(k)) for k in range(1, MOST + 1)]
    assert first() is None
    assert value_of(a, float(MOST)) is values[-1]


def test_copies_that_go_elsewhere_keep_nothing():
    a = Record("a")
    value = value_of(a)
    value_of_two(a, a)
    for other in (pickle.loads(pickle.dumps(a)), copy.deepcopy(a), replace(a), twin(a)):
        assert other.name == "a"
        assert value_of(other) is not value


def test_a_value_may_hold_a_twin():
    a = Record("a")
    held = weakref.ref(a)

    @once_per_record
    def made(record: Record) -> Value:
        return Value(twin(record))

    made(a)
    del a
    assert held() is None
