"""All checks, by code: importing a module of checks enters them in the registry."""

from borecheck.validation.checks import (
    centres,
    document,
    geometry,
    inertia,
    joints,
    limits,
    loading,
    materials,
    mesh_files,
    mesh_shape,
    mimics,
    names,
    numbers,
    references,
    running,
    self_contact,
    sidecars,
    spelling,
    tree,
    xacro,
)
from borecheck.validation.registry import all_checks, find_check

__all__ = ["MODULES", "all_checks", "find_check"]

MODULES = (
    centres,
    document,
    geometry,
    inertia,
    joints,
    limits,
    loading,
    materials,
    mesh_files,
    mesh_shape,
    mimics,
    names,
    numbers,
    references,
    running,
    self_contact,
    sidecars,
    spelling,
    tree,
    xacro,
)
