"""Case files: the same as the options they stand for; what is wrong is a line each."""

import json
import os
import re
import time
import tomllib
from pathlib import Path

import jsonschema
import pytest

from borecheck import cli
from borecheck.cli import main
from borecheck.commands.case.keys import KEYS
from borecheck.commands.case.reading import MAX_BYTES, read_case
from borecheck.commands.init import template
from borecheck.errors import CaseError, InputError
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh_files.reading import write_stl
from tests.places import PROJECT, ROBOTS

SCHEMA = PROJECT / "borecheck" / "schemas" / "case.schema.json"
BEGIN = '[robot]\nfile = "arm.urdf"\n[scanner]\nfile = "block.stl"\nunit = "m"\n'


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """An arm of one joint, a block, a path and plans."""
    made = tmp_path_factory.mktemp("case")
    (made / "arm.urdf").write_text((ROBOTS / "two_link.urdf").read_text())
    write_stl(made / "block.stl", box("block", (0.2, 0.2, 0.2)))
    (made / "path.csv").write_text("j\n0\n0.1\n")
    for name in ("plans.csv", "errors.json", "arm.srdf"):
        (made / name).write_text("x")
    return made


@pytest.fixture
def case(folder, monkeypatch):
    """Writes a case into the folder, which is the one we are in."""
    monkeypatch.chdir(folder)

    def write(text, name="case.toml"):
        (folder / name).write_text(text)
        return folder / name

    return write


def parsed(words):
    """What the command is given, without what tells a case from typed words."""
    commands = cli._all_commands()
    given, use = cli._with_case(words, commands)
    found = vars(cli._parser(commands, words[0])[0].parse_args(given))
    return {name: value for name, value in found.items() if name != "run"}, use


def run(capsys, *words):
    status = main([str(word) for word in words])
    return status, *capsys.readouterr()


# What a case says, and what is typed for it.
SAME = (
    ('[check]\nq = { j = "10deg" }', "--q j=10deg"),
    ('[check]\nq = "home"\nmargin = "20mm"\nlevel = "fine"', "--q home --margin 20mm"
     " --level fine"),
    ('[check]\npath = "path.csv"\nlong_way = true\nsamples = 5', "--path path.csv "
     "--long-way --samples 5"),
    ('[check]\npath = "path.csv"\ncorridor = "last-leg"\n[needle]\nlink = "n"\n'
     'tip = "t:-x"\ninsertion = "k"', "--path path.csv --corridor last-leg "
     "--needle n --tip t:-x --insertion k"),
    ('[check]\npath = "path.csv"\ncorridor = { entry = [0, "0", "2 cm"], target = '
     '["1mm", 0, 0] }', "--path path.csv --corridor 0,0,2cm:1mm,0,0"),
    ('[check]\npath = "path.csv"\ncorridor = { file = "plans.csv", plan = "a" }',
     "--path path.csv --corridor plans.csv:a"),
    ('[check]\nplan = "plans.csv"\nmargin_kind = "security"\nchecker = "coal"\n'
     'uncertainty = "errors.json"\nrisk = 0.01', "--plan plans.csv --margin-kind "
     "security --checker coal --uncertainty errors.json --risk 0.01"),
    ('[check]\nq = "home"\n[couch]\nfile = "block.stl"\n[[obstacle]]\n'
     'file = "block.stl"\nunit = "mm"\npose = ["1m", 0, "-20mm"]\n[[obstacle]]\n'
     'file = "arm.urdf"\n[[patient]]\nfile = "block.stl"\nunit = "cm"\nframe = "LPS"\n'
     'pose = [0, 0, 0, 0, "90deg", "-1rad"]', "--q home --obstacle block.stl "
     "--obstacle block.stl:mm@1m,0,-20mm --obstacle arm.urdf "
     "--patient block.stl:cm:lps@0,0,0,0,90deg,-1rad"),
    ('[check]\nq = "home"\n[allowed]\nsrdf = "arm.srdf"\ntrust_never = true\n'
     'pairs = [["a", "b"], ["b", "c"]]', "--q home --srdf arm.srdf --trust-never "
     "--allow a:b --allow b:c"),
    ('[check]\nplan = "plans.csv"\n[coordinates]\nisocentre = ["12mm", 0, "-75cm"]\n'
     'position = "FFP"', "--plan plans.csv --isocentre 12mm,0,-75cm --position FFP"),
    ('[check]\nq = "home"\n[[patient]]\nbody = "sex=f,bmi=35"\npose = [0, 0, "1cm"]',
     "--q home --patient body:sex=f,bmi=35@0,0,1cm"),
    ('[check]\nplan = "plans.csv"\n[coordinates]\ntransform = "block.stl"',
     "--plan plans.csv --transform block.stl"),
)  # fmt: skip


