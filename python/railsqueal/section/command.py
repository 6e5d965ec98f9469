"""`railsqueal section FILE`: a drawing or a table of coordinates becomes the section of a wheel or a rail."""

import argparse
import json
import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import INPUT, USAGE, WRITING, ResultError
from . import coordinates, dxf
from .drawing import UNITS, Drawing
from .edges import divide
from .mesh import PlaneMesh, triangulate, write
from .outline import Outline
from .placing import Options, RunningLine, expect_groups, middle_of, placed, remarks, unit_of
from .properties import RailProperties, WheelProperties


@dataclass(frozen=True)
class Section:
    """A section made from a drawing."""

    outline: Outline
    mesh: PlaneMesh
    running: RunningLine
    properties: WheelProperties | RailProperties
    lines: list[str]  # how the drawing was understood
    remarks: list[str]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    add = parser.add_argument
    add("file", type=Path, metavar="FILE", help="DXF drawing, or table of coordinates (CSV)")
    add("--kind", choices=("wheel", "wheelset", "rail"), required=True, help="what the section is of")
    add("--unit", choices=tuple(UNITS), help="unit of the drawing (default: the one that the file names)")
    add("-o", "--output", type=Path, metavar="FILE.msh", help="mesh (default: beside FILE)")
    add("-f", "--force", action="store_true", help="replace an existing mesh")
    add("--picture", type=Path, metavar="FILE.png", help="picture of outline, groups and mesh (.png, .pdf or .svg)")
    add("--size", type=float, default=6e-3, metavar="M", help="edge length of the mesh, m (default 0.006)")
    add(
        "--fine",
        type=float,
        metavar="M",
        help="edge length on the running line, m (default: the size, on rails at most 0.003)",
    )
    add(
        "--axis",
        choices=("x", "y"),
        default="x",
        help="axis of the drawing along the axle or across the track (default x)",
    )
    add("--mirror", action="store_true", help="turn x round: the flange, or the middle of the track, is to be at +x")
    add(
        "--origin",
        type=float,
        nargs=2,
        default=(0.0, 0.0),
        metavar=("X", "Y"),
        help="point of the drawing that becomes (0, 0)",
    )
    add(
        "--group", action="append", default=[], metavar="NAME=LAYER", help="edges on a layer are this group; repeatable"
    )
    add(
        "--pick",
        action="append",
        default=[],
        metavar="NAME=X,Y",
        help="the curve at this point of the drawing is this group; repeatable",
    )
    add("--ignore", action="append", default=[], metavar="LAYER", help="leave out a layer; repeatable")
    add(
        "--tolerance",
        type=float,
        default=1e-5,
        metavar="M",
        help="distance within which ends are joined, m (default 1e-5)",
    )
    add(
        "--density",
        type=float,
        default=7860.0,
        metavar="RHO",
        help="density for masses that are told, kg/m³ (default 7860)",
    )


def run(given: argparse.Namespace) -> int:
    """Makes the mesh and the picture, and prints how the drawing was understood."""
    options = _options(given)
    output = given.output or given.file.with_suffix(".msh")
    _expect_free(given, output)
    made = make(given.file, options)
    surface = options.kind
    write(made.mesh, output, surface)
    print("\n".join(made.lines))
    for remark in made.remarks:
        print(f"remark: {remark}")
    print(f"wrote {output}")
    if given.picture:
        from .picture import draw  # matplotlib takes a second

        draw(given.picture, given.file.name, made.outline, made.mesh, made.properties.lines(options.density))
        print(f"wrote {given.picture}")
    print("\nin the job, with the path from its folder:\n\n" + snippet(made, options, output))
    return 0


def make(path: Path, options: Options) -> Section:
    """The section of a drawing; `InputError` where the drawing is none of a wheel or a rail."""
    drawing = _read(path, options)
    unit = unit_of(drawing, path, options)
    curves, found = placed(drawing, unit, options)
    outline = Outline.join(curves, options.tolerance)
    expect_groups(outline, options)
    edges = divide(outline.curves, lambda group: options.running_size if group == "running" else options.size)
    running = RunningLine(edges)
    mesh = triangulate(edges, options.size)
    properties: WheelProperties | RailProperties
    match options.kind:
        case "rail":
            properties = RailProperties.of_outline(outline, options.density)
        case "wheelset":
            properties = WheelProperties.of_half(outline, options.density, middle_of(outline, options))
        case _:
            properties = WheelProperties.of_outline(outline, options.density)
    (left, low), (right, high) = 1e3 * outline.box()
    source = f"--unit {unit}" if options.unit else f"unit {unit} by {drawing.unit_source}"
    groups = ", ".join(f"{name} {1e3 * length:.2f} mm" for name, length in outline.group_lengths().items())
    sides = np.linalg.norm(mesh.nodes[mesh.edges[:, 0]] - mesh.nodes[mesh.edges[:, 1]], axis=1)
    lines = [
        f"{path.name}: {drawing.summary}; {source}",
        f"outline: one loop of {len(outline.curves)} curves, {1e3 * outline.length():.2f} mm long, joined within "
        f"{1e3 * options.tolerance:g} mm, x {left:.2f} to {right:.2f} mm, y {low:.2f} to {high:.2f} mm",
        f"groups: {groups}",
        *properties.lines(options.density),
        f"mesh: {len(mesh.triangles)} triangles of 6 nodes, {len(mesh.nodes)} nodes, edges of {1e3 * options.size:g} "
        "mm on the boundary "
        f"down to {1e3 * sides.min():.2g} mm, area {mesh.area() / outline.moment(0, 0) - 1:+.1e} of that of the "
        "outline",
    ]
    return Section(
        outline, mesh, running, properties, lines, [*drawing.remarks, *found, *remarks(outline, running, options)]
    )


