"""Bodies of patients by sex, height and body mass index, lying on a flat couch.

Shapes are MakeHuman's (CC0), posed, laid down and made closed solids by `python -m
studies.body_baking`; here they are scaled to what is asked for. Knows meshes, no robot.
"""
