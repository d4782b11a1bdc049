"""The window of the live view: viser on this machine, and a worker that answers.

Callbacks of the browser only note what is wanted; one worker thread answers the newest
wish, first with a glance and, when nothing newer is wanted, with the full check.
"""

import contextlib
import io
import logging
import re
import signal
import socket
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.errors import UsageError
from borecheck.plans.corridor import Corridor
from borecheck.plans.plan_motion import PlanMotion
from borecheck.view.bridge import Bridge
from borecheck.view.folder import MESH_SUFFIXES, Folder
from borecheck.view.guard import Guard, check_guarded, guarded
from borecheck.view.panel import Panel, plain
from borecheck.view.session import Session, Shown
from borecheck.view.stage import Stage

Array = NDArray[np.float64]

HOST = "127.0.0.1"

ASTRAY = "the robot does not stand where the plan is"

# So long nothing must have been dragged before the full check begins, [s]: it takes
# longer than a picture may.
REST = 0.1


class LiveView:
    """A running live view.

    Args:
        session: Robot, scene, plan and margin to begin with.
        port: Port on this machine.
        folder: Files are read and written below it only; the current one by default.

    Raises:
        UsageError: viser is not installed, or the port is taken.
        BorecheckError: This viser cannot be kept from strangers.
    """

    def __init__(self, session: Session, port: int, folder: Path | None = None) -> None:
        viser = _viser()
        check_port(port)
        logging.getLogger("websockets").setLevel(logging.CRITICAL)
        self.session = session
        self.folder = Folder(folder or Path.cwd())
        self._uploads = tempfile.TemporaryDirectory(prefix="borecheck-view-")
        self._guard = Guard()
        # viser's banner would tell an address without the token
        with contextlib.redirect_stdout(io.StringIO()), guarded(self._guard):
            self.server: Any = viser.ViserServer(host=HOST, port=port, verbose=False)
        self.port = int(self.server.get_port())
        self._guard.port = self.port
        self._check_guard()
        # the button of viser's page that would publish the view through a tunnel
        self.server.request_share_url = lambda *_, **__: None
        self.q: Array = session.robot.home.copy()
        self.shown: Shown | None = None
        self.answers = 0
        self._corridor: Corridor | None = None
        self._motion: PlanMotion | None = None
        self._wish = threading.Event()
        self._stopped = False
        self._astray = False  # the plan on the screen is not where the robot stands
        self._lock = threading.RLock()
        rotations = viser.transforms.SO3
        self.stage = Stage(self.server, rotations, session, self.q)
        self.panel = Panel(self.server.gui, session, self.q, self)
        if session.follows_plans:
            self.stage.add_plan(session.plan, self.replan)
        self._worker = threading.Thread(target=self._answer_wishes, daemon=True)
        self._worker.start()
        self.ask()

    @property
    def address(self) -> str:
        """What to type in the browser; who has it may use the view."""
        return self._guard.address(HOST)

    def _check_guard(self) -> None:
        try:
            check_guarded(self._guard, HOST)
        except BaseException:
            self.server.stop()
            raise

    def ask(self) -> None:
        """Wants the newest configuration to be shown and judged."""
        self._wish.set()

    def stop(self) -> None:
        """Ends worker and server."""
        self._stopped = True
        self._wish.set()
        self._worker.join(timeout=5.0)
        with contextlib.redirect_stdout(io.StringIO()):
            self.server.stop()
        self._uploads.cleanup()

    def _answer_wishes(self) -> None:
        while True:
            self._wish.wait()
            self._wish.clear()
            if self._stopped:
                return
            with self._lock:
                session, q, corridor = self.session, self.q.copy(), self._corridor
            try:
                self._show(session.glance(q, corridor))
                if not self._wish.wait(REST):
                    self._show(session.judge(q, corridor))
            except Exception as error:  # noqa: BLE001
                # whatever it was, an older verdict must not stay on the screen
                self._unsure(f"{type(error).__name__}: {error}")

    def _unsure(self, reason: str) -> None:
        """Takes the verdict off the screen."""
        self.panel.tell("unknown", reason)

    @contextlib.contextmanager
    def _told(self, moves: bool = False) -> Iterator[None]:
        """Errors become a line in the panel, and the view goes on.

        Args:
            moves: The robot was to move: where it cannot, no verdict may stay.
        """
        try:
            yield
        except Exception as error:  # noqa: BLE001 - of whatever the browser sent
            self.panel.remark(f"**Not done:** {plain(str(error))}")
            if moves:
                self._astray = True
                self._unsure(ASTRAY)

    def _show(self, shown: Shown) -> None:
        """Moves the meshes and tells the state."""
        with self.server.atomic():
            self.stage.show(self.session, shown)
            if self._astray:
                self.panel.tell("unknown", ASTRAY)
            else:
                self.panel.tell(shown.state, shown.reason)
        self.shown = shown
        self.answers += 1

    def move_joint(self, index: int, value: float) -> None:
        """Puts a joint there, or to the limit it is beyond, [rad] or [m]."""
        with self._lock:
            model = self.session.robot.model
            low, high = float(model.lower[index]), float(model.upper[index])
            self.q[index] = min(max(value, low), high)
            self._corridor = None
            self._astray = False
        self.ask()

    def stand(self, q: Array) -> None:
        """Puts the robot there, as a tracker says."""
        with self._told(moves=True), self._lock:
            self.q = q.copy()
            self._corridor = None
            self._astray = False
            self.panel.set_joints(self.q)
        self.ask()

    def replan(self) -> None:
        """The handles were dragged: the plan follows, and the robot with it."""
        entry, target = self.stage.dragged_plan()
        with self._told(moves=True), self._lock:
            self._motion = None
            self.session = self.session.with_plan(entry, target)
            self.follow()

    def follow(self) -> None:
        """Puts the robot where the slider says on the plan's motion."""
        with self._told(moves=True), self._lock:
            if self._motion is None:
                self._motion = self.session.motion()
            self.q = self.session.at(self._motion, self.panel.along.value / 100.0)
            self._corridor = self._motion.corridor
            self._astray = False
            self.panel.remark("")
            self.panel.set_joints(self.q)
            self.ask()

    def set_mount(self, mount: str) -> None:
        """Mounts the robot on another side."""
        self._change(lambda s: s.with_mount(mount))

    def load_patient(self, file: str) -> None:
        """Puts the patient of a file into the scene; the file lies below the folder."""
        if file.strip():
            self._change(lambda s: s.with_patient(self.folder.readable(file.strip())))

    def take(self, upload: Any) -> None:
        """A mesh dropped on the view: kept in a folder of our own, then read."""
        with self._told():
            name = re.sub(r"[^\w.-]", "_", str(upload.name).rpartition("/")[2])
            if Path(name).suffix.lower() not in MESH_SUFFIXES:
                raise UsageError(f"{name}: drop a mesh: {', '.join(MESH_SUFFIXES)}")
            path = Path(tempfile.mkdtemp(dir=self._uploads.name)) / name
            path.write_bytes(upload.content)
            self._change(lambda s: s.with_patient(str(path)))

    def _change(self, changed: Callable[[Session], Session]) -> None:
        """Replaces the session, if that succeeds, and furnishes the scene anew."""
        with self._told(), self._lock:
            self.panel.remark("loading …")
            self.session = changed(self.session)
            self._motion = None
            self.stage.furnish(self.session)
            self.panel.remark(plain("; ".join(self.session.scene.warnings)))
        self.ask()

    def set_margin(self, margin_mm: float) -> None:
        """Asks for another margin, [mm]."""
        with self._lock:
            self.session = replace(
                self.session, margin=max(float(margin_mm), 0.0) / 1e3
            )
        self.ask()

    def save_plan(self, name: str) -> None:
        """Writes the plan as CSV or JSON below the folder."""
        with self._told():
            path = self._target(name, (".csv", ".json"))
            self.session.save_plan(path)
            self.panel.remark(f"Saved {plain(str(path))}")

    def write_report(self, name: str) -> None:
        """Writes a page about what is shown below the folder."""
        with self._told():
            path = self._target(name, (".html",))
            self.panel.remark("checking the whole motion …")
            verdict = self.session.write_report(path, self.q)
            self.panel.remark(f"Wrote {plain(str(path))}: {verdict}")

    def _target(self, name: str, suffixes: tuple[str, ...]) -> Path:
        """Where to write."""
        overwrite = self.panel.may_overwrite()
        return self.folder.writable(name.strip(), suffixes, overwrite=overwrite)


