"""Patients as they are: scans read, and turned into obstacles that contain them.

Others use `reading.read_volume` and `obstacle.patient_obstacle`.
"""
