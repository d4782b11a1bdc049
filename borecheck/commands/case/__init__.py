"""Case files: robot, scanner, patients, plans and margin in one file, `case.toml`.

A case is put into the words of a command line, so that every command has one way in.
"""
