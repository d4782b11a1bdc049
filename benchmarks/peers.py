"""The same queries through Coal (three ways), Pinocchio and python-fcl.

Coal is asked with its default request and with `break_distance = 0`, which keeps it
from opening boxes that are already apart; `gjk_tolerance` stays as it is unless said.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.poses import BenchScene, Pose
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.robots.kinematics.forward import SLIDES, TURNS

MANY = 10**6


def coal_model(mesh: TriangleMesh) -> Any:
    """Coal's tree of oriented boxes for a mesh."""
    import coal

    model = coal.BVHModelOBBRSS()
    model.beginModel(len(mesh.triangles), len(mesh.vertices))
    model.addVertices(np.array(mesh.vertices))
    model.addTriangles(np.array(mesh.triangles))
    model.endModel()
    model.computeLocalAABB()
    return model


def coal_request(contacts: int = 1, tight: bool = False) -> Any:
    """A request; `tight` sets break_distance to 0."""
    import coal

    request = coal.CollisionRequest()
    request.enable_contact = False
    request.num_max_contacts = contacts
    if tight:
        request.break_distance = 0.0
    return request


class Coal:
    """Models and objects of one scene, built once."""

    def __init__(self, scene: BenchScene) -> None:
        import coal

        self._coal = coal
        self.links = [coal_model(mesh) for mesh in scene.links]
        self.obstacle = coal_model(scene.obstacle)
        self.still = coal.Transform3s(np.eye(3), np.zeros(3))
        self.objects = [coal.CollisionObject(m, self.still) for m in self.links]
        self.standing = coal.CollisionObject(self.obstacle, self.still)
        self.result = coal.CollisionResult()

    def transforms(self, pose: Pose) -> list[Any]:
        """Coal's transforms of all links."""
        return [
            self._coal.Transform3s(T[:3, :3].copy(), T[:3, 3].copy())
            for T in pose.placements
        ]

    def geometry(self, pose: Pose, request: Any) -> bool:
        """Geometry API: a transform and a result for every link, as in its examples."""
        coal = self._coal
        for model, T in zip(self.links, pose.placements, strict=True):
            place = coal.Transform3s(T[:3, :3], T[:3, 3])
            result = coal.CollisionResult()
            if coal.collide(model, place, self.obstacle, self.still, request, result):
                return True
        return False

    def reused(self, transforms: list[Any], request: Any) -> bool:
        """Objects that are moved, one result that is cleared."""
        coal = self._coal
        for item, place in zip(self.objects, transforms, strict=True):
            item.setTransform(place)
            self.result.clear()
            if coal.collide(item, self.standing, request, self.result):
                return True
        return False

    def one(self, k: int, transform: Any, request: Any) -> Callable[[], bool]:
        """A call for one link: its object is moved, the result cleared."""
        item, standing, result = self.objects[k], self.standing, self.result
        collide = self._coal.collide

        def call() -> bool:
            item.setTransform(transform)
            result.clear()
            return bool(collide(item, standing, request, result))

        return call

    def all_contacts(self, pose: Pose, request: Any) -> int:
        """How many triangle pairs are in contact."""
        coal = self._coal
        count = 0
        for model, T in zip(self.links, pose.placements, strict=True):
            place = coal.Transform3s(T[:3, :3], T[:3, 3])
            result = coal.CollisionResult()
            coal.collide(model, place, self.obstacle, self.still, request, result)
            count += result.numContacts()
        return count

    def distance(self, pose: Pose) -> float:
        """Least distance of all links."""
        coal = self._coal
        least = np.inf
        for model, T in zip(self.links, pose.placements, strict=True):
            place = coal.Transform3s(T[:3, :3], T[:3, 3])
            result = coal.DistanceResult()
            request = coal.DistanceRequest()
            coal.distance(model, place, self.obstacle, self.still, request, result)
            least = min(least, result.min_distance)
        return float(least)


