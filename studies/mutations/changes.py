"""Small changes of a module, as a slip of the hand makes them, by its syntax tree.

A change puts one node in the place of another. What people read (docstrings, messages,
logging), types and clocks are left as they are: see `exempt`.
"""

import ast
import copy
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from hashlib import sha256

from studies.mutations.exempt import left_alone

_FLIPPED: dict[type[ast.cmpop], tuple[type[ast.cmpop], ...]] = {
    ast.Lt: (ast.LtE, ast.Gt),
    ast.LtE: (ast.Lt, ast.GtE),
    ast.Gt: (ast.GtE, ast.Lt),
    ast.GtE: (ast.Gt, ast.LtE),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}
_SWAPPED: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
    ast.BitXor: ast.BitOr,
}
_OTHER_NAME = {
    a: b
    for pair in (
        ("min", "max"),
        ("any", "all"),
        ("minimum", "maximum"),
        ("argmin", "argmax"),
        ("floor", "ceil"),
        ("cos", "sin"),
        ("inf", "nan"),
    )
    for a, b in (pair, pair[::-1])
}
_DROPPED = (ast.Raise, ast.Continue, ast.Break, ast.Delete)


@dataclass(frozen=True)
class Mutant:
    """One change of one module.

    Attributes:
        module: Path of the module in the project.
        number: Which of the module's changes.
        function: Where it stands; empty: run when the module is imported.
        lines: First and last line of the statement (of a compound one, its head).
        before: What stands there.
        after: What is put in its place.
        again: How many of the same text stand before it in the function.
    """

    module: str
    number: int
    function: str
    lines: tuple[int, int]
    before: str
    after: str
    again: int = 0

    @property
    def change(self) -> str:
        """Without the line, so that it is known again when lines move."""
        text = f"{self.module} {self.function}: {self.before} -> {self.after}"
        return f"{text} (#{self.again + 1})" if self.again else text

    def rank(self, seed: int) -> str:
        """A place among all, which nothing but its own text and the seed decides."""
        return sha256(f"{seed} {self.change}".encode()).hexdigest()


@dataclass(frozen=True)
class Edit:
    """The node `new` in the place of `old`, a field of `parent` or an entry of one."""

    parent: ast.AST
    field: str
    index: int | None
    old: ast.AST
    new: ast.AST
    function: str
    lines: tuple[int, int]

    def apply(self) -> None:
        """Makes the change in the tree."""
        if self.index is None:
            setattr(self.parent, self.field, self.new)
        else:
            getattr(self.parent, self.field)[self.index] = self.new


def mutants(module: str, source: str) -> list[Mutant]:
    """All changes of a module, in the order of its text."""
    found = []
    seen: Counter[tuple[str, ...]] = Counter()
    for k, edit in enumerate(edits(ast.parse(source))):
        what = edit.function, _text(edit.old), _text(edit.new)
        found.append(Mutant(module, k, what[0], edit.lines, *what[1:], seen[what]))
        seen[what] += 1
    return found


def mutated(source: str, number: int) -> ast.Module:
    """The module's tree with one change made."""
    tree = ast.parse(source)
    for k, edit in enumerate(edits(tree)):
        if k == number:
            edit.apply()
            return tree
    raise IndexError(f"there is no change {number}")


def edits(tree: ast.Module) -> Iterator[Edit]:
    """The changes of a tree, nothing of it changed yet."""
    yield from _below(tree, "", (1, 1))


def _text(node: ast.AST) -> str:
    text = " ".join(ast.unparse(node).split())
    return text if len(text) <= 76 else text[:73] + "..."


def _below(parent: ast.AST, function: str, lines: tuple[int, int]) -> Iterator[Edit]:
    for field, value in ast.iter_fields(parent):
        nodes = value if isinstance(value, list) else [value]
        for index, node in enumerate(nodes):
            if not isinstance(node, ast.AST) or left_alone(parent, field, node):
                continue
            inside = _function(function, node)
            here = _lines(node) if isinstance(node, ast.stmt) else lines
            place = index if isinstance(value, list) else None
            for new in _others(node, parent, field):
                ast.fix_missing_locations(ast.copy_location(new, node))
                yield Edit(parent, field, place, node, new, inside, here)
            if not isinstance(node, ast.Raise):  # of which the rest is a message
                yield from _below(node, inside, here)


def _function(function: str, node: ast.AST) -> str:
    if isinstance(node, ast.FunctionDef | ast.ClassDef):
        return f"{function}.{node.name}" if function else node.name
    return function