@pytest.mark.parametrize(("text", "words"), SAME)
def test_a_case_is_what_is_typed_for_it(case, text, words):
    case(BEGIN + text)
    found, use = parsed(["check", "case.toml"])
    typed, none = parsed(["check", "arm.urdf", "block.stl:m", *words.split()])
    assert found == typed
    assert (use.file, use.overridden, use.unused, none) == ("case.toml", (), (), None)


def test_what_belongs_to_robot_and_scanner(case):
    case(
        '[robot]\nname = "zerobot"\narguments = { mount = "-90" }\n'
        'base = [0, "-0.7m", 0]\npackage_paths = ["."]\nallow_outside = true\n'
        '[scanner]\nname = "ct_gantry"\narguments = { bore = "780mm" }\n'
        '[check]\nq = "home"'
    )
    words = "check zerobot ct_gantry --arg mount=-90 --base=0,-0.7m,0 --q home "
    words += "--package-path . --allow-outside --scene-arg bore=780mm"
    assert parsed(["check", "case.toml"])[0] == parsed(words.split())[0]


def test_every_key_is_in_some_case_above_and_in_the_template(case):
    every = " ".join(text for text, _ in SAME) + BEGIN
    for key in KEYS:
        last = key.name.partition(".")[2] or key.name
        if key.name not in ("robot.name", "scanner.name") and last != "body":
            inside = re.search(rf"\b{last}\b", every) or key.name.startswith("robot.")
            assert inside or key.name == "scanner.arguments", key.name
            assert re.search(rf"^#? ?\[*{last}\b", template(), re.M), key.name


def test_paths_are_seen_from_the_file(case, folder, monkeypatch):
    case(BEGIN + '[check]\npath = "path.csv"')
    monkeypatch.chdir(folder.parent)
    found, _ = parsed(["check", f"{folder.name}/case.toml"])
    assert found["robot"] == f"{folder.name}/arm.urdf"
    assert found["scene"] == [f"{folder.name}/block.stl:m"]
    assert str(found["path"]) == f"{folder.name}/path.csv"


# What is typed besides, what is then asked for, and what is said to be replaced.
FULL = (
    BEGIN + 'arguments = { bore = "1m", tilt = "2deg" }\n[robot.arguments]\n'
    'mount = "+90"\n[needle]\nlink = "n"\n[[patient]]\nfile = "block.stl"\n[check]\n'
    'path = "path.csv"\ncorridor = "last-leg"\nmargin = "20mm"'
)  # fmt: skip
TYPED = (
    ("case.toml --margin 5mm", {"margin": "5mm"}, {"check.margin"}),
    ("case.toml --patient=arm.urdf", {"patient": ["arm.urdf"]}, {"patient"}),
    ("--q home case.toml", {"q": "home", "path": None, "corridor": None},
     {"check.path", "check.corridor"}),
    ("case.toml --plan plans.csv", {"path": None, "corridor": None},
     {"check.path", "check.corridor"}),
    ("case.toml other.stl:mm", {"scene": ["other.stl:mm"], "scene_arg": []},
     {"scanner", "scanner.arguments"}),
    ("other.urdf case.toml --q home", {"robot": "other.urdf", "scene": ["block.stl:m"],
     "arg": [], "needle": None}, {"robot.file", "robot.arguments", "needle.link",
     "check.path", "check.corridor"}),
    ("case.toml --mount=-90", {"arg": [], "mount": "-90"}, {"robot.arguments.mount"}),
    ("case.toml --scene-arg tilt=1deg", {"scene_arg": ["tilt=1deg", "bore=1m"]},
     {"scanner.arguments.tilt"}),
    ("case.toml --patient arm.urdf", {"patient": ["arm.urdf"]}, {"patient"}),
)  # fmt: skip


@pytest.mark.parametrize(("words", "asked", "replaced"), TYPED)
def test_what_is_typed_is_used_instead_and_said(case, words, asked, replaced):
    case(FULL)
    found, use = parsed(["check", *words.split()])
    assert {name: found[name] for name in asked} == asked
    assert set(use.overridden) == replaced


