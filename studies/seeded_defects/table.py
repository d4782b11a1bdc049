"""The study's tables: what each tool noticed, kind by kind."""

import json
import re
from collections import Counter, defaultdict
from datetime import UTC, datetime
from importlib.metadata import version as version_of
from pathlib import Path

from studies.seeded_defects import KINDS
from studies.seeded_defects.expected import element_of, is_seen
from studies.seeded_defects.files import read_lines, rows_of

PEERS = (
    "check_urdf",
    "urdf_parser_py",
    "pinocchio",
    "yourdfpy",
    "drake",
    "mujoco",
    "urdf-validator",
    "simcheck",
)


def judged(folder, rows):
    """{file: whether the fault was seen with a right code at the right element}."""
    done = {row["file"]: row for row in read_lines(folder / "borecheck.jsonl")}
    seen = {}
    for row in rows:
        if not row["kind"] or row["file"] not in done:
            continue
        path = Path(row["file"])
        base = done[str(path.with_name("sound.urdf"))]["marks"]
        new = Counter(map(tuple, done[row["file"]]["marks"]))
        new -= Counter(map(tuple, base))
        element = element_of(path, row["where"])
        seen[row["file"]] = is_seen(row["kind"], sorted(new), element)
    return seen


def said_by(folder, name):
    """{file: (rejected, set of complaints)} of one tool."""
    said = {}
    for line in (folder / f"{name}.jsonl").read_text().splitlines():
        record = json.loads(line)
        if name == "simcheck":
            said[record["asset"]] = simcheck_said(record)
        else:
            plain = {normal(text) for text in record["lines"] if is_loud(text)}
            said[record["file"]] = (record["status"] != "ok", plain)
    return said


def simcheck_said(record):
    """Whether it found an error, and what it says at warning or above."""
    loud, errors = set(), record["verdict"] in ("ERROR", "TIMEOUT", "CRASH")
    for result in record["results"]:
        for entry in result["findings"]:
            if entry["severity"] in ("error", "warning"):
                text = f"{entry['check']} {entry['target']} {entry['message']}"
                loud.add(normal(text))
                errors = errors or entry["severity"] == "error"
    return errors, loud


def is_loud(line):
    """Whether a line of output is a complaint."""
    return bool(
        re.search(r"warn|error|fail|reject|invalid|unknown|missing", line, re.I)
    )


def normal(line):
    """A complaint without paths and numbers."""
    line = re.sub(r"(/[^\s:'\"]*)+", "PATH", line)
    return re.sub(r"[-+]?\d+(\.\d+)?(e[-+]?\d+)?", "#", line)


def noticed(said, rows):
    """{file: whether a tool said something new about it}; files it went through."""
    found = {}
    for row in rows:
        sound = str(Path(row["file"]).with_name("sound.urdf"))
        if row["kind"] is None or row["file"] not in said or sound not in said:
            continue
        base_rejected, base_loud = said[sound]
        rejected, loud = said[row["file"]]
        is_new = (rejected and not base_rejected) or bool(loud - base_loud)
        found[row["file"]] = is_new
    return found


def alarms(said, rows):
    """How many sound robots a tool refuses, or warns of."""
    sound = [said[row["file"]] for row in rows if not row["kind"]]
    refused = sum(rejected for rejected, _ in sound)
    warned = sum(bool(loud) and not rejected for rejected, loud in sound)
    return f"{refused} + {warned}"


def own_alarms(folder, rows):
    """The same of borecheck, in profile collision."""
    done = {row["file"]: row for row in read_lines(folder / "borecheck.jsonl")}
    sound = [done[row["file"]]["collision"] for row in rows if not row["kind"]]
    refused = sum("error" in levels for levels in sound)
    warned = sum("warning" in levels and "error" not in levels for levels in sound)
    return f"{refused} + {warned}"


def table(folder, per_kind):
    """The study's page: tables and what stays undetected, as Markdown."""
    rows = rows_of(folder, per_kind)
    columns = {"borecheck": judged(folder, rows)}
    false, versions = {"borecheck": own_alarms(folder, rows)}, []
    for name in PEERS:
        if (folder / f"{name}.jsonl").exists():
            said = said_by(folder, name)
            columns[name], false[name] = noticed(said, rows), alarms(said, rows)
            version = (folder / f"{name}.version").read_text()
            versions.append(f"{name} {version}")
    robots = sum(row["kind"] is None for row in rows)
    done = set.intersection(*(set(column) for column in columns.values()))
    rows = [row for row in rows if row["file"] in done]
    groups = {kind: group for kind, (group, _) in KINDS.items()}
    template = Path(__file__).with_name("page.md").read_text()
    text = template.format(
        date=datetime.now(tz=UTC).date(),
        kinds=len({row["kind"] for row in rows}),
        files=len(rows),
        robots=robots,
        version=version_of("borecheck"),
        summary=summary(rows, columns, groups, false),
        versions=f"Versions: {', '.join(versions)}.",
        missed=missed(rows, columns["borecheck"]),
        by_kind=by_kind(rows, columns),
    )
    print(text, end="")


def missed(rows, column):
    """Kind by kind, the robots whose file was not noticed."""
    places = defaultdict(list)
    for row in rows:
        if not column[row["file"]]:
            places[row["kind"]].append(Path(row["file"]).parent.name)
    count = Counter(row["kind"] for row in rows)
    lines = []
    for kind, robots in places.items():
        where = "everywhere" if len(robots) == count[kind] else ", ".join(robots)
        lines.append(f"- `{kind}`: {len(robots)} of {count[kind]} ({where})")
    return "\n".join(lines)


def rates(rows, column):
    """{kind: share of its files that were noticed}."""
    counts = defaultdict(list)
    for row in rows:
        counts[row["kind"]].append(column[row["file"]])
    return {kind: sum(found) / len(found) for kind, found in counts.items()}


def summary(rows, columns, groups, false):
    """Per tool: shares of files, kinds, and alarms on sound robots."""
    names = ["structure", "joints", "inertia", "geometry"]
    lines = ["| tool | " + " | ".join(names) + " | all files | kinds | sound robots |"]
    lines.append("|---|" + "---:|" * (len(names) + 3))
    for name, column in columns.items():
        hits, files_of = Counter(), Counter(groups[row["kind"]] for row in rows)
        for row in rows:
            hits[groups[row["kind"]]] += column[row["file"]]
        cells = [f"{100 * hits[g] / max(files_of[g], 1):.0f} %" for g in names]
        share = rates(rows, column)
        kinds = sum(rate >= 0.5 for rate in share.values())
        cells.append(f"{100 * sum(hits.values()) / len(rows):.1f} %")
        cells.append(f"{kinds} of {len(share)}")
        lines.append(f"| {name} | " + " | ".join([*cells, false[name]]) + " |")
    return "\n".join(lines)


def by_kind(rows, columns):
    shares = {name: rates(rows, column) for name, column in columns.items()}
    count = Counter(row["kind"] for row in rows)
    lines = ["| kind | files | " + " | ".join(columns) + " |"]
    lines.append("|---|---:|" + "---:|" * len(columns))
    for kind in KINDS:
        if kind in count:
            cells = [f"{100 * shares[name][kind]:.0f}" for name in columns]
            lines.append(f"| {kind} | {count[kind]} | " + " | ".join(cells) + " |")
    return "\n".join(lines)
