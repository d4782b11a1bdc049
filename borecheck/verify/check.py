"""Checks a path certificate again, with numpy only and no code of the search.

Every pair of a part and an obstacle, and every pair of parts that the chain asks for,
must be stated; for each the intervals must cover the motion from its first waypoint to
its last without a gap. For every interval three things are derived here once more: the
placements at the named instant (products of Rodrigues rotations), how far any point of
one surface can move against the other during the interval (`verify.chain`), and that
no two triangles are nearer than the named clearance (`verify.distance`). The clearance
must exceed displacement and margin. Closed surfaces must not hold each other at the
start (`verify.solid`).

A passage is a pair that may touch within a stated corridor, a needle and its patient.
Its intervals name an instant and a displacement; `verify.passage` says what must hold
then, and how wide a corridor may be. Others, `beside`, say that the needle is plainly
clear of the patient: they are asked as those of any pair, with the same margin, and
that neither holds the other where each run of them begins. Together they must cover the
motion; which of both an interval is said to be is no evidence for it.

A certificate alone shows that the motion it describes is clear. That this is the motion
of a certain robot, scene and plan is known only if these are given: `verify.binding`.
Nothing is accepted that was not asked here; whatever goes wrong, it is not accepted.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from borecheck.verify.binding import Expected, differences
from borecheck.verify.claims import Claims
from borecheck.verify.fields import Rejected
from borecheck.verify.read_statement import check_frame, read_statement
from borecheck.verify.reading import Meshes, Missing, read_document, read_meshes
from borecheck.verify.verification import Verification

Expect = Callable[[Mapping[str, Any]], Expected]


def verify(
    source: str | Path | Mapping[str, Any],
    meshes: Meshes | None = None,
    expect: Expect | None = None,
) -> Verification:
    """Checks a certificate.

    Args:
        source: A file, or its content.
        meshes: The surfaces it speaks of: arrays (vertices (n, 3) [m], triangles
            (m, 3)) in any order or under any names, or the `.npz` file with them. By
            default the file beside the certificate with the suffix `.npz`.
        expect: From the plain values of the certificate to what it should state; any
            difference is a problem. See `motion.binding`.

    Returns:
        Whether it holds, and if not, why not. Nothing is raised for a certificate,
        whatever it holds: what cannot be checked is not accepted.
    """
    document: Mapping[str, Any] = {}
    try:
        # a number that overflows or is none is no number to go on with
        with np.errstate(over="raise", invalid="raise"):
            document = read_document(source)
            found = _verified(document, source, meshes, expect)
    except Missing as problem:
        return Verification(False, (str(problem),), could_not_run=True)
    except Rejected as problem:
        found = Verification(False, (str(problem),))
    except Exception as problem:  # noqa: BLE001 - whatever it is, it was not confirmed
        text = " ".join(f"{type(problem).__name__}: {problem}".split())
        found = Verification(False, (f"not a certificate that can be checked: {text}",))
    return replace(found, stated=document)


def _verified(
    document: Mapping[str, Any],
    source: str | Path | Mapping[str, Any],
    meshes: Meshes | None,
    expect: Expect | None,
) -> Verification:
    check_frame(document)
    if meshes is None:
        if isinstance(source, Mapping):
            raise Rejected("the meshes it speaks of are needed to check it")
        meshes = Path(source).with_suffix(".npz")
    statement = read_statement(document, read_meshes(meshes))
    if expect is None:
        return Claims(statement).run()
    expected = expect(document)
    content = expected.content
    different = differences(statement, expected)
    if different:
        return Verification(
            False, different, bound_to=expected.what, not_known=expected.not_known
        )
    reasons = {(r["first"], r["second"]): r["reason"] for r in content["allowed"]}
    found = Claims(statement, reasons).run()
    return replace(found, bound_to=expected.what, not_known=expected.not_known)
