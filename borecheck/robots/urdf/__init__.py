"""URDF and xacro text: expanded, parsed with its lines, paths resolved."""
