"""The public door of the published tests of triangles."""

from borecheck.geometry.triangles.published import paper as paper
from borecheck.geometry.triangles.published import two_sided as two_sided
