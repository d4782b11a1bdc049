"""Forward kinematics from several sources, and whether they agree."""
