"""The study of mutations itself: what it changes, what it leaves, what it notices.

`python -m studies.mutations` asks hundreds; here a handful, in this process.
"""

import ast
from types import SimpleNamespace

import pytest

from studies.mutations import judge
from studies.mutations.__main__ import (
    KERNEL_TESTS,
    State,
    confirm,
    files_for,
    recorded,
    sample,
    sources,
    who_noticed_before,
)
from studies.mutations.changes import Mutant, mutants, mutated
from studies.mutations.exempt import EQUIVALENT, KERNELS
from studies.mutations.judge import PROJECT, KnownTest, reaching

VERDICT = "borecheck/contact/verdict.py"
PLAN = "borecheck/plans/needle_plan.py"


def changes(text):
    return {(m.before, m.after) for m in mutants("m.py", text)}


@pytest.mark.parametrize(
    ("text", "before", "after"),
    [
        ("x = a < b", "a < b", "a <= b"),
        ("x = a < b", "a < b", "a > b"),
        ("x = a == b", "a == b", "a != b"),
        ("x = a + b", "a + b", "a - b"),
        ("x = a and b", "a and b", "a or b"),
        ("x = a and b", "a and b", "b"),
        ("x = not a", "not a", "a"),
        ("x = -a", "-a", "a"),
        ("x = a if b else c", "b", "not b"),
        ("if a:\n    b()", "a", "not a"),
        ("x = min(a, b)", "min", "max"),
        ("x = abs(a)", "abs(a)", "a"),
        ("x = np.floor(a)", "np.floor", "np.ceil"),
        ("x = True", "True", "False"),
        ("x = 0.5", "0.5", "1.0"),
        ("x = 3", "3", "4"),
        ("x = a[0]", "0", "1"),
        ("x = a[1]", "1", "0"),
        ("a.add(b)", "a.add(b)", "pass"),
        ("a += b", "a += b", "pass"),
        ("a += b", "a += b", "a = b"),
        ("raise A('b')", "raise A('b')", "pass"),
        ("x = f(a, b=c)", "f(a, b=c)", "f(a)"),
        ("x = np.diff(a, b)", "np.diff(a, b)", "np.diff(a)"),
        ("x = [a for a in b if c]", "for a in b if c", "for a in b"),
    ],
)
def test_each_kind_of_slip(text, before, after):
    assert (before, after) in changes(text)


@pytest.mark.parametrize(
    "text",
    [
        '"""1 + 1"""',
        "import a",
        "raise A(f'{1 + 1}', -b)",
        "x = f'{1 + 1}'",
        "_log.info('a', 1)",
        "start = time.perf_counter()",
        "Array = NDArray[np.float64]",
        "Kind = A | B",
        "def f(a: A[0] | B) -> C[1]:\n    return a",
        "if TYPE_CHECKING:\n    a = 1",
        "def __repr__(self):\n    return 1 + 1",
        "x = f(dtype=int)",
    ],
)
def test_what_nobody_rests_on_is_left(text):
    assert all(before.startswith("raise") for before, _ in changes(text))


def test_a_mutant_differs_in_one_place_and_can_be_compiled():
    text = (PROJECT / VERDICT).read_text()
    plain = ast.unparse(ast.parse(text)).splitlines()
    for k in range(len(mutants(VERDICT, text))):
        tree = mutated(text, k)
        compile(tree, VERDICT, "exec")
        lines = ast.unparse(tree).splitlines()
        assert lines != plain
        assert len(set(lines) ^ set(plain)) <= 4
    with pytest.raises(IndexError):
        mutated(text, 10**6)


def test_a_handful_is_noticed_by_what_worst_of_must_say():
    """Contact beats unknown beats clear, and nothing examined is unknown."""
    text = (PROJECT / VERDICT).read_text()
    noticed = []
    for mutant in mutants(VERDICT, text):
        if mutant.function != "worst_of":
            continue
        room: dict[str, object] = {"__name__": "mutant"}
        exec(compile(mutated(text, mutant.number), VERDICT, "exec"), room)
        worst_of = room["worst_of"]
        said = [
            worst_of(list(words.split()))
            for words in ("clear unknown contact", "clear unknown", "clear", "")
        ]
        noticed.append(said != ["contact", "unknown", "clear", "unknown"])
    assert len(noticed) >= 2
    assert all(noticed)


