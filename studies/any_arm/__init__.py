"""Stranger's arms do the main job: needle plans solved, certified and verified."""
