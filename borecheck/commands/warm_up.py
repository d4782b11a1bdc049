"""Kernels are loaded or compiled before a check's clock runs.

numba loads or compiles a kernel when it is first called, in every process; a result's
`seconds` are those of the check alone.
"""

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from borecheck.contact.settings import Settings
    from borecheck.robots.robot import Robot


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
