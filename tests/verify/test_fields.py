"""Values of a certificate: each type and range, at its borders."""

from typing import Any

import numpy as np
import pytest

from borecheck.verify.fields import (
    LONGEST_TEXT,
    Rejected,
    array,
    listed,
    number,
    record,
    text,
    whole,
)


def accepted(ask: Any, *words: Any) -> bool:
    try:
        ask(*words)
    except Rejected:
        return False
    return True


@pytest.mark.parametrize(
    ("value", "good"),
    [
        ({"a": 1, "b": 2}, True),
        ({"a": 1, "b": 2, "c": 3}, True),
        ({"a": 1}, False),
        ({"a": 1, "b": 2, "d": 3}, False),
        ([("a", 1), ("b", 2)], False),
        (None, False),
    ],
)
def test_records(value: Any, good: bool) -> None:
    assert accepted(record, value, "it", ("a", "b"), ("c",)) == good


@pytest.mark.parametrize(
    ("value", "good"),
    [([1], True), ([1, 2], True), ([], False), ([1, 2, 3], False), ((1,), False)],
)
def test_lists(value: Any, good: bool) -> None:
    assert accepted(listed, value, "it", 2, 1) == good


def test_an_empty_list_is_one_unless_some_are_asked_for() -> None:
    assert listed([], "it", 2) == []


@pytest.mark.parametrize(
    ("value", "good"),
    [
        ("", True),
        ("a" * LONGEST_TEXT, True),
        ("a" * (LONGEST_TEXT + 1), False),
        (b"a", False),
    ],
)
def test_texts(value: Any, good: bool) -> None:
    assert LONGEST_TEXT == 10_000
    assert accepted(text, value, "it") == good


@pytest.mark.parametrize(
    ("value", "good"),
    [
        (2, True),
        (4, True),
        (1, False),
        (5, False),
        (3.0, False),
        (True, False),
        ("3", False),
    ],
)
def test_whole_numbers(value: Any, good: bool) -> None:
    assert accepted(whole, value, "it", 2, 4) == good


NAN, INF = float("nan"), float("inf")


@pytest.mark.parametrize(
    ("value", "good"),
    [(0.0, True), (1, True), (2.5, True), (2.5 + 1e-12, False), (-1e-12, False)]
    + [(bad, False) for bad in (NAN, INF, -INF, True, "1", None, [1.0], 10**400)],
)
def test_numbers(value: Any, good: bool) -> None:
    assert accepted(number, value, "it", 0.0, 2.5) == good


@pytest.mark.parametrize(
    ("value", "good"),
    [
        ([[1, 2.0], [3, -4.0]], True),
        ([[5.0, -5.0]], True),
        ([[5.0, -5.1]], False),
        ([[5.1, 0.0]], False),
        ([[1, NAN]], False),
        ([[1, INF]], False),
        ([[1, True]], False),
        ([[1, "2"]], False),
        ([[1, 10**400]], False),
        ([[1, 2, 3]], False),
        ([[1], [2, 3]], False),
        ([1, 2], False),
        ([], False),
        ([[[1, 2]]], False),
        ([(1, 2)], False),
    ],
)
def test_arrays(value: Any, good: bool) -> None:
    assert accepted(array, value, "it", (None, 2), 5.0) == good
    if good:
        assert np.array_equal(array(value, "it", (None, 2), 5.0), value)


def test_rows_of_nothing_are_rows_and_no_rows_are_none() -> None:
    assert array([[], []], "it", (2, 0), 5.0).shape == (2, 0)
    with pytest.raises(Rejected, match="it: empty"):
        array([], "it", (None, 2), 5.0)
