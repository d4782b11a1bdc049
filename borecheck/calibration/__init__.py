"""Axis-by-axis calibration of serial arms and its refinement, [Heikkila2010] section 4.

Any arm given by a URDF; nothing here knows a robot by name.
"""
