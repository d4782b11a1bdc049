"""What a user asks for: needle plans, joint paths, the corridor of a needle.

Others use the readers in `plan_file` and `path_file`, and `corridor.Corridor`.
"""
