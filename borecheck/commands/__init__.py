"""The subcommands of the command line, one module each.

Each has `add_arguments(parser)` and `run(args) -> int`, and imports what is heavy only
when it runs.
"""
