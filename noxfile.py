"""Chores: what people, pre-commit and CI run, each written once.

They run in the environment that nox is started from
(`pip install -e ".[dev,view,ct]"`).
"""

import os
import sys
from pathlib import Path

import nox

nox.options.default_venv_backend = "none"
nox.options.sessions = ["lint", "types", "rooms", "generated", "tests"]

BIN = Path(sys.executable).parent


def _run(session: nox.Session, program: str, *words: str) -> None:
    session.run(str(BIN / program), *words, external=True)


@nox.session
def lint(session: nox.Session) -> None:
    """Format and lint, without changing anything."""
    _run(session, "ruff", "format", "--check", ".")
    _run(session, "ruff", "check", ".")


@nox.session
def types(session: nox.Session) -> None:
    """Strict types."""
    _run(session, "mypy")


@nox.session
def rooms(session: nox.Session) -> None:
    """Imports only go down."""
    _run(session, "lint-imports")


@nox.session
def generated(session: nox.Session) -> None:
    """What scripts write is what lies here."""
    _run(session, "python", "scripts/compile_urdf.py", "--check")
    _run(session, "python", "scripts/make_meshes.py", "--check")
    _run(session, "python", "scripts/make_examples.py", "--check")


@nox.session
def docs(session: nox.Session) -> None:
    """The documentation site; a broken link or name is an error."""
    _run(session, "mkdocs", "build", "--strict", "--quiet")


@nox.session
def tests(session: nox.Session) -> None:
    """All tests, or those named after `--`."""
    _run(session, "pytest", "-n", "2", *session.posargs)


@nox.session
def random_order(session: nox.Session) -> None:
    """All tests, or those named after `--`, in an order drawn from a seed."""
    seed = os.environ.get("BORECHECK_ORDER_SEED", "1")
    order = ("-p", "randomly", f"--randomly-seed={seed}")
    _run(session, "pytest", "-n", "2", *order, *session.posargs)


@nox.session
def alone(session: nox.Session) -> None:
    """Each test file in a process of its own; an interrupted run goes on."""
    _run(session, "python", "-m", "studies.tests_alone", *session.posargs)
