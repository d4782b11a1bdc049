"""CRANE: eight-axis robot for needles inside a CT bore [CRANE]; see docs/crane.md."""
