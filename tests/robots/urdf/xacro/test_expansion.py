import pytest

from borecheck.errors import UrdfError
from borecheck.robots.urdf.parse import parse
from borecheck.robots.urdf.reach import Roots
from borecheck.robots.urdf.xacro import expand
from borecheck.robots.urdf.xacro.document import MAX_DEPTH

NS = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
MAIN = f"""<?xml version="1.0"?>
<robot name="a" {NS}>
  <xacro:arg name="n" default="2"/>
  <xacro:arg name="spare" default="1"/>
  <xacro:include filename="$(find arm_pkg)/parts/rod.xacro"/>
  <link name="base"/>
  <xacro:rod name="x" size="${{2 * 0.1}}"/>
  <xacro:if value="${{$(arg n) > 1}}">
    <xacro:rod name="y" size="1"/>
  </xacro:if>
</robot>
"""
ROD = f"""<robot {NS}>
  <xacro:macro name="rod" params="name size">
    <link name="${{name}}">
      <visual><geometry><sphere radius="${{size}}"/></geometry></visual>
    </link>
    <joint name="j_${{name}}" type="fixed">
      <parent link="base"/><child link="${{name}}"/>
    </joint>
  </xacro:macro>
</robot>
"""


@pytest.fixture
def main(tmp_path):
    package = tmp_path / "arm_pkg"
    (package / "parts").mkdir(parents=True)
    (package / "parts" / "rod.xacro").write_text(ROD)
    (package / "a.urdf.xacro").write_text(MAIN)
    return package / "a.urdf.xacro"


def test_a_file_is_expanded_without_ros(main):
    expanded = expand(main, {"n": "3"})
    tree = parse(expanded.text, "a", expanded.places)
    assert [link.name for link in tree.links] == ["base", "x", "y"]
    assert expanded.arguments == {"n": "3", "spare": "1"}
    assert expanded.unreferenced == ("spare",)
    assert [path.name for path in expanded.files] == ["a.urdf.xacro", "rod.xacro"]


def test_elements_know_the_line_of_their_source(main):
    expanded = expand(main)
    tree = parse(expanded.text, "a", expanded.places)
    assert tree.link("base").place.file == str(main)
    assert tree.link("base").place.line == 6
    assert tree.link("y").place.file.endswith("rod.xacro")
    assert tree.link("y").place.line == 3


def test_arguments_that_nobody_declares_are_told(main):
    assert expand(main, {"m": "1"}).unused == ("m",)


def test_packages_are_found_over_given_roots(main, tmp_path_factory):
    elsewhere = tmp_path_factory.mktemp("elsewhere") / "b.urdf.xacro"
    elsewhere.write_text(MAIN)
    with pytest.raises(UrdfError, match=r"find arm_pkg.*tried"):
        expand(elsewhere)
    assert len(parse(expand(elsewhere, {}, Roots((main.parents[1],))).text).links) == 3


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('xacro:rod name="x"', 'xacro:rid name="x"', "line 7: xacro: unknown macro"),
        ("2 * 0.1", "2 * foo", "line 7.*'foo' is not defined"),
        ("$(arg n)", "$(arg m)", "line 8.*'m' has no value"),
        ('<link name="base"/>', "<link>", "not well-formed"),
        ('size="1"', 'sice="1"', "line 9: xacro: Invalid parameter"),
        ("rod.xacro", "rud.xacro", "line 5.*no such file"),
        ("2 * 0.1", "10**10**10", "exponent"),
        (
            "2 * 0.1",
            "[0 for i in range(10**10)][0]",
            r"line 7.*range\(10000000000\) is longer than",
        ),
        ("2 * 0.1", "python.sum(python.range(10**30))", "line 7.*range.*longer than"),
    ],
)
def test_mistakes_are_told_with_their_line(main, old, new, words):
    assert old in MAIN
    main.write_text(MAIN.replace(old, new))
    with pytest.raises(UrdfError, match=words) as error:
        expand(main)
    assert "\n" not in str(error.value)


def test_an_optional_include_may_be_missing(main):
    main.write_text(
        MAIN.replace(
            "  <link",
            '  <xacro:include filename="none.xacro" optional="true"/>\n  <link',
            1,
        )
    )
    assert len(parse(expand(main).text).links) == 3


def test_macro_bombs_end(main):
    calls = "".join(
        f'<xacro:macro name="m{i}" params="">{2 * f"<xacro:m{i - 1}/>"}</xacro:macro>'
        for i in range(1, 40)
    )
    first = '<xacro:macro name="m0" params=""/>'
    main.write_text(f'<robot name="b" {NS}>{first}{calls}<xacro:m39/></robot>')
    with pytest.raises(UrdfError, match="macro calls"):
        expand(main)


@pytest.mark.parametrize("levels", [MAX_DEPTH, 20_000])
def test_elements_within_elements_end(main, levels):
    """Each is marked in as many steps as it is deep: 20,000 took 13 s."""
    deep = "<a>" * levels + "</a>" * levels
    main.write_text(f'<robot name="b" {NS}>{deep}</robot>')
    with pytest.raises(UrdfError, match=f"deeper than {MAX_DEPTH} levels"):
        expand(main)


def test_endless_recursion_ends(main):
    main.write_text(
        f'<robot name="b" {NS}><xacro:macro name="m" params=""><xacro:m/></xacro:macro>'
        "<xacro:m/></robot>"
    )
    with pytest.raises(UrdfError, match="without end"):
        expand(main)


def test_entities_are_refused(main):
    main.write_text('<!DOCTYPE r [<!ENTITY a "b">]>\n<robot name="&a;"/>')
    with pytest.raises(UrdfError, match="refused"):
        expand(main)


def test_the_xacro_package_is_left_as_it_was(main):
    import xacro
    from xacro import substitution_args

    before = (xacro.parse, xacro.eval_all, substitution_args._eval_find)
    expand(main)
    with pytest.raises(UrdfError):
        expand(main.parent / "none.xacro")
    assert (xacro.parse, xacro.eval_all, substitution_args._eval_find) == before


def test_memory_bombs_end(main):
    import resource

    before = resource.getrlimit(resource.RLIMIT_AS)
    for bomb in ("([0] * 10**10)[0]", "len('x' * 10**11)"):
        main.write_text(MAIN.replace("2 * 0.1", bomb))
        with pytest.raises(UrdfError, match=r"line 7: xacro: .*is larger than 250000"):
            expand(main)
        assert resource.getrlimit(resource.RLIMIT_AS) == before
    main.write_text(MAIN.replace("2 * 0.1", "len([0] * 10**5)"))
    assert "100000" in expand(main).text


def test_time_bombs_end(main, monkeypatch):
    import signal

    from borecheck.robots.urdf.xacro import limits, values

    monkeypatch.setattr(limits, "MAX_SECONDS", 0.3)
    monkeypatch.setattr(values.Budget, "spend", lambda *_: None)
    before = signal.getsignal(signal.SIGALRM)
    loop = "[0 for i in range(10**6) for j in range(10**6) if 0]"
    main.write_text(MAIN.replace("2 * 0.1", loop))
    with pytest.raises(UrdfError, match=r"line 7: xacro: .*longer than 0\.3 s"):
        expand(main)
    assert signal.getsignal(signal.SIGALRM) == before
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)


def test_another_thread_expands_without_a_timer(main):
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(1) as pool:
        assert pool.submit(expand, main).result().text == expand(main).text


def test_ranges_of_any_form_still_count(main):
    main.write_text(MAIN.replace("2 * 0.1", "len(list(range(2, 8, 2)))"))
    assert 'radius="3"' in expand(main).text