def _lines(node: ast.stmt) -> tuple[int, int]:
    """Of a statement, or of what a compound one asks before its body."""
    body = getattr(node, "body", None)
    last = node.end_lineno or node.lineno
    if isinstance(body, list):
        last = max(node.lineno, body[0].lineno - 1)
    return node.lineno, last


def _others(node: ast.AST, parent: ast.AST, field: str) -> Iterator[ast.AST]:
    """What may stand in the place of a node."""
    if field == "test" and isinstance(node, ast.expr) and _is_no_flip(node):
        yield ast.UnaryOp(ast.Not(), node)
    if isinstance(node, ast.stmt):
        yield from _other_statements(node)
    elif isinstance(node, ast.comprehension) and node.ifs:
        yield _with(node, ifs=node.ifs[1:])
    elif isinstance(node, ast.Constant):
        yield from _other_constants(node, parent, field)
    elif isinstance(node, ast.expr):
        yield from _other_expressions(node)


def _other_statements(node: ast.stmt) -> Iterator[ast.AST]:
    if isinstance(node, _DROPPED):
        yield ast.Pass()
    elif isinstance(node, ast.Expr):
        if isinstance(node.value, ast.Call | ast.Yield | ast.YieldFrom):
            yield ast.Pass()
    elif isinstance(node, ast.AugAssign):
        yield ast.Pass()
        yield ast.Assign([node.target], node.value)
    elif isinstance(node, ast.Assign) and isinstance(
        node.targets[0], ast.Attribute | ast.Subscript
    ):
        yield ast.Pass()


def _other_expressions(node: ast.expr) -> Iterator[ast.AST]:
    if isinstance(node, ast.Compare):
        for k, op in enumerate(node.ops):
            for other in _FLIPPED[type(op)]:
                yield _with(node, ops=[*node.ops[:k], other(), *node.ops[k + 1 :]])
    elif isinstance(node, ast.BinOp) and type(node.op) in _SWAPPED:
        yield _with(node, op=_SWAPPED[type(node.op)]())
    elif isinstance(node, ast.BoolOp):
        other_op = ast.Or() if isinstance(node.op, ast.And) else ast.And()
        yield _with(node, op=other_op)
        for k in range(len(node.values)):
            rest = node.values[:k] + node.values[k + 1 :]
            yield rest[0] if len(rest) == 1 else _with(node, values=rest)
    elif isinstance(node, ast.UnaryOp):
        if not isinstance(node.op, ast.UAdd):
            yield node.operand
    elif isinstance(node, ast.Call):
        yield from _other_calls(node)
    elif isinstance(node, ast.Attribute | ast.Name):
        name = node.attr if isinstance(node, ast.Attribute) else node.id
        if name in _OTHER_NAME:
            field = "attr" if isinstance(node, ast.Attribute) else "id"
            yield _with(node, **{field: _OTHER_NAME[name]})


def _other_calls(node: ast.Call) -> Iterator[ast.AST]:
    name = getattr(node.func, "attr", getattr(node.func, "id", ""))
    if name == "abs" and node.args:
        yield node.args[0]
    if len(node.args) > 1 and _is_numpy(node.func):  # else mostly a TypeError
        yield _with(node, args=node.args[:-1])
    for k, keyword in enumerate(node.keywords):
        if not left_alone(node, "keywords", keyword):
            yield _with(node, keywords=node.keywords[:k] + node.keywords[k + 1 :])


def _other_constants(
    node: ast.Constant, parent: ast.AST, field: str
) -> Iterator[ast.AST]:
    value = node.value
    if isinstance(value, bool):
        yield ast.Constant(not value)
    elif isinstance(value, int):
        is_index = isinstance(parent, ast.Subscript) and field == "slice"
        if is_index and value == 1:
            yield ast.Constant(0)
        else:
            yield ast.Constant(value + 1 if value < 10 else 2 * value)
    elif isinstance(value, float):
        yield ast.Constant(2.0 * value if value else 1.0)


def _is_numpy(func: ast.expr) -> bool:
    while isinstance(func, ast.Attribute):
        func = func.value
    return isinstance(func, ast.Name) and func.id == "np"


def _is_no_flip(node: ast.expr) -> bool:
    """Whether denying the node is none of its own changes."""
    if isinstance(node, ast.Compare):
        return len(node.ops) > 1
    return not isinstance(node, ast.UnaryOp)


def _with(node: ast.AST, **fields: object) -> ast.AST:
    """A copy of the node alone with other fields."""
    other = copy.copy(node)
    for name, value in fields.items():
        setattr(other, name, value)
    return other
