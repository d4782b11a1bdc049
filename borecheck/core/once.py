"""Values that are made once for a record and die with it.

The value lies in the record itself, not in a table of the process: nothing keeps a mesh
or a scene alive for its search structures, and nothing is thrown out because others
came between. A value must not hold its record, or both wait for the garbage collector;
it may hold a `twin`.
"""

from collections.abc import Callable
from functools import wraps
from typing import Any, Concatenate, ParamSpec, TypeVar
from weakref import WeakKeyDictionary

_NAME = "_kept"

P = ParamSpec("P")
R = TypeVar("R")
A = TypeVar("A")
B = TypeVar("B")

# Of values that differ in further arguments (margins) so many are kept, the newest.
MOST = 32


class _Kept(dict[str, Any]):
    """What a record keeps, by who made it; copied or pickled it is empty."""

    def __reduce__(self) -> tuple[type["_Kept"], tuple[()]]:
        return _Kept, ()


def once_per_record(
    make: Callable[Concatenate[A, P], R],
) -> Callable[Concatenate[A, P], R]:
    """Keeps what a function makes of a record in that record.

    Args:
        make: Takes a record (a dataclass without slots) and hashable arguments.
    """
    name = f"{make.__module__}.{make.__qualname__}"

    @wraps(make)
    def kept(record: A, /, *args: P.args, **kwargs: P.kwargs) -> R:
        values = _of(record).setdefault(name, {})
        return _one(
            values, (args, *kwargs.items()), lambda: make(record, *args, **kwargs)
        )

    return kept


def once_per_pair(
    make: Callable[Concatenate[A, B, P], R],
) -> Callable[Concatenate[A, B, P], R]:
    """Keeps what a function makes of two records as long as both live.

    It lies in the second, under a weak reference to the first, which must be hashable
    by identity and which the value must not hold.

    Args:
        make: Takes two records and hashable arguments.
    """
    name = f"{make.__module__}.{make.__qualname__}"

    @wraps(make)
    def kept(first: A, second: B, /, *args: P.args, **kwargs: P.kwargs) -> R:
        of_first = _of(second).setdefault(name, WeakKeyDictionary())
        values = of_first.setdefault(first, {})
        return _one(
            values,
            (args, *kwargs.items()),
            lambda: make(first, second, *args, **kwargs),
        )

    return kept


def twin(record: A) -> A:
    """The same fields as a record of its own, which keeps nothing yet.

    Of a mesh it costs no memory: the arrays are shared, those found so far included.
    """
    other = object.__new__(type(record))
    fields = {name: x for name, x in vars(record).items() if name != _NAME}
    vars(other).update(fields)
    return other


def _of(record: Any) -> _Kept:
    kept: _Kept | None = record.__dict__.get(_NAME)
    if kept is None:
        kept = record.__dict__.setdefault(_NAME, _Kept())
    return kept


def _one(values: dict[Any, R], key: Any, make: Callable[[], R]) -> R:
    """The value of a key, made if it is not there; the oldest ones go."""
    try:
        return values[key]
    except KeyError:
        made = values.setdefault(key, make())
        while len(values) > MOST:
            values.pop(next(iter(values)), None)
        return made
