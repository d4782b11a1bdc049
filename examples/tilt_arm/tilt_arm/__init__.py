"""A made-up needle robot: two slides, a tilt, an insertion; and a tube to work in."""
