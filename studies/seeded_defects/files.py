"""The list of the study's files, and what was kept about them."""

import json
from collections import defaultdict
from random import Random


def rows_of(folder, per_kind=None):
    """The sound robots and the spoilt files; of each kind all, or so many at random."""
    lines = (folder / "files.jsonl").read_text().splitlines()
    rows = [json.loads(line) for line in lines]
    by_kind = defaultdict(list)
    for row in rows:
        by_kind[row["kind"]].append(row)
    chosen = by_kind.pop(None)
    for kind, found in by_kind.items():
        count = len(found) if per_kind is None else min(per_kind, len(found))
        chosen += Random(kind).sample(found, count)
    return chosen


def read_lines(path):
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text().splitlines()]
