"""STL, OBJ, PLY and Collada files read strictly: all of a file, or a refusal."""
