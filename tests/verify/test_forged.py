"""A fixed part of `studies.forged_certificates`: none accepted, honest ones held."""

from studies.forged_certificates.__main__ import LONGEST, run
from studies.forged_certificates.lies import LIES


def test_forged_certificates_are_refused_and_honest_ones_hold() -> None:
    tally = run(count=170, honest_count=5, robots=0, seed=8, report=lambda text: None)
    assert tally.wrong == []
    assert tally.counts["forged or malformed"] >= 170
    assert tally.counts["accepted"] == tally.counts["tracebacks"] == 0
    assert tally.longest < LONGEST
    assert tally.counts["honest"] == 5
    # all kinds were there: changed fields, lies, files, and what binding alone can tell
    kinds = set(tally.kinds)
    assert {f"lie: {lie.__name__}" for lie in LIES} <= kinds
    assert {"lie: hidden both sides", "bound: another path of it"} <= kinds
    assert {"text: files", "meshes: files"} <= kinds
    assert sum(kind.startswith("changed ") for kind in kinds) > 20
