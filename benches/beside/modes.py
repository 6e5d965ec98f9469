"""Modes of the clamped annulus beside dolfinx with slepc4py, and CalculiX, on the same mesh."""

import re
import tempfile
import threading
from contextlib import contextmanager, suppress
from pathlib import Path

import matplotlib
import numpy as np
from clock import DEBIAN, ROOT, Spent, busy, in_turn, middle, noted, ratio, run, spent, version
from pages import put
from peers import petsc
from railsqueal import Fields
from report import table
from system import install

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402

PAGE = ROOT / "docs" / "developers" / "performance.md"
PICTURE = ROOT / "docs" / "pictures" / "performance-modes.svg"
# Edge lengths, m: 30, 98, 180 and 300 thousand rows.
SIZES = (0.026, 0.017, 0.0137, 0.0115)
MIDDLE = 0.017
# CalculiX factorises with SPOOLES here, which takes minutes beyond.
CALCULIX_UP_TO = 110_000
# Names of its elements, whose nodes stand as VTK's do, by VTK's number of a kind.
CALCULIX = {12: "C3D8", 24: "C3D10", 25: "C3D20"}


def sized(size, count):
    mesh = {f"bodies.lower.mesh.cylinder.{key}": size for key in ("element_size", "max_element_size")}
    return mesh | {"analyses.modes.count": count}


def ours(folder, size, count, ranks):
    return run("annulus.json", "--output", folder / "own.h5", "--force", sets=sized(size, count), ranks=ranks)


def dolfinx(result, count, ranks, *bore):
    """The peer's own clock, without imports and the compilation of forms, and the memory it says; `bore` is what it
    clamps (dolfinx_modes.py)."""
    done = spent([DEBIAN, ROOT / "benches/peers/dolfinx_modes.py", result, count, *bore], ranks, petsc("real"))
    found = re.search(r"wall ([\d.]+) s  cpu ([\d.]+) s", done.out)
    return Spent(float(found[1]), float(found[2]), done.memory, done.out)


def calculix(folder, count, threads):
    return spent(
        ["ccx", "-i", folder / "annulus"],
        1,
        {"OMP_NUM_THREADS": str(threads), "CCX_NPROC_EQUATION_SOLVER": str(threads)},
        folder,
    )


def deck(result, count, path, bore=(0.1, -0.5), material=None):
    """Our mesh as an input of CalculiX, clamped at a radius about an axis at a height, m; the number of its rows
    without supports."""
    with Fields(result) as fields:
        mesh = fields.mesh
    (kind,) = np.unique(mesh.types)
    cells, points = mesh.cells(kind), mesh.points
    steel = material or {"young": 205e9, "poisson": 0.3, "density": 7800}
    bore = np.flatnonzero(abs(np.hypot(points[:, 0], points[:, 2] - bore[1]) - bore[0]) < 1e-6)
    with open(path, "w") as file:
        file.write("*NODE, NSET=ALL\n")
        np.savetxt(file, np.column_stack([np.arange(1, len(points) + 1), points]), fmt="%d, %.12g, %.12g, %.12g")
        file.write(f"*ELEMENT, TYPE={CALCULIX[kind]}, ELSET=BODY\n")
        for number, cell in enumerate(cells + 1, 1):
            words = [f"{n}" for n in (number, *cell)]
            # A line has sixteen entries at the most.
            file.write(", ".join(words[:16]) + (",\n" + ", ".join(words[16:]) if len(words) > 16 else "") + "\n")
        file.write("*NSET, NSET=BORE\n" + "".join(f"{n + 1},\n" for n in bore))
        file.write(
            f"*MATERIAL, NAME=STEEL\n*ELASTIC\n{steel['young']}, {steel['poisson']}\n*DENSITY\n{steel['density']}\n"
        )
        file.write("*SOLID SECTION, ELSET=BODY, MATERIAL=STEEL\n")
        file.write(f"*BOUNDARY\nBORE, 1, 3\n*STEP\n*FREQUENCY\n{count}\n*NODE FILE\nU\n*END STEP\n")
    return 3 * (len(points) - len(bore))


def meshed(folder, size):
    """A result file of ours with the annulus in elements of this size, and the number of its rows."""
    done = ours(folder, size, 4, 2)
    result = (folder / "own.h5").rename(folder / "mesh.h5")
    return result, int(re.search(r"(\d+) degrees of freedom", done.out)[1])


def packages():
    install("python3-dolfinx-real", "python3-slepc4py-real", "python3-h5py", "libopenblas0-pthread", "calculix-ccx")
    return (
        f"dolfinx {version('python3-dolfinx-real')}",
        f"SLEPc {version('python3-slepc4py-real')}",
        f"CalculiX {version('calculix-ccx')}",
    )


def lines(names, found):
    """Rows of a table: each program, then ours over each of the others."""
    keys = ("wall", "cpu", "memory")
    mid = [[middle(f, key) for key in keys] for f in found]
    rows = [[name, f"{m[0]:.1f} s", f"{m[1]:.1f} s", f"{m[2] / 1e9:.2f} GB"] for name, m in zip(names, mid)]
    for name, m in zip(names[1:], mid[1:]):
        rows.append([f"ours over {name}", *(ratio(a, b) for a, b in zip(mid[0], m))])
    return rows, mid


