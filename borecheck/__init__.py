"""borecheck: will a needle robot touch the scanner it works in?

The Python door. Names are imported when they are first used, so that `import
borecheck` costs nothing.

    import borecheck as bc
    robot = bc.load_robot("zerobot", mount="+90")
    scene = bc.load_scene("ct_gantry")
    verdict = bc.check(robot, scene, robot.home, margin=0.02)
"""

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

from borecheck.core.version import __version__ as __version__

if TYPE_CHECKING:
    from borecheck.api import certify as certify
    from borecheck.api import check_plans as check_plans
    from borecheck.api import fk as fk
    from borecheck.api import inverse as inverse
    from borecheck.api import random_configurations as random_configurations
    from borecheck.api import report as report
    from borecheck.api import show as show
    from borecheck.contact.check import check as check
    from borecheck.contact.compare import compare as compare
    from borecheck.contact.many_poses import first_contacts as first_contacts
    from borecheck.contact.queries import queries as queries
    from borecheck.directions.ask import directions as directions
    from borecheck.errors import BorecheckError as BorecheckError
    from borecheck.geometry.tree.mesh_tree import MeshTree as MeshTree
    from borecheck.geometry.tree.pair import Pair as Pair
    from borecheck.motion.binding import verify as verify
    from borecheck.motion.check import check_path as check_path
    from borecheck.planning.route import route as route
    from borecheck.plans.needle_plan import NeedlePlan as NeedlePlan
    from borecheck.robots.robot import load_robot as load_robot
    from borecheck.robots.scene import load_scene as load_scene
    from borecheck.setup.door import setup as setup
    from borecheck.validation.run import validate_file as validate  # noqa: F401


_HOMES = {
    "BorecheckError": "borecheck.errors:BorecheckError",
    "MeshTree": "borecheck.geometry.tree.mesh_tree:MeshTree",
    "NeedlePlan": "borecheck.plans.needle_plan:NeedlePlan",
    "Pair": "borecheck.geometry.tree.pair:Pair",
    "certify": "borecheck.api:certify",
    "check": "borecheck.report.pictured:check",
    "check_plans": "borecheck.api:check_plans",
    "check_path": "borecheck.report.pictured:check_path",
    "compare": "borecheck.contact.compare:compare",
    "directions": "borecheck.directions.ask:directions",
    "fk": "borecheck.api:fk",
    "first_contacts": "borecheck.contact.many_poses:first_contacts",
    "inverse": "borecheck.api:inverse",
    "load_robot": "borecheck.robots.robot:load_robot",
    "load_scene": "borecheck.robots.scene:load_scene",
    "queries": "borecheck.contact.queries:queries",
    "route": "borecheck.planning.route:route",
    "random_configurations": "borecheck.api:random_configurations",
    "report": "borecheck.api:report",
    "setup": "borecheck.setup.door:setup",
    "show": "borecheck.api:show",
    "validate": "borecheck.validation.run:validate_file",
    "verify": "borecheck.api:verify",
}

__all__ = sorted(_HOMES)


class _Door(ModuleType):
    """The package as a door: a room of the same name takes no public name's place."""

    def __setattr__(self, name: str, value: object) -> None:
        if not (name in _HOMES and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Door


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'borecheck' has no attribute {name!r}")
    module, _, attribute = _HOMES[name].partition(":")
    value = getattr(import_module(module), attribute)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(["__version__", *_HOMES])
