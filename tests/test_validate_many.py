"""Many files in several processes: interrupted, killed, out of memory."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
import corpus

ARM = corpus.FOLDER / "arm" / "arm.urdf"
ENDS_WITHIN_S = 5.0  # a second in practice; the workers would sleep for a minute

# `borecheck validate` whose check notes its process, and does by the file's name.
SCRIPT = """
import os, sys, time
from pathlib import Path
from borecheck.cli import main
from borecheck.errors import InputError
from borecheck.validation import command

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
    workers = [int(p.stem) for p in tmp_path.glob("*.pid")]
    for pid in (process.pid, *workers):
        os.kill(pid, signal.SIGINT)
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
