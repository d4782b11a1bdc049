"""Faults of masses and inertias."""

from lxml import etree

from studies.seeded_defects.spoiling import assign, drop, kind, pick, scale


@kind("inertia")
def mass_zero(r, rng):
    inertial = pick(rng, r.inertials())
    return None if inertial is None else assign(inertial.find("mass"), "value", "0")


@kind("inertia")
def mass_negative(r, rng):
    inertial = pick(rng, r.inertials())
    return None if inertial is None else scale(inertial.find("mass"), "value", -1.0)


@kind("inertia")
def mass_missing(r, rng):
    return drop(pick(rng, r.inertials()), "mass")


@kind("inertia")
def mass_in_grams(r, rng):
    inertial = pick(rng, r.inertials())
    return None if inertial is None else scale(inertial.find("mass"), "value", 1e3)


@kind("inertia")
def inertial_missing(r, rng):
    inertial = pick(rng, r.inertials())
    return None if inertial is None else drop(inertial.getparent(), "inertial")


def _inertia(r, rng, **values):
    inertial = pick(rng, r.inertials())
    if inertial is None:
        return None
    inertia = inertial.find("inertia")
    for name, value in values.items():
        inertia.set(name, value)
    return inertia


@kind("inertia")
def inertia_negative(r, rng):
    return _inertia(r, rng, ixx="-0.01")


@kind("inertia")
def inertia_products_too_large(r, rng):
    inertial = pick(rng, r.inertials())
    if inertial is None:
        return None
    inertia = inertial.find("inertia")
    value = 3.0 * max(float(inertia.get(n)) for n in ("ixx", "iyy", "izz"))
    return assign(inertia, "ixy", f"{value:.6g}")


@kind("inertia")
def inertia_triangle_broken(r, rng):
    inertial = pick(rng, r.inertials())
    if inertial is None:
        return None
    inertia = inertial.find("inertia")
    value = 10.0 * sum(float(inertia.get(n)) for n in ("ixx", "iyy"))
    return assign(inertia, "izz", f"{value:.6g}")


@kind("inertia")
def inertia_zero(r, rng):
    zero = dict.fromkeys(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), "0")
    return _inertia(r, rng, **zero)


@kind("inertia")
def inertia_placeholder(r, rng):
    ones = dict.fromkeys(("ixx", "iyy", "izz"), "1")
    return _inertia(r, rng, **ones, ixy="0", ixz="0", iyz="0")


@kind("inertia")
def inertia_in_square_millimetres(r, rng):
    inertial = pick(rng, r.inertials())
    if inertial is None:
        return None
    inertia = inertial.find("inertia")
    for name in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"):
        scale(inertia, name, 1e6)
    return inertia


@kind("inertia")
def inertia_nan(r, rng):
    return _inertia(r, rng, izz="nan")


@kind("inertia")
def inertia_entry_missing(r, rng):
    inertial = pick(rng, r.inertials())
    return None if inertial is None else assign(inertial.find("inertia"), "iyy", None)


@kind("inertia")
def centre_of_mass_in_millimetres(r, rng):
    inertial = pick(rng, r.inertials())
    if inertial is None:
        return None
    origin = inertial.find("origin")
    if origin is None:
        origin = etree.SubElement(inertial, "origin")
    return assign(origin, "xyz", "0 0 50")
