"""The list of claims can be read, and every command in it is there."""

import re
import tomllib
from importlib.util import find_spec
from pathlib import Path

from tests.places import PROJECT

CLAIMS = tomllib.loads((PROJECT / "scripts/evidence.toml").read_text())["claim"]


def test_every_claim_is_named_once_and_has_a_command():
    items = [claim["item"] for claim in CLAIMS]
    assert len(items) == len(set(items)) > 30
    assert all(claim["claim"] and claim["command"] for claim in CLAIMS)


def test_studies_and_tests_that_commands_name_exist():
    text = "\n".join(claim["command"] for claim in CLAIMS)
    modules = set(
        re.findall(r"python -m ((?:crane\.)?(?:studies|benchmarks)[.\w]*)", text)
    )
    assert len(modules) > 10
    assert all(find_spec(name) for name in modules)
    files = set(re.findall(r"\b((?:tests|scripts)/[\w/.]+)", text))
    assert len(files) > 10
    assert [name for name in files if not (PROJECT / Path(name)).exists()] == []


def test_what_is_shown_is_claimed():
    page = (PROJECT / "docs/evidence.md").read_text()
    shown = re.findall(r"^## (\d+\.\d+\w?) ", page, re.MULTILINE)
    assert set(shown) <= {claim["item"] for claim in CLAIMS}
