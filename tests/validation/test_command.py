"""`borecheck validate` as it is called: options, files, exit status."""

import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from borecheck.cli import main
from tests import corpus
from tests.places import PROJECT

ARM = corpus.FOLDER / "arm" / "arm.urdf"
ZERO = corpus.FOLDER / "J302-axis-zero" / "zero.bad.urdf"
LONG = corpus.FOLDER / "J303-axis-not-unit" / "long.bad.urdf"
URDF = PROJECT / "urdf"


@pytest.fixture
def validate(capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)

    def call(*words, run=False):
        extra = () if run else ("--no-run",)
        status = main(["validate", *map(str, words), *extra])
        out, err = capsys.readouterr()
        return status, out, err

    return call


def test_exit_status(validate):
    assert validate(ARM)[0] == 0
    assert validate(ZERO)[0] == 1
    assert validate(LONG)[0] == 0
    assert validate(LONG, "--fail-on", "warning")[0] == 1
    assert validate(ZERO, "--fail-on", "never")[0] == 0


@pytest.mark.parametrize(
    "words",
    [
        ("missing.urdf",),
        ("--arg", "x", "missing.urdf"),
        ("--select", "Q9", ARM),
        ("--baseline", "missing.json", ARM),
        ("--config", "missing.toml", ARM),
        (),
    ],
)
def test_what_cannot_be_done_ends_with_2_and_one_line(validate, words):
    status, out, err = validate(*words)
    assert status == 2
    assert "Traceback" not in out + err


def test_a_folder_a_pattern_and_a_name(validate, tmp_path):
    home = tmp_path / "robots"
    (home / "meshes").mkdir(parents=True)
    folder = home / "a"
    folder.mkdir()
    shutil.copy(corpus.FOLDER / "meshes" / "box.stl", home / "meshes")
    for name in ("one.urdf", "two.urdf", "notes.txt"):
        shutil.copy(ARM, folder / name)
    for word in (folder, home, f"{folder}/*.urdf"):
        status, out, _ = validate(word, "--format", "json")
        assert status == 0
        files = [Path(e["file"]).name for e in json.loads(out)["files"]]
        assert files == ["one.urdf", "two.urdf"]
    (tmp_path / "empty").mkdir()
    assert validate(tmp_path / "empty")[0] == 2


def test_select_and_ignore(validate):
    def codes(*words):
        out = validate(ZERO, "--format", "json", *words)[1]
        entries = json.loads(out)["files"][0]["findings"]
        return {entry["code"] for entry in entries}

    assert codes() == {"J302"}
    assert codes("--ignore", "J3") == set()
    assert codes("--select", "T,axis-zero") == {"J302"}
    assert codes("--select", "T") == set()


def test_a_baseline_hides_what_is_known(validate, tmp_path):
    known = tmp_path / "known.json"
    assert validate(ZERO, "--write-baseline", known)[0] == 1
    assert validate(ZERO, "--baseline", known)[0] == 0
    assert validate(LONG, "--baseline", known, "--fail-on", "warning")[0] == 1


def test_the_nearest_settings_hold(validate, tmp_path):
    shutil.copy(ZERO, tmp_path / "a.urdf")
    shutil.copytree(
        corpus.FOLDER / "meshes", tmp_path.parent / "meshes", dirs_exist_ok=True
    )
    assert validate(tmp_path / "a.urdf")[0] == 1
    (tmp_path / "borecheck.toml").write_text('[validate]\nignore = ["J302"]\n')
    assert validate(tmp_path / "a.urdf")[0] == 0
    (tmp_path / "borecheck.toml").unlink()
    (tmp_path / "pyproject.toml").write_text(
        '[tool.borecheck.validate.per-file-ignore]\n"a.urdf" = ["J3"]\n'
    )
    assert validate(tmp_path / "a.urdf")[0] == 0


@pytest.mark.parametrize(
    "text",
    ["[validate]\nprofil = 'x'\n", "[validate\n", "[validate]\nselect = 'J'\n"],
)
def test_wrong_settings_are_told(validate, tmp_path, text):
    (tmp_path / "borecheck.toml").write_text(text)
    shutil.copy(ARM, tmp_path / "a.urdf")
    status, _, err = validate(tmp_path / "a.urdf")
    assert status == 2
    assert "borecheck.toml" in err


