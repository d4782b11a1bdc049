"""Large, seeded runs whose figures stand in the docs: `python -m studies.NAME`."""