def test_the_result_names_the_case_in_every_form(case, folder, capsys):
    case(BEGIN + 'pose = ["2m", 0, 0]\n[check]\nq = "home"\nmargin = "1mm"')
    words = ["check", "case.toml", "--margin", "2mm", "--report", folder / "page.html"]
    status, out, _ = run(capsys, *words)
    use = parsed(["check", "case.toml", "--margin", "2mm"])[1]
    digest = read_case(folder / "case.toml").sha256
    assert status == 0
    assert f"\n  case file case.toml, SHA-256 {digest}\n" in out
    assert "\n  the command line is used instead of its check.margin\n" in out
    assert digest in (folder / "page.html").read_text().partition("borecheck-result")[0]
    typed = ["check", "arm.urdf", "block.stl:m@2m,0,0", "--q", "home", "--margin=2mm"]
    found, same = (
        json.loads(run(capsys, *w, "--format", "json")[1]) for w in (words[:4], typed)
    )
    assert found.pop("case") == {**use.to_json(), "overridden": ["check.margin"],
                                 "unused": []}  # fmt: skip
    for document in (found, same):
        del document["argv"], document["seconds"]
    assert found == same


def test_verify_is_bound_by_a_case(case, folder, capsys):
    text = BEGIN + 'pose = ["2m", 0, 0]\n[check]\npath = "path.csv"\n'
    case(text)
    assert run(capsys, "check", "case.toml", "--certificate", "clear.json")[0] == 0
    status, out, _ = run(capsys, "verify", "clear.json", "case.toml")
    assert status == 0
    assert "case file case.toml" in out
    case(text.replace('"2m"', '"2.001m"'))
    assert run(capsys, "verify", "clear.json", "case.toml")[0] == 1
    case(text + 'margin = "900mm"')
    assert run(capsys, "verify", "clear.json", "case.toml")[0] == 1


def test_fk_and_compare_take_what_they_have_a_use_for(case, capsys):
    case(BEGIN + 'pose = ["2m", 0, 0]\n[check]\nq = "home"\nmargin = "1mm"')
    status, out, _ = run(capsys, "fk", "case.toml")
    assert status == 0
    assert "not asked for here: its scanner, check.margin" in out
    status, out, _ = run(capsys, "compare", "case.toml", "--random", "2")
    assert status == 0
    assert "instead of its check.q" in out


# What a case may not hold, and what is said: the key, and of what is wrong.
WRONG = (
    ("[rob]\nfile = 1", "rob: unknown key; did you mean robot?"),
    ("[check]\nmargn = 1", "check.margn: unknown key; did you mean margin?"),
    ("[check]\nmargin = 20", 'check.margin: 20 has no unit; write for example "20mm"'),
    ('[check]\nmargin = "20"', "check.margin: '20' is no number with a unit"),
    ('[check]\nmargin = "20deg"', "check.margin: '20deg' is no number with a unit"),
    ("[check]\nmargin = nan", "check.margin: nan has no unit"),
    ("[check]\nmargin = true", "check.margin: is true or false, not text"),
    ("[check]\nmargin = 1979-05-27", "check.margin: is a date or time, not text"),
    ("[check]\nsamples = 1.5", "check.samples: is a number, not a whole number"),
    ("[check]\nsamples = true", "check.samples: is true or false, not a whole number"),
    ("[check]\nrisk = inf", "check.risk: is no finite number"),
    ("[check]\nq = {}", "check.q: is neither"),
    ("[check]\nq = { j = 1 }", "check.q.j: 1 has no unit"),
    ('[check]\nq = { "a,b" = "1deg" }', "check.q.a,b: 'a,b'"),
    ('[check]\nplan = "none.csv"', "check.plan: there is no file none.csv"),
    ('[check]\nplan = "."', "check.plan: . is no file"),
    ('[check]\nplan = ""', "check.plan: is empty"),
    ('[check]\nplan = "a\\u001b[2J"', "check.plan: is empty, or not text"),
    ('[check]\nlong_way = "yes"', "check.long_way: is text, not true or false"),
    ('[check]\ncorridor = "leg"', "check.corridor: is neither"),
    ('[check]\ncorridor = { entry = [0, 0], target = [0, 0, 0] }',
     "check.corridor.entry: has 2 numbers, not 3"),
    ('[check]\nq = "home"\npath = "path.csv"', "check.q and check.path: give one"),
    ('[robot]\nbase = [0, 0, 1]', "robot.base[3]: 1 has no unit"),
    ('[robot]\nbase = ["0", "0"]', "robot.base: has 2 numbers"),
    ('[robot]\nbase = [0, 0, "900m"]', "robot.base: pose '0,0,900m' lies beyond"),
    ('[robot]\nbase = "0,0,1m"', "robot.base: is text, not a list"),
    ('[robot]\nname = "a.urdf"', "robot.name: 'a.urdf' is no name"),
    ('[robot]\narguments = { mount = 90 }', "robot.arguments.mount: is a whole number"),
    ('[robot]\npackage_paths = ["x"]', "robot.package_paths[1]: there is no folder x"),
    ("robot = 3", "robot: is no table; write [robot]"),
    ('[scanner]\nunit = "mm"', "scanner.file: is missing"),
    ('[scanner]\nfile = "block.stl"\nunit = "ft"', "scanner.unit: 'ft' is none of m,"),
    ('[scanner]\nname = "ct_gantry"\nfile = "block.stl"', "scanner.name and scanner: "),
    ('[[patient]]\nfile = "block.stl"\n[[patient]]\nfile = "block.stl"\nfrme = "lps"',
     "patient[2].frme: unknown key; did you mean frame?"),
    ('[patient]\nfile = "block.stl"\nframe = "up"', "patient.frame: 'up' is none of"),
    ('patient = "block.stl"', "patient: is text, not a table"),
    ('[allowed]\npairs = [["a"]]', "allowed.pairs[1]: holds 1 links"),
    ('[allowed]\npairs = [["a", "b:c"]]', "allowed.pairs[1][2]: 'b:c'"),
    ('[allowed]\npairs = ["a:b"]', "allowed.pairs[1]: is text, not a list"),
    ("[needle]\nlink = 3", "needle.link: is a whole number, not text"),
    ("x = [", "is no TOML: "),
)  # fmt: skip


