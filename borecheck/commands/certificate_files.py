"""Which file gets the certificate of which motion, and why one gets none."""

import argparse
import glob
import os
import unicodedata
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from borecheck.commands.progress import say
from borecheck.contact.verdict import CLEAR
from borecheck.core.whole_files import check_writable, remove
from borecheck.errors import BorecheckError, UsageError

if TYPE_CHECKING:
    from borecheck.motion.samples import Proof
    from borecheck.plans.needle_plan import NeedlePlan
    from borecheck.robots.robot import Robot
    from borecheck.robots.scene import Scene

# Stands in every certificate (`motion.certificate.FORMAT`, not imported for speed).
CERTIFICATE_MARK = "borecheck path certificate"
# What file systems take for a name, less what temporary files beside it add, [bytes].
MOST_BYTES = 255 - 10
# Under this name the motion of `--path` has its file; no plan is called so.
PATH = ""


def prepared(
    args: argparse.Namespace, plans: Sequence["NeedlePlan"]
) -> dict[str, Path]:
    """The file of every motion by the plan's name; no earlier certificate is left.

    Args:
        args: The options.
        plans: What `--plan` holds.

    Raises:
        UsageError: A file that cannot be written, is something else, or would be that
            of two plans. Nothing has been taken away then.
    """
    file = args.certificate
    if file is None:
        return {}
    if args.path is None and args.plan is None:
        raise UsageError("--certificate goes with --path or --plan")
    if args.no_certificate:
        raise UsageError("--certificate and --no-certificate exclude each other")
    if file.suffix.lower() == ".npz":
        raise UsageError(f"--certificate {file}: .npz is for the meshes beside it")
    names = [plan.name for plan in plans] or [PATH]
    files = files_for(file, names)
    for target in files.values():
        _check_target(args, target)
    _remove_earlier(file, list(files.values()))
    return files


def files_for(file: Path, names: Sequence[str]) -> dict[str, Path]:
    """A file for each of these plans: FILE for one, `FILE_<plan>` for several.

    What a file system may not take (anything but letters, digits, - and _) becomes _.

    Raises:
        UsageError: Two plans would have the same file, also where upper and lower case
            are the same, or a name is too long.
    """
    if len(names) == 1:
        return {names[0]: file}
    found: dict[str, Path] = {}
    owner: dict[str, str] = {}
    for name in names:
        target = file.with_name(f"{file.stem}_{_safe(name)}{file.suffix}")
        same = unicodedata.normalize("NFKC", target.name).casefold()
        if same in owner:
            raise UsageError(
                f"plans {owner[same]!r} and {name!r} would both have the certificate "
                f"{target}: rename one of them, by letters or digits"
            )
        if len(os.fsencode(target.name)) > MOST_BYTES:
            raise UsageError(
                f"plan {name!r}: its certificate would be called {target.name}, which "
                "is too long for a file: give the plan a shorter name"
            )
        owner[same] = name
        found[name] = target
    return found


def add_certificates(
    document: dict[str, Any],
    robot: "Robot",
    scene: "Scene",
    files: Mapping[str, Path],
    proofs: Mapping[str, "Proof"],
) -> bool:
    """Writes the certificates, and adds to every motion which it got, or why none.

    Args:
        document: The judged result; every motion gets its certificate, in place.
        robot: The robot that was checked.
        scene: What stands around it.
        files: From `prepared`.
        proofs: What the search said of every motion, by the plan's name.

    Returns:
        Whether every motion that is clear has its certificate.
    """
    complete = True
    stopped = False
    for block in document.get("plans", [document]):
        reason = _why_none(block)
        if reason is None:
            name = block.get("name", PATH)
            file = files[name]
            try:
                reason = "interrupted" if stopped else None
                if reason is None:
                    _write(proofs[name], robot, scene, file, name)
            except BorecheckError as error:
                reason = str(error)
            except KeyboardInterrupt:
                stopped = document["interrupted"] = True
                reason = "interrupted"
            complete = complete and reason is None
        block["certificate"] = {
            "file": str(file) if reason is None else None,
            "meshes": str(file.with_suffix(".npz")) if reason is None else None,
            "reason": reason,
        }
    return complete


def _why_none(block: Mapping[str, Any]) -> str | None:
    """Why there is nothing to certify: only what is proven clear, and judged so, is."""
    if block["verdict"] != CLEAR:
        return str(block["verdict"])
    return None if block["path"]["certified"] else "not proven between the samples"


def _write(
    proof: "Proof", robot: "Robot", scene: "Scene", file: Path, plan: str
) -> None:
    from borecheck.motion.certify import write_certificate_of

    write_certificate_of(proof, robot, scene, file, plan)


def _check_target(args: argparse.Namespace, file: Path) -> None:
    for path in (file, file.with_suffix(".npz")):
        check_writable(path, stream=False)
        if path.resolve() in [p.resolve() for p in (args.out, args.report) if p]:
            raise UsageError(f"--certificate and another option both write {path}")


def _remove_earlier(file: Path, targets: Sequence[Path]) -> None:
    """Takes away earlier certificates of these names: they would pass for this run's.

    So would FILE itself where each plan has its own. Certificates of plans that are
    gone are told and left: nobody named them.

    Raises:
        UsageError: What stands there is no certificate, or meshes of none, and is left
            alone.
    """
    earlier = list(targets)
    if file not in targets and _is_certificate(file):
        earlier.append(file)
    for target in earlier:
        _refuse_other(target)
    for target in earlier:
        remove(target)
        remove(target.with_suffix(".npz"))
    if file not in targets:
        pattern = f"{glob.escape(file.stem)}_*{glob.escape(file.suffix)}"
        for left in sorted(file.absolute().parent.glob(pattern)):
            if _is_certificate(left):
                say(
                    f"borecheck: {file.with_name(left.name)} is an earlier certificate "
                    "of none of these plans; it was left alone"
                )


def _refuse_other(file: Path) -> None:
    """Refuses what is there already and was not written by an earlier run."""
    meshes = file.with_suffix(".npz")
    if file.exists() and not _is_certificate(file):
        raise UsageError(f"--certificate {file}: is there already and no certificate")
    if meshes.exists():
        from borecheck.motion.certificate import holds_certified_meshes

        if not holds_certified_meshes(meshes):
            raise UsageError(
                f"--certificate {file}: {meshes} is there already and holds no meshes "
                "of a certificate"
            )


def _is_certificate(file: Path) -> bool:
    try:
        return CERTIFICATE_MARK in file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return False


def _safe(name: str) -> str:
    composed = unicodedata.normalize("NFC", name)
    return "".join(c if c.isalnum() or c in "-_" else "_" for c in composed)
