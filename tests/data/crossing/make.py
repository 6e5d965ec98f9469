#!/usr/bin/env python3
"""Writes rail.csv from the slices of a crossing: python3 make.py testbank/profiles

The folder is that of CONTACT (github eve70a/CONTACT, Apache-2.0). `uk_interrupt_v2.slcs` divides each slice into parts
between features. A line of points at the same share of a part, half a millimetre apart in the longest slice, runs along
the rail from slice to slice. The file has those lines that pass the two contacts of `two_patches`.
"""

import csv
import pathlib
import sys

import numpy as np
from scipy.interpolate import CubicSpline

FIRST_SLICE = 7  # the first one with all features
SPACING = 0.5  # mm
# Parts of the profile, and the range of y, mm, at the slice next to the contact.
CONTACTS = {1: ((7, 8), (27.5, 36.5)), 2: ((1, 2, 3), (-36.0, -28.0))}
NEXT_SLICE = 16

folder = pathlib.Path(sys.argv[1])
lines = (folder / "uk_interrupt_v2.slcs").read_text().splitlines()
named = [line.split() for line in lines if "'uk_crossing" in line]
rows = [line.split() for line in lines if len(line.split()) == 12]
features = np.array([row[1:] for row in rows if row[0] != "%"], dtype=float)
place = [1e3 * float(u) for u, _ in named]


def slice_of(name):
    """Arc length of a slice, mm, and the spline through its points."""
    points = 1e3 * np.loadtxt(folder / name.strip("'"))
    along = np.r_[0, np.cumsum(np.hypot(*np.diff(points, axis=0).T))]
    return along, CubicSpline(along, points)


slices = [slice_of(name) for _, name in named]


def points(part, share):
    """Points of all slices at a share of a part."""
    found = []
    for k in range(FIRST_SLICE, len(slices)):
        begin, end = features[k, part], min(features[k, part + 1], slices[k][0][-1])
        found.append((place[k], *slices[k][1](begin + (end - begin) * share)))
    return found


with (pathlib.Path(__file__).parent / "rail.csv").open("w", newline="") as file:
    out = csv.writer(file, lineterminator="\n")
    out.writerow(["contact", "line", "along", "y", "z"])
    for contact, (parts, (least, most)) in CONTACTS.items():
        number = 0
        for part in parts:
            lengths = [min(f[part + 1], s[0][-1]) - f[part] for f, s in zip(features, slices, strict=True)]
            count = 1 + int((max(lengths[FIRST_SLICE:]) + 1e-6) / SPACING)
            for k in range(count):
                line = points(part, k / count)
                if least <= line[NEXT_SLICE - FIRST_SLICE][1] <= most:
                    for u, y, z in line:
                        out.writerow([contact, number, f"{u:.2f}", f"{y:.5f}", f"{z:.5f}"])
                    number += 1
