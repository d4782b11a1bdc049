"""Do `check` and `validate` agree about every robot file?

    python -m studies.one_judge [--no-run] [FILE or FOLDER ...]

One line a file: whether `check` loads it, the first error that
`validate --profile collision` finds, and whether the two agree: check refuses exactly
the files that have an error.
Without files: this project's robots, the corpora of the tests, and example-robot-data,
if it is installed. `--no-run` asks no other library about the file (faster; borecheck's
own judgement is the same).
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from borecheck.errors import BorecheckError
from borecheck.robots.robot import robot_with
from borecheck.validation import validate_file

PROJECT = Path(__file__).resolve().parents[1]
ENDINGS = (".urdf", ".xacro")
IN_PROJECT = ("tests/data", "zerobot", "mri_arm", "borecheck_models")
SHOWN = 90  # characters of a reason


class Judgement(NamedTuple):
    """What the two say about one file.

    Attributes:
        file: The file.
        refusal: Why check does not load it; None if it does.
        errors: The errors that validate finds, as code and message.
    """

    file: Path
    refusal: str | None
    errors: tuple[str, ...]

    @property
    def agree(self) -> bool:
        """Whether check refuses exactly where validate has an error."""
        return (self.refusal is None) == (not self.errors)


def judge(file: Path, run: bool = False) -> Judgement:
    """Both judges about one file; `run` also asks Pinocchio and yourdfpy about it."""
    try:
        robot_with(file, {})
        refusal = None
    except BorecheckError as error:
        refusal = str(error)
    found = validate_file(file, configured=False, profile="collision", run=run)
    errors = (f"{f.code} {f.message}" for f in found if f.severity == "error")
    return Judgement(file, refusal, tuple(errors))


def robot_files(places: Sequence[Path]) -> list[Path]:
    """The robot files in these folders, and the files among them."""
    found: list[Path] = []
    for place in places:
        if place.is_dir():
            inside = (p for p in place.rglob("*") if p.suffix in ENDINGS)
            found += sorted(path for path in inside if path.is_file())
        else:
            found.append(place)
    return found


def default_places() -> Iterator[Path]:
    """This project's robots, the corpora, and example-robot-data where it is."""
    yield from (PROJECT / name for name in IN_PROJECT)
    yield from example_robot_data()


def example_robot_data() -> list[Path]:
    """The folder of example-robot-data's robots, if it is installed."""
    share = "cmeel.prefix/share/example-robot-data/robots"
    folders = (Path(entry) / share for entry in sys.path if entry)
    return [folder for folder in folders if folder.is_dir()][:1]


def main(argv: Sequence[str] | None = None) -> int:
    """Prints the table; 1 if the judges disagree anywhere."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--no-run", action="store_true", help="ask no library")
    parser.add_argument("places", nargs="*", type=Path)
    args = parser.parse_args(argv)
    files = robot_files(args.places or list(default_places()))
    judged = []
    for file in files:
        judged.append(judge(file, run=not args.no_run))
        print(_row(judged[-1]), flush=True)
    refused = sum(j.refusal is not None for j in judged)
    apart = [j for j in judged if not j.agree]
    print(
        f"{len(judged)} files: check loads {len(judged) - refused} and refuses "
        f"{refused}; validate agrees about {len(judged) - len(apart)}"
    )
    return 1 if apart else 0


def _row(judgement: Judgement) -> str:
    name = _short(judgement.file)
    if judgement.refusal is None and judgement.agree:
        return f"agree     loads    {name}"
    said = "refuses" if judgement.refusal is not None else "loads"
    mark = "agree   " if judgement.agree else "DISAGREE"
    reason = (*judgement.errors, judgement.refusal or "-")[0][:SHOWN]
    return f"{mark}  {said:7}  {name}: {' '.join(reason.split())}"


def _short(file: Path) -> str:
    for base in (PROJECT, *example_robot_data()):
        if file.is_relative_to(base):
            return str(file.relative_to(base))
    return str(file)


if __name__ == "__main__":
    sys.exit(main())