def test_the_sample_is_seeded_and_few_of_it_are_kernels():
    texts = sources()
    assert {name.split("/")[1] for name in texts} == {
        "contact",
        "motion",
        "verify",
        "plans",
    }
    some = {name: texts[name] for name in (VERDICT, PLAN, *KERNELS)}
    first = sample(some, 30, 1)
    assert first == sample(some, 30, 1)
    assert first != sample(some, 30, 2)
    assert len({(m.module, m.number) for m in first}) == 30
    assert 0 < sum(m.module in KERNELS for m in first) <= 10


def test_like_changes_of_a_function_are_told_apart():
    found = mutants("m.py", "def f():\n    return a[0] + b[0]")
    likes = [m.change for m in found if m.before == "0"]
    assert likes == ["m.py f: 0 -> 1", "m.py f: 0 -> 1 (#2)"]


def test_an_edit_moves_nothing_else_in_the_sample():
    """Edited lines, and a change that is called equivalent, give up their own places.

    Those are filled by others that come next in the order.
    """
    names = [VERDICT, "borecheck/contact/gradient.py"]
    texts = {name: sources()[name] for name in names}
    before = {m.change for m in sample(texts, 20, 1)}
    moved = {**texts, VERDICT: "SHIFTED = 1\n\n" + texts[VERDICT]}
    after = {m.change for m in sample(moved, 20, 1)}
    assert len(before - after) <= 1  # SHIFTED's own change takes one place or none

    some = next(c for c in sorted(before) if c.startswith(VERDICT))
    without = dict(EQUIVALENT) | {some: "for this test"}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("studies.mutations.__main__.EQUIVALENT", without)
        after = {m.change for m in sample(texts, 20, 1)}
    assert before - after == {some}


def mutant_of(module, change="a"):
    return Mutant(module, 0, "f", (3, 3), change, "b")


def test_what_is_noticed_is_known_while_the_module_is_the_same(tmp_path):
    module, name = "borecheck/contact/none.py", "tests/contact/test_none.py::test_a"
    texts = {module: "a = 1"}
    file = tmp_path / "state.jsonl"
    mutant = mutant_of(module)
    State(file, texts).keep_noticed(mutant, name)
    again = State(file, texts)
    assert again.noticed == {mutant.change: name}
    changed = State(file, {module: "a = 2"})
    assert changed.noticed == {}
    assert changed.before == {mutant.change: name}
    # who noticed it is asked first, if it is still there
    assert who_noticed_before(mutant, changed) == []
    changed.before[mutant.change] = "tests/test_mutations.py::a"
    (asked,) = who_noticed_before(mutant, changed)
    assert asked.name == "tests/test_mutations.py::a"
    changed.before[mutant.change] = "no end, or a crash"
    assert who_noticed_before(mutant, changed) == []
    again.forget({"another"})
    assert again.noticed == {mutant.change: name}
    again.forget({name})
    assert again.noticed == {}


def test_tests_are_recorded_again_where_what_they_reach_is_asked_and_changed(
    tmp_path, monkeypatch
):
    module, other = VERDICT, "borecheck/contact/gradient.py"
    file = "tests/contact/test_verdict.py"
    tests = [KnownTest(f"{file}::test_a", 0.1, {module: frozenset({3})})]
    texts = {module: "a = 1", other: "b = 1"}
    kept, ran = tmp_path / "state.jsonl", []
    State(kept, texts).keep_tests(file, tests)

    def record(files, _modules):
        ran.extend(files)
        return tests

    monkeypatch.setattr(judge, "record", record)
    monkeypatch.setattr("studies.mutations.__main__.files_for", lambda module: (file,))
    for change, mutated_one, again in (
        ({}, module, False),
        ({other: "b = 2"}, module, False),
        ({module: "a = 2"}, other, False),
        ({module: "a = 2"}, module, True),
    ):
        state = State(kept, {**texts, **change})
        assert state.tests[file][0].lines == (
            {} if module in change else tests[0].lines
        )
        ran.clear()
        recorded([mutant_of(mutated_one)], state, texts)
        assert ran == [file] * again
        assert state.tests[file] == tests or not again


def test_what_a_test_noticed_that_fails_anyway_is_not_noticed(monkeypatch):
    state = State(None, {})
    state.noticed = {"a": "t::fails", "b": "t::passes", "c": "no end, or a crash"}
    monkeypatch.setattr(judge, "failing", lambda names: {"t::fails"} & set(names))
    confirm(["b", "c"], state)
    assert set(state.noticed) == {"a", "b", "c"}
    confirm(["a", "b"], state)
    assert set(state.noticed) == {"b", "c"}


