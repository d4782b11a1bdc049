"""What every room may use: rigid motions, units, files, the cache folder, the version.

Knows no mesh and no robot.
"""
