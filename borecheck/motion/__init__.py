"""Every instant of a motion: the certified search, its outcome and certificate.

Others use `check.check_path`, the records in `problem` and `certificate`.
"""