def test_tests_that_pass_are_those_that_run_and_fail_in_no_phase(monkeypatch):
    names = ["tests/test_mutations.py::a", "tests/test_mutations.py::b", "gone.py::c"]

    def pytest_run(files, plugin, *_more):
        assert files == ["tests/test_mutations.py"]
        for name, passed in ((names[0], True), (names[0], False), (names[1], True)):
            plugin.pytest_runtest_logreport(SimpleNamespace(nodeid=name, passed=passed))
        return 1

    class Now:
        def __init__(self, run, seconds):
            self._found = run()

        def wait(self):
            return self._found

    monkeypatch.setattr(judge, "_pytest", pytest_run)
    monkeypatch.setattr(judge, "Child", Now)
    assert judge.failing(names) == {names[0], names[2]}


def test_tests_are_those_of_the_mirrored_room_the_modules_own_first():
    assert all((PROJECT / f).is_file() for fs in KERNEL_TESTS.values() for f in fs)
    files = files_for("borecheck/contact/decision.py")
    assert files[0] == "tests/contact/test_decision.py"
    assert all(name.startswith("tests/contact/") for name in files)
    assert len(set(files)) == len(files)


def judge_of(monkeypatch, tests, statuses):
    """What a child says of tests for which pytest ends so; and what it was asked."""
    runs = []

    def pytest_run(files, chosen, *_more):
        runs.append((files, list(chosen._order)))
        return statuses[len(runs) - 1]

    monkeypatch.setattr(judge, "_pytest", pytest_run)
    monkeypatch.setattr(judge, "Child", lambda run, seconds: run())
    monkeypatch.setattr(judge.sys, "meta_path", [])
    tree, first = ast.parse("a = 1"), ("own",)
    return judge.judged("b/m.py", tree, tests, first=first, kernels=False), runs


def test_what_no_test_reaches_is_missed(monkeypatch):
    """Without a file pytest would run all, and end as if something had failed."""
    answer, runs = judge_of(monkeypatch, [], [])
    assert (answer["noticed"], runs) == (False, [])


@pytest.mark.parametrize(
    ("statuses", "noticed", "asked"),
    [
        ((1,), True, 1),
        ((0, 1), True, 2),
        ((0, 0), False, 2),
        ((judge.NONE_FOUND, judge.NONE_FOUND), False, 2),
        ((2,), True, 1),  # it cannot even be imported
    ],
)
def test_own_tests_are_run_before_other_files_are_read(
    monkeypatch, statuses, noticed, asked
):
    names = ("own::b", "other::a", "third::a", "own::a", "other::b")
    tests = [KnownTest(name, 0.1, {}) for name in names]
    answer, runs = judge_of(monkeypatch, tests, statuses)
    assert answer["noticed"] == noticed
    assert (
        runs
        == [
            (["own"], ["own::b", "own::a"]),
            (["other", "third"], ["other::a", "third::a", "other::b"]),
        ][:asked]
    )


def test_tests_that_reach_the_line_are_asked_quickest_first():
    module = "m.py"
    tests = [
        KnownTest("slow", 2.0, {module: frozenset({3, 4})}),
        KnownTest("quick", 0.1, {module: frozenset({4})}),
        KnownTest("elsewhere", 0.1, {module: frozenset({9})}),
        KnownTest("study", 99.0, {module: frozenset({4})}),
    ]
    found = [t.name for t in reaching(tests, module, (4, 5), importing=False)]
    assert found == ["quick", "slow"]
    every = [t.name for t in reaching(tests, module, (1, 1), importing=True)]
    assert every == ["quick", "elsewhere", "slow"]
    found = reaching(tests, module, (4, 5), importing=False, first=["slow"])
    assert [t.name for t in found] == ["quick", "slow"]
    tests.append(KnownTest("own::test", 0.5, {module: frozenset({4})}))
    found = reaching(tests, module, (4, 5), importing=False, first=["own"])
    assert [t.name for t in found] == ["own::test", "quick", "slow"]


def test_what_is_called_equivalent_is_there():
    """A change that no longer exists is no reason, and a reason is a sentence."""
    modules = {name.partition(" ")[0] for name in EQUIVALENT}
    texts = {module: (PROJECT / module).read_text() for module in modules}
    there = {m.change for name, text in texts.items() for m in mutants(name, text)}
    assert set(EQUIVALENT) <= there
    assert all(len(reason) > 20 for reason in EQUIVALENT.values())
