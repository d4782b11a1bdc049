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

from borecheck.core.text import printable
from borecheck.errors import UsageError
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.plans.corridor import Corridor
from borecheck.plans.plan_motion import PlanMotion
from borecheck.report.display import MOST_TRIANGLES
from borecheck.report.thinning import thinned
from borecheck.view.folder import MESH_SUFFIXES, Folder
from borecheck.view.guard import Guard, check_guarded, guarded
from borecheck.view.session import Session, Shown

Array = NDArray[np.float64]

HOST = "127.0.0.1"

ASTRAY = "the robot does not stand where the plan is"

# So long nothing must have been dragged before the full check begins, [s]: it takes
# longer than a picture may.
REST = 0.1

# Where the eye stands at first, across from the robot's base, and looks, [m].
EYE, LOOK_AT = np.array([-1.9, 2.5, 1.3]), np.array([-0.7, 0.0, 0.0])

COLOURS = {
    "robot": (84, 131, 181),
    "needle": (34, 36, 42),
    "scanner": (205, 209, 214),
    "couch": (148, 158, 170),
    "patient": (226, 188, 160),
    "other": (170, 160, 185),
}
TOUCHING = (213, 94, 0)
CLOSEST = (181, 0, 110)

WORDS = {
    "clear": "✓ CLEAR",
    "contact": "✗ CONTACT",
    "unknown": "? UNKNOWN",
    "checking": "… checking",
}


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
        self._so3: Any = viser.transforms.SO3
        self._corridor: Corridor | None = None
        self._motion: PlanMotion | None = None
        self._wish = threading.Event()
        self._stopped = False
        self._setting = False
        self._astray = False  # the plan on the screen is not where the robot stands
        self._lock = threading.RLock()
        self._links: dict[str, Any] = {}
        self._around: dict[str, Any] = {}
        self._furnish()
        self._panel()
        self._handles()
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
        self._state.content = f"## {WORDS['unknown']}\n{_plain(reason)}"

    @contextlib.contextmanager
    def _told(self, moves: bool = False) -> Iterator[None]:
        """Errors become a line in the panel, and the view goes on.

        Args:
            moves: The robot was to move: where it cannot, no verdict may stay.
        """
        try:
            yield
        except Exception as error:  # noqa: BLE001 - of whatever the browser sent
            self._note.content = f"**Not done:** {_plain(str(error))}"
            if moves:
                self._astray = True
                self._unsure(ASTRAY)

    def _furnish(self) -> None:
        """Meshes of robot and surroundings, those that were there before removed."""
        for handle in (*self._links.values(), *self._around.values()):
            handle.remove()
        description = self.session.robot.description
        needle = description.needle_link if description else None
        self._links = {
            part.mesh.name: self._solid(
                f"/robot/{k}",
                part.mesh,
                COLOURS["needle" if part.link == needle else "robot"],
            )
            for k, part in enumerate(self.session.robot.parts)
        }
        self._around = {
            o.name: self._solid(
                f"/scene/{k}",
                o.mesh,
                COLOURS[o.role],
                0.35 if o.role == "scanner" else None,
            )
            for k, o in enumerate(self.session.scene.obstacles)
        }

    def _solid(
        self,
        name: str,
        mesh: TriangleMesh,
        colour: tuple[int, int, int],
        opacity: float | None = None,
    ) -> Any:
        vertices, triangles = mesh.vertices, mesh.triangles
        if len(triangles) > MOST_TRIANGLES:
            vertices, triangles, _ = thinned(vertices, triangles, MOST_TRIANGLES)
        return self.server.scene.add_mesh_simple(
            name,
            vertices.astype(np.float32),
            triangles.astype(np.uint32),
            color=colour,
            flat_shading=True,
            side="double" if opacity is None else "front",
            opacity=opacity,
            cast_shadow=False,
            receive_shadow=False,
        )

    def _show(self, shown: Shown) -> None:
        """Moves the meshes and tells the state."""
        with self.server.atomic():
            for part in self.session.robot.parts:
                handle, T = self._links[part.mesh.name], shown.placements[part.link]
                handle.position = T[:3, 3]
                handle.wxyz = self._so3.from_matrix(T[:3, :3]).wxyz
            self._mark(shown)
            state, reason = shown.state, shown.reason
            if self._astray:
                state, reason = "unknown", ASTRAY
            self._state.content = f"## {WORDS[state]}\n{_plain(reason)}"
        self.shown = shown
        self.answers += 1

    def _mark(self, shown: Shown) -> None:
        closest = shown.closest
        if closest is not None:
            points = np.array([closest.points], dtype=np.float32)
            self._line.points = points
            self._label.text = f"{1e3 * closest.distance:.1f} mm"
            self._label.position = points[0].mean(axis=0)
        self._line.visible = self._label.visible = closest is not None
        for name, handle in {**self._around, **self._links}.items():
            colour = TOUCHING if name in shown.touching else self._colour(name)
            if tuple(handle.color) != colour:
                handle.color = colour

    def _colour(self, name: str) -> tuple[int, int, int]:
        description = self.session.robot.description
        needle = description.needle_link if description else None
        for part in self.session.robot.parts:
            if part.mesh.name == name:
                return COLOURS["needle" if part.link == needle else "robot"]
        roles = {o.name: o.role for o in self.session.scene.obstacles}
        return COLOURS[roles[name]]

    def _panel(self) -> None:
        gui, scene = self.server.gui, self.server.scene
        scene.set_up_direction("+z")
        self.server.initial_camera.position = EYE * (1.0, self._near(), 1.0)
        self.server.initial_camera.look_at = LOOK_AT
        self._state = gui.add_markdown("## …")
        self._note = gui.add_markdown("")
        self._line = scene.add_line_segments(
            "/closest", np.zeros((1, 2, 3), np.float32), CLOSEST, thickness=0.002
        )
        self._label = scene.add_label("/distance", "")
        margin = gui.add_number(
            "Margin [mm]", 1e3 * self.session.margin, min=0.0, step=1
        )
        margin.on_update(lambda _: self._set_margin(margin.value))
        self._joint_sliders()
        if self.session.follows_plans:
            self._plan_panel()
        with gui.add_folder("Robot and patient", expand_by_default=False):
            self._mount_switch()
            patient = gui.add_text("Patient's file", "")
            patient.on_update(lambda _: self._load_patient(patient.value))
            upload = gui.add_upload_button("Drop a patient's mesh")
            upload.on_upload(lambda _: self._take(upload.value))
        with gui.add_folder("Keep", expand_by_default=False):
            page = gui.add_text("Report", "report.html")
            report = gui.add_button("Write the report")
            report.on_click(lambda _: self._write_report(page.value))
            self._overwrite = gui.add_checkbox("Overwrite", False)

    def _near(self) -> float:
        """Side of the y axis across from the robot's base: 1 or -1."""
        placed = self.session.robot.placements(self.q)
        parts = self.session.robot.parts
        middle = np.mean([placed[part.link][1, 3] for part in parts])
        return 1.0 if middle <= 0.0 else -1.0

    def _joint_sliders(self) -> None:
        self._sliders = []
        with self.server.gui.add_folder("Joints"):
            for k, joint in enumerate(self.session.robot.model.free_joints):
                scale, unit = (180.0 / np.pi, "deg") if joint.is_angle else (1e3, "mm")
                low, high = (_bound(v, scale) for v in (joint.lower, joint.upper))
                slider = self.server.gui.add_slider(
                    f"{joint.name} [{unit}]",
                    low,
                    high,
                    0.01,
                    float(np.clip(scale * self.q[k], low, high)),
                )
                slider.on_update(self._joint_moved(k, slider, scale))
                self._sliders.append((slider, scale))

    def _joint_moved(
        self, index: int, slider: Any, scale: float
    ) -> Callable[[Any], None]:
        def moved(_: Any) -> None:
            if self._setting:
                return
            with self._lock:
                model = self.session.robot.model
                value = slider.value / scale
                low, high = float(model.lower[index]), float(model.upper[index])
                self.q[index] = min(max(value, low), high)
                self._corridor = None
                self._astray = False
            self.ask()

        return moved

    def _plan_panel(self) -> None:
        gui = self.server.gui
        with gui.add_folder("Needle plan"):
            self._along = gui.add_slider("Along the plan [%]", 0.0, 100.0, 0.1, 0.0)
            self._along.on_update(lambda _: self._follow())
            name = gui.add_text("Plan's file", "plan.csv")
            save = gui.add_button("Save the plan")
            save.on_click(lambda _: self._save_plan(name.value))

    def _handles(self) -> None:
        if not self.session.follows_plans:
            return
        scene, plan = self.server.scene, self.session.plan
        self._ends = []
        for name, point in (("entry", plan.entry), ("target", plan.target)):
            handle = scene.add_transform_controls(
                f"/plan/{name}",
                scale=0.12,
                disable_rotations=True,
                depth_test=False,
                position=point,
            )
            scene.add_icosphere(f"/plan/{name}/ball", radius=0.004, color=(0, 79, 196))
            scene.add_label(
                f"/plan/{name}/name",
                name,
                anchor="bottom-right" if name == "entry" else "top-right",
                font_screen_scale=0.7,
            )
            handle.on_update(lambda _: self._replan())
            self._ends.append(handle)
        self._needle_line = scene.add_line_segments(
            "/plan/line",
            np.array([[plan.entry, plan.target]], dtype=np.float32),
            (0, 79, 196),
            thickness=0.0015,
        )

    def _replan(self) -> None:
        """The handles were dragged: the plan follows, and the robot with it."""
        entry, target = (np.array(handle.position) for handle in self._ends)
        self._needle_line.points = np.array([[entry, target]], dtype=np.float32)
        with self._told(moves=True), self._lock:
            self._motion = None
            self.session = self.session.with_plan(entry, target)
            self._follow()

    def _follow(self) -> None:
        """Puts the robot where the slider says on the plan's motion."""
        with self._told(moves=True), self._lock:
            if self._motion is None:
                self._motion = self.session.motion()
            self.q = self.session.at(self._motion, self._along.value / 100.0)
            self._corridor = self._motion.corridor
            self._astray = False
            self._note.content = ""
            self._set_sliders()
            self.ask()

    def _set_sliders(self) -> None:
        self._setting = True
        try:
            for (slider, scale), value in zip(self._sliders, self.q, strict=True):
                slider.value = float(np.clip(scale * value, slider.min, slider.max))
        finally:
            self._setting = False

    def _mount_switch(self) -> None:
        description = self.session.robot.description
        argument = description.arguments.get("mount") if description else None
        if argument is None or not argument.choices:
            return
        chosen = self.session.robot.arguments["mount"]
        switch = self.server.gui.add_dropdown(
            "Mount [deg]", argument.choices, initial_value=chosen
        )
        switch.on_update(lambda _: self._change(lambda s: s.with_mount(switch.value)))

    def _load_patient(self, file: str) -> None:
        if file.strip():
            self._change(lambda s: s.with_patient(self.folder.readable(file.strip())))

    def _take(self, upload: Any) -> None:
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
            self._note.content = "loading …"
            self.session = changed(self.session)
            self._motion = None
            self._furnish()
            self._note.content = _plain("; ".join(self.session.scene.warnings))
        self.ask()

    def _set_margin(self, margin_mm: float) -> None:
        with self._lock:
            self.session = replace(
                self.session, margin=max(float(margin_mm), 0.0) / 1e3
            )
        self.ask()

    def _save_plan(self, name: str) -> None:
        with self._told():
            path = self._target(name, (".csv", ".json"))
            self.session.save_plan(path)
            self._note.content = f"Saved {_plain(str(path))}"

    def _write_report(self, name: str) -> None:
        with self._told():
            path = self._target(name, (".html",))
            self._note.content = "checking the whole motion …"
            verdict = self.session.write_report(path, self.q)
            self._note.content = f"Wrote {_plain(str(path))}: {verdict}"

    def _target(self, name: str, suffixes: tuple[str, ...]) -> Path:
        """Where to write; leave to overwrite is given for once."""
        overwrite, self._overwrite.value = self._overwrite.value, False
        return self.folder.writable(name.strip(), suffixes, overwrite=overwrite)


def serve(session: Session, port: int, say: Callable[[str], None]) -> None:
    """Runs the live view until it is interrupted, or told to end.

    A shell starts what runs in the background deaf to Ctrl-C; `kill -INT` is meant.
    """
    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.default_int_handler)
    view = LiveView(session, port)
    say(f"borecheck: live view at {view.address} (Ctrl-C ends it)")
    say(f"borecheck: it reads and writes files in {view.folder.path} only")
    try:
        while True:
            time.sleep(3600.0)
    finally:
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


def _bound(value: float, scale: float) -> float:
    """A joint's limit for a slider; one without an end gets a full turn or a metre."""
    if np.isfinite(value):
        return float(scale * value)
    return float(np.copysign(180.0 if scale < 100.0 else 1000.0, value))


def _plain(text: str) -> str:
    """Text that Markdown leaves as it is."""
    text = printable(text)
    for character in "\\`*_{}[]()#+!|<>":
        text = text.replace(character, f"\\{character}")
    return text
