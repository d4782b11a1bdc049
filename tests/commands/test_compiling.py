"""What numba compiles is told once, as it happens; what it loads is not told."""

import sys

from numba import njit

from borecheck.commands import compiling
from borecheck.commands.compiling import tell_of_compiling


def test_compiling_is_told_and_how_far_it_is(capsys, monkeypatch):
    monkeypatch.setattr(compiling, "EVERY_S", 0.0)
    listener = compiling._Telling()
    with compiling.event.install_listener("numba:compile", listener):

        @njit
        def inner(x):
            return 2 * x

        @njit
        def outer(x):
            return inner(x) + 1

        assert outer(3) == 7
        first = capsys.readouterr()
        assert outer(3) == 7  # compiled already: nothing to tell
        assert capsys.readouterr().err == ""
    assert first.out == ""
    lines = first.err.splitlines()
    assert lines[0].startswith("borecheck: compiling its kernels, once")
    assert [line.split(",")[0] for line in lines[1:]] == [
        "borecheck: 1 kernels",
        "borecheck: 2 kernels",
    ]


def test_it_listens_once_however_often_it_is_asked(monkeypatch):
    heard = []
    monkeypatch.setattr(compiling.event, "register", lambda *a: heard.append(a))
    tell_of_compiling.cache_clear()
    tell_of_compiling()
    tell_of_compiling()
    tell_of_compiling.cache_clear()
    assert [kind for kind, _ in heard] == ["numba:compile"]
    assert "numba" in sys.modules