def test_out_writes_a_file_and_nothing_else(validate, tmp_path):
    status, out, _ = validate(ZERO, "--format", "sarif", "--out", tmp_path / "o.sarif")
    assert (status, out) == (1, "")
    assert json.loads((tmp_path / "o.sarif").read_text())["version"] == "2.1.0"


def test_finished_files_are_not_done_again(validate, tmp_path, monkeypatch):
    kept = tmp_path / "kept.jsonl"
    first = validate(ZERO, LONG, "--resume", kept, "--format", "json")[1]
    assert len(kept.read_text().splitlines()) == 2

    def never(*_):
        raise AssertionError("checked again")

    monkeypatch.setattr("borecheck.commands.validate.check_one", never)
    again = validate(ZERO, LONG, "--resume", kept, "--format", "json")[1]
    assert json.loads(again)["files"] == json.loads(first)["files"]


def test_fix_shows_a_diff_and_writes_only_when_told(validate, tmp_path):
    path = tmp_path / "a.urdf"
    text = ARM.read_text().replace('xyz="0 0.3 0" rpy', 'xyz="0 0.3 0" ryp')
    text = text.replace('<axis xyz="0 1 0"/>', '<axis xyz="0 2 0"/>')
    path.write_text(text)
    status, out, _ = validate(path, "--fix", "--no-meshes")
    assert status == 0
    assert '-    <axis xyz="0 2 0"/>' in out
    assert '+    <axis xyz="0 1 0"/>' in out
    assert path.read_text() == text
    validate(path, "--fix", "--write", "--no-meshes")
    assert path.read_text() == ARM.read_text()


def test_fix_leaves_a_prismatic_axis_alone(validate, tmp_path):
    bad = corpus.FOLDER / "J303-axis-not-unit" / "prismatic.bad.urdf"
    path = tmp_path / "a.urdf"
    shutil.copy(bad, path)
    assert validate(path, "--fix", "--no-meshes")[1] == ""


def test_fix_turns_an_inverted_mesh_into_a_new_file(validate, tmp_path):
    from borecheck.geometry.mesh_files.reading import read_mesh
    from borecheck.validation.reading.mesh_facts import facts_of

    bad = corpus.FOLDER / "G519-mesh-inverted" / "inverted.bad.urdf"
    shutil.copytree(corpus.FOLDER / "meshes", tmp_path / "meshes")
    (tmp_path / "x").mkdir()
    path = tmp_path / "x" / "a.urdf"
    shutil.copy(bad, path)
    before = (tmp_path / "meshes" / "box_inverted.stl").read_bytes()
    validate(path, "--fix", "--write")
    turned = tmp_path / "meshes" / "box_inverted_turned.stl"
    assert not facts_of(read_mesh(turned)).inverted
    assert (tmp_path / "meshes" / "box_inverted.stl").read_bytes() == before
    assert validate(path)[1].strip() == "1 file: no findings"


def test_list_checks_and_explain(validate, capsys):
    status, out, _ = validate("--list-checks")
    assert status == 0
    assert "J302" in out
    assert main(["explain", "J302", "axis-not-unit"]) == 0
    text = capsys.readouterr().out
    assert "The axis of a moving joint is 0 0 0." in text
    assert "J303" in text
    assert main(["explain", "Q999"]) == 2