def snippet(made: Section, options: Options, output: Path) -> str:
    """The body of a job that has the section, as JSON."""
    low, high = made.running.reach
    file: dict[str, Any] = {"path": str(output)}
    swept: dict[str, Any] = {"section": {"file": file}}
    steel = {"young": 210e9, "poisson": 0.3, "density": options.density}
    if options.kind == "rail":
        rail = {"lower": {"mesh": {"extruded": swept}, "profile": "60E1", "material": steel}}
        return json.dumps(rail, indent=2)
    contact = 0.0 if low <= 0 <= high else round(0.5 * (low + high), 6)
    file["radius"] = round(made.running.height(contact), 7)
    if contact:
        swept["contact_offset"] = contact
    groups = made.outline.group_lengths()
    body: dict[str, Any] = {"upper": {"mesh": {"revolved": swept}, "profile": "S1002", "material": steel}}
    if options.kind == "wheelset":
        middle = middle_of(made.outline, options)
        file["middle"] = round(middle, 7)
        journal = [curve.chords() for curve in made.outline.curves if curve.group == "journal"]
        if journal:
            along = np.concatenate(journal)[:, 0]
            apart = round(middle - 0.5 * float(along.min() + along.max()), 6)
            springs: dict[str, Any] = {"longitudinal": 10e6, "lateral": 5e6, "vertical": 1.2e6}
            body["upper"]["suspension"] = springs | {"journals": [-apart, apart]}
    elif "bore" in groups:
        body["upper"]["fixed"] = ["bore"]
    return json.dumps(body, indent=2)


def _read(path: Path, options: Options) -> Drawing:
    if not path.exists():
        raise ResultError(f"{path}: no such file; expected a DXF drawing or a table of coordinates", INPUT)
    if not path.is_file():
        raise ResultError(f"{path} is no regular file; expected a DXF drawing or a table of coordinates", INPUT)
    if path.suffix.lower() in (".dxf", ".dwg"):
        return dxf.read(path, options.ignored)
    if options.ignored:
        raise ResultError("--ignore: a table of coordinates has no layers", USAGE)
    return coordinates.read(path)


def _expect_free(given: argparse.Namespace, output: Path) -> None:
    """Refuses to write over the drawing, or over a mesh without --force; and into a folder that is not there."""
    for option, path in (("--output", output), ("--picture", given.picture)):
        if path is None:
            continue
        if path.exists() and given.file.exists() and os.path.samefile(path, given.file):
            raise ResultError(f"{option} {path} is the drawing itself; name another file", USAGE)
        if not path.absolute().parent.is_dir():
            raise ResultError(f"{option} {path}: there is no folder {path.parent}", WRITING)
    if output.exists() and not given.force:
        raise ResultError(
            f"{output} is there already; name another file with --output, or replace it with --force", USAGE
        )


def _options(given: argparse.Namespace) -> Options:
    for name in ("size", "fine", "tolerance", "density"):
        value = getattr(given, name)
        if value is not None and not (value > 0 and math.isfinite(value)):
            raise ResultError(f"--{name}: expected a number > 0, found {value}", USAGE)
    for name, most in (("size", 0.05), ("fine", 0.05), ("tolerance", 1e-3)):
        value = getattr(given, name)
        if value is not None and value > most:
            raise ResultError(f"--{name}: {value} m is more than {most} m; is it given in mm?", USAGE)
    if not all(map(math.isfinite, given.origin)):
        raise ResultError(f"--origin: expected two numbers, found {given.origin}", USAGE)
    groups = {}
    for text in given.group:
        name, sign, layer = text.partition("=")
        if not (name and sign and layer):
            raise ResultError(f"--group {text}: expected NAME=LAYER, as in running=TREAD", USAGE)
        groups[layer.lower()] = name
    return Options(
        kind=given.kind,
        unit=given.unit,
        axis=given.axis,
        mirror=given.mirror,
        origin=(given.origin[0], given.origin[1]),
        size=given.size,
        fine=given.fine,
        tolerance=given.tolerance,
        groups=groups,
        picks=[_pick(text) for text in given.pick],
        ignored=given.ignore,
        density=given.density,
    )


def _pick(text: str) -> tuple[str, float, float]:
    name, sign, point = text.partition("=")
    try:
        x, y = map(float, point.split(","))
    except ValueError:
        x = y = math.nan
    if not (name and sign and math.isfinite(x) and math.isfinite(y)):
        raise ResultError(f"--pick {text}: expected NAME=X,Y, as in running=-20,460", USAGE)
    return name, x, y
