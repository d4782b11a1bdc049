"""Files and messages of the programs beside ours: 3D Slicer and what speaks ITK.

Points, transforms and messages are read strictly and written exactly; nothing here
knows a robot, a scene or a verdict.
"""
