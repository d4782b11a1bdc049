"""Expressions of xacro files against their evaluator: a grammar, and known escapes.

    python -m studies.hostile_expressions [--count 100000] [--seed 1]

Each is evaluated as in a file, under an audit hook (`watched`): nothing may be
imported, run or opened beyond one folder, the value must be plain data, and each may
take 2 s.
Exit status 1 if anything of that happens.
"""

import argparse
import io
import random
import sys
import tempfile
from contextlib import redirect_stderr
from pathlib import Path
from typing import Any

from studies.watched import Tally, Watch, peak_bytes, timed, watching

MAX_SECONDS = 2.0
MAX_BYTES = 1_000_000_000

ESCAPES = (
    "(lambda: ().__class__.__base__.__subclasses__())()",
    "[c for c in ().__class__.__base__.__subclasses__() if c.__name__ == 'Popen']",
    "__import__('os').system('id > PWNED')",
    "(lambda f: f(f))(lambda f: f(f))",
    "'{0.__class__.__mro__}'.format(1)",
    "'{0.__class__}'.format_map(dict(a=1))",
    "str.format('{0.__init__.__globals__}', xacro)",
    "xacro.load_yaml.__globals__['os'].system('id')",
    "math.sin.__self__.__loader__.load_module('os')",
    "getattr(1, '__class__')",
    "eval('1')",
    "exec('import os')",
    "open('/etc/passwd').read()",
    "python.type(1).mro()",
    "python.vars(xacro)",
    "[x for x in (1).__class__.__mro__][1].__subclasses__()",
    "(x for x in [1]).gi_frame.f_back.f_globals",
    "[y := 1, y]",
    "list(map(lambda x: x, [1]))",
    "map.__call__(str, [1])",
    "xacro.load_yaml('/etc/passwd')",
    "xacro.load_yaml('../secret.yaml')",
    "load_yaml('link.yaml')",
    "xacro.load_yaml('own.yaml')",
    "xacro.load_yaml('bomb.yaml')",
    "str(xacro.load_yaml('bomb.yaml'))",
    "xacro.message(open)",
    "dict(a=1).__class__",
    "own.a.__class__",
    "own['__class__']",
    "own.pop.__globals__",
    "''.join(['x'] * 10**9)",
    "'%999999999d' % 1",
    "'%*d' % (10**9, 1)",
    "'%(a)s' % dict(a='x' * 10**6)",
    "9**9**9**9",
    "1 << 10**12",
    "(2**7999) ** 2",
    "'a' * 10**12",
    "[[[0] * 10**6] * 10**6] * 10**6",
    "[0 for a in range(10**6) for b in range(10**6)]",
    "sum(range(10**6) for i in range(10**6))",
    "list(map(list, [range(10**6)] * 1000))",
    "'x'.replace('', 'y' * 10**6).replace('', 'z' * 10**6)",
    "'x'.ljust(10**12)",
    "math.factorial(10**7)",
    "math.comb(10**9, 10**8)",
    "math.perm(10**6)",
    "math.prod([2**7000] * 10**6)",
    "round(10**300, -10**10)",
    "{2**61 - 1: 1 for i in range(10**5)}",
    "set([i * (2**61 - 1) for i in range(10**5)])",
    "sorted([0] * 10**6, key=lambda x: -x)",
    "max(range(10**6), key=xacro.load_yaml)",
    "[xs, xs] == [xs, xs]",
    "(" * 300 + "1" + ")" * 300,
    "-" * 15000 + "1",
    "not " * 3000 + "1",
    "1" + "+1" * 9000,
    "1" * 10000,
    "[" * 150 + "]" * 150,
    "\uff45val('1')",
    "().\uff3f\uff3fclass\uff3f\uff3f",
    "f'{().__class__}'",
    "b'x'",
    "...",
    "await x",
    "(yield)",
    "x @ x",
    "*x",
    "print_location()",
    "xacro.fatal('stop')",
    "xacro.tokenize('a' * 10**5, sep=']|(a+)+$[')",
    "xacro.arg('nothing')",
    "xacro.abs_filename('/etc/passwd')",
    "python.range(10**30)",
    "python.isinstance(1, xacro)",
    "\0",
    "",
    "import os",
    "a; b",
    "x.y.z",
    "math.__dict__",
    "xacro['load_yaml']",
    "python['type']",
)

WARM_UP = ("math.sin(x) + é", "xacro.error(1)", "xacro.load_yaml('/x')", "(", "x.y")
WARM_UP += ("xacro.load_yaml('own.yaml')", "xacro.load_yaml('bomb.yaml')", "2**9**9")

