"""The same findings as text, JSON, SARIF, JUnit and Markdown."""

import io
import json
from xml.etree import ElementTree

import jsonschema
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from borecheck.validation import (
    Finding,
    Options,
    Severity,
    validate_file,
    validate_text,
)
from borecheck.validation.outputs.json import as_json
from borecheck.validation.outputs.junit import as_junit
from borecheck.validation.outputs.markdown import as_markdown
from borecheck.validation.outputs.sarif import as_sarif
from borecheck.validation.outputs.text import as_text, wants_colour
from tests import corpus
from tests.places import DATA

SCHEMA = DATA / "sarif" / "sarif-2.1.0-trimmed.schema.json"
KEYS = {
    *("code", "severity", "tier", "element", "file", "line", "message", "why", "hint"),
    "libraries",
}


@pytest.fixture
def results():
    folders = ("J302-axis-zero", "G503-mesh-absolute-path", "J338-angle-rounded")
    found = []
    for folder in folders:
        for path in sorted((corpus.FOLDER / folder).glob("*.urdf")):
            found.append((str(path), validate_file(path, run=False, configured=False)))
    severities = {f.severity for _, findings in found for f in findings}
    assert severities == set(Severity), "premise: all severities are there"
    return found


def _all(results):
    return [finding for _, findings in results for finding in findings]


def test_json_holds_the_contract(results):
    document = json.loads(as_json(results, "collision"))
    assert document["schema_version"]
    assert len(document["files"]) == len(results)
    for entry in document["files"]:
        for finding in entry["findings"]:
            assert set(finding) >= KEYS
            assert finding["severity"] in ("error", "warning", "info")
            assert isinstance(finding["libraries"], list)
    assert document["summary"]["files"] == len(results)
    assert document["summary"]["error"] == sum(
        finding.severity == "error" for finding in _all(results)
    )


def test_sarif_fits_its_schema(results):
    document = json.loads(as_sarif(results, "collision"))
    jsonschema.validate(document, json.loads(SCHEMA.read_text()))
    run = document["runs"][0]
    assert len(run["results"]) == len(_all(results))
    rules = run["tool"]["driver"]["rules"]
    for result in run["results"]:
        assert rules[result["ruleIndex"]]["id"] == result["ruleId"]


def test_sarif_fingerprints_outlive_inserted_lines(tmp_path):
    text = (corpus.FOLDER / "J302-axis-zero" / "zero.bad.urdf").read_text()
    path = tmp_path / "a.urdf"
    marks = []
    for shift in ("", "\n\n\n"):
        path.write_text(text.replace("<link", shift + "<link", 1))
        found = validate_file(path, run=False, select=["J302"], configured=False)
        document = json.loads(as_sarif([("a.urdf", found)], "collision"))
        marks.append(document["runs"][0]["results"][0]["partialFingerprints"])
    assert marks[0] == marks[1]


def test_junit_is_xml_with_a_failure_for_each_error(results):
    root = ElementTree.fromstring(as_junit(results, Severity.ERROR))
    errors = [finding for finding in _all(results) if finding.severity == "error"]
    assert len(root.findall(".//failure")) == len(errors) > 0
    assert len(root.findall("testsuite")) == len(results)
    for suite in root.findall("testsuite"):
        assert int(suite.get("tests", "0")) == len(suite.findall("testcase")) > 0


def test_markdown_leaves_nothing_to_interpret():
    odd = Finding(
        *("J302", Severity.ERROR, "joints", "robot", "a|b.urdf", 3),
        *("<script> | *x*", "why", "hint", ()),
    )
    text = as_markdown([("a|b.urdf", [odd])])
    assert "<script>" not in text
    assert r"\| \*x\*" in text


def test_text_points_at_the_attribute():
    path = corpus.FOLDER / "J302-axis-zero" / "zero.bad.urdf"
    found = validate_file(path, run=False, configured=False, select=["J302"])
    head, source, caret, *_ = as_text([(str(path), found)]).splitlines()
    assert head == (
        f"{path}:121: error: J302: the axis is 0 0 0 [robot/joint[@name='elbow']/axis]"
    )
    start = caret.index("^")
    assert source[start : start + caret.count("^")] == 'xyz="0 0 0"'


def test_text_points_at_an_attribute_on_another_line_of_the_tag(tmp_path):
    path = tmp_path / "a.urdf"
    text = (corpus.FOLDER / "J302-axis-zero" / "zero.bad.urdf").read_text()
    path.write_text(text.replace('<axis xyz="0 0 0"/>', '<axis\n  xyz="0 0 0"\n/>'))
    found = validate_file(path, run=False, configured=False, select=["J302"])
    head, source, caret, *_ = as_text([(str(path), found)]).splitlines()
    assert head.startswith(f"{path}:121: error: J302")
    assert source.startswith("  122 | ")
    assert source[caret.index("^") :] == 'xyz="0 0 0"'


def test_colour_only_on_a_terminal(monkeypatch):
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    monkeypatch.delenv("NO_COLOR", raising=False)
    assert wants_colour(Terminal())
    assert not wants_colour(io.StringIO())
    monkeypatch.setenv("NO_COLOR", "1")
    assert not wants_colour(Terminal())


def test_coloured_text_says_the_same(results):
    import re

    coloured = as_text(results, colour=True)
    assert "\033[" in coloured
    assert re.sub(r"\033\[[\d;]*m", "", coloured) == as_text(results)


HOSTILE = st.text(
    st.characters(blacklist_categories=("Cs",), blacklist_characters="\0"), max_size=12
).map(lambda text: f"a{text}\n::error file=x::pwn\x85\u2028\x1b[2J\u202e")


@settings(max_examples=30, deadline=None)
@given(HOSTILE, HOSTILE)
def test_whatever_a_name_holds_a_finding_is_one_line(link, file):
    shown = "".join(f"&#{ord(c)};" for c in link if c in "\t\n\r" or c >= " ")
    text = f'<robot name="r"><link name="{shown}"/><link name="{shown}"/></robot>'
    found = validate_text(text, f"::{file}.urdf", Options(run=False))
    assert found, "premise: two links of one name"
    results = [(f"::{file}.urdf", found)]
    forms = (
        as_text(results, colour=False),
        as_junit(results, Severity.ERROR),
        as_markdown(results),
        as_sarif(results, "collision"),
    )
    for form in forms:
        for line in form.split("\n"):
            assert line.isprintable(), line
            assert not line.startswith(("::", "##["))
    ElementTree.fromstring(forms[1])
    heads = [line for line in forms[0].split("\n") if ": error: " in line]
    assert len(heads) == sum(f.severity is Severity.ERROR for f in found)
