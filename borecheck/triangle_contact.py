"""The public door of the published tests of triangles."""

from borecheck.geometry.triangles.published import paper as paper
from borecheck.geometry.triangles.two_sided import two_sided as two_sided
