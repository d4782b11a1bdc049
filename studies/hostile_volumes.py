"""Damaged DICOM, NIfTI, NRRD and markup files: one line or a result, never a traceback.

    python -m studies.hostile_volumes [--count 10000] [--seed 1]

Small scans and markups are made, one file of each is damaged by a seeded hand (bytes,
lengths, tags, numbers of headers, cut ends, compressed or not), and `borecheck patient`
reads it; every tenth goes through to the obstacle. Each must end within 2 s of
processor time and 1 GB, with nothing but one line or a result. Exit status 1 otherwise.
"""

import argparse
import contextlib
import gzip
import io
import json
import random
import resource
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

MAX_SECONDS = 2.0
MAX_BYTES = 1_000_000_000
CHUNK = 500
KINDS = ("dicom", "nifti", "nrrd", "json")

WORDS = (b"nan", b"inf", b"-1", b"0", b"1e308", b"-1e999", b"9" * 30, b"", b"\x00")
WORDS += (b"\xff\xfe", b"../..", b"[]", b"{}", b"null", b"1" * 5000, b"\x1b[31m")
# Tags that place a slice or shape its pixels, and what they are not.
TAGS = ("ImagePositionPatient", "ImageOrientationPatient", "PixelSpacing", "Rows")
TAGS += ("Columns", "BitsAllocated", "BitsStored", "HighBit", "PixelRepresentation")
TAGS += ("SamplesPerPixel", "RescaleSlope", "RescaleIntercept", "NumberOfFrames")
TAGS += ("PixelPaddingValue", "ReconstructionDiameter", "PatientPosition", "ImageType")
TAGS += ("SeriesInstanceUID", "PhotometricInterpretation", "Modality")
TEXTS = ("nan", "inf", "-1", "0", "1e9", "9" * 15, "x", "1\\2", "", "1\\2\\3\\4\\5\\6")
NUMBERS = (0, 1, 2, 3, 7, 8, 15, 16, 17, 32, 63, 64, 255, 4096, 32767, 65535)
SYNTAXES = ("1.2.840.10008.1.2", "1.2.840.10008.1.2.2", "1.2.840.10008.1.2.4.90")
SYNTAXES += ("1.2.840.10008.1.2.4.80", "1.2.840.10008.1.2.5", "1.2.840.10008.1.2.1.99")
SYNTAXES += ("1.2.840.10008.1.2.4.70", "1.2.840.10008.1.2.4.50", "1.2.3")


def made(rng: random.Random, kind: str, folder: Path) -> Path:
    """A damaged scan or markup; what `borecheck` is to read."""
    return {"dicom": _dicom, "nifti": _nifti, "nrrd": _nrrd, "json": _json}[kind](
        rng, folder
    )


def damaged(rng: random.Random, data: bytes, within: int | None = None) -> bytes:
    """Bytes changed, put in, taken out; mostly in the first part, where headers are."""
    found = bytearray(data)
    for _ in range(rng.choice((1, 1, 1, 2, 4, 16))):
        if not found:
            break
        reach = min(len(found), within or len(found))
        at = rng.randrange(reach)
        way = rng.randrange(6)
        if way == 0:
            found[at] = rng.randrange(256)
        elif way == 1:
            found[at : at + 4] = rng.choice((b"\xff" * 4, b"\0" * 4, b"\0\0\0\x7f"))
        elif way == 2:
            found[at:at] = rng.choice(WORDS)
        elif way == 3:
            del found[at : at + rng.choice((1, 2, 4, 100))]
        elif way == 4:
            del found[rng.randrange(len(found) + 1) :]
        else:
            found[at : at + 2] = rng.randbytes(2)
    return bytes(found)


def _dicom(rng: random.Random, folder: Path) -> Path:
    from tests.patients.series import block, straight, write_series

    write_series(folder / "scan", block(4), straight(4))
    victim = folder / "scan" / f"{rng.randrange(4):03d}.dcm"
    if rng.random() < 0.5:
        victim.write_bytes(damaged(rng, victim.read_bytes(), rng.choice((1500, None))))
    else:
        _retagged(rng, victim)
    return folder / "scan"


def _retagged(rng: random.Random, victim: Path) -> None:
    """Another value in a tag, or another claim of how the pixels are packed."""
    import pydicom

    image = pydicom.dcmread(victim)
    with contextlib.suppress(Exception):  # what the library will not write
        if rng.random() < 0.2:
            image.file_meta.TransferSyntaxUID = rng.choice(SYNTAXES)
        name = rng.choice(TAGS)
        element = image.get(name)
        numeric = isinstance(element, int) and not isinstance(element, bool)
        if rng.random() < 0.2:
            delattr(image, name)
        elif numeric:
            setattr(image, name, rng.choice(NUMBERS))
        else:
            image.add_new(name, "LO", rng.choice(TEXTS))
        image.save_as(victim)


def _nifti(rng: random.Random, folder: Path) -> Path:
    import nibabel
    import numpy as np

    from tests.patients.series import block

    data = block(4).transpose(2, 1, 0)
    image = nibabel.Nifti1Image(data, np.diag([2.0, 2.0, 3.0, 1.0]))
    content = damaged(rng, image.to_bytes(), rng.choice((352, None)))
    if rng.random() < 0.5:
        path = folder / "scan.nii.gz"
        packed = gzip.compress(content, 1)
        path.write_bytes(damaged(rng, packed) if rng.random() < 0.3 else packed)
        return path
    path = folder / "scan.nii"
    path.write_bytes(content)
    return path


