"""Forged certificates against `verify`: none may be accepted, none may hang it.

    python -m studies.forged_certificates --count 12000 --honest 500 --seed 1

Three kinds of false ones: certificates of clear motions with a field changed
(`mutations`), certificates of motions that touch with every lie that suggests itself
(`lies`), and files that are damaged (`files`). A changed certificate may still be true:
of the same motion (another label, a clearance stated smaller), or of another motion
that is clear as well. These are counted by themselves, and those of another motion must
be refused when they are bound to the files of the first. Honest ones must all hold.
"""

import argparse
import json
import sys
import time
import warnings
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from borecheck.verify.check import verify
from borecheck.verify.reading import mesh_hash, read_meshes
from borecheck.verify.verification import Verification
from studies.forged_certificates import judge, lies, problems
from studies.forged_certificates.files import damaged, is_same
from studies.forged_certificates.mutations import mutated
from studies.forged_certificates.problems import Case
from studies.forged_certificates.robots import robots_certificates

LONGEST = 2.0  # a certificate answered later than this counts as a hang, [s]
MUTATIONS_EACH, CASES_BETWEEN = 40, 20


class Tally:
    """What came of each certificate."""

    def __init__(self, report: Callable[[str], None]) -> None:
        self.counts: Counter[str] = Counter()
        self.kinds: Counter[str] = Counter()
        self.wrong: list[str] = []
        self.longest = 0.0
        self.report = report

    def asked(self, kind: str, *words: Any) -> Verification | None:
        """Verifies; an exception or a long time is remembered."""
        self.kinds[kind] += 1
        begin = time.process_time()
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                found = verify(*words)
        except Exception as error:  # noqa: BLE001 - this is what is looked for
            self.wrong.append(f"{kind}: raised {type(error).__name__}: {error}")
            self.counts["tracebacks"] += 1
            return None
        seconds = time.process_time() - begin
        self.longest = max(self.longest, seconds)
        if seconds > LONGEST:
            self.counts["hangs"] += 1
            self.wrong.append(f"{kind}: took {seconds:.1f} s")
        return found

    def false(self, kind: str, found: Verification | None) -> None:
        """Counts a certificate that must not be accepted."""
        self.counts["forged or malformed"] += 1
        if found is not None and found.accepted:
            self.counts["accepted"] += 1
            self.wrong.append(f"{kind}: accepted")


def mutations(tally: Tally, rng: np.random.Generator, case: Case, other: Case) -> None:
    """Changes of a genuine certificate; who is accepted is judged."""
    kind, document = mutated(rng, case.document, other.document)
    if document == case.document:
        return  # swapped with its like
    found = tally.asked(f"changed {kind}", document, case.meshes)
    if found is None or not found.accepted:
        tally.false(kind, found)
    elif judge.is_same_motion(document, case.document):
        tally.counts["still true: the same motion up to 1e-12, told otherwise"] += 1
    elif judge.is_clear(document, {mesh_hash(*m): m for m in case.meshes}):
        tally.counts["still true: of another motion that is clear"] += 1
        again = tally.asked(f"bound {kind}", document, case.meshes, case.expect)
        if again is None or again.accepted:
            tally.counts["... and taken for the same when bound"] += 1
            tally.wrong.append(f"{kind}: accepted when bound")
    else:
        tally.false(kind, found)


def touching(tally: Tally, rng: np.random.Generator) -> None:
    """All lies about one motion that touches, with and without its meshes thinned."""
    case = problems.touching(rng)
    for kind, document in lies.forged(case):
        tally.false(f"lie {kind}", tally.asked(f"lie: {kind}", document, case.meshes))
    thin = [(v, t[:-2]) for v, t in case.meshes]
    document = next(lies.forged(case))[1]
    tally.false("thinned", tally.asked("lie: thinned meshes", document, thin))
    for kind, document, meshes in lies.hidden(rng):
        found = tally.asked(f"lie: hidden {kind}", document, meshes)
        tally.false(f"hidden {kind}", found)
    clear = problems.honest(rng)
    for kind, document in lies.of_another(clear, case):
        meshes = [*case.meshes, *clear.meshes]
        found = tally.asked(f"bound: {kind}", document, meshes, case.expect)
        tally.false(f"bound: {kind}", found)


