"""Many files in several processes: interrupted, killed, out of memory."""

import io
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests import corpus

ARM = corpus.FOLDER / "arm" / "arm.urdf"
ENDS_WITHIN_S = 5.0  # a second in practice; the workers would sleep for a minute

# `borecheck validate` whose check notes its process, and does by the file's name.
# Where the tests run in the background, Ctrl-C may be switched off for all they start.
SCRIPT = """
import os, signal, sys, time
signal.signal(signal.SIGINT, signal.default_int_handler)
from pathlib import Path
from borecheck.cli import main
from borecheck.errors import InputError
from borecheck.commands import validate as command

def check(file, given, config):
    name = Path(file).stem
    Path(f"{os.getpid()}.pid").touch()
    if name == "dies":
        time.sleep(0.3)
        os.kill(os.getpid(), 9)
    if name == "fails":
        raise InputError(file, "is odd")
    if name.startswith("slow"):
        time.sleep(60)
    return []

command.check_one = check
sys.exit(main(["validate", ".", "--jobs", "2", "--resume", "kept.jsonl"]))
"""


@pytest.fixture
def start(tmp_path):
    def call(*names):
        for name in names:
            shutil.copy(ARM, tmp_path / f"{name}.urdf")
        return subprocess.Popen(
            [sys.executable, "-c", SCRIPT],
            cwd=tmp_path,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,  # a process group of its own, as in a terminal
        )

    return call


def wait_for(is_so):
    end = time.monotonic() + 20.0
    while not is_so():
        assert time.monotonic() < end, "never began"
        time.sleep(0.02)


def is_alive(pid):
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"


@pytest.mark.parametrize(
    ("number", "status", "words"),
    [(signal.SIGINT, 130, "interrupted"), (signal.SIGTERM, 143, "terminated")],
)
def test_a_signal_ends_it_and_its_workers_at_once(
    start, tmp_path, number, status, words
):
    process = start("a", "b", *(f"slow{i}" for i in range(6)))
    kept = tmp_path / "kept.jsonl"
    wait_for(lambda: kept.exists() and kept.read_text().count("\n") == 2)
    wait_for(lambda: len(list(tmp_path.glob("*.pid"))) == 2)
    workers = [int(p.stem) for p in tmp_path.glob("*.pid")]
    began = time.monotonic()
    process.send_signal(number)
    _, err = process.communicate(timeout=30)
    assert time.monotonic() - began < ENDS_WITHIN_S
    assert process.returncode == status
    assert err == f"borecheck: {words}\n"
    wait_for(lambda: not any(map(is_alive, workers)))
    assert [json.loads(line)["file"] for line in kept.read_text().splitlines()]


def test_ctrl_c_in_a_terminal_reaches_the_workers_too(tmp_path, start):
    process = start(*(f"slow{i}" for i in range(6)))
    wait_for(lambda: len(list(tmp_path.glob("*.pid"))) == 2)
    # one after another, the last could be gone before its turn
    os.killpg(process.pid, signal.SIGINT)
    _, err = process.communicate(timeout=30)
    assert (process.returncode, err) == (130, "borecheck: interrupted\n")


def test_a_worker_that_dies_is_one_line_with_the_unfinished(start, tmp_path):
    process = start("a", "b", "dies", "slow")
    _, err = process.communicate(timeout=30)
    (line,) = err.splitlines()
    assert process.returncode == 2
    assert "a process died" in line
    assert "not finished: dies.urdf, slow.urdf" in line
    kept = (tmp_path / "kept.jsonl").read_text().splitlines()
    assert {json.loads(line)["file"] for line in kept} == {"a.urdf", "b.urdf"}


def test_an_error_in_a_worker_is_told_as_it_is(start):
    process = start("a", "b", "fails", "slow1", "slow2")
    began = time.monotonic()
    _, err = process.communicate(timeout=30)
    assert time.monotonic() - began < 20.0
    assert process.returncode == 2
    assert err == "borecheck: error: fails.urdf: is odd\n"


class Terminal(io.StringIO):
    def isatty(self):
        return True


def counted(stream, monkeypatch, seconds_per_file):
    from borecheck.validation import many

    clock = iter(float(seconds_per_file * n // 2) for n in range(1000))
    monkeypatch.setattr(time, "monotonic", lambda: next(clock))
    files = [f"{i}.urdf" for i in range(30)]
    many.check_many(files, lambda _: [], jobs=1, resume=None, key=str, progress=stream)
    return stream.getvalue()


def test_a_log_gets_few_lines_and_no_carriage_returns(monkeypatch):
    log = counted(io.StringIO(), monkeypatch, seconds_per_file=2)
    lines = log.splitlines()
    assert "\r" not in log
    assert 1 <= len(lines) <= 6
    assert all(line.endswith("/30 files") for line in lines)


def test_a_short_run_leaves_nothing_in_a_log(monkeypatch):
    assert counted(io.StringIO(), monkeypatch, seconds_per_file=0) == ""


def test_a_terminal_sees_each_file(monkeypatch):
    text = counted(Terminal(), monkeypatch, seconds_per_file=0)
    assert text.count("\r") == 30
    assert text.endswith("30/30 files\n")
