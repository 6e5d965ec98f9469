"""Matrices of `jobs/disc-brake.json`: an annular disc and two pads from CalculiX, the disc reduced after Craig and
Bampton and written as DMIG, the pads as CalculiX writes them; and the eigenvalues of the brake by numpy alone.

    python3 scripts/studies/disc_brake.py write      makes the files anew; needs `ccx` (Debian's calculix-ccx)
    python3 scripts/studies/disc_brake.py solve      eigenvalues of the files, without the program
"""

import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

FOLDER = Path(__file__).parents[2] / "jobs" / "disc-brake"
JOB = FOLDER.parent / "disc-brake.json"
# Steel, and the lining of the pads (Young's modulus, Poisson's ratio, density).
STEEL, LINING = (210e9, 0.3, 7850.0), (8e9, 0.25, 2600.0)
# Radii of the mesh of the disc, m, its thickness, and the sectors round it.
RADII, THICKNESS, SECTORS = (0.070, 0.088, 0.106, 0.118, 0.130), 0.012, 24
# The pads lie between these radii and sectors -1 and 1 (15 degrees to either side), and have these thicknesses.
PAD_RADII, PAD_LAYERS = (0.088, 0.118), (0.010, 0.005)
# Modes of the disc with its contact nodes held, and their damping ratio.
MODES, DAMPING = 14, 0.001


