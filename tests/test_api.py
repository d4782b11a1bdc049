import subprocess
import sys

import pytest

import borecheck as bc
from tests.places import ROBOTS

ROBOT = ROBOTS / "two_link.urdf"


@pytest.mark.parametrize("name", bc.__all__)
def test_every_public_name_is_there(name):
    assert callable(getattr(bc, name))
    assert name in dir(bc)


def test_names_stay_functions_after_their_modules_are_imported():
    code = (
        "import borecheck.validation, borecheck.contact.compare\n"
        "import borecheck.contact.check\n"
        "from borecheck.verify import check\n"  # a room that is called as a name is
        "import borecheck as bc\n"
        "import types\n"
        "found = {n: getattr(bc, n) for n in bc.__all__}\n"
        "bad = [n for n, f in found.items() if isinstance(f, types.ModuleType)]\n"
        "raise SystemExit(', '.join(bad) or 0)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="chekc"):
        bc.chekc  # noqa: B018


def test_validate_gives_findings_as_values(tmp_path):
    assert isinstance(bc.validate(ROBOT), list)
    broken = tmp_path / "broken.urdf"
    broken.write_text(ROBOT.read_text().replace('child link="arm"', 'child link="am"'))
    assert any(f.severity == "error" for f in bc.validate(broken))