@pytest.mark.parametrize(
    ("code", "near"),
    [("J999", "J338"), ("j303x", "J303, J302"), ("axis-not-unt", "axis-not-unit")],
)
def test_an_unknown_code_names_the_nearest_in_one_line(capsys, code, near):
    assert main(["explain", code]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert near in line
    assert line.count("J3") <= 3


def test_a_missing_file_is_one_calm_line(validate):
    status, out, _ = validate("nope.urdf")
    assert status == 2
    first, summary = out.splitlines()
    assert first.endswith("nope.urdf: error: D101: no such file")
    assert summary.startswith("1 file: 1 error")


def test_an_empty_line_is_not_underlined(validate, tmp_path):
    (tmp_path / "empty.urdf").write_text("")
    out = validate(tmp_path / "empty.urdf")[1]
    assert "D101: is empty" in out
    assert "^" not in out
    assert "fix:" in out


def test_standard_input(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "borecheck.cli", "validate", "-", "--no-meshes"],
        input=ZERO.read_bytes(),
        capture_output=True,
        cwd=tmp_path,
    )
    assert done.returncode == 1
    assert b"<stdin>:121: error: J302" in done.stdout


def test_nothing_heavy_is_imported_without_meshes(tmp_path):
    code = (
        "import sys; from borecheck.cli import main; "
        f"main(['validate', '--no-meshes', {str(ARM)!r}]); "
        "heavy = {'numba', 'pinocchio', 'coal', 'scipy', 'trimesh', 'yourdfpy'}; "
        "sys.exit(', '.join(heavy & set(sys.modules)) or 0)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path
    )
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize(
    "path",
    sorted(
        p
        for p in [*URDF.rglob("*.urdf"), *URDF.rglob("*.urdf.xacro")]
        if p.stem.partition(".")[0] not in ("parts", "table_row")
    ),
    ids=lambda p: p.name,
)
def test_our_own_robots_and_scanners_are_sound(validate, path):
    status, out, _ = validate(
        path, "--profile", "dynamics", "--fail-on", "info", run=True
    )
    assert (status, out) == (0, "1 file: no findings\n")


def test_the_pages_of_the_checks_are_up_to_date():
    script = PROJECT / "scripts" / "make_check_pages.py"
    done = subprocess.run([sys.executable, str(script), "--check"], capture_output=True)
    assert done.returncode == 0, done.stdout.decode()


def test_sixty_links_are_checked_quickly(tmp_path):
    links = "".join(
        f'<link name="l{i}"><visual><geometry><box size="0.1 0.1 0.1"/></geometry>'
        '</visual><collision><geometry><box size="0.1 0.1 0.1"/></geometry>'
        "</collision></link>"
        for i in range(60)
    )
    joints = "".join(
        f'<joint name="j{i}" type="revolute"><origin xyz="0 0 0.2"/>'
        f'<parent link="l{i}"/><child link="l{i + 1}"/><axis xyz="0 1 0"/>'
        '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
        for i in range(59)
    )
    from borecheck.validation import validate_text
    from borecheck.validation.options import Options

    text = f'<robot name="long">{links}{joints}</robot>'
    validate_text(text, options=Options(run=False))
    start = time.process_time()
    assert [
        f.code
        for f in validate_text(text, options=Options(run=False))
        if f.severity == "error"
    ] == []
    # 0.05 s in practice; the bound only catches what has become quadratic
    assert time.process_time() - start < 2.0


@pytest.fixture
def two_folders(tmp_path):
    """Folders `strict` and `calm` with the same sound file, and its meshes."""
    for folder in ("strict", "calm"):
        (tmp_path / folder).mkdir()
        shutil.copy(LONG, tmp_path / folder / "a.urdf")
    shutil.copytree(corpus.FOLDER / "meshes", tmp_path / "meshes")
    return tmp_path


def test_fail_on_comes_from_the_settings_nearest_to_each_file(validate, two_folders):
    settings = two_folders / "strict" / "borecheck.toml"
    settings.write_text('[validate]\nfail-on = "warning"\n')
    assert validate("calm")[0] == 0
    assert validate("strict")[0] == 1
    assert validate("calm", "strict")[0] == 1
    assert validate("calm", "strict", "--fail-on", "never")[0] == 0
    junit = validate("calm", "strict", "--format", "junit")[1]
    assert junit.count("<failure") == 1


