"""Expressions of xacro files, evaluated from their syntax tree.

What is not in the lists below is not evaluated: there is no lambda, no assignment, no
attribute but the methods in `methods` and the names in a namespace or a dictionary
from YAML, and so no way from a value to Python itself. Nothing is compiled or run.
"""

import ast
import warnings
from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache
from typing import Any, Protocol

from borecheck.robots.urdf.xacro.attribute import attribute_of, refuse_no_entries
from borecheck.robots.urdf.xacro.values import (
    COMPARISONS,
    OPERATORS,
    SIGNS,
    Budget,
    ExpressionError,
    Function,
    call,
    checked,
    weigh,
)

MAX_LENGTH = 20_000  # letters of an expression; the longest public ones have 500
MAX_KNOWN = 500  # letters of an expression whose tree is kept


class Names(Protocol):
    """Where names are looked up."""

    def __getitem__(self, name: str, /) -> Any:
        """The value of a name, or KeyError."""


def evaluate(text: str, names: Names, budget: Budget) -> Any:
    """The value of an expression.

    Args:
        text: A Python expression.
        names: What it may name.
        budget: The steps it may take.

    Raises:
        ExpressionError: It is not allowed, or costs too much.
        SyntaxError: It is no expression.
        Exception: Whatever its own operations raise (a division by zero).
    """
    if len(text) > MAX_LENGTH:
        raise ExpressionError(f"an expression of more than {MAX_LENGTH} letters")
    parse = _known if len(text) <= MAX_KNOWN else _parsed
    return _Evaluation(names, budget).value(parse(text.strip()))


def _parsed(text: str) -> ast.expr:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # "invalid escape sequence": not our text
        try:
            return ast.parse(text, "<expression>", "eval").body
        except (MemoryError, RecursionError):
            raise ExpressionError("the expression nests too deeply") from None


_known = lru_cache(maxsize=512)(_parsed)  # a macro's expressions come again and again


class _Scope:
    """Names of a comprehension in front of those around it."""

    def __init__(self, names: Names) -> None:
        self._own: dict[str, Any] = {}
        self._outer = names

    def __getitem__(self, name: str) -> Any:
        return self._own[name] if name in self._own else self._outer[name]

    def __setitem__(self, name: str, value: Any) -> None:
        self._own[name] = value


