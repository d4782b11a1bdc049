"""What is not mutated: what no verdict rests on, and what changes nothing."""

import ast

# Names of what is said, logged or timed, and of what only types or lays out.
_SAID = ("_log", "logging", "warnings", "progress", "perf_counter", "cast", "setflags")
_FUNCTIONS = ("__repr__", "__str__", "to_json")
# Arguments that say of which type, layout or order something is, or that lists are of
# one length: a change is refused at once or changes nothing.
_KEYWORDS = ("dtype", "order", "strict", "maxsize", "reason", "indent")
_TYPES = ("NDArray", "Callable", "Mapping", "Sequence", "Array")


def left_alone(parent: ast.AST, field: str, node: ast.AST) -> bool:
    """Whether a part of a syntax tree is not mutated.

    Args:
        parent: Where it stands.
        field: As what.
        node: The part.
    """
    if field in ("decorator_list", "annotation", "returns", "bases", "ctx"):
        return True
    if isinstance(node, ast.JoinedStr | ast.Import | ast.ImportFrom):
        return True
    if isinstance(node, ast.FunctionDef):
        return node.name in _FUNCTIONS
    if isinstance(node, ast.keyword):
        return node.arg in _KEYWORDS
    if isinstance(node, ast.If):
        return "TYPE_CHECKING" in _names(node.test)
    if isinstance(node, ast.Assign | ast.Expr | ast.Call):
        return _is_said(node) or (isinstance(parent, ast.Module) and _is_type(node))
    return False


def _is_said(node: ast.AST) -> bool:
    if isinstance(node, ast.Expr):
        return _is_said(node.value)
    if isinstance(node, ast.Call):
        return bool(_names(node.func) & set(_SAID)) or _is_format(node.func)
    return isinstance(node, ast.Assign) and "perf_counter" in _names(node.value)


def _is_format(func: ast.expr) -> bool:
    return (
        isinstance(func, ast.Attribute)
        and func.attr in ("format", "join")
        and isinstance(func.value, ast.Constant)
    )


def _is_type(node: ast.AST) -> bool:
    """Names of types, and of what a module lets others see."""
    if not isinstance(node, ast.Assign):
        return False
    is_union = isinstance(node.value, ast.BinOp) and isinstance(
        node.value.op, ast.BitOr
    )
    names = _names(node.value) | _names(node.targets[0])
    is_alias = isinstance(node.value, ast.Subscript) and bool(names & set(_TYPES))
    return is_union or is_alias or "__all__" in names


def _names(node: ast.AST) -> set[str]:
    found = {n.id for n in ast.walk(node) if isinstance(n, ast.Name)}
    return found | {n.attr for n in ast.walk(node) if isinstance(n, ast.Attribute)}


# Modules of compiled kernels: each of their mutants is compiled anew with all that use
# them (a minute or two), so that few are taken.
KERNELS = ("borecheck/motion/halving.py", "borecheck/motion/swept_boxes.py")

