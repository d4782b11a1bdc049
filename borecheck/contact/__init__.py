"""One pose: do any parts touch, how near are they, what do other checkers say?

Others use `check`, `compare`, `many_poses` and the records in `verdict`.
"""