NAMES = (
    *("x", "text", "xs", "own", "math.pi", "pi", "True", "None", "_", "_x", "__x"),
    *("python.len", "math.sin", "xacro.dotify", "str", "int", "list", "dict", "map"),
    *("python.sorted", "min", "max", "round", "python.type", "python.filter", "sum"),
    *("xacro.load_yaml", "python.zip", "python.enumerate", "range", "python.range"),
)
VALUES = ("0", "1", "-1", "2.5", "1e308", "10**9", "2**7000", "'a'", "''", "'%s'", "[]")
VALUES += ("(1, 2)", "{}", "'own.yaml'", "'link.yaml'", "'/etc/passwd'", "'a b c'")
ATTRIBUTES = ("split", "join", "replace", "format", "get", "items", "pop", "append")
ATTRIBUTES += ("__class__", "__globals__", "_x", "a", "real", "mro", "gi_frame", "keys")
ATTRIBUTES += ("count", "zfill", "format_map", "encode", "update", "index", "center")
OPERATORS = ("+", "-", "*", "/", "//", "%", "**", "<<", ">>", "|", "&", "^", "@")
COMPARISONS = ("==", "!=", "<", ">=", "in", "not in", "is", "is not")


def expression(rng: random.Random, depth: int = 4) -> str:
    """A random expression: mostly of the grammar, with escapes as its leaves."""
    if depth == 0 or rng.random() < 0.15:
        kinds = (VALUES, NAMES, ESCAPES) if rng.random() < 0.1 else (VALUES, NAMES)
        return rng.choice(rng.choice(kinds))
    return rng.choice(_FORMS)(rng, depth - 1)


def _binary(rng: random.Random, depth: int) -> str:
    symbol = rng.choice(OPERATORS)
    return f"({expression(rng, depth)} {symbol} {expression(rng, depth)})"


def _comparison(rng: random.Random, depth: int) -> str:
    symbol = rng.choice((*COMPARISONS, "and", "or"))
    return f"({expression(rng, depth)} {symbol} {expression(rng, depth)})"


def _call(rng: random.Random, depth: int) -> str:
    given = [expression(rng, depth) for _ in range(rng.randint(0, 3))]
    if rng.random() < 0.1:
        given.append(f"key={expression(rng, depth)}")
    if rng.random() < 0.1:
        given.append(rng.choice(("*xs", "**own", "sep=text")))
    return f"{rng.choice(NAMES)}({', '.join(given)})"


def _method(rng: random.Random, depth: int) -> str:
    given = ", ".join(expression(rng, depth) for _ in range(rng.randint(0, 2)))
    call = f"({given})" if rng.random() < 0.7 else ""
    return f"({expression(rng, depth)}).{rng.choice(ATTRIBUTES)}{call}"


def _subscript(rng: random.Random, depth: int) -> str:
    key = expression(rng, depth)
    key = rng.choice((key, f"{key}:", f":{key}", f"::{key}"))
    return f"({expression(rng, depth)})[{key}]"


def _comprehension(rng: random.Random, depth: int) -> str:
    start, end = rng.choice(("[]", "()", ("{", "}")))
    loops = "".join(
        f" for {rng.choice(('i', 'j', '_', 'i, j', '__i'))} in {expression(rng, depth)}"
        for _ in range(rng.randint(1, 2))
    )
    test = f" if {expression(rng, depth)}" if rng.random() < 0.3 else ""
    return f"{start}{rng.choice((expression(rng, depth), 'i'))}{loops}{test}{end}"


def _collection(rng: random.Random, depth: int) -> str:
    items = ", ".join(expression(rng, depth) for _ in range(rng.randint(0, 3)))
    start, end = rng.choice(("[]", "()", ("{", "}")))
    return f"{start}{items}{end}"


def _choice(rng: random.Random, depth: int) -> str:
    a, b, c = (expression(rng, depth) for _ in range(3))
    return f"({a} if {b} else {c})"


def _broken(rng: random.Random, depth: int) -> str:
    """An expression with a few letters changed."""
    text = list(expression(rng, depth))
    for _ in range(rng.randint(1, 3)):
        at = rng.randrange(len(text) + 1)
        text[at : at + rng.randint(0, 2)] = rng.choice("()[]{}.,:_*'\"\\ =@lambda0é\0")
    return "".join(text)


_FORMS = (_binary, _binary, _comparison, _call, _call, _method, _subscript)
_FORMS += (_comprehension, _collection, _choice, _broken)


def yaml_bomb() -> str:
    """30 lists, each of nine times the one before."""
    lines = ["b0: &b0 [x, x]"]
    for i in range(1, 30):
        lines.append(f"b{i}: &b{i} [{', '.join([f'*b{i - 1}'] * 9)}]")
    return "\n".join(lines) + "\n"


