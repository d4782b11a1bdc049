"""What numba compiles is told once, as it happens; what it loads is not told."""

import sys

from numba import njit

from borecheck.commands import compiling
from borecheck.commands.compiling import tell_of_compiling


def test_compiling_is_told_and_how_far_it_is(capsys, monkeypatch):
    monkeypatch.setattr(compiling, "EVERY_S", 0.0)
    listener = compiling._Telling()
    # a kind of its own: other tests may have asked for the true one
    happens = compiling.event.trigger_event
    with (
        compiling.event.install_listener("test:compile", listener),
        happens("test:compile"),
        happens("test:compile"),
    ):
        pass
    out, err = capsys.readouterr()
    assert out == ""
    lines = err.splitlines()
    assert lines[0].startswith("borecheck: compiling its kernels, once")
    assert [line.split(",")[0] for line in lines[1:]] == [
        "borecheck: 1 kernels",
        "borecheck: 2 kernels",
    ]


def test_numba_says_what_it_compiles_and_not_what_it_has():
    heard = []

    class Hears(compiling.event.Listener):
        def on_start(self, event):
            heard.append(event)

        def on_end(self, event):
            pass

    @njit
    def doubled(x):
        return 2 * x

    with compiling.event.install_listener("numba:compile", Hears()):
        assert doubled(3) == 6
        assert len(heard) == 1
        assert doubled(4) == 8
        assert len(heard) == 1


def test_it_listens_once_however_often_it_is_asked(monkeypatch):
    heard = []
    monkeypatch.setattr(compiling.event, "register", lambda *a: heard.append(a))
    tell_of_compiling.cache_clear()
    tell_of_compiling()
    tell_of_compiling()
    tell_of_compiling.cache_clear()
    assert [kind for kind, _ in heard] == ["numba:compile"]
    assert "numba" in sys.modules