# Changes that no test can notice, each with its reason. They are not counted.
EQUIVALENT = {
    "borecheck/contact/causes.py _determinants: i + 1 -> i - 1": (
        "the edges of a triangle the other way round; absolute values are compared"
    ),
    "borecheck/contact/causes.py _determinants: j + 1 -> j - 1": (
        "as above, of the other triangle"
    ),
    "borecheck/contact/causes.py _determinants: 1 -> 2": (
        "as above: the edge from a corner to the one before it, the other way round"
    ),
    "borecheck/contact/causes.py _determinants: 1 -> 2 (#2)": (
        "as above, of the other triangle"
    ),
    "borecheck/contact/check.py _clearance: "
    "min(links.values(), default=None) -> min(links.values())": (
        "it is asked only where there are some"
    ),
    "borecheck/contact/containment.py _has_component_within: "
    "corners <= high -> corners < high": (
        "a quick look: what is within the part and apart from its surface, both known, "
        "stays off the border of its box"
    ),
    "borecheck/contact/pose_batch.py PoseBatch.held: 2 -> 3": (
        "a slice of two entries up to the third holds both"
    ),
    "borecheck/contact/pose_batch.py PoseBatch.__init__: "
    "np.array(robot.self_pairs, np.int64) -> np.array(robot.self_pairs)": (
        "pairs of links are made whole numbers where they are taken, of none, too"
    ),
    "borecheck/contact/skipped.py pairs_without: 1 -> 2": (
        "numpy takes any negative length of a shape for the one to be found"
    ),
    "borecheck/contact/skipped.py pairs_without: 1 -> 2 (#2)": (
        "numpy takes any negative length of a shape for the one to be found"
    ),
    "borecheck/motion/search.py search: np.inf -> np.nan": (
        "no comparison holds of nan, as none of room with minus infinity does"
    ),
    "borecheck/motion/search.py examine_pair: len(rows) > 0 -> len(rows) >= 0": (
        "without rows nothing is left to examine by distance: the answer is the same"
    ),
    "borecheck/motion/search.py _by_boxes_and_planes: 64 -> 128": (
        "room for findings, which grows as needed"
    ),
    "borecheck/motion/search.py _by_boxes_and_planes: 3 -> 4": (
        "as above: a column that nothing reads"
    ),
    "borecheck/motion/search.py _examined_by_distance: 1 -> 2": (
        "numpy takes any negative length of a shape for the one to be found"
    ),
    "borecheck/motion/by_distance.py _displacement: "
    "kind[j] == FIXED or change[j] == 0.0 -> kind[j] == FIXED": (
        "a joint that does not change is passed over: it would add nothing"
    ),
    "borecheck/motion/round_shapes.py _joined: 0.0 -> 1.0": (
        "the first stretch begins at 0, so that its start is among the ends anyway"
    ),
    "borecheck/verify/distance.py _some_points_nearer: "
    "_lengths((a[:, None] - b).reshape(-1, 3)) < distance -> "
    "_lengths((a[:, None] - b).reshape(-1, 3)) <= distance": (
        "a quick look; what is as far as the distance is answered so by the bounds, too"
    ),
    "borecheck/verify/distance.py nearer_than: "
    "_lengths(first[:, 0] - second[:, 0]) < distance -> "
    "_lengths(first[:, 0] - second[:, 0]) <= distance": (
        "a quick look, too; the bounds answer the same"
    ),
    "borecheck/verify/distance.py _some_points_nearer: 1 -> 2": (
        "a quick look at other corners; the bounds answer the same"
    ),
    "borecheck/verify/distance.py _some_points_nearer: 1 -> 2 (#2)": (
        "a quick look at other corners; the bounds answer the same"
    ),
    "borecheck/verify/distance.py _some_points_nearer: 1 -> 2 (#3)": (
        "numpy takes any negative length of a shape for the one to be found"
    ),
    "borecheck/verify/distance.py _edges: i + 1 -> i - 1": (
        "the edges of a triangle the other way round: the same edges"
    ),
    "borecheck/verify/distance.py _edges: j + 1 -> j - 1": (
        "as above, of the other triangle"
    ),
    "borecheck/verify/distance.py _edges: 1 -> 2": (
        "as above: an edge to the corner before, the other way round"
    ),
    "borecheck/verify/distance.py _edges: 1 -> 2 (#2)": (
        "as above, of the other triangle"
    ),
    "borecheck/verify/distance.py _normals: 0 -> 1 (#2)": (
        "the second side drawn from the other end of the first: the same normal"
    ),
    "borecheck/verify/distance.py : 32 -> 64": (
        "how many triangles are in a group: answers are those of all pairs anyway"
    ),
    "borecheck/verify/distance.py : 100000 -> 200000": (
        "how many pairs are handled at a time: they are all handled"
    ),
    "borecheck/verify/passage.py StatedCorridor.depth_and_width: 1 -> 2 (#2)": (
        "numpy takes any negative length of a shape for the one to be found"
    ),
    "borecheck/plans/corridor.py common_points: 1 -> 2": (
        "numpy takes any negative length of a shape for the one to be found"
    ),
    "borecheck/verify/passage.py StatedCorridor._aside_of: "
    "best * around <= abs(sum(turns)) + thin -> "
    "best * around < abs(sum(turns)) + thin": (
        "both differ by far more or by far less than the rounding that is added"
    ),
    "borecheck/verify/passage.py StatedCorridor._aside_of: -1 -> 1": (
        "the sides of a polygon the other way round: as near, and all turns negated"
    ),
    "borecheck/verify/passage.py StatedCorridor._aside_of: -1 -> 1 (#2)": (
        "as above: the length around is the same"
    ),
    "borecheck/verify/passage.py StatedCorridor._aside_of: 0.0 -> 1.0 (#2)": (
        "a place along a side of no length: any is the same point"
    ),
    "borecheck/verify/passage.py StatedCorridor._aside_of: "
    "min(turns) >= -thin -> min(turns) > -thin": (
        "through a side or a corner the line is at distance 0 from it anyway"
    ),
    "borecheck/verify/solid.py _is_free: point <= high -> point < high": (
        "from beside a part a line leads away, whether its box is touched or not"
    ),
    "borecheck/verify/solid.py side_of: corners.min(axis=(0, 1)) -> corners.min()": (
        "a quick look: from outside of the box a line along an axis leads away"
    ),
    "borecheck/verify/solid.py leads_away: "
    "np.abs(along) > rim * size -> np.abs(along) >= rim * size": (
        "what is at the bound is rounding of it"
    ),
    "borecheck/verify/solid.py leads_away: "
    "np.abs(across) > 3.0 * rim -> np.abs(across) >= 3.0 * rim": (
        "as above: three heights, each within rounding of the bound, met at once"
    ),
    "borecheck/verify/binding.py _numbers: np.array(expected, float) -> "
    "np.array(expected)": (
        "what should be is made of numbers by us; whole ones compare by value"
    ),
    "borecheck/contact/compare.py _warm_up: "
    "contacts(a, WORLD, b, WORLD, name, pruning, same_vertices=True) -> "
    "contacts(a, WORLD, b, WORLD, name, pruning)": (
        "what the warm-up finds is thrown away, and it calls the same kernels"
    ),
    "borecheck/verify/solid.py is_embedded: i < j -> i > j": (
        "each pair is looked at once either way, and both of its orders are asked"
    ),
    "borecheck/verify/solid.py _meets_neighbour: 3 -> 4": (
        "of one and the same triangle a corner is left as what lies opposite: it meets"
    ),
    "borecheck/verify/binding.py _numbers: first.size and "
    "(not (np.abs(first - second) <= SAME).all()) -> "
    "not (np.abs(first - second) <= SAME).all()": ("of no numbers all are the same"),
    "borecheck/verify/binding.py _pairs: 0.0 -> 1.0": (
        "pairs that may touch have no numbers: the same on both sides"
    ),
    "borecheck/verify/binding.py _names: plan is not None and other is not None -> "
    "plan is not None or other is not None": (
        "where one of them is None alone, that was told before"
    ),
    "borecheck/verify/binding.py _names: plan is not None and other is not None -> "
    "plan is not None": ("where one of them is None alone, that was told before"),
    "borecheck/verify/binding.py _names: plan is not None and other is not None -> "
    "other is not None": ("where one of them is None alone, that was told before"),
    "borecheck/verify/binding.py _names: path is not None and other is not None -> "
    "path is not None or other is not None": (
        "as of the plan: where one of them is None alone, that was told before"
    ),
    "borecheck/verify/claims.py Claims._true: 0 -> 1 (#2)": (
        "surfaces are apart throughout the interval, which was asked before: any "
        "instant of it tells what one holds of the other"
    ),
    "borecheck/verify/statement.py Surface.box: 1 -> 2": (
        "numpy takes any negative length of a shape for the one to be found"
    ),
    "borecheck/plans/skin.py distance_to: 1 -> 2 (#2)": (
        "a point as a triangle of three like corners: any of them may be named twice"
    ),
    "borecheck/plans/corridor.py _is_in: "
    "inward < -tolerance * length * float(np.linalg.norm(q - p)) -> "
    "inward <= -tolerance * length * float(np.linalg.norm(q - p))": (
        "at the bound of rounding; triangles of no area come to no crossing"
    ),
    "borecheck/plans/needle_line.py _each: 1 -> 2 (#2)": (
        "numpy takes any negative length of a shape for the one to be found"
    ),
    "borecheck/plans/whole_arm.py _with_drive: "
    "not stations.driven or robot.needle is None -> not stations.driven": (
        "stations that are driven are those of a needle's own joint (`_stations`); the "
        "second question is for the checker of types"
    ),
    "borecheck/plans/plan_fields.py unknown_line: "
    "get_close_matches(name, known, n=1) -> get_close_matches(name, known)": (
        "of several that are close the first is named, which is the closest"
    ),
    "borecheck/plans/plan_file.py plans_csv: plan.mount or '' -> plan.mount": (
        "the writer of CSV writes None as nothing"
    ),
    "borecheck/plans/plan_file.py _json_plan: "
    "len(set(bare.values())) < len(bare) -> len(set(bare.values())) > len(bare)": (
        "one coordinate under two names has two units, which is refused before"
    ),
}