def test_a_baseline_comes_from_the_settings_nearest_to_each_file(validate, two_folders):
    validate("strict", "--write-baseline", two_folders / "strict" / "known.json")
    settings = two_folders / "strict" / "borecheck.toml"
    settings.write_text('[validate]\nbaseline = "known.json"\n')
    found = json.loads(validate("calm", "strict", "--format", "json")[1])["files"]
    assert [len(entry["findings"]) for entry in found] == [1, 0]
    (two_folders / "strict" / "known.json").unlink()
    status, out, err = validate("calm", "strict")
    assert (status, out) == (2, "")
    assert "known.json" in err


def test_settings_are_read_once_per_folder(validate, two_folders, monkeypatch):
    from borecheck.validation import config

    read = []
    original = config.read_settings
    monkeypatch.setattr(
        config, "read_settings", lambda path: read.append(path) or original(path)
    )
    (two_folders / "borecheck.toml").write_text("[validate]\n")
    validate("calm", "strict")
    assert len(read) == 1


def test_fix_takes_the_settings_nearest_to_each_file(validate, two_folders):
    settings = two_folders / "strict" / "borecheck.toml"
    settings.write_text("[validate]\npackage-pth = []\n")
    assert validate("calm", "--fix")[0] == 0
    assert validate("calm", "strict", "--fix")[0] == 2


def test_a_kept_result_is_done_again_under_other_settings(validate, two_folders):
    words = ("strict", "--resume", "kept.jsonl", "--fail-on", "warning")
    assert validate(*words)[0] == 1
    settings = two_folders / "strict" / "borecheck.toml"
    settings.write_text('[validate]\nignore = ["J303"]\n')
    assert validate(*words)[0] == 0


@pytest.mark.parametrize("text", ['fail-on = "worst"', 'profile = "arm"'])
def test_a_word_that_is_none_of_the_list_names_the_file(validate, two_folders, text):
    (two_folders / "calm" / "borecheck.toml").write_text(f"[validate]\n{text}\n")
    status, _, err = validate("calm")
    assert status == 2
    assert "borecheck.toml" in err


@pytest.mark.parametrize(
    "text",
    [
        'ignore = ["J999"]',
        'select = ["zzz"]',
        'select = [""]',
        "ignore = [3]",
        'per-file-ignore = {"*.urdf" = ["J999"]}',
        'per-file-ignore = {"*.urdf" = "J3"}',
        "per-file-ignore = 3",
        "frame = [3]",
    ],
)
def test_unknown_codes_in_settings_are_one_line(validate, two_folders, text):
    (two_folders / "calm" / "borecheck.toml").write_text(f"[validate]\n{text}\n")
    status, out, err = validate("calm")
    assert (status, out) == (2, "")
    (line,) = err.splitlines()
    assert "borecheck.toml" in line
    assert text.partition(" ")[0] in line


def test_settings_know_checks_by_name(validate, two_folders):
    settings = two_folders / "calm" / "borecheck.toml"
    settings.write_text('[validate]\nignore = ["axis-not-unit"]\n')
    assert validate("calm", "--fail-on", "warning")[0] == 0
    settings.write_text('[validate.per-file-ignore]\n"a*" = ["axis-not-unit"]\n')
    assert validate("calm", "--fail-on", "warning")[0] == 0


def test_the_function_refuses_unknown_codes_and_knows_names():
    import borecheck
    from borecheck.errors import UnknownNameError

    def codes(**words):
        return [f.code for f in borecheck.validate(ZERO, run=False, **words)]

    for words in ({"select": ["zzz"]}, {"ignore": "J999"}, {"select": [""]}):
        with pytest.raises(UnknownNameError, match="unknown check"):
            codes(**words)
    assert codes(select=["axis-zero"]) == codes(select="J3") == ["J302"]
    assert codes(select=[]) == ["J302"]
    assert codes(ignore=["Axis-Zero"]) == []


def test_options_with_names_of_checks_hold_for_text_too():
    from borecheck.errors import UnknownNameError
    from borecheck.validation import Options, validate_text

    text = ZERO.read_text()
    named = Options(run=False, meshes=False, select=("axis-zero",))
    assert [f.code for f in validate_text(text, options=named)] == ["J302"]
    with pytest.raises(UnknownNameError):
        validate_text(text, options=Options(select=("zzz",)))


