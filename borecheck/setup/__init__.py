"""The best configuration for a needle, with proof; or that there is none, with proof.

[CRANE] section V: a configuration that can hold the needle's forces, keeps clear of all
that stands around, and can turn the needle within a cone about its entry; among those
the one of least cost. Every one that is given was asked of the exact checker.
"""
