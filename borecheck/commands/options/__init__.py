"""Groups of options that are more than a line or two; no heavy imports."""
