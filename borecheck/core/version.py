"""The version, which everything may name."""

__version__ = "0.2.0"
