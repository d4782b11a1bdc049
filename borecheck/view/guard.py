"""Who may speak with the live view: pages that it served itself, by its address.

Whatever a browser has open may send requests to this machine, and every user of the
machine may connect to the port. So the address carries a token, which only who started
the view has been told; a request must name this machine as its host (else a foreign
name could be made to lead here), and where it says from which page it comes, that page
must be ours.
"""

import contextlib
import http
import http.client
import secrets
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any
from urllib.parse import urlsplit

from borecheck.errors import BorecheckError

# Names under which a browser on this machine reaches it.
OURSELVES = ("127.0.0.1", "localhost")

_TOKEN_BYTES = 24
_PATIENCE_S = 10.0

_HEADERS = {
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}

Answer = Callable[[Any, Any], Any]


class Guard:
    """What a request must bring.

    Attributes:
        token: Part of the address.
        port: Where the view listens, as soon as that is known; till then nobody may.
    """

    def __init__(self) -> None:
        self.token = secrets.token_urlsafe(_TOKEN_BYTES)
        self.port: int | None = None

    def address(self, host: str) -> str:
        """What to type in the browser; viser's page connects back to the same path."""
        return f"http://{host}:{self.port}/{self.token}/"

    def problem(self, path: str, hosts: list[str], origins: list[str]) -> str | None:
        """Why a request is refused, or None.

        Args:
            path: As it was asked for.
            hosts: Its Host headers.
            origins: Its Origin headers; programs send none.
        """
        ours = {f"{name}:{self.port}" for name in OURSELVES}
        if self.port is None or len(hosts) != 1 or hosts[0].lower() not in ours:
            return "this host is not served"
        if any(origin.lower() != f"http://{hosts[0].lower()}" for origin in origins):
            return "pages of others may not speak with the live view"
        given = urlsplit(path).path.split("/")[1:2]
        if not secrets.compare_digest("".join(given).encode(), self.token.encode()):
            return "the address is not complete: it ends with a token"
        return None

    def before(self, served: Answer | None) -> Answer:
        """What answers requests instead of `served`, and lets through what may pass.

        Both are called with connection and request, and give a response, or None
        where a websocket may be opened: see `process_request` of websockets.
        """

        def answer(connection: Any, request: Any) -> Any:
            headers = request.headers
            problem = self.problem(
                request.path, headers.get_all("Host"), headers.get_all("Origin")
            )
            if problem is not None:
                return connection.respond(http.HTTPStatus.FORBIDDEN, f"{problem}\n")
            path = request.path.removeprefix(f"/{self.token}") or "/"
            if served is None:
                return None
            response = served(connection, replace(request, path=path))
            if response is not None:
                for name, value in _HEADERS.items():
                    response.headers[name] = value
            return response

        return answer


@contextlib.contextmanager
def guarded(guard: Guard) -> Iterator[None]:
    """Meanwhile a server of viser is started behind the guard.

    viser has no door for this: it starts `websockets.asyncio.server.serve` with its own
    `process_request`. `check_guarded` tells whether this still works.
    """
    from websockets.asyncio import server

    plain: Any = server.serve

    def serve(*args: Any, process_request: Answer | None = None, **more: Any) -> Any:
        return plain(*args, process_request=guard.before(process_request), **more)

    changing: Any = server
    changing.serve = serve
    try:
        yield
    finally:
        changing.serve = plain


def check_guarded(guard: Guard, host: str) -> None:
    """Asks without the token, as a stranger would.

    Raises:
        BorecheckError: That was answered: this viser starts its server in another way.
    """
    connection = http.client.HTTPConnection(host, guard.port, timeout=_PATIENCE_S)
    try:
        connection.request("GET", "/")
        status = connection.getresponse().status
    finally:
        connection.close()
    if status != http.HTTPStatus.FORBIDDEN:
        raise BorecheckError(
            "the live view cannot be kept from strangers with this version of viser"
        )