def malformed(tally: Tally, rng: np.random.Generator, case: Case) -> None:
    """Damaged files."""
    with TemporaryDirectory() as folder:
        file = Path(folder) / "c.json"
        genuine = json.dumps(case.document, indent=1).encode()
        for kind in damaged(rng, case, Path(folder)):
            found = tally.asked(kind.split(" ")[0] + " files", file)
            if (
                found is not None
                and found.accepted
                and _is_genuine(file, genuine, case)
            ):
                tally.counts[
                    "still true: the same motion up to 1e-12, told otherwise"
                ] += 1
            else:
                tally.false(kind, found)


def _is_genuine(file: Path, genuine: bytes, case: Case) -> bool:
    """Whether what was damaged says nothing: the same record, the same meshes."""
    known = read_meshes(file.with_suffix(".npz"))
    needed = {body["mesh_sha256"] for body in case.document["bodies"]}
    return is_same(file.read_bytes(), genuine) and needed <= known.keys()


def honest(tally: Tally, rng: np.random.Generator, count: int, robots: int) -> None:
    """Certificates as they were written, of small robots and of the published ones."""
    for document, meshes, expect in robots_certificates(rng, robots):
        _one_honest(tally, "published robots", document, meshes, expect)
    for _ in range(count - tally.counts["honest"]):
        case = problems.honest(rng)
        _one_honest(tally, "small robots", case.document, case.meshes, case.expect)


def _one_honest(tally: Tally, kind: str, *words: Any) -> None:
    document, meshes, expect = words
    tally.counts["honest"] += 1
    for more in ((), (expect,)):
        found = tally.asked(f"honest {kind}", document, meshes, *more)
        if found is None or not found.accepted:
            tally.counts["honest refused"] += 1
            tally.wrong.append(f"honest, {kind}: {found and found.problems[:2]}")
    if tally.counts["honest"] % 50 == 0:
        tally.report(f"{tally.counts['honest']} honest ones")


def run(
    count: int, honest_count: int, robots: int, seed: int, report: Callable[[str], None]
) -> Tally:
    """The study: at least so many false certificates, and so many honest ones."""
    rng = np.random.default_rng(seed)
    tally = Tally(report)
    before, rounds = problems.honest(rng), 0
    while tally.counts["forged or malformed"] < count:
        case = problems.honest(rng)
        for _ in range(MUTATIONS_EACH):
            mutations(tally, rng, case, before)
        touching(tally, rng)
        if rounds % CASES_BETWEEN == 0:
            malformed(tally, rng, case)
        before, rounds = case, rounds + 1
        if rounds % 5 == 0:
            report(f"{tally.counts['forged or malformed']} false ones")
    honest(tally, rng, honest_count, robots)
    return tally


def lines(tally: Tally) -> list[str]:
    """The result in words."""
    groups: Counter[str] = Counter()
    for kind, number in tally.kinds.items():
        groups[kind.split(" ")[0].rstrip(":")] += number
    lines = [f"asked: {', '.join(f'{n} {k}' for k, n in sorted(groups.items()))}"]
    for name in ("forged or malformed", "accepted", "tracebacks", "hangs"):
        lines.append(f"{name}: {tally.counts[name]}")
    lines += [f"{k}: {n}" for k, n in sorted(tally.counts.items()) if "true" in k]
    lines.append(
        "... and taken for the same when bound: "
        f"{tally.counts['... and taken for the same when bound']}"
    )
    lines.append(
        f"honest: {tally.counts['honest']}, each by itself and bound; "
        f"refused: {tally.counts['honest refused']}"
    )
    lines.append(f"longest answer: {tally.longest:.2f} s of processor time")
    return [*lines, *tally.wrong[:20]]


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the study; 1 if anything false was accepted or anything honest refused."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=12_000)
    parser.add_argument("--honest", type=int, default=500)
    parser.add_argument("--robots", type=int, default=20, help="of them, published")
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args(argv)

    def report(text: str) -> None:
        print(text, file=sys.stderr, flush=True)

    tally = run(args.count, args.honest, args.robots, args.seed, report)
    print("\n".join(lines(tally)))
    return 1 if tally.wrong else 0


if __name__ == "__main__":
    sys.exit(main())
