"""What stands in the window: meshes of robot and surroundings, the plan's handles."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.core import palette
from borecheck.core.palette import ROLES, rgb
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.plans.needle_plan import NeedlePlan
from borecheck.report.display import MOST_TRIANGLES
from borecheck.report.thinning import thinned
from borecheck.robots.robot import Robot
from borecheck.view.session import Session, Shown

Array = NDArray[np.float64]

# Where the eye stands at first, across from the robot's base, and looks, [m].
EYE, LOOK_AT = np.array([-1.9, 2.5, 1.3]), np.array([-0.7, 0.0, 0.0])

COLOURS = {role: rgb(colour) for role, colour in ROLES.items()}
# Of triangles in contact, the robot's and the other surface's.
TOUCHING = tuple(map(rgb, palette.TOUCHING))
# Of the distance line, by what is said; while that is not known yet, as of a plan.
CLOSEST = {verdict: rgb(shade.ink) for verdict, shade in palette.LIGHT.items()}
PLAN = rgb(palette.PLAN)
# So far beside its surface a triangle in contact is drawn, [m].
HAIR = 2e-4


class Stage:
    """Meshes, closest points and handles of one view.

    Args:
        server: The viser server.
        rotations: Its class of rotations.
        session: What is shown at first.
        q: Where the robot stands at first.
    """

    def __init__(self, server: Any, rotations: Any, session: Session, q: Array) -> None:
        self.server = server
        self._rotations = rotations
        self.links: dict[str, Any] = {}
        self._around: dict[str, Any] = {}
        self._colours: dict[str, tuple[int, int, int]] = {}
        self.ends: list[Any] = []
        self.lit: list[Any] = []
        scene = server.scene
        scene.set_up_direction("+z")
        server.initial_camera.position = EYE * (1.0, _near(session.robot, q), 1.0)
        server.initial_camera.look_at = LOOK_AT
        self._line = scene.add_line_segments(
            "/closest", np.zeros((1, 2, 3), np.float32), PLAN, thickness=0.002
        )
        self._label = scene.add_label("/distance", "")
        self.furnish(session)

    def furnish(self, session: Session) -> None:
        """Meshes of robot and surroundings, those that were there before removed."""
        for handle in (*self.links.values(), *self._around.values()):
            handle.remove()
        self._colours = _colours(session)
        self.links = {
            part.mesh.name: self._solid(
                f"/robot/{k}", part.mesh, self._colours[part.mesh.name]
            )
            for k, part in enumerate(session.robot.parts)
        }
        self._around = {
            o.name: self._solid(
                f"/scene/{k}",
                o.mesh,
                COLOURS[o.role],
                0.35 if o.role == "scanner" else None,
            )
            for k, o in enumerate(session.scene.obstacles)
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

    def show(self, session: Session, shown: Shown) -> None:
        """Moves the meshes and marks what touches and what is nearest."""
        for part in session.robot.parts:
            handle, T = self.links[part.mesh.name], shown.placements[part.link]
            handle.position = T[:3, 3]
            handle.wxyz = self._rotations.from_matrix(T[:3, :3]).wxyz
        closest = shown.closest
        if closest is not None:
            points = np.array([closest.points], dtype=np.float32)
            self._line.points = points
            self._label.text = f"{1e3 * closest.distance:.1f} mm"
            self._label.position = points[0].mean(axis=0)
        self._line.visible = self._label.visible = closest is not None
        colour = np.array(CLOSEST.get(shown.state, PLAN), dtype=np.uint8)
        self._line.colors = np.broadcast_to(colour, (1, 2, 3)).copy()
        self._light(shown.lit)
        # Where no triangles meet, a part within the margin or in a solid is coloured.
        alone = shown.touching if not len(shown.lit) else frozenset()
        for name, handle in self.links.items():
            wanted = TOUCHING[0] if name in alone else self._colours[name]
            if tuple(handle.color) != wanted:
                handle.color = wanted

    def _light(self, lit: Array) -> None:
        """Lights triangles in contact, (n, 2, 3, 3), in place of those before."""
        for handle in self.lit:
            handle.remove()
        self.lit = []
        for side in (0, 1) if len(lit) else ():
            corners = _beside(lit[:, side]).astype(np.float32)
            handle = self.server.scene.add_mesh_simple(
                f"/contact/{side}",
                corners.reshape(-1, 3),
                np.arange(3 * len(corners), dtype=np.uint32).reshape(-1, 3),
                color=TOUCHING[side],
                side="double",
                cast_shadow=False,
                receive_shadow=False,
            )
            self.lit.append(handle)

    def add_plan(self, plan: NeedlePlan, dragged: Callable[[], None]) -> None:
        """Handles at entry and target; `dragged` is called when one was moved."""
        scene = self.server.scene
        for name, point in (("entry", plan.entry), ("target", plan.target)):
            handle = scene.add_transform_controls(
                f"/plan/{name}",
                scale=0.12,
                disable_rotations=True,
                depth_test=False,
                position=point,
            )
            scene.add_icosphere(f"/plan/{name}/ball", radius=0.004, color=PLAN)
            scene.add_label(
                f"/plan/{name}/name",
                name,
                anchor="bottom-right" if name == "entry" else "top-right",
                font_screen_scale=0.7,
            )
            handle.on_update(lambda _: dragged())
            self.ends.append(handle)
        self._needle_line = scene.add_line_segments(
            "/plan/line",
            np.array([[plan.entry, plan.target]], dtype=np.float32),
            PLAN,
            thickness=0.0015,
        )

    def dragged_plan(self) -> tuple[Array, Array]:
        """Entry and target as the handles stand; the line between them follows."""
        entry, target = (np.array(handle.position) for handle in self.ends)
        self._needle_line.points = np.array([[entry, target]], dtype=np.float32)
        return entry, target


def _beside(triangles: Array) -> Array:
    """Triangles a hair before and behind (n, 3, 3): not in the surface they are of."""
    normals = np.cross(
        triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    )
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    step = HAIR * (normals / np.where(lengths > 0.0, lengths, 1.0))[:, None]
    return np.concatenate([triangles + step, triangles - step])


def _near(robot: Robot, q: Array) -> float:
    """Side of the y axis across from the robot's base: 1 or -1."""
    placed = robot.placements(q)
    middle = np.mean([placed[part.link][1, 3] for part in robot.parts])
    return 1.0 if middle <= 0.0 else -1.0


def _colours(session: Session) -> dict[str, tuple[int, int, int]]:
    """The colour of every part and obstacle while it touches nothing."""
    stated = session.robot.needle
    needle = stated.link if stated else None
    around = {o.name: COLOURS[o.role] for o in session.scene.obstacles}
    parts = {
        part.mesh.name: COLOURS["needle" if part.link == needle else "robot"]
        for part in session.robot.parts
    }
    return around | parts
