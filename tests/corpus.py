"""The corpus of URDF files: what is expected of each, and what is found."""

import tomllib
from functools import cache
from pathlib import Path

from borecheck.validation import Finding, validate_file
from borecheck.validation.options import Loop, RemoteCentre, ToolAxis

FOLDER = Path(__file__).parent / "data" / "urdf"
# Checks that need other libraries are run only where a case asks for it.
DEFAULT = {"run": False, "profile": "dynamics"}
_RECORDS = {"remote_centres": RemoteCentre, "tool_axes": ToolAxis, "loops": Loop}


def cases(kind: str) -> list[Path]:
    """All files of a kind, "bad" or "sound"."""
    return sorted(FOLDER.glob(f"*/*.{kind}.urdf*"))


def stem(path: Path) -> str:
    """The case's name: what stands before .bad or .sound."""
    return path.name.split(".")[0]


def code_of(path: Path) -> str:
    """The code of the check that the case is for."""
    return path.parent.name.partition("-")[0]


def options_of(path: Path) -> dict[str, object]:
    """The options of a case, from the TOML file beside it."""
    beside = path.parent / f"{stem(path)}.toml"
    options: dict[str, object] = dict(DEFAULT)
    if beside.exists():
        for key, value in tomllib.loads(beside.read_text()).items():
            options[key] = _option(key, value, path)
    return options


@cache
def findings_of_case(path: Path) -> list[Finding]:
    """What is found in a case; not to be changed."""
    return validate_file(path, configured=False, **options_of(path))


def expected_of(path: Path) -> list[str]:
    """The expected findings: `CODE severity line element` each."""
    text = (path.parent / f"{stem(path)}.expected").read_text()
    return [line for line in text.splitlines() if line]


def _option(key: str, value: object, path: Path) -> object:
    if key in _RECORDS:
        return tuple(
            _RECORDS[key](**{k: _frozen(v) for k, v in entry.items()})
            for entry in value
        )
    if key in ("srdf", "reference"):
        return path.parent / str(value)
    if key == "closed_form":
        return _closed_form(float(value))
    return _frozen(value)


def _frozen(value: object) -> object:
    return tuple(value) if isinstance(value, list) else value


def _closed_form(height: float):
    """The base of the corpus's arm, analytically: a frame `height` above the root."""
    import numpy as np

    def forward(positions):
        T = np.eye(4)
        c, s = np.cos(positions["shoulder"]), np.sin(positions["shoulder"])
        T[:2, :2] = [[c, -s], [s, c]]
        T[2, 3] = height
        return {"upper": T}

    return forward
