"""Meshes, triangles and trees: arrays in, arrays out; knows no robot.

Others use `surfaces` (which parts of two surfaces meet, and how near they are),
`mesh.triangle_mesh`, `mesh_files.reading` and `tree.mesh_tree`.
"""
