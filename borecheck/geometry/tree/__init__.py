"""An 8-wide tree of boxes over a mesh, and what is asked of it: contact, clearance."""
