"""xacro files expanded without ROS, and without trusting whoever wrote them.

`expand` is the door. Expressions are evaluated from their syntax tree (`expression`,
with `names`, `methods`, `values`), files are read within reach only (`run`), and the
`xacro` package is held by `hooks` while it expands.
"""

from borecheck.robots.urdf.xacro.expansion import Expanded, expand

__all__ = ["Expanded", "expand"]
