import pytest

from borecheck.errors import UrdfError
from borecheck.robots.urdf.attributes import NotNumbersError, parse_numbers
from borecheck.robots.urdf.source import MAX_ATTRIBUTES, MAX_DEPTH, elements, read
from borecheck.robots.urdf.text import MAX_BYTES, read_bytes

MANY = " ".join(f"a{k}='1'" for k in range(MAX_ATTRIBUTES + 1))


def test_places_name_line_and_path():
    source = read(
        '<robot name="a">\n  <joint name="j">\n    <axis/>\n</joint></robot>', "f"
    )
    axis = next(source.root.iter("axis"))
    assert source.place(axis) == ("f", 3, "robot/joint[@name='j']/axis")


def test_elements_of_equal_name_are_counted():
    source = read(
        '<robot><link name="a"/><link name="a"/><link name="b"/></robot>', "f"
    )
    paths = [source.path(element) for element in elements(source.root)]
    assert paths == ["robot", "robot/link[1]", "robot/link[2]", "robot/link[@name='b']"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty"),
        ("  \n", "empty"),
        ("<robot>", "not well-formed"),
        ('<!DOCTYPE r [<!ENTITY a "b">]><robot/>', "entities"),
        ("<!DOCTYPE r [<!ELEMENT a ANY>]><robot/>", "entities"),
        ("<robot>" + "<a>" * MAX_DEPTH + "</a>" * MAX_DEPTH + "</robot>", "deeper"),
        ("<robot><a " + MANY + "/></robot>", "attributes"),
        ("\x00\x01", "not"),
    ],
)
def test_what_cannot_be_read_is_refused_in_one_line(text, words):
    with pytest.raises(UrdfError, match=words) as error:
        read(text, "f.urdf")
    assert "\n" not in str(error.value)


def test_billion_laughs_is_refused():
    levels = "".join(f'<!ENTITY a{i} "{f"&a{i - 1};" * 10}">' for i in range(1, 10))
    text = f'<!DOCTYPE r [<!ENTITY a0 "ha">{levels}]><robot name="&a9;"/>'
    with pytest.raises(UrdfError):
        read(text, "f")


def test_external_entities_are_not_read(tmp_path):
    secret = tmp_path / "secret"
    secret.write_text("42")
    text = f'<!DOCTYPE r [<!ENTITY x SYSTEM "{secret}">]><robot name="r">&x;</robot>'
    with pytest.raises(UrdfError, match="entities"):
        read(text, "f")


def test_giant_files_are_refused_before_they_are_read(tmp_path):
    path = tmp_path / "giant.urdf"
    with path.open("wb") as stream:
        stream.truncate(MAX_BYTES + 1)  # sparse: takes no room on the disk
    with pytest.raises(UrdfError, match="larger than"):
        read_bytes(path)


def test_files_that_are_none(tmp_path):
    with pytest.raises(UrdfError, match="directory"):
        read_bytes(tmp_path)
    with pytest.raises(UrdfError, match="no such file"):
        read_bytes(tmp_path / "nothing.urdf")
    loop = tmp_path / "loop.urdf"
    loop.symlink_to(loop)
    with pytest.raises(UrdfError):
        read_bytes(loop)


def test_what_parsers_disagree_about_is_a_defect_not_an_error():
    source = read('<?xml version="0.0"?><robot><a:b/></robot>', "f")
    assert [defect.kind for defect in source.defects] == ["version", "prefix"]


def test_older_errors_do_not_leak_into_a_later_file():
    with pytest.raises(UrdfError):
        read("<robot><", "f")
    assert [defect.kind for defect in read("<robot><a:b/></robot>", "f").defects] == [
        "prefix"
    ]


@pytest.mark.parametrize(
    ("text", "values"),
    [("1 2 3", (1, 2, 3)), (" -.5\t1e-3 +2. ", (-0.5, 1e-3, 2)), ("", ())],
)
def test_numbers_are_read(text, values):
    assert parse_numbers(text) == values


@pytest.mark.parametrize(
    "text", ["1,2", "1_0", "0x10", "nan", "inf", "1e999", "1 2 a", "1-2", "١"]
)
def test_what_is_no_number_is_refused(text):
    with pytest.raises(NotNumbersError):
        parse_numbers(text)