class Bench:
    """A folder with a few files, and names, in which expressions are evaluated."""

    def __init__(self, folder: Path) -> None:
        inside = folder / "inside"
        inside.mkdir()
        (folder / "secret.yaml").write_text("a: 1\n")
        (inside / "own.yaml").write_text("a: 1\nb: [1, 2]\nc: {d: text}\n")
        (inside / "bomb.yaml").write_text(yaml_bomb())
        (inside / "link.yaml").symlink_to("/etc/passwd")
        self.main = inside / "main.xacro"
        self.main.write_text("<robot/>")
        self.folder = str(inside.resolve())

    def evaluate(self, text: str) -> Any:
        """The value of an expression as a file would get it."""
        import xacro

        from borecheck.robots.urdf.reach import NO_ROOTS, reach_of
        from borecheck.robots.urdf.xacro.hooks import held
        from borecheck.robots.urdf.xacro.run import Run

        run = Run(self.main, NO_ROOTS, reach_of(self.main.parent, NO_ROOTS))
        run.files.append(self.main)
        with held(xacro, run):
            xacro.init_stacks(str(self.main))
            xacro.substitution_args_context["arg"] = {"given": "1"}
            symbols = xacro.Table(xacro._global_symbols)
            for name, value in self._properties(xacro):
                symbols._setitem(name, value, unevaluated=False)
            return xacro.safe_eval(text, symbols)

    @staticmethod
    def _properties(xacro: Any) -> list[tuple[str, Any]]:
        own = xacro.YamlListWrapper.wrap({"a": 1, "b": [1, 2], "c": {"d": "text"}})
        return [("x", 1.5), ("text", "a b"), ("xs", [1, 2, [3]]), ("own", own)]


def is_plain(value: Any, depth: int = 0) -> bool:
    """Whether a value is data all through, or one of our own functions."""
    from borecheck.robots.urdf.xacro.values import Function, Namespace

    kinds = (bool, int, float, complex, str, type(None), range, slice)
    if depth > 60 or isinstance(value, (*kinds, Function, Namespace)):
        return True
    if isinstance(value, dict):
        return all(is_plain(v, depth + 1) for pair in value.items() for v in pair)
    if isinstance(value, list | tuple | set | frozenset):
        return all(is_plain(v, depth + 1) for v in list(value)[:1000])
    return False


def outcome_of(bench: Bench, text: str) -> str:
    """How an expression ends: with a value, or refused."""
    try:
        value = bench.evaluate(text)
    except Exception as error:  # noqa: BLE001  an expression may raise anything
        return f"refused ({type(error).__name__})" if not str(error) else "refused"
    return "a value" if is_plain(value) else f"NO PLAIN VALUE {type(value)}"


def run(count: int, seed: int, folder: Path) -> Tally:
    """Evaluates the known escapes and random expressions.

    Args:
        count: How many.
        seed: Of the random ones.
        folder: Where to put the files they may read.
    """
    rng = random.Random(seed)
    bench, tally = Bench(folder), Tally()
    with redirect_stderr(io.StringIO()):
        for warm in WARM_UP:
            outcome_of(bench, warm)  # what is imported on demand is imported now
    for number in range(count):
        text = ESCAPES[number] if number < len(ESCAPES) else expression(rng)
        noise = io.StringIO()
        with watching(Watch((bench.folder,))) as watch, redirect_stderr(noise):
            outcome, seconds = timed(lambda text=text: outcome_of(bench, text))
        tally.add(outcome, seconds, text)
        tally.problems += [f"{text!r:.200}: {seen}" for seen in watch.seen]
        if outcome.startswith("NO PLAIN"):
            tally.problems.append(f"{text!r:.200}: {outcome}")
        if seconds > MAX_SECONDS:
            tally.problems.append(f"{text!r:.200}: {seconds:.1f} s")
    return tally


def main() -> int:
    """Runs the study; 1 if anything happened that must not."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        tally = run(asked.count, asked.seed, Path(folder))
    for problem in tally.problems[:50]:
        print(problem)
    peak = peak_bytes()
    counts = ", ".join(f"{n} {name}" for name, n in sorted(tally.counts.items()))
    print(f"slowest: {tally.slowest}")
    print(
        f"{asked.count} expressions (seed {asked.seed}): {counts}; "
        f"{len(tally.problems)} imports, files opened outside, programs run or values "
        f"beyond data; at most {tally.seconds:.2f} s and {peak / 1e6:.0f} MB"
    )
    return 1 if tally.problems or peak > MAX_BYTES else 0


if __name__ == "__main__":
    sys.exit(main())
