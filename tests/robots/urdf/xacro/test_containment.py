"""A xacro file reads what belongs to it, and what it reads cannot fill the machine."""

import os
import time

import pytest

from borecheck.errors import UrdfError
from borecheck.robots.urdf.reach import NO_ROOTS, Roots
from borecheck.robots.urdf.xacro import expand

NS = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
SECRET = "hunter2"
ALLOWED = Roots(allow_outside=True)


@pytest.fixture
def robot(tmp_path, monkeypatch):
    """A folder for a robot, with secrets beside it and links to them in it."""
    monkeypatch.setenv("HOME", "/nobody")
    link = f'<link name="{SECRET}"/>'
    (tmp_path / "secret.xacro").write_text(f"<robot {NS}>{link}</robot>")
    (tmp_path / "secret.yaml").write_text(f"password: {SECRET}\n")
    (tmp_path / "secret.txt").write_text(f"{{{SECRET}: [\n")
    folder = tmp_path / "robot"
    folder.mkdir()
    (folder / "link.xacro").symlink_to(tmp_path / "secret.xacro")
    (folder / "link.yaml").symlink_to(tmp_path / "secret.yaml")
    (folder / "around").symlink_to(tmp_path)
    (folder / "part.xacro").write_text(f'<robot {NS}><link name="part"/></robot>')
    (folder / "own.yaml").write_text("a: 1\nb: {c: [2, 3]}\nd: !degrees 180\n")
    return folder


def expanded(folder, body, roots=NO_ROOTS, head="", arguments=None):
    main = folder / "main.xacro"
    main.write_text(f'{head}<robot name="r" {NS}>\n{body}\n</robot>')
    return expand(main, arguments, roots).text


def include(name, more=""):
    return f'<xacro:include filename="{name}" {more}/>'


def yaml(name):
    return f"<link name=\"l${{xacro.load_yaml('{name}')}}\"/>"


@pytest.mark.parametrize(
    "body",
    [
        include("../secret.xacro"),
        include("../secret.xacro", 'optional="true"'),
        include("link.xacro"),
        include("around/secret.xacro"),
        include("../*.xacro"),
        include("around/*.xacro"),
        include("/etc/*"),
        include("/etc/passwd"),
        include("../secret.txt"),
        yaml("../secret.yaml"),
        yaml("link.yaml"),
        yaml("/etc/passwd"),
        '<link name="$(env HUB_TOKEN)"/>',
        '<link name="$(optenv AWS_SECRET_ACCESS_KEY none)"/>',
    ],
)
def test_what_lies_outside_is_refused_by_one_line(robot, body, monkeypatch):
    monkeypatch.setenv("HUB_TOKEN", SECRET)
    words = r"main.xacro: line 2: .*--allow-outside"
    with pytest.raises(UrdfError, match=words) as told:
        expanded(robot, body)
    assert SECRET not in str(told.value)
    assert "\n" not in str(told.value)


@pytest.mark.parametrize("body", [include("../secret.xacro"), yaml("link.yaml")])
def test_the_user_may_allow_it(robot, body):
    assert SECRET in expanded(robot, body, ALLOWED)
    assert SECRET in expanded(robot, body, Roots((robot.parent,)))


def test_a_foreign_file_is_not_quoted_where_it_cannot_be_read(robot):
    for body in (include("../secret.txt"), yaml("../secret.txt")):
        with pytest.raises(UrdfError) as told:
            expanded(robot, body, ALLOWED)
        assert SECRET not in str(told.value)


@pytest.mark.parametrize(
    "doctype",
    [
        "<!DOCTYPE robot>",
        '<!DOCTYPE robot SYSTEM "../secret.xacro">',
        '<!DOCTYPE robot [<!ENTITY a SYSTEM "/etc/passwd">]>',
    ],
)
def test_a_document_type_is_refused_in_every_file(robot, doctype):
    with pytest.raises(UrdfError, match="DOCTYPE"):
        expanded(robot, "", head=doctype)
    (robot / "part.xacro").write_text(f"{doctype}<robot/>")
    with pytest.raises(UrdfError, match=r"part.xacro: .*DOCTYPE"):
        expanded(robot, include("part.xacro"))


@pytest.mark.parametrize(
    ("body", "words"),
    [
        (include("part.xacro"), 'name="part"'),
        (include("par*.xacro"), 'name="part"'),
        (include("none.xacro", 'optional="true"'), "<robot"),
        ("${xacro.load_yaml('own.yaml').b.c[1]}", "3"),
        ("${round(xacro.load_yaml('own.yaml')['d'], 4)}", "3.1416"),
        ("$(eval 2*n + pi)", "9.14"),
        ("$(eval n if true else 1)", "3"),
        ("$(env WHEELS) $(optenv NOTHING two)", "4 two"),
        ("$(cwd)", os.sep),
        ("$${1} $$(x)", "${1} $(x)"),
        (include("part.xacro", 'ns="p"'), "part"),
    ],
)
def test_what_belongs_to_it_is_read(robot, body, words, monkeypatch):
    monkeypatch.setenv("WHEELS", "4")
    text = f'<xacro:arg name="n" default="0"/><a>{body}</a>'
    assert words in expanded(robot, text, arguments={"n": "3"})


def _doubling(count):
    texts = "".join(
        f'<xacro:property name="p{i}" value="${{p{i - 1}}}${{p{i - 1}}}"/>'
        for i in range(1, count)
    )
    return f'<xacro:property name="p0" value="ab"/>{texts}<a b="${{p{count - 1}}}"/>'


BOMBS = {
    "texts": _doubling(60),
    "parameters": f"<xacro:macro name='m' params='a:=&quot;{'x' * 60} b'/>",
    "dollars": f'<a b="{"$a" * 100_000}"/>',
    "itself": "<link name='l'/>" * 500 + include("main.xacro"),
    "yaml": yaml("bomb.yaml"),
    "merges": yaml("merge.yaml"),
    "depth": "<a>" * 5000 + "</a>" * 5000,
    "elements": "<a/>" * 70_000,
    "attributes": "<a " + " ".join(f'a{i}=""' for i in range(120_000)) + "/>",
    "properties": '<xacro:property name="a" value="1"/>\n' * 20_000,
    "lists": '<xacro:property name="a" value="${[1]}"/>'
    + '<xacro:property name="a" value="${[a, a]}" lazy_eval="false"/>' * 40
    + "${a}",
}


@pytest.mark.parametrize("name", BOMBS)
def test_bombs_end_soon(robot, name):
    lines = [f"b{i}: &b{i} [{', '.join([f'*b{i - 1}'] * 9)}]" for i in range(1, 30)]
    (robot / "bomb.yaml").write_text("\n".join(["b0: &b0 [x]", *lines]))
    merges = [f"b{i}: &b{i} {{<<: [*b{i - 1}, *b{i - 1}]}}" for i in range(1, 30)]
    (robot / "merge.yaml").write_text("\n".join(["b0: &b0 {x: 1}", *merges]))
    start = time.process_time()
    try:
        text = expanded(robot, BOMBS[name])
    except UrdfError as error:
        text = str(error)
    assert len(text) < 500_000
    assert time.process_time() - start < 10.0  # a bomb takes minutes, or all there is
