"""`xacro.load_yaml`: plain data from a YAML file, with xacro's tags for units.

A YAML file can repeat itself by reference until no memory holds it, and its numbers can
be of any length; both end in one line.
"""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

from borecheck.robots.urdf.xacro.values import Budget, ExpressionError, Scale

MAX_YAML_BYTES = 256_000  # the largest public ones have 20,000
MAX_NODES = 50_000
MAX_SCALAR = 1_000  # letters of a number

# Tag and metres or radians per unit, as in xacro's ConstructUnits.
UNITS = {
    "!radians": 1.0,
    "!degrees": math.pi / 180.0,
    "!meters": 1.0,
    "!millimeters": 0.001,
    "!foot": 0.3048,
    "!inches": 0.0254,
}

_IN_ITSELF = object()


def parse_yaml(
    data: bytes, path: Path, evaluate: Callable[[str], Any], budget: Budget
) -> Any:
    """What a YAML file holds.

    Args:
        data: The file's content.
        path: What to call it.
        evaluate: The value of an expression behind a unit's tag.
        budget: Weighs what was read.

    Raises:
        ExpressionError: It is no YAML, too large, or no plain data; nothing that stands
            in the file is repeated.
    """
    import yaml

    if len(data) > MAX_YAML_BYTES:
        raise ExpressionError(f"{path} is larger than {MAX_YAML_BYTES // 1000} kB")
    try:
        loader = _loader(evaluate)(data)
        found = _plain(loader.get_single_data(), {})
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 1
        raise ExpressionError(f"{path}:{line}: not YAML of plain data") from None
    except (yaml.YAMLError, ValueError, TypeError, OverflowError):
        raise ExpressionError(f"{path}: not YAML of plain data") from None
    except RecursionError:
        raise ExpressionError(f"{path}: nests without end") from None
    Scale(budget).size(found)
    return found


def _loader(evaluate: Callable[[str], Any]) -> type:
    """A loader class of our own: yaml's is left as it is."""
    import yaml

    class Loader(yaml.SafeLoader):  # type: ignore[misc]
        nodes = 0

        def compose_node(self, parent: Any, index: Any) -> Any:
            self.count(1)
            return super().compose_node(parent, index)

        def count(self, nodes: int) -> None:
            self.nodes += nodes
            if self.nodes > MAX_NODES:
                raise yaml.YAMLError("too many nodes")

        def flatten_mapping(self, node: Any) -> None:
            super().flatten_mapping(node)
            self.count(len(node.value))  # merged keys, copied each time

        def construct_scalar(self, node: Any) -> Any:
            number = node.tag.endswith((":int", ":float"))
            if number and len(node.value) > MAX_SCALAR:
                raise yaml.YAMLError("too long a number")
            return super().construct_scalar(node)

    for tag, factor in UNITS.items():
        Loader.add_constructor(tag, _unit(evaluate, factor))
    return Loader


def _unit(evaluate: Callable[[str], Any], factor: float) -> Callable[..., float]:
    def construct(loader: Any, node: Any) -> float:
        return float(evaluate(loader.construct_scalar(node))) * factor

    return construct


def _plain(value: Any, made: dict[int, Any]) -> Any:
    """Lists, dictionaries, texts and numbers; dates become texts.

    What is referred to twice stays one thing (`made`); what holds itself is refused.
    """
    if isinstance(value, bytes):
        raise TypeError("bytes")
    if not isinstance(value, list | tuple | set | dict):
        is_plain = value is None or isinstance(value, bool | int | float | str)
        return value if is_plain else str(value)
    if id(value) not in made:
        made[id(value)] = _IN_ITSELF
        if isinstance(value, dict):
            pairs = ((_plain(k, made), _plain(v, made)) for k, v in value.items())
            made[id(value)] = dict(pairs)
        else:
            made[id(value)] = [_plain(item, made) for item in value]
    if made[id(value)] is _IN_ITSELF:
        raise ValueError("it holds itself")
    return made[id(value)]
