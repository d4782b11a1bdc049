"""SRDF: who may touch whom, and that nothing in it is read over."""

import pytest

from borecheck.errors import UrdfError
from borecheck.robots.srdf import MOST_PAIRS, kind_of, read_srdf
from tests.sliders import pair, srdf

LINKS = ("rail", "a", "b", "c", "d")


def read(tmp_path, text, links=LINKS):
    file = tmp_path / "robot.srdf"
    file.write_text(text)
    return read_srdf(file, links)


def names(pairs):
    return {"".join(sorted((p.first, p.second))) for p in pairs}


@pytest.mark.parametrize(
    ("reason", "kind", "taken"),
    [
        ("Adjacent", "Adjacent", True),
        ("adjacent links", "Adjacent", True),
        ("Default", "Default", True),
        ("Collision by Default", "Default", True),
        ("ALWAYS", "Always", True),
        ("  Always   in\nCollision ", "Always", True),
        ("Never", "Never", False),
        ("Never in Collision", "Never", False),
        ("Never in 500: below 0.006", "Never", False),
        ("never: sampled", "Never", False),
        ("User", "User", False),
        ("Adjacently placed, almost always", "Adjacently placed, almost always", False),
        ("Nevertheless adjacent", "Nevertheless adjacent", False),
        ("", "no reason given", False),
        (None, "no reason given", False),
    ],
)
def test_reasons(tmp_path, reason, kind, taken):
    (found,) = read(tmp_path, srdf(pair("a", "b", reason))).pairs
    assert (found.kind, found.is_taken, found.line) == (kind, taken, 2)
    assert kind_of(found.reason) == kind


def test_a_pair_is_in_no_order_and_once(tmp_path):
    """What is taken counts, wherever it stands."""
    text = srdf(
        pair("a", "b", "Never"), pair("b", "a", "Always"), pair("a", "b", "Default")
    )
    found = read(tmp_path, text)
    assert [(p.kind, p.line) for p in found.pairs] == [("Always", 3)]
    assert (len(found.taken), len(found.left)) == (1, 0)


def test_by_default_a_link_may_touch_every_other_but_for_those_enabled(tmp_path):
    text = srdf(
        '<disable_default_collisions link="a"/>',
        '<enable_collisions link1="c" link2="a"/>',
        pair("b", "c", "Never"),
    )
    found = read(tmp_path, text)
    assert names(found.taken) == {"arail", "ab", "ad"}
    assert names(found.left) == {"bc"}
    assert {p.kind for p in found.taken} == {"disable_default_collisions"}


def test_enabled_alone_changes_nothing(tmp_path):
    assert read(tmp_path, srdf('<enable_collisions link1="a" link2="b"/>')).pairs == ()


