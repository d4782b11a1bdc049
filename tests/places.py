"""Where the tests find their data and the project."""

from pathlib import Path

DATA = Path(__file__).parent / "data"
ROBOTS = DATA / "robots"
PROJECT = Path(__file__).parents[1]
