#!/usr/bin/env python3
"""Writes the cubes of ../msh as input files of Abaqus, with Gmsh: python3 make.py"""

import pathlib

import gmsh

here = pathlib.Path(__file__).parent
gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
for kind in ("tet4", "tet10", "wedge6", "wedge15", "hex8", "hex20"):
    gmsh.open(str(here.parent / "msh" / f"{kind}-4.1.msh"))
    path = here / f"{kind}.inp"
    gmsh.write(str(path))
    # The second line is the path of the file.
    lines = path.read_text().splitlines()
    path.write_text("\n".join([lines[0], path.name, *lines[2:]]) + "\n")
gmsh.finalize()
