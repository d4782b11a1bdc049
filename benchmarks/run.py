"""Prints the table of everything that is compared, and writes JSON and a picture.

    python -m benchmarks                          everything (about half an hour)
    python -m benchmarks --scenes "arm S" --rows 1,2 --repeats 9
    python -m benchmarks --quick                  a small selection, to see that it runs

Times are CPU seconds, medians of interleaved measurements; see docs/benchmarks.md.
"""

import argparse
import json
import platform
import sys
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from benchmarks.growth import coal_bytes_per_triangle, measure, starts
from benchmarks.poses import SCENES
from benchmarks.rows import ROWS, Bench, Line

PACKAGES = (
    "borecheck", "numpy", "numba", "llvmlite", "coal", "pin", "python-fcl",
)  # fmt: skip
QUICK = ("arm S", "zerobot coarse")
OUT = Path(__file__).parent / "results.json"


def main(argv: Sequence[str] | None = None) -> int:
    """Runs what was asked for; 0 when every goal was met, else 1."""
    arguments = _arguments(argv)
    result: dict[str, Any] = {"where": where(), "repeats": arguments.repeats}
    lines: list[Line] = []
    for name in arguments.scenes:
        bench = Bench(SCENES[name](), arguments.repeats)
        for row in arguments.rows:
            if row not in ROWS:
                continue
            for line in ROWS[row](bench):
                lines.append(line)
                print(text_of(line), flush=True)
    result["lines"] = [
        {**vars(line), "ratios": {n: line.ratio(n) for n in line.others}}
        for line in lines
    ]
    if "8" in arguments.rows:
        growth = measure(repeats=arguments.repeats)
        result["growth"] = vars(growth)
        result["coal_bytes_per_triangle"] = coal_bytes_per_triangle()
        print(json.dumps({"slopes": growth.slopes}, indent=1))
        print(f"bytes per triangle {growth.bytes_per_triangle[-1]:.0f}")
    if "9" in arguments.rows:
        result["starts"] = starts()
        print(json.dumps(result["starts"], indent=1))
    print(json.dumps(result["where"], indent=1))
    if arguments.out:
        arguments.out.write_text(json.dumps(result, indent=1), encoding="utf-8")
        table = arguments.out.with_suffix(".md")
        table.write_text(markdown(lines, result), encoding="utf-8")
        draw(result, arguments.out.with_suffix(".png"))
    return int(any(missed(line) for line in lines))


def _arguments(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks")
    parser.add_argument("--scenes", help="comma-separated; default all", default=None)
    parser.add_argument("--rows", default="1,2,3,4,5,6,7,8,9")
    parser.add_argument("--repeats", type=int, default=9)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--out", type=Path, default=OUT, help="JSON; a PNG beside it")
    arguments = parser.parse_args(argv)
    names = arguments.scenes.split(",") if arguments.scenes else list(SCENES)
    arguments.rows = arguments.rows.split(",")
    if arguments.quick:
        names, arguments.rows, arguments.out = list(QUICK), list(ROWS), None
        arguments.repeats = 3
    unknown = [name for name in names if name not in SCENES]
    if unknown:
        parser.error(f"no scene {unknown[0]!r}; there are {', '.join(SCENES)}")
    arguments.scenes = names
    return arguments


def text_of(line: Line) -> str:
    """One line of the table."""
    peers = "; ".join(
        f"{name} {unit_of(seconds)} (x{line.ratio(name):.3g}"
        + (f", goal {line.goals[name]:.3g})" if name in line.goals else ")")
        for name, seconds in line.others.items()
    )
    mark = "  BELOW GOAL" if missed(line) else ""
    note = f" [{line.note}]" if line.note else ""
    return f"{line.row} | {line.case} | {unit_of(line.ours)} | {peers}{note}{mark}"


def markdown(lines: Sequence[Line], result: dict[str, Any]) -> str:
    """The table for the README: times, and how many times faster."""
    rows = ["| row | case | time | times faster than | note |", "|---|---|---|---|---|"]
    for line in lines:
        ratios = "; ".join(
            f"{name} ({unit_of(line.others[name])}) **{line.ratio(name):.3g}**"
            for name in line.others
        )
        ours = unit_of(line.ours)
        rows.append(f"| {line.row} | {line.case} | {ours} | {ratios} | {line.note} |")
    growth, place = result.get("growth"), result["where"]
    tail = [f"{place['processor']}; {place['system']}; Python {place['python']}"]
    tail.append(", ".join(f"{n} {v}" for n, v in place["versions"].items()))
    if growth:
        slopes = ", ".join(f"{n} {v:.2f}" for n, v in growth["slopes"].items())
        memory = growth["bytes_per_triangle"][-1]
        coal = result["coal_bytes_per_triangle"]
        tail.append(f"Growth, slopes of log time: {slopes}.")
        tail.append(f"Memory: {memory:.0f} bytes a triangle (Coal {coal:.0f}).")
    for name, seconds in result.get("starts", {}).items():
        tail.append(f"{name}: {unit_of(seconds)} (wall clock).")
    return "\n".join([*rows, "", *(f"- {text}" for text in tail), ""])


def missed(line: Line) -> bool:
    """Whether a wanted ratio was not reached."""
    return any(line.ratio(name) < goal for name, goal in line.goals.items())


def unit_of(seconds: float) -> str:
    """A time with the unit that suits it."""
    for unit, size in (("s", 1.0), ("ms", 1e-3)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds * 1e6:.3g} us"


def where() -> dict[str, Any]:
    """Versions, and the machine as far as it is to be known."""
    versions = {}
    for name in PACKAGES:
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = "not installed"
    return {
        "versions": versions,
        "python": platform.python_version(),
        "processor": _processor(),
        "system": f"{platform.system()} {platform.machine()}",
    }


def _processor() -> str:
    """Name of the processor and whether it has AVX-512."""
    import llvmlite.binding as llvm

    name = platform.processor() or llvm.get_host_cpu_name()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        for text in cpuinfo.read_text(encoding="utf-8").splitlines():
            if text.startswith("model name"):
                name = text.partition(":")[2].strip()
                break
    has = llvm.get_host_cpu_features().get("avx512f", False)
    return f"{name} ({llvm.get_host_cpu_name()}, AVX-512 {'yes' if has else 'no'})"


def draw(result: dict[str, Any], file: Path) -> None:
    """The ratios to every peer, and the growth, as one picture."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(13, 5), layout="constrained")
    for line in result["lines"]:
        row = line["row"].partition(" ")[0]
        for name, ratio in line["ratios"].items():
            colour = "C0" if "Coal" in name or "coal" in name else "C1"
            colour = "C2" if "Pinocchio" in name else colour
            left.semilogy([float(row)], [ratio], ".", color=colour, alpha=0.6)
    for colour, name in (("C0", "Coal"), ("C2", "Pinocchio"), ("C1", "others")):
        left.plot([], [], ".", color=colour, label=name)
    left.axhline(1.0, color="black", linewidth=0.8)
    left.set(xlabel="row of the table", ylabel="times faster", title="Ratios")
    left.legend()
    growth = result.get("growth")
    if growth:
        for name, seconds in growth["seconds"].items():
            label = f"{name}, slope {growth['slopes'][name]:.2f}"
            right.loglog(growth["triangles"], seconds, "o-", label=label)
        right.set(xlabel="sqrt(triangles x triangles)", ylabel="CPU seconds a pose")
        right.set_title("Growth")
        right.legend()
    figure.savefig(file, dpi=110)
    plt.close(figure)


if __name__ == "__main__":
    sys.exit(main())
