"""The public door of the exact test of triangles."""

from borecheck.geometry.triangles.exact import exact as exact
