"""Checks certificates again: numpy only, nothing of the rest of borecheck.

Others use `check.verify`.
"""
