"""`borecheck body`: a patient's body by sex, height and body mass index."""

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from borecheck.commands.common import add_format
from borecheck.commands.output import refuse_surface


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the command."""
    parser.add_argument(
        "body",
        metavar="BODY",
        help="sex=m|f,bmi=20..45[,height=1.40..2.10][,arms=up|side]; height: the "
        "mean of that sex, arms: up",
    )
    parser.add_argument(
        "--out", type=Path, metavar="FILE.stl", help="write its surface there, metres"
    )
    add_format(parser)


def run(args: argparse.Namespace) -> int:
    """Makes the body, writes it, and says what it is; 0."""
    from borecheck.bodies.body import NOT_MODELLED, make_body
    from borecheck.bodies.spec import body_spec
    from borecheck.geometry.mesh_files.stl import write_stl
    from borecheck.report.document import dumps

    spec = body_spec(args.body)
    refuse_surface(args)
    body = make_body(spec)
    if args.out is not None:
        write_stl(args.out, body.mesh)
    said = {**body.to_json(), "not_modelled": [NOT_MODELLED]}
    sys.stdout.write(dumps(said) if args.format == "json" else _text(said))
    return 0


def _text(said: Mapping[str, Any]) -> str:
    table = said["table"]
    size = " x ".join(f"{1e3 * x:.0f}" for x in said["size_m"])
    lines = (
        f"{said['body']}",
        f"{said['height_m']:.3f} m, {said['mass_kg']:.1f} kg "
        f"(BMI {said['bmi']:.1f} at {said['density_kg_m3']:g} kg/m3)",
        f"waist {100 * said['waist_m']:.1f} cm (table {100 * table['waist_m']:.1f}), "
        f"hips {100 * said['hip_m']:.1f} cm (table {100 * table['hip_m']:.1f})",
        f"{size} mm, {said['triangles']} triangles; waist at the isocentre, the couch "
        f"at z = {1e3 * said['couch_z_m']:.0f} mm",
        f"not covered: {said['not_modelled'][0]}",
    )
    return "\n".join(lines) + "\n"
