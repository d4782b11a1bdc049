"""Pairs of triangles: the published tests, the exact one, distance, winding."""