def serve(
    session: Session,
    port: int,
    say: Callable[[str], None],
    bridged: Callable[[LiveView], Bridge] | None = None,
) -> None:
    """Runs the live view until it is interrupted, or told to end.

    A shell starts what runs in the background deaf to Ctrl-C; `kill -INT` is meant.

    Args:
        session: What is shown to begin with.
        port: Of the view.
        say: Takes one line.
        bridged: Starts what speaks with trackers.
    """
    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.default_int_handler)
    view = LiveView(session, port)
    say(f"borecheck: live view at {view.address} (Ctrl-C ends it)")
    say(f"borecheck: it reads and writes files in {view.folder.path} only")
    bridge = None
    try:
        bridge = None if bridged is None else bridged(view)
        while True:
            time.sleep(3600.0)
    finally:
        if bridge is not None:
            bridge.stop()
        view.stop()


def check_port(port: int) -> None:
    """Refuses a port that is taken.

    Raises:
        UsageError: It is.
    """
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((HOST, port))
        except OSError as error:
            raise UsageError(
                f"port {port} of {HOST} cannot be had ({error.strerror}): "
                "give another one with --port"
            ) from error


def _viser() -> Any:
    try:
        import viser
        import viser.transforms
    except ImportError as error:
        raise UsageError(
            "the live view needs viser: pip install 'borecheck[view]'"
        ) from error
    return viser