ONE_LINE = {
    "no link": (pair("a", "bb"), r"<disable_collisions> names 'bb', which is no"),
    "an obstacle": (pair("gantry", "a"), "names 'gantry'.*never an obstacle"),
    "a name meant": (pair("a", "Rail"), r"did you mean 'rail'\?"),
    "itself": (pair("b", "b"), "names the link 'b' with itself"),
    "no name": ('<disable_collisions link1="a"/>', "has no link2"),
    "never, but no link": (pair("a", "zz", "Never"), "names 'zz'"),
    "enabled, no link": (
        '<enable_collisions link1="a" link2="zz"/>',
        "<enable_collisions> names 'zz'",
    ),
    "by default, no link": (
        '<disable_default_collisions link="zz"/>',
        "<disable_default_collisions> names 'zz'",
    ),
    "by default, no name": ("<disable_default_collisions/>", "has no link"),
    "misspelt": (
        '<enable_collision link1="a" link2="b"/>',
        r"<enable_collision> is not known .*did you mean 'enable_collisions'\?",
    ),
    "misspelt in its second word": (
        '<enable_colisions link1="a" link2="b"/>',
        r"<enable_colisions> is not known .*did you mean 'enable_collisions'\?",
    ),
    "misspelt in both": ('<enabel_colision link1="a" link2="b"/>', "is not known"),
    "another word for it": ('<Enable-Contact link1="a" link2="b"/>', "is not known"),
    "taken back": (
        '<disable_collisions link1="a" link2="b" reason="Always" enabled="false"/>',
        "<disable_collisions> has enabled, which nobody reads",
    ),
    "a misspelt attribute": (
        '<disable_collisions link1="a" link2="b" raeson="Never"/>',
        r"has raeson, which nobody reads; did you mean 'reason'\?",
    ),
    "of another namespace": (
        '<m:disable_collisions xmlns:m="m" link1="a" link2="b"/>',
        "<m:disable_collisions> is not known",
    ),
    "misplaced": (
        f'<group name="g">{pair("a", "b")}</group>',
        "<disable_collisions> stands in <group>",
    ),
    "a URDF": ('<link name="a"/>', "this is a URDF, not an SRDF"),
    "a URDF's joint": ('<joint name="j" type="fixed"/>', "this is a URDF"),
    "a xacro": (
        '<xacro:macro xmlns:xacro="http://wiki.ros.org/xacro" name="m">'
        f"{pair('a', 'b')}</xacro:macro>",
        "line 2: <xacro:macro>: expand the xacro first",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", ONE_LINE)
def test_what_cannot_be_meant_is_refused_in_one_line(tmp_path, name):
    element, words = ONE_LINE[name]
    with pytest.raises(UrdfError, match=words) as caught:
        read(tmp_path, srdf(element))
    told = str(caught.value)
    assert told.startswith(f"{tmp_path / 'robot.srdf'}: line 2: ")
    assert "\n" not in told


def test_disabled_and_enabled_is_refused_whichever_comes_first(tmp_path):
    enable = '<enable_collisions link1="b" link2="a"/>'
    for elements in ((pair("a", "b"), enable), (enable, pair("a", "b"))):
        with pytest.raises(UrdfError, match="names the same pair: one must go"):
            read(tmp_path, srdf(*elements))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        ("<robot>", "not well-formed XML"),
        ("<semantic/>", "its root is <semantic>, not <robot>"),
        (
            '<!DOCTYPE r [<!ENTITY e SYSTEM "/etc/passwd">]><robot>&e;</robot>',
            "DOCTYPE",
        ),
        ("<robot>" + "<group>" * 70 + "</group>" * 70 + "</robot>", "nests deeper"),
        ("<robot>" + "<group/>" * 500_001 + "</robot>", "more than 500000 elements"),
    ],
)
def test_it_is_read_as_carefully_as_a_urdf(tmp_path, text, words):
    with pytest.raises(UrdfError, match=words):
        read(tmp_path, text)


def test_a_link_out_of_its_folder_is_not_followed(tmp_path):
    (tmp_path / "secret").mkdir()
    (tmp_path / "secret" / "real.srdf").write_text(srdf(pair("a", "b")))
    (tmp_path / "project").mkdir()
    link = tmp_path / "project" / "arm.srdf"
    link.symlink_to(tmp_path / "secret" / "real.srdf")
    with pytest.raises(UrdfError, match="is a link to"):
        read_srdf(link, LINKS)


def test_pairs_of_a_hostile_file_have_an_end(tmp_path):
    links = [f"l{k}" for k in range(2000)]
    text = srdf(*(f'<disable_default_collisions link="{n}"/>' for n in links))
    with pytest.raises(UrdfError, match=f"more than {MOST_PAIRS:,} pairs"):
        read(tmp_path, text, links)


def test_a_long_reason_is_cut(tmp_path):
    (found,) = read(tmp_path, srdf(pair("a", "b", "x" * 9000))).pairs
    assert found.reason == "x" * 117 + "..."


@pytest.mark.parametrize("tag", ["gripper", "group", "specificities", "rotor_params"])
def test_what_speaks_of_something_else_is_let_pass(tmp_path, tag):
    found = read(tmp_path, srdf(f'<{tag} name="x" any="thing"/>', pair("a", "b")))
    assert names(found.pairs) == {"ab"}
