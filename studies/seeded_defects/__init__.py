"""Single faults for URDF files, and what the study of them needs.

`spoiling` and the four modules of faults import nothing of borecheck: they follow the
faults that other validators were measured with and those that users report.
"""

from studies.seeded_defects import structure, joints, inertia, geometry  # isort: skip
from studies.seeded_defects.spoiling import KINDS, spoil

__all__ = ["KINDS", "geometry", "inertia", "joints", "spoil", "structure"]
