"""A bogie in curves: steady curving of the program beside the multibody program Exudyn, which runs it in time."""

import csv

import numpy as np
from program import ROOT, run

TABLE = ROOT / "docs/data/curving_exudyn.csv"
WHEELS = (("1", "right"), ("1", "left"), ("2", "right"), ("2", "left"))  # as numbered in /curving/contacts/wheel


def reference():
    """Rows of the table by radius, with names of columns without units."""
    lines = [line for line in TABLE.read_text().splitlines() if not line.startswith("#")]
    names = [name.split(" ")[0] for name in lines[0].split(",")]
    rows = {}
    for row in csv.DictReader(lines[1:], names):
        rows.setdefault(float(row["radius"]), []).append(row)
    return rows


def compared():
    """Each place of contact in each curve: shift and yaw of the axle, load, creepages and lateral force of both."""
    found = []
    for radius, rows in reference().items():
        sets = {
            "curve.radius": radius,
            "curve.rail_cant": np.arctan(1 / 40),
            "contact.friction": rows[0]["friction"],
            "analyses": '{"curving":{}}',
        }
        got, _ = run("wheel-on-rail.json", sets, ranks=1, groups=("curving",))
        names = ("wheel", "wheel_y", "normal_force", "creepage", "force")
        contacts = {name: got[f"curving/contacts/{name}"] for name in names}
        for row in rows:
            axle = int(row["axle"]) - 1
            wheel = WHEELS.index((row["axle"], row["wheel"]))
            apart = np.abs(1e3 * contacts["wheel_y"] - float(row["wheel_y"])) + 1e3 * (contacts["wheel"] != wheel)
            k = int(np.argmin(apart))
            if apart[k] > 0.2:
                raise SystemExit(f"R {radius:g} m: no contact of the {row['wheel']} wheel at {row['wheel_y']} mm")
            program = [
                1e3 * got["curving/axles/shift"][axle],
                1e3 * got["curving/axles/yaw"][axle],
                1e-3 * contacts["normal_force"][k],
                1e3 * contacts["creepage"][k][0],
                1e3 * contacts["creepage"][k][1],
                1e-3 * contacts["force"][k][1],
            ]
            exudyn = [float(row[name]) for name in ("y", "yaw", "N", "xi", "eta", "F_lateral")]
            place = f"{('leading', 'trailing')[axle]} {('outer', 'inner')[row['wheel'] == 'right']}"
            found.append(
                {
                    "radius": radius,
                    "place": place,
                    "wheel_y": float(row["wheel_y"]),
                    "program": [float(p) for p in program],
                    "exudyn": exudyn,
                }
            )
    return found