@pytest.mark.parametrize("option", ["--seed", "--samples", "--jobs", "--self-contact"])
def test_a_negative_count_is_one_line(validate, option):
    status, out, err = validate(ARM, option, "-3")
    assert (status, out) == (2, "")
    (line,) = err.splitlines()
    assert f"{option} is -3" in line


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[validate]\nseed = -1", "seed is -1"),
        ("[validate]\narg = {n = [1]}", "arg"),
        ('[[validate.remote-centre]]\nframe = "tool"', "remote-centre lacks joints"),
        *(
            (f'[[validate.remote-centre]]\nframe = "tool"\njoints = ["a"]\n{t}', words)
            for t, words in [
                ("point = [0, 0]", "remote-centre: point is [0, 0], not three"),
                ('point = "0 0 0"', "remote-centre: point is '0 0 0'"),
                ('point = [0, 0, "0"]', "remote-centre: point"),
                ("point = [0, 0, nan]", "remote-centre: point"),
                ('tolerance = "1"', "remote-centre: tolerance is '1'"),
                ("tolerance = -1.0", "remote-centre: tolerance is -1.0"),
            ]
        ),
        (
            '[[validate.remote-centre]]\nframe = "tool"\njoints = "elbow"',
            "remote-centre: joints is 'elbow'",
        ),
        (
            '[[validate.tool-axis]]\nframe = "tool"\njoints = ["a"]\naxis = 3',
            "tool-axis: axis is 3",
        ),
        (
            '[[validate.tool-axis]]\nframe = "tool"\njoints = ["a"]\naxis = [0, 0, 0]',
            "tool-axis: axis is 0 0 0",
        ),
        ('[[validate.loop]]\nfirst = 1\nsecond = "b"', "loop: first is 1"),
        (
            '[[validate.loop]]\nfirst = "a"\nsecond = "b"\ntolerance = nan',
            "loop: tolerance is nan",
        ),
    ],
)
def test_wrong_values_in_settings_name_file_and_key(validate, two_folders, text, words):
    (two_folders / "calm" / "borecheck.toml").write_text(text)
    status, out, err = validate("calm", run=True)
    assert (status, out) == (2, "")
    (line,) = err.splitlines()
    assert "borecheck.toml" in line
    assert words in line


def test_numbers_for_xacro_arguments_in_settings(validate, two_folders):
    (two_folders / "calm" / "a.urdf").unlink()
    (two_folders / "calm" / "a.urdf.xacro").write_text(
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">'
        '<xacro:arg name="n" default="a"/><link name="l$(arg n)"><visual><geometry>'
        '<sphere radius="1"/></geometry></visual></link></robot>'
    )
    settings = two_folders / "calm" / "borecheck.toml"
    settings.write_text('[validate]\narg = {n = 3}\nframe = ["l3"]\n')
    assert validate("calm")[0] == 0


def test_the_function_refuses_what_is_no_count():
    import borecheck
    from borecheck.errors import UsageError
    from borecheck.validation.options import RemoteCentre

    for words in ({"seed": -1}, {"samples": -1}, {"self_contact": 0.5}):
        with pytest.raises(UsageError, match="not a whole number"):
            borecheck.validate(ARM, **words)
    with pytest.raises(UsageError, match="three numbers"):
        RemoteCentre("tool", ("a",), point=(0.0, 0.0))


OUTPUTS = ["--out", "--report", "--resume", "--write-baseline", "--write-srdf"]


@pytest.mark.parametrize("option", OUTPUTS)
def test_what_cannot_be_written_is_refused_before_the_run(
    validate, tmp_path, monkeypatch, option
):
    def never(*_):
        raise AssertionError("checked all the same")

    monkeypatch.setattr("borecheck.commands.validate.check_one", never)
    monkeypatch.setattr("borecheck.validation.srdf_proposal.load_file", never)
    more = ("--self-contact", "5") if option == "--write-srdf" else ()
    (tmp_path / "file").write_text("")
    for name, words in (
        ("none/x", "no folder"),
        ("file/x", "no folder"),
        (".", "Is a directory"),
    ):
        status, out, err = validate(ARM, option, name, *more)
        assert (status, out) == (2, "")
        (line,) = err.splitlines()
        assert f"{name}: cannot be written: {words}" in line
    monkeypatch.setattr("os.access", lambda *_, **__: False)
    (line,) = validate(ARM, option, "file", *more)[2].splitlines()
    assert line.endswith("file: cannot be written: Permission denied")
    assert (tmp_path / "file").read_text() == ""


