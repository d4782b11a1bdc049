"""The panel beside the window: the verdict, sliders, plan, files."""

from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from borecheck.core.text import printable
from borecheck.view.session import Session

Array = NDArray[np.float64]

WORDS = {
    "clear": "✓ CLEAR",
    "contact": "✗ CONTACT",
    "unknown": "? UNKNOWN",
    "checking": "… checking",
}


class Wishes(Protocol):
    """What the panel asks of the view when somebody moves or presses something."""

    def move_joint(self, index: int, value: float) -> None:
        """A joint was moved, [rad] or [m]."""

    def set_margin(self, margin_mm: float) -> None:
        """Another margin is wanted."""

    def follow(self) -> None:
        """The robot is to stand where the slider says on the plan."""

    def set_mount(self, mount: str) -> None:
        """Another mount is wanted."""

    def load_patient(self, file: str) -> None:
        """A patient's file was named."""

    def take(self, upload: Any) -> None:
        """A mesh was dropped."""

    def save_plan(self, name: str) -> None:
        """The plan is to be kept."""

    def write_report(self, name: str) -> None:
        """A page is to be written."""


class Panel:
    """Widgets of one view.

    Args:
        gui: The viser server's.
        session: Robot, plan and margin to begin with.
        q: Where the robot stands.
        wishes: Whom to ask.
    """

    def __init__(self, gui: Any, session: Session, q: Array, wishes: Wishes) -> None:
        self._gui = gui
        self._wishes = wishes
        self._setting = False
        self.state = gui.add_markdown("## …")
        self.note = gui.add_markdown("")
        margin = gui.add_number("Margin [mm]", 1e3 * session.margin, min=0.0, step=1)
        margin.on_update(lambda _: wishes.set_margin(margin.value))
        self.sliders: list[tuple[Any, float]] = []
        self._add_joints(session, q)
        if session.follows_plans:
            self._add_plan()
        with gui.add_folder("Robot and patient", expand_by_default=False):
            self._add_mount(session)
            patient = gui.add_text("Patient's file", "")
            patient.on_update(lambda _: wishes.load_patient(patient.value))
            upload = gui.add_upload_button("Drop a patient's mesh")
            upload.on_upload(lambda _: wishes.take(upload.value))
        with gui.add_folder("Keep", expand_by_default=False):
            page = gui.add_text("Report", "report.html")
            report = gui.add_button("Write the report")
            report.on_click(lambda _: wishes.write_report(page.value))
            self.overwrite = gui.add_checkbox("Overwrite", False)

    def tell(self, state: str, reason: str) -> None:
        """The verdict and its reason."""
        self.state.content = f"## {WORDS[state]}\n{plain(reason)}"

    def remark(self, text: str) -> None:
        """A line below the verdict."""
        self.note.content = text

    def may_overwrite(self) -> bool:
        """Whether a file that is there may be written over; leave is for once."""
        leave, self.overwrite.value = bool(self.overwrite.value), False
        return leave

    def set_joints(self, q: Array) -> None:
        """Puts the sliders where the robot stands."""
        self._setting = True
        try:
            for (slider, scale), value in zip(self.sliders, q, strict=True):
                slider.value = float(np.clip(scale * value, slider.min, slider.max))
        finally:
            self._setting = False

    def _add_joints(self, session: Session, q: Array) -> None:
        with self._gui.add_folder("Joints"):
            for k, joint in enumerate(session.robot.model.free_joints):
                scale, unit = (180.0 / np.pi, "deg") if joint.is_angle else (1e3, "mm")
                low, high = (_bound(v, scale) for v in (joint.lower, joint.upper))
                slider = self._gui.add_slider(
                    f"{joint.name} [{unit}]",
                    low,
                    high,
                    0.01,
                    float(np.clip(scale * q[k], low, high)),
                )
                slider.on_update(self.joint_moved(k, slider, scale))
                self.sliders.append((slider, scale))

    def joint_moved(
        self, index: int, slider: Any, scale: float
    ) -> Callable[[Any], None]:
        """What happens when a slider was moved, by hand or by `set_joints`."""

        def moved(_: Any) -> None:
            if not self._setting:
                self._wishes.move_joint(index, slider.value / scale)

        return moved

    def _add_plan(self) -> None:
        gui, wishes = self._gui, self._wishes
        with gui.add_folder("Needle plan"):
            self.along = gui.add_slider("Along the plan [%]", 0.0, 100.0, 0.1, 0.0)
            self.along.on_update(lambda _: wishes.follow())
            name = gui.add_text("Plan's file", "plan.csv")
            save = gui.add_button("Save the plan")
            save.on_click(lambda _: wishes.save_plan(name.value))

    def _add_mount(self, session: Session) -> None:
        choices = _mounts(session)
        if not choices:
            return
        switch = self._gui.add_dropdown(
            "Mount [deg]", choices, initial_value=session.robot.arguments["mount"]
        )
        switch.on_update(lambda _: self._wishes.set_mount(switch.value))


def _mounts(session: Session) -> Sequence[str]:
    description = session.robot.description
    argument = description.arguments.get("mount") if description else None
    return () if argument is None else argument.choices


def _bound(value: float, scale: float) -> float:
    """A joint's limit for a slider; one without an end gets a full turn or a metre."""
    if np.isfinite(value):
        return float(scale * value)
    return float(np.copysign(180.0 if scale < 100.0 else 1000.0, value))


def plain(text: str) -> str:
    """Text that Markdown leaves as it is."""
    text = printable(text)
    for character in "\\`*_{}[]()#+!|<>":
        text = text.replace(character, f"\\{character}")
    return text