@pytest.mark.parametrize(("text", "said"), WRONG)
def test_what_is_wrong_is_one_line_with_file_and_key(case, capsys, text, said):
    case(text)
    status, out, err = run(capsys, "check", "case.toml")
    assert (status, out) == (2, "")
    assert err.startswith(f"borecheck: error: case.toml: {said}")
    assert err.count("\n") == 1


@pytest.mark.parametrize(("text", "said"), WRONG[:-1])
def test_the_schema_refuses_the_same(text, said):
    # only who sees the folder, or reads a text further, can refuse these
    beyond = ("there is no", "is no file", "lies beyond", "give one", "is no name",
              "a,b", "b:c", "up' is", "not text", "scanner.name and",
              "no finite", "file: is missing")  # fmt: skip
    document = tomllib.loads(text)
    judge = jsonschema.Draft202012Validator(json.loads(SCHEMA.read_text()))
    free = any(words in said for words in beyond) and "is text" not in said
    assert free or not judge.is_valid(document)


def test_the_schema_takes_what_is_read():
    judge = jsonschema.Draft202012Validator(json.loads(SCHEMA.read_text()))
    for text, _ in SAME:
        judge.validate(tomllib.loads(BEGIN + text))
    judge.validate(tomllib.loads(FULL))


def test_every_problem_has_its_line(case, capsys):
    case("[check]\nmargin = 1\nplan = 2\n[needle]\ntp = 1\n")
    _, _, err = run(capsys, "check", "case.toml")
    keys = re.findall(r"error: case\.toml: ([\w.]+): ", err)
    assert keys == ["check.margin", "check.plan", "needle.tp"]
    assert err.count("\n") == 3
    case("".join(f"a{k} = 1\n" for k in range(50)))
    lines = run(capsys, "check", "case.toml")[2].splitlines()
    assert len(lines) == 21
    assert lines[-1].endswith("and 30 more problems")


def test_a_hostile_file_is_one_line_and_soon(case, folder):
    deep = "a = " + "[\n" * 30_000
    dots = "".join(f"{'a.' * 900}b{k} = 1\n" for k in range(50))
    hostile = {
        "huge.toml": b"#" * (MAX_BYTES + 1),
        "long.toml": b"a" + b".a" * 20_000 + b" = 1",
        "deep.toml": deep.encode(),
        "dots.toml": dots.encode(),
        "digits.toml": b"a = " + b"9" * 1_900,
        "bytes.toml": b"\xff\xfe\x00",
        "nul.toml": b"a = \x00",
    }
    start = time.monotonic()
    for name, content in hostile.items():
        (folder / name).write_bytes(content)
        with pytest.raises((InputError, CaseError)) as error:
            read_case(folder / name)
        assert "\n" not in str(error.value)
        assert error.value.file.endswith(name)
    os.mkfifo(folder / "pipe.toml")
    (folder / "loop.toml").symlink_to(folder / "loop.toml")
    (folder / "zero.toml").symlink_to("/dev/zero")
    (folder / "folder.toml").mkdir()
    for name in ("pipe.toml", "loop.toml", "zero.toml", "folder.toml", "none.toml"):
        with pytest.raises(InputError, match=r"is no file|no such file"):
            read_case(folder / name)
    assert time.monotonic() - start < 20.0  # a parser without end, not a slow machine