def test_fix_writes_all_or_nothing(validate, tmp_path):
    bad = corpus.FOLDER / "G519-mesh-inverted" / "inverted.bad.urdf"
    shutil.copytree(corpus.FOLDER / "meshes", tmp_path / "meshes")
    (tmp_path / "x").mkdir()
    for name in ("a.urdf", "b.urdf"):
        shutil.copy(bad, tmp_path / "x" / name)
    (tmp_path / "x" / "b.urdf").chmod(0o640)
    before = {p: p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()}
    (tmp_path / "x" / "b.urdf").chmod(0o440)
    status, _, err = validate("x", "--fix", "--write")
    (tmp_path / "x" / "b.urdf").chmod(0o640)
    assert status == 2
    (line,) = err.splitlines()
    assert line.endswith("b.urdf: cannot be written: Permission denied")
    assert {p: p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()} == before
    assert validate("x", "--fix", "--write")[0] == 0
    changed = {p for p in tmp_path.rglob("*") if p.is_file()} - set(before)
    assert [p.name for p in changed] == ["box_inverted_turned.stl"]
    assert (tmp_path / "x" / "b.urdf").stat().st_mode & 0o777 == 0o640
    assert validate("x")[1].strip() == "2 files: no findings"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--write",), "--write goes with --fix"),
        (("--package-path", "none"), "--package-path 'none' is no folder"),
        (("--select", ""), "--select: '' is no check"),
        (("--ignore", " , "), "--ignore: '' is no check"),
        (("--fix", "--format", "text"), "--format does not go with it"),
        (("--fix", "--out", "x"), "--out does not go with it"),
        (("--fix", "--report", "x"), "--report does not go with it"),
    ],
)
def test_nonsense_is_refused_in_one_line(validate, words, said):
    status, out, err = validate(ARM, *words)
    assert (status, out) == (2, "")
    (line,) = err.splitlines()
    assert said in line


@pytest.fixture
def locked(tmp_path, monkeypatch):
    """A folder that cannot be read, as for a user who is not root."""
    (tmp_path / "all" / "locked").mkdir(parents=True)
    scandir = os.scandir

    def guarded(path="."):
        if Path(os.fspath(path)).name == "locked":
            raise PermissionError(13, "Permission denied", str(path))
        return scandir(path)

    monkeypatch.setattr(os, "scandir", guarded)
    return tmp_path / "all" / "locked"


def test_a_folder_that_cannot_be_read_is_told_and_the_others_are_checked(
    validate, locked
):
    for word in (locked, locked.parent, f"{locked}/*.urdf"):
        status, out, err = validate(word)
        assert (status, err) == (2, "")
        assert "locked: error: D101: cannot be read: Permission denied" in out.replace(
            ":1:", ":"
        )
    shutil.copy(ARM, locked.parent)
    shutil.copytree(corpus.FOLDER / "meshes", locked.parents[1] / "meshes")
    for words in ((locked.parent,), (locked, locked.parent / "arm.urdf")):
        status, out, _ = validate(*words, "--format", "json", "--select", "J3")
        assert status == 1
        files = {
            Path(e["file"]).name: [f["code"] for f in e["findings"]]
            for e in json.loads(out)["files"]
        }
        assert files == {"locked": ["D101"], "arm.urdf": []}


def test_a_pattern_that_matches_nothing_is_one_line(validate):
    assert "matches no file" in validate("none*.urdf")[2]


def test_markdown_counts_as_text_does(validate):
    head = validate(ZERO, "--format", "markdown")[1].splitlines()[2]
    assert head == "1 file: 1 error, 0 warnings, 0 info"
