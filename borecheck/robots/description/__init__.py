"""Robots and scanners as data, and where installed ones are found.

They plug in from above through the entry-point groups `borecheck.robots` and
`borecheck.scanners`; nothing here knows one by name. A package is another's code:
`fields` looks at what it filled in, `hooks` at its functions and at what they return,
and `plugins` tells in one line what is wrong with it.
"""

from borecheck.robots.description.hooks import hook, plugin_hook
from borecheck.robots.description.plugins import (
    installed,
    installed_folders,
    installed_names,
)
from borecheck.robots.description.records import (
    LEVELS,
    ROLES,
    Argument,
    Description,
    JointMap,
    RobotDescription,
    ScannerDescription,
    Solutions,
)

__all__ = [
    "LEVELS",
    "ROLES",
    "Argument",
    "Description",
    "JointMap",
    "RobotDescription",
    "ScannerDescription",
    "Solutions",
    "hook",
    "installed",
    "installed_folders",
    "installed_names",
    "plugin_hook",
]
