"""Coverage-guided fuzzing of the URDF reader and of all checks: no traceback, no hang.

    pip install -e .[fuzz]
    python -m studies.fuzz_validate [CORPUS_FOLDER] [-max_total_time=600] [-timeout=10]

Without atheris the same inputs come from a seeded generator (`--plain N`), which needs
nothing but borecheck; the tests run a little of it.
"""

import os
import random
import sys
from pathlib import Path

SEEDS = Path(__file__).resolve().parents[1] / "tests" / "data" / "urdf"
WORDS = (
    *("0", "-1", "1e999", "nan", "1e308", "-1e308", "1e-320", "", " ", "1,5", "35mm"),
    *("0 0 0", "1 2", "1 2 3 4", "${x}", "$(arg y)", "package://", "../..", "\x7f"),
    *("base", "tool", "elbow", "mesh", "continuous", "floating", "planar", "prismatic"),
)


def check(data: bytes) -> None:
    """One input: whatever it is, findings come back and nothing is raised."""
    from borecheck.validation import Options, validate_text

    options = Options(run=False, profile="dynamics", frames=("tool",))
    for finding in validate_text(data, "fuzz.urdf", options):
        assert finding.message
        assert finding.line >= 1


def mutated(rng: random.Random, seeds: list[bytes]) -> bytes:
    """A seed with a few places changed: attributes, tags, bytes, blocks."""
    data = rng.choice(seeds)
    for _ in range(rng.randint(1, 4)):
        data = rng.choice((_attribute, _block, _byte, _cut))(rng, data)
    return data


def _attribute(rng: random.Random, data: bytes) -> bytes:
    parts = data.split(b'"')
    if len(parts) < 3:
        return data
    parts[rng.randrange(1, len(parts), 2)] = rng.choice(WORDS).encode()
    return b'"'.join(parts)


def _block(rng: random.Random, data: bytes) -> bytes:
    lines = data.split(b"\n")
    start = rng.randrange(len(lines))
    piece = lines[start : start + rng.randint(1, 8)]
    if rng.random() < 0.5:
        del lines[start : start + len(piece)]
    else:
        at = rng.randrange(len(lines) + 1)
        lines[at:at] = piece
    return b"\n".join(lines)


def _byte(rng: random.Random, data: bytes) -> bytes:
    at = rng.randrange(len(data) + 1)
    return data[:at] + bytes([rng.randrange(256)]) + data[at + 1 :]


def _cut(rng: random.Random, data: bytes) -> bytes:
    return data[: rng.randrange(len(data) + 1)] if rng.random() < 0.2 else data


def seed_files() -> list[bytes]:
    """The corpus of the tests."""
    return [path.read_bytes() for path in sorted(SEEDS.glob("*/*.urdf"))]


def plain(count: int, seed: int = 0) -> None:
    """The same without coverage guidance."""
    rng, seeds = random.Random(seed), seed_files()
    for _ in range(count):
        data = mutated(rng, seeds)
        try:
            check(data)
        except Exception:
            Path("fuzz_failure.urdf").write_bytes(data)
            print("kept as fuzz_failure.urdf")
            raise
    print(f"{count} inputs, no traceback")


def main() -> None:
    if "--plain" in sys.argv:
        plain(int(sys.argv[sys.argv.index("--plain") + 1]))
        return
    guided()


def guided() -> None:
    """Inputs that reach new lines of borecheck are kept and changed further."""
    import atheris

    with atheris.instrument_imports(include=["borecheck"]):
        from borecheck.validation.catalogue import all_checks

        all_checks()  # imports the checks
        check(seed_files()[0])  # and what they import when they are first run
    seeds, words = seed_files(), _words(sys.argv)
    os.chdir(SEEDS / "arm")  # so that the meshes that the seeds name are read

    def mutate(data: bytes, size: int, seed: int) -> bytes:
        rng = random.Random(seed)
        if rng.random() < 0.8:
            pool = [data] if data and rng.random() < 0.5 else seeds
            return mutated(rng, pool)[:size]
        return bytes(atheris.Mutate(data, size))

    atheris.Setup(words, check, custom_mutator=mutate)
    atheris.Fuzz()


def _words(argv: list[str]) -> list[str]:
    """The options of libFuzzer, with absolute folders and longer inputs."""
    given = [str(Path(w).resolve()) if Path(w).is_dir() else w for w in argv]
    return [*given, "-max_len=20000", f"-artifact_prefix={Path.cwd()}/"]


if __name__ == "__main__":
    main()