class Pinocchio:
    """Chain and meshes as Pinocchio has them: one call for kinematics and all."""

    def __init__(self, scene: BenchScene, coal: Coal) -> None:
        import pinocchio as pin

        self._pin = pin
        chain = scene.chain
        self.model = pin.Model()
        ids: list[int] = []
        offsets: list[Any] = []
        entries: list[tuple[int, float, float]] = []
        for j in range(chain.frame_count):
            origin = pin.SE3(chain.origin[j])
            before = 0 if chain.parent[j] < 0 else ids[chain.parent[j]]
            placed = (
                origin if chain.parent[j] < 0 else offsets[chain.parent[j]] * origin
            )
            if chain.kind[j] not in (TURNS, SLIDES):
                ids.append(before)
                offsets.append(placed)
                continue
            made = (
                pin.JointModelRevoluteUnaligned(chain.axis[j])
                if chain.kind[j] == TURNS
                else pin.JointModelPrismaticUnaligned(chain.axis[j])
            )
            ids.append(self.model.addJoint(before, made, placed, f"joint{j}"))
            offsets.append(pin.SE3.Identity())
            entries.append(
                (int(chain.source[j]), float(chain.factor[j]), float(chain.offset[j]))
            )
        self.entries = entries
        self.data = self.model.createData()
        self.geometry = pin.GeometryModel()
        self.obstacle = self.geometry.addGeometryObject(
            pin.GeometryObject("obstacle", 0, pin.SE3.Identity(), coal.obstacle)
        )
        for k, (frame, model) in enumerate(zip(scene.frames, coal.links, strict=True)):
            item = pin.GeometryObject(f"link{k}", ids[frame], offsets[frame], model)
            index = self.geometry.addGeometryObject(item)
            self.geometry.addCollisionPair(pin.CollisionPair(index, self.obstacle))
        self.geometry_data = self.geometry.createData()

    def configuration(self, q: Any) -> Any:
        """Q of Pinocchio's joints, mimic joints expanded."""
        return np.array([factor * q[s] + offset for s, factor, offset in self.entries])

    def stand(self, pose: Pose) -> None:
        """The foot is shifted by shifting the obstacle the other way."""
        self.geometry.geometryObjects[self.obstacle].placement = self._pin.SE3(
            np.eye(3), -pose.shift
        )

    def collide(self, q: Any) -> bool:
        """Kinematics and collision of all links in one call, up to the first."""
        return bool(
            self._pin.computeCollisions(
                self.model, self.data, self.geometry, self.geometry_data, q, True
            )
        )


class Fcl:
    """python-fcl: models and objects built once, moved for every query."""

    def __init__(self, scene: BenchScene) -> None:
        import fcl

        self._fcl = fcl
        self.objects = [
            fcl.CollisionObject(self._model(mesh), fcl.Transform())
            for mesh in scene.links
        ]
        self.standing = fcl.CollisionObject(
            self._model(scene.obstacle), fcl.Transform()
        )

    def _model(self, mesh: TriangleMesh) -> Any:
        model = self._fcl.BVHModel()
        model.beginModel(len(mesh.vertices), len(mesh.triangles))
        model.addSubModel(np.array(mesh.vertices), np.array(mesh.triangles))
        model.endModel()
        return model

    def collide(self, pose: Pose, contacts: int = 1) -> int:
        """How many contacts are found, up to that many for a link."""
        fcl = self._fcl
        count = 0
        for item, T in zip(self.objects, pose.placements, strict=True):
            item.setTransform(fcl.Transform(T[:3, :3], T[:3, 3]))
            request = fcl.CollisionRequest(
                num_max_contacts=contacts, enable_contact=contacts > 1
            )
            result = fcl.CollisionResult()
            count += fcl.collide(item, self.standing, request, result)
            if count and contacts == 1:
                return count
        return count

    def distance(self, pose: Pose) -> float:
        """Least distance of all links."""
        fcl = self._fcl
        least = np.inf
        for item, T in zip(self.objects, pose.placements, strict=True):
            item.setTransform(fcl.Transform(T[:3, :3], T[:3, 3]))
            result = fcl.DistanceResult()
            fcl.distance(item, self.standing, fcl.DistanceRequest(), result)
            least = min(least, result.min_distance)
        return float(least)
