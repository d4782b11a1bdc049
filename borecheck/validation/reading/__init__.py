"""What checks look at: the draft of a robot, its meshes, what libraries make of it."""
