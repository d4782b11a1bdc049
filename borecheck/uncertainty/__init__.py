"""How likely is contact, when joints, dimensions and registration are not exact?"""
