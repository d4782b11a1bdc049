"""Expressions: Python's own value where they are allowed, else refused."""

import math

import pytest

from borecheck.robots.urdf.xacro import names
from borecheck.robots.urdf.xacro.expression import evaluate
from borecheck.robots.urdf.xacro.values import (
    MAX_BITS,
    Budget,
    ExpressionError,
    Function,
)
from studies import hostile_expressions

OWN = {"x": 2.5, "n": 3, "text": "a b,c", "xs": [3, 1, 2], "own": {"a": {"b": 1}}}
PYTHON = {"python": None, "math": math, **vars(math), **OWN}


def value(text, **more):
    budget = Budget()
    yaml = {
        name: Function(name, str) for name in ("load_yaml", "abs_filename", "dotify")
    }
    known = names.global_names(budget, yaml, lambda _: None)
    return evaluate(text, {**known, **OWN, **more}, budget)


@pytest.mark.parametrize(
    "text",
    [
        "1 + 2*n - x/4 // 1 % 3",
        "-2**2 + ~n + (n << 2) - (n >> 1) + (n ^ 1 | 4 & 6)",
        "1 < n <= 3 != 4",
        "n == 3 and not x > 5 or 'never'",
        "0 or '' or 'last'",
        "'a' if n > 2 else 'b'",
        "text.split(',')[0].upper() + 'x' * n",
        "' '.join([str(i) for i in xs if i > 1])",
        "[i * j for i in xs for j in (1, 2) if i != j]",
        "{k: v for k, v in dict(a=1, b=2).items()}['b']",
        "max(i for i in xs)",
        "xs[::-1] + xs[1:] + [xs[-1]]",
        "own['a']['b'] + own.get('z', 5) + len(list(own.keys()))",
        "sorted(xs, reverse=True)[0] + max(xs) - min(1, n) + round(2.567, 1)",
        "max(['aa', 'b'], key=len)",
        "int('12') + float('1e3') + len(text) + bool(0)",
        "list(map(float, '1 2 3'.split()))",
        "list(range(2, 9, 3))",
        "(1, 2)[0] in [1] and 'b' in text and 5 not in xs",
        "math.degrees(math.pi) + radians(90) + sin(0.5) + atan2(1, 2) + pi",
        "'%.3f and %s, %d %%' % (x, text, n)",
        "None is None and x is not None",
        "[*xs, *(7, 8)]",
        "text.replace('a', 'b').startswith('b')",
    ],
)
def test_what_xacro_files_use_has_the_value_that_python_gives(text):
    expected = eval(text, {**PYTHON}, {})
    assert value(text) == expected
    assert type(value(text)) is type(expected)


def test_names_behind_python():
    assert value("python.isinstance(xs, list) and not python.isinstance(n, str)")
    assert value("python.isinstance(n, (int, str)) and python.type(n) == int")
    assert value("list(python.zip(xs, python.sorted(xs)))") == [(3, 1), (1, 2), (2, 3)]
    assert value("python.sum(python.filter(None, [0, 4]))") == 4
    assert value("[i for i, _ in python.enumerate(xs)]") == [0, 1, 2]


def test_a_list_can_be_walked_through_by_pop():
    levels = ["1", "2"]
    assert value("int(levels.pop(0)) + len(levels)", levels=levels) == 2


@pytest.mark.parametrize(
    "text",
    [
        "(lambda: 1)()",
        "().__class__",
        "xs.__len__()",
        "own.items.__self__",
        "__import__('os')",
        "().\uff3f\uff3fclass\uff3f\uff3f",
        "'{0}'.format(1)",
        "'{a}'.format_map(own)",
        "f'{n}'",
        "(n := 1)",
        "xs.append(1)",
        "text.encode()",
        "math.__dict__",
        "math['sin']",
        "b'x'",
        "...",
        "x @ x",
        "'%*d' % (9, 1)",
        "'%(a)s' % own",
        "'%9999d' % 1",
        "[i for __i in xs]",
        "n.real",
        "sin.call",
        "python.kind",
        "str(1)()",
    ],
)
def test_what_could_lead_out_is_refused(text):
    with pytest.raises((ExpressionError, NameError, SyntaxError)):
        value(text)


@pytest.mark.parametrize("name", ["open", "eval", "exec", "getattr", "vars", "print"])
def test_python_is_not_among_the_names(name):
    with pytest.raises(NameError, match=name):
        value(f"{name}('x')")


@pytest.mark.parametrize(
    "text",
    [
        "9**9**9",
        "1 << 10**9",
        f"2**{MAX_BITS - 1} * 4",
        "'a' * 10**9",
        "[0] * 10**9",
        "math.factorial(10**6)",
        "math.comb(10**6, 10**5)",
        "math.prod([2**7000] * 100)",
        "round(5, -10**9)",
        "'x'.ljust(10**9)",
        "'x'.replace('', 'y' * 10**5).replace('', 'z' * 10**5)",
        "('y' * 10**5).join([''] * 1000)",
        "list(map(list, [range(10**6)] * 1000))",
        "[0 for a in range(10**6) for b in range(10**6)]",
        "python.set([i * (2**61 - 1) for i in range(10**4)])",
        "[" * 200 + "]" * 200,
        "1" + "+1" * 20000,
    ],
)
def test_what_could_fill_the_machine_is_refused(text):
    with pytest.raises((ExpressionError, ValueError, SyntaxError)):
        value(text)


def test_a_list_of_lists_of_lists_is_weighed_whole():
    with pytest.raises(ExpressionError, match="larger"):
        value("[[a, a, a, a], [a, a, a, a]]", a=["x" * 50_000])


def test_hostile_expressions_reach_nothing(tmp_path):
    tally = hostile_expressions.run(300, 7, tmp_path)
    assert tally.problems == []
    assert tally.counts["a value"] > 20
    assert tally.counts["refused"] > 100