def test_two_cases_or_none_of_what_is_needed(case, capsys):
    case('[check]\nq = "home"')
    assert "names no robot" in run(capsys, "check", "case.toml")[2]
    assert "names no scanner" in run(capsys, "check", "arm.urdf", "case.toml")[2]
    err = run(capsys, "check", "case.toml", "other.toml")[2]
    assert "two case files: case.toml and other.toml" in err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--samples x", "argument --samples: invalid int value: 'x'"),
        ("--q home --path path.csv", "not allowed with argument"),
        ("--margn 5mm", "--margin"),
        ("--margin", "expected one argument"),
    ],
)
def test_what_is_typed_wrong_beside_a_case_is_one_line(case, capsys, words, said):
    case(FULL)
    status, out, err = run(capsys, "check", "case.toml", *words.split())
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert said in err


def test_a_case_is_never_written_over(case, capsys):
    path = case(BEGIN + 'pose = ["2m", 0, 0]\n[check]\nq = "home"')
    before = path.read_bytes()
    for option in ("--out", "--report"):
        status, _, err = run(capsys, "check", "case.toml", option, "case.toml")
        assert status == 2
        assert "case.toml" in err
    assert path.read_bytes() == before


def test_init_writes_a_case_that_is_read_and_no_file_twice(tmp_path, capsys):
    assert run(capsys, "init", tmp_path)[0] == 0
    written = tmp_path / "case.toml"
    assert dict((k.name, t) for k, t in read_case(written).entries) == {
        "robot.name": ("zerobot",),
        "scanner.name": ("ct_gantry",),
        "check.q": ("home",),
        "check.margin": ("20mm",),
    }
    for where in (tmp_path, written, tmp_path / "none" / "x", tmp_path / "a.txt"):
        status, _, err = run(capsys, "init", where)
        assert (status, err.count("\n")) == (2, 1)
    assert run(capsys, "init", tmp_path / "other.toml")[0] == 0


def test_every_line_of_the_template_is_a_key_that_is_read(folder, monkeypatch):
    """Uncommented one by one, in their tables; only files that are not there fail."""
    monkeypatch.chdir(folder)
    table, seen = "", set()
    for line in template().splitlines():
        bare = line.removeprefix("# ").strip()
        if re.match(r"\[+[a-z]+\]+", bare):
            table = bare
        elif table and re.match(r"[a-z_]+ = ", bare):
            (folder / "line.toml").write_text(f"{table}\n{bare}\n")
            _reads_but_for_files(folder / "line.toml")
            seen.add((table, bare.partition(" ")[0]))
    assert len(seen) > 35


def _reads_but_for_files(file):
    missing = ("there is no file", "there is no folder", "file: is missing")
    try:
        read_case(file)
    except CaseError as error:
        others = [p for p in error.problems if not any(m in p for m in missing)]
        if others:
            raise


@pytest.mark.parametrize(
    ("key", "value"), [("link", "needle_lnk"), ("tip", "needle_tp:z")]
)
def test_a_name_that_is_unknown_is_told_with_file_and_key(
    tmp_path, monkeypatch, capsys, key, value
):
    assert main(["examples", str(tmp_path / "tried")]) == 0
    monkeypatch.chdir(tmp_path / "tried")
    text = Path("case.toml").read_text()
    old = re.search(rf'^{key} = "(\w+)"', text, re.M)
    Path("case.toml").write_text(text.replace(old.group(), f'{key} = "{value}"'))
    capsys.readouterr()
    assert main(["check", "case.toml"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    name = value.partition(":")[0]
    assert f"error: case.toml: needle.{key}: unknown link '{name}'; did you" in line
    # the same name, typed, is not the case's
    assert main(["check", "case.toml", f"--{'needle' if key == 'link' else 'tip'}=x"])
    assert "case.toml" not in capsys.readouterr().err
