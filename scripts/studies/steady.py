"""Steady rolling of two equal crowned cylinders: lateral force against CONTACT, normal contact against Hertz."""

from program import both, extrapolated, run

MU = 0.3
# Load (N), lateral creepage, Fy/(mu N) of CONTACT extrapolated to zero grid size.
CONTACT = [(70e3, 0.003, -0.7177), (70e3, 0.001, -0.3005), (70e3, 0.005, -0.9304), (10e3, 0.003, -0.9684)]
# Load (N): radius of the contact (m), largest pressure (Pa), approach (m).
HERTZ = {70e3: (4.884e-3, 1401.0e6, 95.43e-6), 10e3: (2.553e-3, 732.4e6, 26.08e-6)}


def sweep(compliance, loads, grids):
    rows = []
    for load, eta, reference in CONTACT:
        if load not in loads:
            continue
        radius, pressure, approach = HERTZ[load]
        points = []
        for k in grids:
            size = radius / k
            half = round((k + 2) * size, 9)
            sets = both("mesh.cylinder.element_size", size) | {
                "contact.compliance": compliance,
                "contact.normal_load": load,
                "contact.creepage.lateral": eta,
                "contact.patch.half_length": half,
                "contact.patch.half_width": half,
                "output.fields": "false",
            }
            tables, seconds = run("two-cylinders.json", sets, only="steady")
            points.append(
                {
                    "per_radius": k,
                    "size": size,
                    "force": float(tables["contact/force"][1]) / (MU * load),
                    "along": float(tables["contact/force"][0]) / (MU * load),
                    "pressure": float(tables["contact/pressure"].max()) / pressure,
                    "approach": float(tables["contact/approach"]) / approach,
                    "seconds": seconds,
                }
            )
        force = extrapolated([p["size"] for p in points], [p["force"] for p in points])
        rows.append({"load": load, "eta": eta, "contact": reference, "points": points, "force": force})
    return rows


def half_space():
    return sweep("half_space", (70e3, 10e3), (6, 9, 13))


def spin():
    """Lateral force of spin alone over the size of elements; fails where it is too small by more than 3 h²/a²."""
    load, radius = 70e3, HERTZ[70e3][0]
    rows = []
    for size in (1e-3, 0.7e-3, 0.5e-3, 0.35e-3, 0.25e-3, 0.18e-3, 0.15e-3):
        half = round((int(radius / size) + 3) * size, 9)
        sets = both("mesh.cylinder.element_size", size) | {
            "contact.compliance": "half_space",
            "contact.normal_load": load,
            "contact.creepage.lateral": 0,
            "contact.creepage.spin": 0.4,
            "contact.patch.half_length": half,
            "contact.patch.half_width": half,
            "output.fields": "false",
        }
        tables, _ = run("two-cylinders.json", sets, only="steady")
        rows.append({"size": size, "radius": radius, "force": float(tables["contact/force"][1]) / (MU * load)})
    limit = extrapolated([r["size"] for r in rows], [r["force"] for r in rows])
    for r in rows:
        r["off"] = r["force"] / limit - 1
        assert abs(r["off"]) < 3 * (r["size"] / radius) ** 2 + 1e-3, r
    return rows


def finite_elements():
    return sweep("fe", (70e3,), (5, 7, 10))