class _Evaluation:
    """One walk over a syntax tree."""

    def __init__(self, names: Names, budget: Budget) -> None:
        self.names = names
        self.budget = budget

    def value(self, node: ast.expr) -> Any:
        self.budget.spend()
        kind = type(node).__name__
        step = _STEPS.get(kind)
        if step is None:
            raise ExpressionError(f"{_WORDS.get(kind, kind)} is not allowed")
        return step(self, node)

    def constant(self, node: ast.Constant) -> Any:
        if isinstance(node.value, bytes) or node.value is ...:
            raise ExpressionError(f"{node.value!r} is not allowed")
        return checked(node.value, self.budget)

    def name(self, node: ast.Name) -> Any:
        if node.id.startswith("__"):
            raise ExpressionError(f"the name {node.id!r} is not allowed")
        try:
            return self.names[node.id]
        except KeyError:
            raise NameError(f"name {node.id!r} is not defined") from None

    def attribute(self, node: ast.Attribute) -> Any:
        owner, name = self.value(node.value), node.attr
        if name.startswith("_"):
            raise ExpressionError(f"the attribute {name!r} is not allowed")
        return attribute_of(owner, name)

    def subscript(self, node: ast.Subscript) -> Any:
        owner, key = self.value(node.value), self.value(node.slice)
        refuse_no_entries(owner)
        weigh(key, self.budget)
        found = owner[key]
        if isinstance(key, slice):
            checked(found, self.budget)
        return found

    def a_slice(self, node: ast.Slice) -> slice:
        parts = (node.lower, node.upper, node.step)
        return slice(*(None if p is None else self.value(p) for p in parts))

    def sign(self, node: ast.UnaryOp) -> Any:
        sign = SIGNS[type(node.op).__name__]
        return checked(sign(self.value(node.operand)), self.budget)

    def operation(self, node: ast.BinOp) -> Any:
        operator = OPERATORS.get(type(node.op).__name__)
        if operator is None:
            raise ExpressionError("the operator @ is not allowed")
        left, right = self.value(node.left), self.value(node.right)
        weigh(left, self.budget)
        weigh(right, self.budget)
        return checked(operator(left, right), self.budget)

    def boolean(self, node: ast.BoolOp) -> Any:
        stops_at = isinstance(node.op, ast.Or)
        found: Any = None
        for part in node.values:
            found = self.value(part)
            if bool(found) is stops_at:
                break
        return found

    def comparison(self, node: ast.Compare) -> bool:
        left = self.value(node.left)
        for kind, part in zip(node.ops, node.comparators, strict=True):
            right = self.value(part)
            weigh(left, self.budget)
            weigh(right, self.budget)
            if not COMPARISONS[type(kind).__name__](left, right):
                return False
            left = right
        return True

    def choice(self, node: ast.IfExp) -> Any:
        return self.value(node.body if self.value(node.test) else node.orelse)

    def a_list(self, node: ast.List) -> list[Any]:
        return self._kept(list(self._items(node.elts)))

    def a_tuple(self, node: ast.Tuple) -> tuple[Any, ...]:
        return self._kept(tuple(self._items(node.elts)))

    def a_set(self, node: ast.Set) -> set[Any]:
        return set(self._kept(tuple(self._items(node.elts))))

    def a_dict(self, node: ast.Dict) -> dict[Any, Any]:
        found: dict[Any, Any] = {}
        for key, part in zip(node.keys, node.values, strict=True):
            if key is None:
                found |= self.value(part)
            else:
                found[self.value(key)] = self.value(part)
        return self._kept(found)

    def _kept(self, value: Any) -> Any:
        return checked(value, self.budget)

    def _items(self, nodes: list[ast.expr]) -> Iterator[Any]:
        for node in nodes:
            if isinstance(node, ast.Starred):
                yield from self._each(self.value(node.value))
            else:
                yield self.value(node)

    def _each(self, value: Any) -> Iterator[Any]:
        """The entries of a collection; each costs a step."""
        refuse_no_entries(value)
        for item in value:
            self.budget.spend()
            yield item

    def call(self, node: ast.Call) -> Any:
        function = self.value(node.func)
        if not isinstance(function, Function):
            raise ExpressionError(f"{type(function).__name__} cannot be called")
        given = list(self._items(node.args))
        named: dict[str, Any] = {}
        for keyword in node.keywords:
            value = self.value(keyword.value)
            if keyword.arg is None:
                named |= {str(name): each for name, each in dict(value).items()}
            else:
                named[keyword.arg] = value
        return call(function, given, named, self.budget)

    def comprehension(self, node: Any) -> Any:
        inner = _Evaluation(_Scope(self.names), self.budget)
        found = self._kept(list(inner.produced(node, 0)))
        if isinstance(node, ast.SetComp):
            return set(found)
        return dict(found) if isinstance(node, ast.DictComp) else found

    def produced(self, node: Any, depth: int) -> Iterator[Any]:
        """What a comprehension makes, its loops from the outermost inwards."""
        if depth == len(node.generators):
            if isinstance(node, ast.DictComp):
                yield self.value(node.key), self.value(node.value)
            else:
                yield self.value(node.elt)
            return
        loop = node.generators[depth]
        for item in self._each(self.value(loop.iter)):
            self._bind(loop.target, item)
            if all(self.value(test) for test in loop.ifs):
                yield from self.produced(node, depth + 1)

    def _bind(self, target: ast.expr, value: Any) -> None:
        if isinstance(target, ast.Name):
            if target.id.startswith("_") and target.id != "_":
                raise ExpressionError(f"the name {target.id!r} is not allowed")
            assert isinstance(self.names, _Scope)  # only comprehensions bind
            self.names[target.id] = value
        elif isinstance(target, ast.Tuple | ast.List):
            parts = list(self._each(value))
            if len(parts) != len(target.elts):
                raise ValueError(f"{len(target.elts)} names for {len(parts)} values")
            for part, item in zip(target.elts, parts, strict=True):
                self._bind(part, item)
        else:
            raise ExpressionError("such a loop variable is not allowed")


_WORDS = {
    "Lambda": "lambda",
    "NamedExpr": "an assignment",
    "JoinedStr": "a formatted string",
    "Await": "await",
    "Yield": "yield",
    "YieldFrom": "yield",
    "Starred": "a star",
}

_STEPS: Mapping[str, Callable[[_Evaluation, Any], Any]] = {
    "Constant": _Evaluation.constant,
    "Name": _Evaluation.name,
    "Attribute": _Evaluation.attribute,
    "Subscript": _Evaluation.subscript,
    "Slice": _Evaluation.a_slice,
    "UnaryOp": _Evaluation.sign,
    "BinOp": _Evaluation.operation,
    "BoolOp": _Evaluation.boolean,
    "Compare": _Evaluation.comparison,
    "IfExp": _Evaluation.choice,
    "List": _Evaluation.a_list,
    "Tuple": _Evaluation.a_tuple,
    "Set": _Evaluation.a_set,
    "Dict": _Evaluation.a_dict,
    "Call": _Evaluation.call,
    "ListComp": _Evaluation.comprehension,
    "SetComp": _Evaluation.comprehension,
    "DictComp": _Evaluation.comprehension,
    "GeneratorExp": _Evaluation.comprehension,
}
