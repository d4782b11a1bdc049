"""Stored results: from JSON and from the page that carries it, or one clear line."""

import json

import pytest

from borecheck.core.result_file import RESULT_ID, read_result
from borecheck.errors import InputError

DOCUMENT = {"schema_version": "1", "command": "check", "name": "</script>"}


def test_json(tmp_path):
    file = tmp_path / "r.json"
    file.write_text(json.dumps(DOCUMENT))
    assert read_result(file) == DOCUMENT


def test_the_block_of_a_page(tmp_path):
    file = tmp_path / "r.html"
    block = json.dumps(DOCUMENT).replace("<", "\\u003c")
    file.write_text(
        f'<!doctype html><script>x = 1;</script><script id="{RESULT_ID}" '
        f'type="application/json">{block}</script><p></p>'
    )
    assert read_result(file) == DOCUMENT


@pytest.mark.parametrize(
    ("content", "saying"),
    [
        (b"", "no JSON"),
        (b"{", "no JSON"),
        (b"[" * 100_000, "no JSON"),
        (b'{"schema_version": 1' + b"0" * 5000 + b"}", "no JSON"),
        (b"[1, 2]", "no result of borecheck"),
        (b'{"command": "check"}', "no `schema_version`"),
        (b'{"schema_version": "999"}', "schema version '999'"),
        (b'{"schema_version": 1}', "schema version '1', this borecheck reads '1'"),
        (b'{"schema_version": "1", "x": NaN}', "no finite number"),
        (b"<html></html>", "a page without a result"),
        (b"\xff\xfe\x00", "cannot be read"),
    ],
)
def test_files_that_hold_none(tmp_path, content, saying):
    file = tmp_path / "r.json"
    file.write_bytes(content)
    with pytest.raises(InputError, match=saying) as error:
        read_result(file)
    assert "\n" not in str(error.value)


def test_no_file_and_a_folder(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        read_result(tmp_path / "none.json")
    with pytest.raises(InputError, match="directory"):
        read_result(tmp_path)
