"""A probability of contact in words."""

from collections.abc import Mapping
from typing import Any


def lines(block: Mapping[str, Any]) -> list[str]:
    """The probability in words, for the text of a result."""
    found = block.get("uncertainty")
    if found is None:
        return []
    parts = []
    if found["probability"] is not None:
        low, high = found["interval"]
        parts.append(
            f"{found['probability']:.2g} from {found['samples']} draws "
            f"(95 %: {low:.2g} to {high:.2g})"
        )
    if found["first_order"] is not None:
        low, high = found["first_order_bounds"]
        span = f"{low:.2g} to {high:.2g}"
        # the draws of the linear model end at 5e-6; below, the bounds say more
        known = f"{found['first_order']:.2g} ({span})" if found["first_order"] else span
        parts.append(f"{known} to first order")
    told = ["probability of contact: " + ", ".join(parts)]
    margin = found["margin_for_risk_m"]
    if margin is not None:
        told.append(
            f"for a risk of {found['risk']:g} a clearance of {1e3 * margin:.2f} mm is "
            f"needed, nominal {1e3 * found['clearance_m']:.2f} mm"
        )
    return told
