"""A process whose streams are closed, broken or narrow ends with one line or less."""

import os
import subprocess
import sys

import pytest

BORECHECK = f"'{sys.executable}' -m borecheck"


def shell(line, **more):
    done = subprocess.run(
        ["bash", "-c", line], capture_output=True, text=True, timeout=60, **more
    )
    assert "Traceback" not in done.stderr
    assert "Exception ignored" not in done.stderr
    return done


@pytest.mark.parametrize(
    ("line", "status"),
    [
        (f"{BORECHECK} explain J302 >&-", 0),
        (f"{BORECHECK} explain J302 >&- 2>&- <&-", 0),
        (f"{BORECHECK} explain nothing 2>&-", 2),
        (f"{BORECHECK} explain J302 | head -0; exit ${{PIPESTATUS[0]}}", 2),
        (f"{BORECHECK} explain nothing |& head -0; exit ${{PIPESTATUS[0]}}", 2),
        (f"{BORECHECK} --help | head -0; exit ${{PIPESTATUS[0]}}", 0),
    ],
)
def test_streams_that_nobody_reads(line, status):
    done = shell(line)
    assert (done.returncode, done.stderr) == (status, "")


def test_a_full_disk_behind_the_output_is_told():
    done = shell(f"{BORECHECK} explain J302 > /dev/full")
    assert done.returncode == 2
    assert done.stderr == "borecheck: error: [Errno 28] No space left on device\n"


def test_a_file_is_not_taken_for_the_closed_output(tmp_path):
    code = (
        "from borecheck.core.streams import prepare_streams; prepare_streams();"
        "f = open('file', 'w'); print('lost'); f.write('kept')"
    )
    shell(f"'{sys.executable}' -c \"{code}\" >&-", cwd=tmp_path)
    assert (tmp_path / "file").read_text() == "kept"


def test_letters_that_the_terminal_lacks_are_escaped():
    code = (
        "from borecheck.core.streams import prepare_streams; prepare_streams();"
        "print('\\u624b')"
    )
    narrow = os.environ | {"PYTHONIOENCODING": "ascii"}
    done = shell(f"'{sys.executable}' -c \"{code}\"", env=narrow)
    assert done.stdout == "\\u624b\n"


def test_what_is_logged_is_one_line_without_control_characters():
    code = (
        "import logging, warnings; from borecheck.core.streams import log_in_lines;"
        "log_in_lines(); log = logging.getLogger('x');"
        "log.warning('%s', 'a\\x1b[2Kb\\n::error::');"
        "warnings.warn('c\\x9bd')"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    first, second = done.stderr.splitlines()
    assert first == "a\\x1b[2Kb ::error::"
    assert "c\\x9bd" in second