def calculix(nodes, solids, fixed):
    """K, M and (node, direction) of every row, by CalculiX, and the folder of its files."""
    lines = ["*NODE,NSET=ALL"] + [f"{n},{x:.12g},{y:.12g},{z:.12g}" for n, (x, y, z) in nodes.items()]
    number = 0
    for k, (kind, cells, (young, poisson, density)) in enumerate(solids):
        lines.append(f"*ELEMENT,TYPE={kind},ELSET=E{k}")
        for cell in cells:
            number += 1
            words = [str(n) for n in (number, *cell)]
            # A line has sixteen words at most.
            lines += [",".join(words[:11]) + ",", ",".join(words[11:])] if len(words) > 11 else [",".join(words)]
        lines += [f"*MATERIAL,NAME=M{k}", "*ELASTIC", f"{young},{poisson}", "*DENSITY", f"{density}"]
        lines.append(f"*SOLID SECTION,ELSET=E{k},MATERIAL=M{k}")
    lines += ["*BOUNDARY"] + [f"{n},1,3" for n in fixed] if fixed else []
    lines += ["*STEP", "*FREQUENCY,SOLVER=MATRIXSTORAGE", "*END STEP"]
    folder = Path(tempfile.mkdtemp())
    (folder / "model.inp").write_text("\n".join(lines) + "\n")
    subprocess.run(["ccx", "model"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
    return (*read_calculix(folder / "model"), folder / "model")


def read_calculix(stem):
    """K, M and (node, direction) of every row of CalculiX' files."""
    text = Path(f"{stem}.dof").read_text().split()
    dofs = [tuple(map(int, word.split("."))) for word in text]
    both = []
    for ending in ("sti", "mas"):
        matrix = np.zeros((len(dofs), len(dofs)))
        for line in Path(f"{stem}.{ending}").read_text().splitlines():
            i, j, value = line.split()
            matrix[int(i) - 1, int(j) - 1] = matrix[int(j) - 1, int(i) - 1] = float(value)
        both.append(matrix)
    return both[0], both[1], dofs


def polar(radius, sector, height):
    angle = 2.0 * np.pi * sector / SECTORS
    return radius * np.cos(angle), radius * np.sin(angle), height


def disc():
    """Disc of quadratic hexahedra, clamped at its bore; node 1 + i + 100 j + 10000 k of half steps i along the radius,
    j round the disc and k through its thickness."""

    def label(i, j, k):
        return 1 + i + 100 * (j % (2 * SECTORS)) + 10000 * k

    rings = np.interp(np.arange(2 * len(RADII) - 1) / 2.0, np.arange(len(RADII)), RADII)
    nodes = {
        label(i, j, k): polar(radius, 0.5 * j, 0.5 * THICKNESS * (k - 1))
        for k in range(3)
        for j in range(2 * SECTORS)
        for i, radius in enumerate(rings)
        if i % 2 + j % 2 + k % 2 < 2
    }
    square, edges = ((0, 0), (2, 0), (2, 2), (0, 2)), ((1, 0), (2, 1), (1, 2), (0, 1))
    places = [(i, j, k) for part in (square, edges) for k in (0, 2) for i, j in part] + [(i, j, 1) for i, j in square]
    cells = [
        [label(i + di, j + dj, dk) for di, dj, dk in places]
        for j in range(0, 2 * SECTORS, 2)
        for i in range(0, len(rings) - 1, 2)
    ]
    fixed = [n for n in nodes if (n - 1) % 100 == 0]
    contacts = [[label(2 * r, 2 * s, k) for r in (1, 3) for s in (-1, 1)] for k in (0, 2)]
    return nodes, [("C3D20", cells, STEEL)], fixed, contacts


def pads():
    """Two pads of lining and back plate; nodes 1 to 12 below the disc, 101 to 112 above it, from the disc outwards."""
    nodes, cells, contacts, backs = {}, ([], []), [], []
    for first, side in ((1, -1.0), (101, 1.0)):
        heights = side * (0.5 * THICKNESS + np.cumsum((0.0, *PAD_LAYERS)))
        corners = [(r, s) for r in PAD_RADII for s in (-1, 1)]
        for layer, height in enumerate(heights):
            for k, (radius, sector) in enumerate(corners):
                nodes[first + 4 * layer + k] = polar(radius, sector, height)
        for layer in (0, 1):
            face = lambda at: [first + 4 * at + k for k in (0, 2, 3, 1)]
            lower, upper = (layer, layer + 1) if side > 0 else (layer + 1, layer)
            cells[layer].append(face(lower) + face(upper))
        contacts.append([first + k for k in range(4)])
        backs.append([first + 8 + k for k in range(4)])
    return nodes, [("C3D8", cells[0], LINING), ("C3D8", cells[1], STEEL)], [], contacts, backs


def craig_bampton(stiffness, mass, dofs, kept):
    """K, M and labels of the nodes `kept` and of modes with these held, numbered from 9001 in direction 0."""
    outer = [i for i, (node, _) in enumerate(dofs) if node in kept]
    inner = [i for i, (node, _) in enumerate(dofs) if node not in kept]
    static = -np.linalg.solve(stiffness[np.ix_(inner, inner)], stiffness[np.ix_(inner, outer)])
    factor = np.linalg.inv(np.linalg.cholesky(mass[np.ix_(inner, inner)]))
    squares, vectors = np.linalg.eigh(factor @ stiffness[np.ix_(inner, inner)] @ factor.T)
    shapes = (factor.T @ vectors)[:, :MODES]
    basis = np.zeros((len(dofs), len(outer) + MODES))
    basis[outer, range(len(outer))] = 1.0
    basis[np.ix_(inner, range(len(outer)))] = static
    basis[np.ix_(inner, range(len(outer), len(outer) + MODES))] = shapes
    labels = [dofs[i] for i in outer] + [(9001 + k, 0) for k in range(MODES)]
    return basis.T @ stiffness @ basis, basis.T @ mass @ basis, labels, np.sqrt(squares[:MODES])


def dmig(name, matrix, labels):
    """Lines of a symmetric matrix in large field, ten digits; entries that are zero but for rounding are left out."""
    scale = np.sqrt(np.abs(np.diag(matrix)))
    lines = [f"DMIG    {name:8}{0:8}{6:8}{2:8}{0:8}"]
    for j, (node, direction) in enumerate(labels):
        column = []
        for i in range(j, len(labels)):
            if i == j and matrix[i, j] == 0.0 or abs(matrix[i, j]) <= 1e-10 * scale[i] * scale[j]:
                continue
            value = f"{matrix[i, j]:.9E}".replace("E", "D")
            column.append(f"*       {labels[i][0]:16}{labels[i][1]:16}{value:>16}")
        if column:
            lines += [f"DMIG*   {name:16}{node:16}{direction:16}", *column]
    return lines


def write():
    FOLDER.mkdir(exist_ok=True)
    nodes, solids, fixed, contacts = disc()
    stiffness, mass, dofs, _ = calculix(nodes, solids, fixed)
    kept = sorted({n for side in contacts for n in side})
    reduced, inertia, labels, omega = craig_bampton(stiffness, mass, dofs, kept)
    order = sorted(range(len(labels)), key=labels.__getitem__)
    reduced, inertia = reduced[np.ix_(order, order)], inertia[np.ix_(order, order)]
    labels = [labels[k] for k in order]
    damping = np.zeros_like(inertia)
    for k, w in enumerate(omega):
        at = labels.index((9001 + k, 0))
        damping[at, at] = 2.0 * DAMPING * w
    text = ["$ Disc of a brake: 8 nodes and 14 modes that hold them (scripts/studies/disc_brake.py); kg, m, s"]
    for name, matrix in (("KAAX", reduced), ("MAAX", inertia), ("BAAX", damping)):
        text += dmig(name, matrix, labels)
    (FOLDER / "disc.pch").write_text("\n".join(text) + "\n")
    nodes, solids, fixed, pad_contacts, backs = pads()
    *_, stem = calculix(nodes, solids, fixed)
    for ending in ("sti", "mas", "dof"):
        (FOLDER / f"pads.{ending}").write_text(Path(f"{stem}.{ending}").read_text())
    lower, upper, points = [], [], []
    for side, (on_disc, on_pad) in enumerate(zip(contacts, pad_contacts)):
        into_disc, into_pad = (("z", "-z"), ("-z", "z"))[side]
        for a, b in zip(on_disc, on_pad):
            lower.append({"node": a, "normal": into_disc, "tangential": ["x", "y"]})
            upper.append({"node": b, "normal": into_pad, "tangential": ["x", "y"]})
            x, y, _ = nodes[b]
            radius = float(np.hypot(x, y))
            direction = [round(-y / radius, 6), round(x / radius, 6)]
            points.append({"direction": direction, "force": 500, "slip_velocity": 5})
    job = json.loads(JOB.read_text()) if JOB.exists() else {}
    job |= {
        "version": 5,
        "title": "A disc brake from matrices of other programs: disc from DMIG, pads from CalculiX",
        "bodies": {
            "lower": {
                "matrices": {
                    "stiffness": {"path": "disc-brake/disc.pch", "name": "KAAX"},
                    "mass": {"path": "disc-brake/disc.pch", "name": "MAAX"},
                    "damping": {"path": "disc-brake/disc.pch", "name": "BAAX"},
                    "contacts": lower,
                }
            },
            "upper": {
                "matrices": {
                    "stiffness": "disc-brake/pads.sti",
                    "mass": "disc-brake/pads.mas",
                    "supports": [
                        {"nodes": [n for side in backs for n in side], "stiffness": SPRINGS, "damping": DASHPOTS}
                    ],
                    "contacts": upper,
                }
            },
        },
        "contact": {"friction": 0.5, "points": points},
        "analyses": {"modes": {"count": 38}, "stability": STABILITY},
    }
    # Innermost lists and objects on one line.
    text = json.dumps(job, indent=2)
    for pattern in (r"\[[^\[\]{}]*\]", r"\{[^{}]*\}"):
        text = re.sub(pattern, lambda found: re.sub(r"\s+", " ", found[0]) if len(found[0]) < 140 else found[0], text)
    JOB.write_text(text + "\n")


# On the modes, and on all degrees of freedom.
STABILITY = {"max_frequency": 12000, "full": {"max_frequency": 12000, "damping_ratio": 0.3}}
# Springs and dashpots at each node of the back plates, N/m and N s/m along x, y, z.
SPRINGS, DASHPOTS = [16e6, 16e6, 30e6], [10.0, 10.0, 10.0]


def read_dmig(path, name):
    """A matrix of `disc.pch` and its labels."""
    entries, column, active = {}, None, False
    for line in path.read_text().splitlines():
        if line.startswith("DMIG*"):
            active = line[8:24].strip() == name
            column = int(line[24:40]), int(line[40:56])
        elif line.startswith("*") and active:
            row = int(line[8:24]), int(line[24:40])
            entries[row, column] = entries[column, row] = float(line[40:56].replace("D", "E"))
    return entries


def solve(friction=None):
    """Eigenvalues with positive imaginary part by the constraints of the contacts, eliminated by their null space."""
    job = json.loads(JOB.read_text())
    friction = job["contact"]["friction"] if friction is None else friction
    given = {name: read_dmig(FOLDER / "disc.pch", name) for name in ("KAAX", "MAAX", "BAAX")}
    labels = sorted({row for row, _ in given["KAAX"]})
    place = {dof: i for i, dof in enumerate(labels)}
    disc_matrices = []
    for name in ("KAAX", "MAAX", "BAAX"):
        matrix = np.zeros((len(labels), len(labels)))
        for (row, col), value in given[name].items():
            matrix[place[row], place[col]] = value
        disc_matrices.append(matrix)
    stiffness, mass, dofs = read_calculix(FOLDER / "pads")
    damping = np.zeros_like(mass)
    support = job["bodies"]["upper"]["matrices"]["supports"][0]
    for i, (node, direction) in enumerate(dofs):
        if node in support["nodes"]:
            stiffness[i, i] += support["stiffness"][direction - 1]
            damping[i, i] += support["damping"][direction - 1]
    n, all_dofs = len(labels), len(labels) + len(dofs)
    whole = []
    for a, b in zip(disc_matrices, (stiffness, mass, damping)):
        matrix = np.zeros((all_dofs, all_dofs))
        matrix[:n, :n], matrix[n:, n:] = a, b
        whole.append(matrix)
    stiffness, mass, damping = whole
    number = {("lower", *dof): i for i, dof in enumerate(labels)}
    number |= {("upper", *dof): n + i for i, dof in enumerate(dofs)}
    normals, forces = [], []
    for k, point in enumerate(job["contact"]["points"]):
        normal, along, across = np.zeros((3, all_dofs))
        d = np.array(point["direction"]) / np.linalg.norm(point["direction"])
        for body, sign in (("lower", 1.0), ("upper", -1.0)):
            contact = job["bodies"][body]["matrices"]["contacts"][k]
            normal[number[body, contact["node"], 3]] = -1.0 if contact["normal"] == "-z" else 1.0
            for c in (0, 1):
                row = number[body, contact["node"], c + 1]
                along[row] += sign * d[c]
                across[row] += sign * (-d[1], d[0])[c]
        normals.append(normal)
        # Pressure p acts along n into either body, friction as -mu p against the sliding of the lower body.
        forces.append(normal - friction * along)
        damping = damping + friction * point["force"] / point["slip_velocity"] * np.outer(across, across)
    normals, forces = np.array(normals), np.array(forces)
    # u = Z q with N u = 0, and the equations in the space that the contact forces do not reach.
    null = np.linalg.svd(normals)[2][len(normals) :].T
    left = np.linalg.svd(forces)[2][len(forces) :]
    k, m, c = (left @ a @ null for a in (stiffness, mass, damping))
    size = len(m)
    inverse = np.linalg.inv(m)
    first = np.block([[np.zeros((size, size)), np.eye(size)], [-inverse @ k, -inverse @ c]])
    values = np.linalg.eigvals(first)
    return sorted(values[values.imag > 0], key=lambda v: -v.real)


def main():
    if sys.argv[1:] == ["write"]:
        write()
    limit = 2 * np.pi * json.loads(JOB.read_text())["analyses"]["stability"]["max_frequency"]
    for value in [v for v in solve() if v.imag < limit][:12]:
        here, abaqus = -value.real / abs(value), -2.0 * value.real / value.imag
        print(f"{value.imag / (2 * np.pi):10.3f} Hz  {value.real:+12.5f} 1/s  ratio {here:+.6f}  Abaqus {abaqus:+.6f}")


if __name__ == "__main__":
    main()