def sizes():
    """Four sizes on one rank and two: a table and a picture."""
    programs, load = packages(), busy()
    body, drawn = [], {}
    for size in SIZES:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            result, _ = meshed(folder, size)
            rows = deck(result, 40, folder / "annulus.inp")
            # The forms are compiled in the first run.
            dolfinx(result, 40, 1)
            for ranks in (1, 2):
                names = ["railsqueal", "dolfinx + slepc4py"]
                runs = in_turn(lambda: ours(folder, size, 40, ranks), lambda: dolfinx(result, 40, ranks))
                # It is so much slower that one run says enough.
                if rows < CALCULIX_UP_TO:
                    names.append("CalculiX")
                    runs.append([calculix(folder, 40, ranks)])
                found, mid = lines(names, runs)
                body += [[f"{rows}", str(ranks), *row] for row in found]
                for program, m in zip(names, mid):
                    drawn.setdefault((program, ranks), []).append((rows, m[0], m[2] / 1e9))
    head = ["rows", "ranks", "", "wall", "CPU", "memory"]
    draw(drawn)
    shown = f"\n![wall time and memory over the number of rows](../pictures/{PICTURE.name})\n"
    put(PAGE, "modes", table(head, body) + "\n" + noted(load, *programs[:-1], f"{programs[-1]} (one run)") + shown)


def draw(drawn):
    figure, axes = pyplot.subplots(1, 2, figsize=(9, 3.6))
    colours = {"railsqueal": "C0", "dolfinx + slepc4py": "C1", "CalculiX": "C2"}
    for (program, ranks), points in drawn.items():
        rows, wall, memory = np.array(points).T
        for axis, values in zip(axes, (wall, memory)):
            label = f"{program}, {ranks} rank{'s' if ranks > 1 else ''}" if axis is axes[0] else None
            axis.loglog(rows, values, "o-" if ranks == 1 else "s--", color=colours[program], label=label)
    for axis, name in zip(axes, ("wall time, s", "memory of all ranks, GB")):
        # Plain numbers, few enough not to touch each other.
        axis.set_xticks([3e4, 1e5, 3e5], ["30 000", "100 000", "300 000"])
        axis.set_yticks(*([[1, 3, 10, 30, 100]] if axis is axes[0] else [[0.25, 0.5, 1, 2, 4]]))
        axis.yaxis.set_major_formatter("{x:g}")
        for line in (axis.xaxis, axis.yaxis):
            line.set_minor_formatter("")
        axis.set_xlabel("rows")
        axis.set_ylabel(name)
        axis.grid(True, which="both", alpha=0.3)
    figure.legend(loc="outside lower center", ncols=3, frameon=False)
    figure.tight_layout(rect=(0, 0.14, 1, 1))
    PICTURE.parent.mkdir(exist_ok=True)
    figure.savefig(PICTURE, metadata={"Date": None})
    pyplot.close(figure)


def many():
    """400 modes of the middle mesh, where SLEPc's basis is twice as many."""
    programs, load = packages()[:2], busy()
    body = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        result, _ = meshed(folder, MIDDLE)
        dolfinx(result, 4, 1)
        for ranks in (1, 2):
            names = ["railsqueal", "dolfinx + slepc4py"]
            found, _ = lines(
                names, in_turn(lambda: ours(folder, MIDDLE, 400, ranks), lambda: dolfinx(result, 400, ranks), count=1)
            )
            body += [[str(ranks), *row] for row in found]
    put(
        PAGE,
        "many-modes",
        table(["ranks", "400 modes", "wall", "CPU", "memory"], body) + "\n" + noted(load, *programs, runs=1),
    )


@contextmanager
def watched(folder):
    """The most that lies in a folder meanwhile, in bytes: a list whose last entry is that."""
    most, over = [0], threading.Event()

    def look():
        while not over.wait(0.2):
            # Files may go while they are counted.
            with suppress(FileNotFoundError):
                most.append(max(most[-1], sum(512 * path.stat().st_blocks for path in folder.rglob("*"))))

    looking = threading.Thread(target=look)
    looking.start()
    try:
        yield most
    finally:
        over.set()
        looking.join()


def out_of_core():
    """Factors in memory and on a disk, up to two million rows: half an hour."""
    load, body = busy(), []
    for size in (*SIZES[2:], 0.0094, 0.0078, 0.0061):
        # /tmp may be memory.
        with tempfile.TemporaryDirectory(dir="/var/tmp") as name:
            folder = Path(name)
            disk = folder / "factors"
            disk.mkdir()
            with watched(disk) as most:
                done = run(
                    "annulus.json", "--output", folder / "own.h5", sets=sized(size, 40) | {"solver.out_of_core": disk}
                )
            rows = re.search(r"(\d+) degrees of freedom", done.out)[1]
            inside = ours(folder, size, 40, 1) if size in SIZES else None
        beside = [f"{inside.wall:.0f} s", f"{1e-9 * inside.memory:.2f} GB"] if inside else ["", ""]
        body.append([rows, f"{done.wall:.0f} s", f"{1e-9 * done.memory:.2f} GB", f"{1e-9 * most[-1]:.1f} GB", *beside])
    head = ["rows, one rank", "on a disk", "memory", "disk", "in memory", "memory"]
    put(PAGE, "out-of-core", table(head, body) + "\n" + noted(load, runs=1))
