"""OpenIGTLink on a socket: trackers and 3D Slicer send, the robot answers.

Every client has a thread that reads; one worker answers the newest wish, first with a
glance and, when nothing newer came for a while, with the full check. The protocol knows
no secret, so strangers are kept out by where it listens: this machine, unless told.
"""

import contextlib
import socket
import threading
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from borecheck.errors import BorecheckError, UsageError
from borecheck.exchange.igtl import IgtlError, Message, Reader, string, transform_of
from borecheck.view.tracked import NEEDLE, TABLE, VERDICT, Answer, Tracked

Array = NDArray[np.float64]

MOST_CLIENTS = 4
REST = 0.1  # without anything newer the full check begins, [s]
PATIENCE = 2.0  # a client that does not take what is sent in so long is left, [s]

Told = Callable[[Array], None]


class Bridge:
    """A running bridge.

    Args:
        tracked: Robot and scene.
        port: Where to listen; 0: any.
        host: On which address.
        say: Takes one line about connections.
        moved: Is told every configuration.

    Raises:
        UsageError: The port cannot be had.
    """

    def __init__(
        self,
        tracked: Tracked,
        port: int,
        host: str = "127.0.0.1",
        say: Callable[[str], None] = lambda line: None,
        moved: Told = lambda q: None,
    ) -> None:
        self._tracked, self._say, self._moved = tracked, say, moved
        self._clients: list[socket.socket] = []
        self._lock = threading.Lock()
        self._wishes: dict[str, tuple[Array, float]] = {}
        self._wish = threading.Event()
        self._stopped = False
        self._listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        self._listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            self._listener.bind((host, port))
            self._listener.listen(MOST_CLIENTS)
        except OSError as error:
            self._listener.close()
            why = error.strerror or error
            raise UsageError(f"--igtl: {host}:{port} cannot be had ({why})") from error
        self.port = int(self._listener.getsockname()[1])
        for work in (self._accept, self._answer):
            threading.Thread(target=work, daemon=True).start()

    def stop(self) -> None:
        """Ends it and every connection."""
        self._stopped = True
        self._wish.set()
        with contextlib.suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        with self._lock:
            clients = list(self._clients)
        for client in clients:
            self._leave(client)

    def _accept(self) -> None:
        while not self._stopped:
            try:
                client, address = self._listener.accept()
            except OSError:
                return  # it was closed
            with self._lock:
                full = len(self._clients) >= MOST_CLIENTS
                if not full:
                    self._clients.append(client)
            if full:
                client.close()
                continue
            client.settimeout(PATIENCE)
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._say(f"OpenIGTLink: {address[0]} connected")
            threading.Thread(target=self._read, args=(client,), daemon=True).start()

    def _read(self, client: socket.socket) -> None:
        """Notes what one client wants, until it goes or sends what is no message."""
        reader = Reader()
        try:
            while not self._stopped:
                try:
                    some = client.recv(65536)
                except TimeoutError:
                    continue
                if not some:
                    return
                for message in reader.feed(some):
                    self._note(message)
        except IgtlError as error:
            self._say(f"OpenIGTLink: a connection was closed: {error}")
        except OSError:
            return  # the client has gone
        finally:
            self._leave(client)

    def _note(self, message: Message) -> None:
        """Keeps the newest placement of needle and table; other devices are ignored."""
        if message.kind != "TRANSFORM" or message.name not in (NEEDLE, TABLE):
            return
        T = transform_of(message)
        with self._lock:
            self._wishes[message.name] = (T, message.seconds)
            self._wish.set()

    def _answer(self) -> None:
        last = 0.0
        takers = {TABLE: self._tracked.table, NEEDLE: self._tracked.needle}
        while True:
            self._wish.wait()
            # cleared with what it told of: awake with nothing to take, the worker
            # would judge the pose before one that was refused
            with self._lock:
                self._wish.clear()
                wishes, self._wishes = self._wishes, {}
            if self._stopped:
                return
            try:
                for name, take in takers.items():
                    if name not in wishes:
                        continue
                    T, last = wishes[name]
                    answer = take(T)
                    self._send(answer, last)
                if answer.shown is not None and not self._wish.wait(REST):
                    self._send(self._tracked.judged(), last)
            except BorecheckError as error:
                self._tell(f"unknown: {error}", last)
            except Exception as error:  # noqa: BLE001
                # whatever it was, no older verdict may stand
                self._tell(f"unknown: {type(error).__name__}: {error}", last)

    def _send(self, answer: Answer, seconds: float) -> None:
        self._out(b"".join(m.packed() for m in self._tracked.messages(answer, seconds)))
        if answer.shown is not None:
            self._moved(answer.shown.q)

    def _tell(self, text: str, seconds: float) -> None:
        self._out(string(VERDICT, text, seconds).packed())

    def _out(self, content: bytes) -> None:
        with self._lock:
            clients = list(self._clients)
        for client in clients:
            try:
                client.sendall(content)
            except OSError:  # it has gone, or takes nothing
                self._leave(client)

    def _leave(self, client: socket.socket) -> None:
        with self._lock:
            if client in self._clients:
                self._clients.remove(client)
        with contextlib.suppress(OSError):
            client.shutdown(socket.SHUT_RDWR)
        client.close()


def address(text: str) -> tuple[str, int]:
    """Host and port of `PORT` or `HOST:PORT`.

    Raises:
        UsageError: It is neither.
    """
    host, colon, port = text.rpartition(":")
    if not port.isdecimal() or not port.isascii() or not int(port) < 65536:
        raise UsageError(f"--igtl {text!r} is no port, nor HOST:PORT")
    return (host if colon and host else "127.0.0.1"), int(port)
