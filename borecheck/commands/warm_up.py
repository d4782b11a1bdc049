"""Compiled kernels: said when they are compiled the first time, and kept off the clock.

numba loads or compiles a kernel when it is first called, in every process; a result's
`seconds` are those of the check alone.
"""

import platform
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING

from borecheck.commands.progress import say
from borecheck.core.cache import cache_folder
from borecheck.core.private_folder import make_private

if TYPE_CHECKING:
    from borecheck.contact.settings import Settings
    from borecheck.robots.robot import Robot


def announce_compilation() -> None:
    """One line on standard error before the first, slow run with these versions.

    numba keeps the compiled kernels by themselves; the mark left here only
    remembers that somebody has been told.
    """
    from importlib.metadata import version

    from borecheck.core.version import __version__

    here = sha256(str(Path(__file__).parent).encode()).hexdigest()[:8]
    parts = (__version__, version("numba"), version("numpy"), platform.machine(), here)
    mark = cache_folder() / f"compiled-{'-'.join(parts)}"
    if _exists(mark):
        return
    say(
        "borecheck: compiling the contact kernels, once for this installation; "
        "this takes a minute or two ..."
    )
    try:
        make_private(mark.parent)
        mark.touch()
    except OSError as error:
        say(f"borecheck: {mark.parent} cannot be written ({error.strerror})")


def _exists(mark: Path) -> bool:
    try:
        return mark.exists()
    except OSError:  # a folder that may not be looked into
        return False


def warm_up(chosen: "Settings") -> None:
    """Loads or compiles the kernels of a check, so that its clock measures the check.

    Args:
        chosen: Checker, pruning and margin that are going to be used.
    """
    import numpy as np

    from borecheck.contact.check import check_with
    from borecheck.geometry.mesh.primitives import box
    from borecheck.robots.scene import Obstacle, Scene

    robot = _two_boxes()
    for side, x in ((1.0, 9.0), (1.0, 0.8), (20.0, 0.0)):  # apart, touching, inside
        T = np.eye(4)
        T[0, 3] = x
        solid = box("block", (side, side, side)).moved(T)
        obstacle = Obstacle("block", "other", solid, "warm-up")
        scene = Scene("warm-up", None, {}, "warm-up", (obstacle,), {}, (), ())
        check_with(robot, scene, [0.0], chosen)


def _two_boxes() -> "Robot":
    """A robot of two boxes, 1 m large, with one joint."""
    import numpy as np

    from borecheck.robots.model import RobotModel
    from borecheck.robots.parts import collision_parts
    from borecheck.robots.robot import Robot

    shape = "<collision><geometry><box size='1 1 1'/></geometry></collision>"
    links = "".join(f"<link name='{name}'>{shape}</link>" for name in "abc")
    joints = "".join(
        f"<joint name='{a}{b}' type='{kind}'><parent link='{a}'/><child link='{b}'/>"
        "<origin xyz='0 3 0'/><axis xyz='0 0 1'/>"
        "<limit lower='-1' upper='1' effort='1' velocity='1'/></joint>"
        for a, b, kind in (("a", "b", "revolute"), ("b", "c", "fixed"))
    )
    text = f"<robot name='warm-up'>{links}{joints}</robot>"
    model = RobotModel(text, "warm-up")
    file = Path("warm-up.urdf")
    return Robot(
        name="warm-up",
        description=None,
        arguments={},
        level="as given",
        file=file,
        urdf_text=text,
        model=model,
        parts=collision_parts(model.tree, file),
        T_scene_root=np.eye(4),
        allowed_contacts=(),
        warnings=(),
    )