def _nrrd(rng: random.Random, folder: Path) -> Path:
    from tests.patients.series import block

    data = block(4)
    packed = rng.random() < 0.5
    lines = [
        *("NRRD0004", "type: short", "dimension: 3", "sizes: 32 24 4"),
        *("space: left-posterior-superior", "space origin: (0,0,0)"),
        *("space directions: (2,0,0) (0,2,0) (0,0,3)", "endian: little"),
        f"encoding: {'gzip' if packed else 'raw'}",
    ]
    if rng.random() < 0.5:
        k = rng.randrange(len(lines))
        key, _, _ = lines[k].partition(":")
        words = rng.choices(WORDS, k=rng.choice((1, 3)))
        lines[k] = f"{key}: {b' '.join(words).decode('latin-1')}"
    body = data.tobytes()
    content = "\n".join(lines).encode("latin-1") + b"\n\n"
    content += gzip.compress(body, 1) if packed else body
    if rng.random() < 0.7:
        content = damaged(rng, content, rng.choice((260, None)))
    path = folder / rng.choice(("scan.nrrd", "scan.seg.nrrd"))
    path.write_bytes(content)
    return path


def _json(rng: random.Random, folder: Path) -> Path:
    entry = {"id": "1", "label": "entry", "position": [1.0, 2.0, 3.0]}
    target = {"id": "2", "label": "target", "position": [9.0, 2.0, 30.0]}
    markup = {
        "type": "Line",
        "coordinateSystem": rng.choice(("LPS", "RAS")),
        "coordinateUnits": "mm",
        "controlPoints": [entry, target],
    }
    document = {"@schema": "markups-schema-v1.0.3.json#", "markups": [markup]}
    path = folder / "plan.mrk.json"
    path.write_bytes(damaged(rng, json.dumps(document).encode()))
    return path


def command(path: Path, number: int) -> list[str]:
    """What reads the file."""
    if path.suffix == ".json":
        place = ["--isocentre", "0,0,0", "--position", "HFS", "--no-certificate"]
        arm = Path(__file__).parents[1] / "tests" / "data" / "robots" / "two_link.urdf"
        scene = f"{arm}@5,0,0"
        return ["check", str(arm), scene, "--plan", str(path), *place]
    words = ["patient", str(path), "--format", "json"]
    return words if number % 10 == 0 else [*words, "--geometry-only"]


def outcome(words: list[str]) -> str:
    """How a command ends; "PROBLEM ..." if it must not."""
    from borecheck.cli import main

    out, err = io.StringIO(), io.StringIO()
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            status = main(words)
    except BaseException as error:  # noqa: BLE001 - a traceback, which must not be
        return f"PROBLEM {type(error).__name__}: {error!s:.200}"
    said = out.getvalue() + err.getvalue()
    if "Traceback" in said:
        return f"PROBLEM traceback: {said[-300:]}"
    if status == 2 and words[0] == "patient" and err.getvalue().count("\n") != 1:
        return f"PROBLEM not one line: {err.getvalue()[:300]}"
    if any(ord(c) < 32 and c not in "\n\t" for c in said):
        return "PROBLEM a control character printed"
    return "answered" if status in (0, 1) else "refused"


def read(
    kind: str, start: int, count: int, seed: int
) -> tuple[Counter[str], list[str]]:
    """Makes and reads damaged files; how they ended, and what was wrong."""
    ends: Counter[str] = Counter()
    problems = []
    for number in range(start, start + count):
        with tempfile.TemporaryDirectory() as folder:
            rng = random.Random(f"{seed} {kind} {number}")
            words = command(made(rng, kind, Path(folder)), number)
            begun = time.process_time()
            end = outcome(words)
            spent = time.process_time() - begun
        ends[f"{kind}: {end.partition(' ')[0]}"] += 1
        if end.startswith("PROBLEM"):
            problems.append(f"{kind} {number}: {end}")
        if spent > MAX_SECONDS:
            problems.append(f"{kind} {number}: {spent:.1f} s")
    return ends, problems


def worker(kind: str, start: int, count: int, seed: int) -> None:
    """One chunk in a process that is bounded beyond what it has loaded by then."""
    read(kind, -20, 20, 0)
    used = int(Path("/proc/self/statm").read_text().split()[0])
    limit = used * resource.getpagesize() + MAX_BYTES
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    ends, problems = read(kind, start, count, seed)
    print(json.dumps([dict(ends), problems]))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--worker", nargs=2, metavar=("KIND", "START"))
    args = parser.parse_args()
    if args.worker:
        worker(args.worker[0], int(args.worker[1]), args.count, args.seed)
        return 0
    ends: Counter[str] = Counter()
    problems: list[str] = []
    each = args.count // len(KINDS)
    for kind in KINDS:
        for start in range(0, each, CHUNK):
            count = min(CHUNK, each - start)
            words = [sys.executable, "-m", "studies.hostile_volumes", "--count"]
            words += [
                str(count),
                "--seed",
                str(args.seed),
                "--worker",
                kind,
                str(start),
            ]
            done = subprocess.run(words, capture_output=True, text=True, check=False)
            try:
                counts, found = json.loads(done.stdout.splitlines()[-1])
            except (ValueError, IndexError):
                counts, found = {}, [f"{kind} {start}: died: {done.stderr[-300:]}"]
            ends.update(counts)
            problems += found
        print(f"{kind}: {each} files, {len(problems)} problems so far", flush=True)
    for name, count in sorted(ends.items()):
        print(f"  {name}: {count}")
    for problem in problems:
        print(problem)
    print(f"{sum(ends.values())} files, {len(problems)} problems")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
