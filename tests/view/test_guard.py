"""Nobody gets in: without the token, under another name, or from another's page."""

import http.client
import shutil
import threading
from http.server import BaseHTTPRequestHandler, HTTPServer

import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from borecheck.errors import BorecheckError
from borecheck.view.guard import Guard, check_guarded
from borecheck.view.server import HOST

CHROMIUM = shutil.which("chromium")
PATIENCE = 30.0


def asked(view, path, **headers):
    """Status, headers and body of a plain request."""
    connection = http.client.HTTPConnection(HOST, view.port, timeout=PATIENCE)
    connection.putrequest("GET", path, skip_host="Host" in headers)
    for name, value in headers.items():
        for one in value if isinstance(value, list) else [value]:
            connection.putheader(name, one)
    connection.endheaders()
    response = connection.getresponse()
    body = response.read()
    connection.close()
    return response, body


def path_of(view):
    return f"/{view._guard.token}/"


def test_by_its_address_it_serves_the_page(small_view):
    response, body = asked(small_view, path_of(small_view))
    assert response.status == 200
    assert b"viser" in body.lower()
    assert response.headers["Referrer-Policy"] == "no-referrer"
    assert response.headers["X-Frame-Options"] == "DENY"
    assert small_view.address.endswith(path_of(small_view))
    assert small_view.server.get_host() == "127.0.0.1"


def foreign(view):
    """Requests that must not pass: path and headers."""
    own = f"{HOST}:{view.port}"
    path, token = path_of(view), view._guard.token
    for wrong in ("/", "/index.html", "/x/", f"/{token[:-1]}/", f"/{token}x/"):
        yield wrong, {}
    yield f"/?{token}", {}
    yield f"//{token}/", {}
    yield f"/x/../{token}/", {}
    for host in ("evil.example", f"evil.example:{view.port}", HOST, f"{HOST}:1", ""):
        yield path, {"Host": host}
    yield path, {"Host": [own, "evil.example"]}
    for origin in ("http://evil.example", "null", f"https://{own}", f"http://{HOST}:1"):
        yield path, {"Origin": origin}
        yield path, {"Host": own, "Origin": [f"http://{own}", origin]}
    yield path, {"Host": "evil.example", "Origin": "http://evil.example"}


def test_no_other_request_is_answered(small_view):
    requests = list(foreign(small_view))
    assert len(requests) > 15
    for path, headers in requests:
        response, body = asked(small_view, path, **headers)
        assert response.status == 403, (path, headers)
        assert len(body) < 100
        assert small_view._guard.token.encode() not in body


def opened(view, path, **more):
    """Status of the answer to who wants a websocket there; 101 where it is opened."""
    url = f"ws://{HOST}:{view.port}{path}"
    try:
        with connect(url, subprotocols=["viser-v1"], open_timeout=PATIENCE, **more):
            return 101
    except InvalidStatus as error:
        return error.response.status_code


def test_a_websocket_needs_token_and_origin(small_view):
    own, path = f"http://{HOST}:{small_view.port}", path_of(small_view)
    assert opened(small_view, path) == 101
    assert opened(small_view, path.rstrip("/"), origin=own) == 101
    assert opened(small_view, "/") == 403
    assert opened(small_view, "/", origin=own) == 403
    assert opened(small_view, path, origin="http://evil.example") == 403
    assert opened(small_view, path, origin="null") == 403


def test_tokens_are_long_and_never_the_same():
    tokens = {Guard().token for _ in range(20)}
    assert len(tokens) == 20
    assert min(map(len, tokens)) >= 32


def test_before_the_port_is_known_nobody_is_let_in():
    guard = Guard()
    assert guard.problem(f"/{guard.token}/", ["127.0.0.1:None"], []) is not None


def test_a_server_without_the_guard_is_found_out():
    class Open(BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200)
            self.end_headers()

        def log_message(self, *_):
            pass

    guard = Guard()
    with HTTPServer((HOST, 0), Open) as server:
        thread = threading.Thread(target=server.handle_request)
        thread.start()
        guard.port = server.server_port
        with pytest.raises(BorecheckError, match="strangers"):
            check_guarded(guard, HOST)
        thread.join()


@pytest.fixture(scope="module")
def browser():
    sync_api = pytest.importorskip("playwright.sync_api", reason="playwright missing")
    if CHROMIUM is None:
        pytest.skip("chromium is not installed")
    flags = [
        "--no-sandbox",
        "--disable-quic",
        "--no-first-run",
        "--disable-background-networking",
        "--disable-component-update",
        "--disable-sync",
        "--use-angle=swiftshader",
        "--enable-unsafe-swiftshader",
        "--ignore-gpu-blocklist",
        # whoever owns a name may let it lead to this machine
        "--host-resolver-rules=MAP evil.example 127.0.0.1",
    ]
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=flags)
        yield browser
        browser.close()


TRY_SOCKET = """url => new Promise(done => {
    const socket = new WebSocket(url, ['viser-v1']);
    socket.onopen = () => done('open');
    socket.onerror = () => done('refused');
})"""


@pytest.fixture(scope="module")
def evil_port():
    """A page of somebody else."""

    class Page(BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(b"<h1>evil</h1>")

        def log_message(self, *_):
            pass

    with HTTPServer((HOST, 0), Page) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield server.server_port
        server.shutdown()


def test_in_a_browser_the_view_works(browser, small_view):
    page = browser.new_page(viewport={"width": 500, "height": 400})
    page.goto(small_view.address)
    page.get_by_text("CLEAR").wait_for(timeout=1e3 * PATIENCE)
    page.get_by_text("Joints", exact=True).wait_for(timeout=1e3 * PATIENCE)
    page.close()


def test_in_a_browser_other_pages_get_nowhere(browser, small_view, evil_port):
    page = browser.new_page()
    page.goto(f"http://evil.example:{evil_port}/")
    for path in ("/", path_of(small_view)):
        for host in (HOST, "localhost", "evil.example"):
            url = f"ws://{host}:{small_view.port}{path}"
            assert page.evaluate(TRY_SOCKET, url) == "refused", url
    # a name that leads here is no host of ours, be the page loaded from it or not
    found = page.goto(f"http://evil.example:{small_view.port}{path_of(small_view)}")
    assert found.status == 403
    page.close()
