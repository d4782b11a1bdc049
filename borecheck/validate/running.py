"""Kinematics checks by running the robot in other libraries."""
