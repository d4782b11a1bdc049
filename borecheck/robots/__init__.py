"""From files to placed bodies: URDF and xacro, model, parts, robot, scene.

Others use `robot.load_robot`, `scene.load_scene` and the records of `description`.
Only `model` imports Pinocchio.
"""
