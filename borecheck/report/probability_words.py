"""A probability of contact in words."""

from collections.abc import Mapping
from typing import Any


def lines(block: Mapping[str, Any]) -> list[str]:
    """The probability in words, for the text of a result."""
    found = block.get("uncertainty")
    if found is None:
        return []
    words = [f"probability of contact: {_drawn(found)}", _risk(found)]
    if found["meets"]:
        first, second, share = found["meets"][0]
        words.append(f"most often {first} meets {second}, in {share:.1%} of the draws")
    return [*words, *_estimate(found, "path" in block)]


def cells(block: Mapping[str, Any]) -> tuple[str, str]:
    """The probability with its interval, and the risk, for a row of a table."""
    found = block.get("uncertainty")
    if found is None:
        return "-", "-"
    return _with_interval(found), f"{found['risk']:g} {found['answer']}"


def _with_interval(found: Mapping[str, Any]) -> str:
    if found["probability"] is None:
        return "not drawn"
    low, high = found["interval"]
    return f"{found['probability']:.2g} ({low:.2g} to {high:.2g})"


def _drawn(found: Mapping[str, Any]) -> str:
    """Estimate and interval, and what they rest on."""
    proven = ""
    if found["outside"] < 1.0:
        proven = (
            f"; errors up to {found['proven_radius']:.2f} sigma together are proven "
            f"harmless, larger ones have a probability of {found['outside']:.2g}"
        )
    if found["probability"] is None:
        return f"not drawn{proven}"
    low, high = found["interval"]
    undecided = ""
    if found["undecided"]:
        undecided = f", {found['undecided']:,} undecided"
    among = " of those" if proven else ""
    return (
        f"{found['probability']:.2g} (95 %: {low:.2g} to {high:.2g}){proven}; "
        f"{found['contacts']:,} of {found['samples']:,} draws{among} in contact"
        f"{undecided}, each judged as a whole"
    )


def _risk(found: Mapping[str, Any]) -> str:
    """Whether the risk is kept, with the exact limit that says so."""
    words = f"risk of {found['risk']:g} {found['answer']}"
    if found["answer"] == "kept":
        return f"{words}: at most {found['upper']:.2g} (exact limit, 95 %)"
    if found["answer"] == "exceeded":
        return f"{words}: at least {found['lower']:.2g} (exact limit, 95 %)"
    limit = f"at most {found['upper']:.2g} (exact limit, 95 %)"
    return f"{words}: {limit}; {found['why']}"


def _estimate(found: Mapping[str, Any], is_motion: bool) -> list[str]:
    """What the linear model adds: never a proof."""
    estimate = found["first_order"]
    if estimate is None or estimate["margin_for_risk_m"] is None:
        return []
    # the draws of the linear model end at 5e-6; below, the sum of its cuts says more
    likely = estimate["probability"] or estimate["span"][1]
    where = " at the pose that comes nearest" if is_motion else ""
    return [
        f"to first order{where}, obstacles alone, its error not bounded: {likely:.2g}; "
        f"a risk of {found['risk']:g} would need a clearance of "
        f"{1e3 * estimate['margin_for_risk_m']:.2f} mm, "
        f"nominal {1e3 * estimate['clearance_m']:.2f} mm"
    ]
