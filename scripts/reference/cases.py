"""The jobs whose results are kept: those of jobs/, coarse and short, with tolerances so small that what is compared
does not depend on where an iteration stops."""

import json

# Elements at the contact and far away, m.
COARSE = {"element_size": 0.003, "growth": 1.8, "max_element_size": 0.06}
PATCH = {"half_length": 0.009, "half_width": 0.009}
NODES = [[0.5, -0.02, 0.5], [0.0, 0.0, -0.15]]


def both(key, value):
    return {f"bodies.{body}.{key}": value for body in ("lower", "upper")}


def cylinders(**keys):
    """Coarse cylinders; further keys of the job come with `__` for dots."""
    sets = {"contact.patch": PATCH}
    for key, value in COARSE.items():
        sets |= both(f"mesh.cylinder.{key}", value)
    return sets | {key.replace("__", "."): value for key, value in keys.items()}


# Modes whose frequencies lie near each other tell them apart to the last digits.
SHARP = {"lower_eps_tol": 1e-15, "upper_eps_tol": 1e-15}
STEADY = {"tolerance": 1e-12}
SLIDING = {"direction": "rigid", "max_frequency": 1500, "shapes": 2, "phases": 4}
FALLING = {"exponential": {"static": 0.4, "kinetic": 0.3, "decay_velocity": 0.5}}
MODAL = {
    "damping": None,
    "damping.modal": {"by_frequency": [{"up_to": 900, "loss_factor": 0.002}, {"loss_factor": 0.004}]},
}


def transient(steps, **keys):
    """A transient of so many steps, everything named, little kept."""
    step = 1e-5
    given = {
        "duration": steps * step,
        "step": step,
        "theta": 0.5,
        "solver": "newton",
        "tolerance": 1e-12,
        "hold": "approach",
    }
    given |= {
        "start": {"state": "sliding", "mode": 1, "amplitude": 1e-6},
        "contact_stride": 10,
        "modal_stride": 10,
        "segment": 100,
    }
    return given | keys


def in_time(steps, **keys):
    """The narrow curve in time."""
    return cylinders(
        analyses__modes__count=15,
        analyses__stability={"direction": "rigid", "max_frequency": 1000, "shapes": 0},
        analyses__transient=transient(steps, **keys),
    )


# Name: job, keys set, and the case whose results --reuse takes up: those of the same program, or with "kept:" those of
# the earlier one.
CASES = {
    "annulus": (
        "annulus.json",
        {
            "bodies.lower.mesh.cylinder.element_size": 0.02,
            "bodies.lower.mesh.cylinder.max_element_size": 0.04,
            "analyses.modes.count": 12,
        },
    ),
    "blocks": ("blocks.json", {"analyses.steady": STEADY}),
    "hulten": ("hulten.json", {}),
    "hulten-full": ("hulten.json", {"analyses.stability.full": {"max_frequency": 1000, "damping_ratio": 0.2}}),
    "hulten-sweep": (
        "hulten.json",
        {
            "contact.friction": FALLING,
            "contact.points": [
                {"direction": [-1], "force": 100, "slip_velocity": 0.2},
                {"direction": [1], "force": 50, "slip_velocity": 0.1},
            ],
            "analyses.sweep": {
                "keys": {"contact.points.0.force": [0, 10, 100], "bodies.lower.matrices.damping_factor": [0, 0.1, 1]}
            },
        },
    ),
    # Larger than what is treated by dense matrices.
    "lattice": (
        "lattice-source.json",
        {"analyses.modes.count": 8, "analyses.stability": {"max_frequency": 150}},
    ),
    "two-cylinders": (
        "two-cylinders.json",
        cylinders(analyses__modes__count=8, analyses__steady=STEADY, analyses__stability={"shapes": 2, "phases": 4}),
    ),
    "half-space": (
        "two-cylinders.json",
        cylinders(
            contact__compliance="half_space",
            contact__creepage={"longitudinal": 0.001, "lateral": -0.0005, "spin": 0.2},
            contact__friction=FALLING,
            analyses__modes=None,
            analyses__stability=None,
            analyses__steady=STEADY,
            contact__patch={"half_length": 0.012, "half_width": 0.009},
        ),
    ),
    "approach": (
        "two-cylinders.json",
        cylinders(
            contact__normal_load=None,
            contact__approach=1e-4,
            contact__creepage={"longitudinal": 0.001, "lateral": 0.001, "spin": -0.5},
            bodies__upper__material__young=180e9,
            bodies__upper__mesh__cylinder__contact_offset=0.01,
            analyses__modes=None,
            analyses__stability=None,
            analyses__steady=STEADY,
        ),
    ),
    "gamg": (
        "two-cylinders.json",
        cylinders(
            solver__linear="gamg",
            analyses__modes=None,
            analyses__stability=None,
            analyses__steady={"tolerance": 1e-10},
            petsc_options={"ksp_rtol": 1e-13},
            contact__patch={"half_length": 0.006, "half_width": 0.006},
        )
        | both("mesh.cylinder.max_element_size", 0.1),
    ),
    "curve": (
        "curve.json",
        cylinders(
            analyses__modes__count=20,
            analyses__stability=SLIDING,
            analyses__receptance={"frequency": {"from": 0, "to": 1000, "count": 6}, "spread": "pressure"},
        ),
    ),
    "curve-reused": (
        "curve.json",
        cylinders(
            analyses__modes__count=20, analyses__stability=SLIDING, contact__friction=0.35, analyses__steady=STEADY
        ),
        "curve",
    ),
    "curve-falling": (
        "curve.json",
        cylinders(
            analyses__modes__max_frequency=1200,
            analyses__modes__count=None,
            contact__friction=FALLING,
            analyses__stability={"shapes": 1, "phases": 4},
        )
        | both("damping", MODAL["damping"])
        | both("damping.modal", MODAL["damping.modal"]),
    ),
    "curve-full": (
        "curve.json",
        cylinders(
            analyses__modes__count=25,
            analyses__stability=SLIDING | {"max_frequency": None, "full": {"max_frequency": 700, "agreement": 0.1}},
        ),
    ),
    "curve-full-complex": (
        "curve.json",
        cylinders(
            bodies__upper__damping={"alpha": 2.0, "beta": 2e-6},
            analyses__modes__count=25,
            analyses__stability=SLIDING | {"max_frequency": None, "full": {"max_frequency": 550, "agreement": 0.1}},
        ),
    ),
    # With the creepage that damps: growth would amplify rounding in the modes. The modes of the cases in time, which
    # take them from the earlier program: so rounding in the modes, which unstable motion amplifies, and their signs,
    # which random velocities have a part in, do not matter.
    "squeal-model": (
        "squeal.json",
        cylinders(
            analyses__modes__count=15, analyses__stability=None, analyses__transient=None, analyses__steady=STEADY
        )
        | {"output.fields": True},
    ),
    "squeal": (
        "squeal.json",
        in_time(
            2400,
            points=[{"name": "rim", "body": "upper", "at": NODES[0]}, {"name": "web", "body": "lower", "at": NODES[1]}],
            sound_power={"from": 0.004, "min_frequency": 900},
            body_stride=1200,
            contact_stride=100,
            modal_stride=20,
            segment=1000,
        )
        | {"output.fields": True, "contact.creepage.lateral": -0.01, "petsc_options": SHARP},
    ),
    "squeal-fixed-point": ("squeal.json", in_time(40, solver="fixed_point", theta=0.6), "squeal-model"),
    "squeal-load": (
        "squeal.json",
        in_time(
            200,
            hold="load",
            start={"state": "steady", "mode": None, "amplitude": None},
            histories={
                "normal_load": [[0, 70e3], [1e-3, 50e3], [2e-3, 65e3]],
                "lateral": [[0, 0.003], [1.5e-3, 0.006], [2e-3, 0.006]],
                "longitudinal": [[0, 0], [2e-3, 0.001]],
                "spin": [[0, 0], [2e-3, 0.1]],
            },
        )
        | {"contact.creepage.lateral": 0.003, "analyses.stability": None},
        "squeal-model",
    ),
    # Falling friction makes fast motion unstable: few steps.
    "squeal-falling": (
        "squeal.json",
        in_time(40, start={"state": "steady", "mode": None, "amplitude": None}, contact_stride=5)
        | {"contact.creepage.lateral": 0.003, "analyses.stability": None, "contact.friction": FALLING},
        "squeal-model",
    ),
    # Without a mode to start from: in the earlier program bodies at rest had its phase as the eigensolver left it,
    # which is rounding.
    "squeal-approach": (
        "squeal.json",
        in_time(
            200,
            start={"state": "sliding", "mode": None, "amplitude": None},
            histories={"approach": [[0, 1e-4], [1e-3, 0.7e-4], [2e-3, 1.1e-4]]},
            theta=0.55,
        )
        | {"contact.normal_load": None, "contact.approach": 1e-4}
        | both("damping", MODAL["damping"])
        | both("damping.modal", MODAL["damping.modal"]),
    ),
    "sweep-curve": (
        "sweep-curve.json",
        cylinders(
            analyses__modes__count=12,
            analyses__stability__max_frequency=900,
            analyses__receptance=None,
            analyses__sweep={
                "keys": {
                    "bodies.upper.mesh.cylinder.contact_offset": [0.02, 0.01],
                    "contact.friction": {"from": 0.1, "to": 0.5, "count": 3},
                    "contact.creepage.lateral": [-0.01, 0.01],
                }
            },
        ),
    ),
    "sweep-zip": (
        "sweep-curve.json",
        cylinders(
            analyses__modes__count=12,
            analyses__stability__max_frequency=900,
            analyses__receptance={"frequency": [0, 400, 410], "spread": "uniform"},
            analyses__sweep={
                "keys": {
                    "contact.normal_load": [50e3, 60e3, 70e3],
                    "analyses.stability.direction": ["rigid", "rigid", "rigid"],
                    "contact.speed": [5, 10, 10],
                },
                "combine": "zip",
            },
        ),
    ),
}


# Cases in time that begin in steady rolling.
STEADY_START = ("squeal-load",)


def plain(value):
    """As `--set` takes it: JSON, and what is None left out of objects."""
    given = lambda v: {k: given(w) for k, w in v.items() if w is not None} if isinstance(v, dict) else v  # noqa: E731
    return json.dumps(given(value))


def lattice(folder, side=30):
    """Writes the matrices of a square lattice of masses on springs that moves along x, y and n, and a job on them."""
    count = 3 * side * side
    unknown = lambda i, j, c: 3 * (i + side * j) + c + 1  # noqa: E731
    entries = {}

    def spring(a, b, k):
        for r, s, v in ((a, a, k), (b, b, k), (max(a, b), min(a, b), -k)):
            entries[r, s] = entries.get((r, s), 0.0) + v

    for j in range(side):
        for i in range(side):
            for c in range(3):
                # Unlike along the two sides, so that no frequencies coincide; bound to the ground, a little more on one
                # side.
                row = unknown(i, j, c)
                entries[row, row] = entries.get((row, row), 0.0) + 2e5 * (1 + 0.01 * i + 0.017 * j * j / side + 0.3 * c)
                if i + 1 < side:
                    spring(row, unknown(i + 1, j, c), 3e7 * (1 + 0.2 * c))
                if j + 1 < side:
                    spring(row, unknown(i, j + 1, c), 2e7 * (1 + 0.1 * c))
            # Normal and tangential motion are coupled.
            entries[unknown(i, j, 2), unknown(i, j, 0)] = -2e4
    head = "%%MatrixMarket matrix coordinate real symmetric\n"
    write = lambda name, items: (folder / name).write_text(
        head + f"{count} {count} {len(items)}\n" + "".join(f"{r} {c} {v!r}\n" for (r, c), v in items)
    )  # noqa: E731
    write("stiffness.mtx", sorted(entries.items()))
    write("mass.mtx", [((k, k), 0.5) for k in range(1, count + 1)])
    write("heavier.mtx", [((k, k), 0.55) for k in range(1, count + 1)])
    write("damping.mtx", [((k, k), 2.0 + k / count) for k in range(1, count + 1)])
    at = [(0, 0), (1, 0), (side // 2, 1)]
    body = {"mass": "lattice/mass.mtx", "damping": "lattice/damping.mtx", "stiffness": "lattice/stiffness.mtx"}
    body["contacts"] = [
        {"normal": unknown(i, j, 2), "tangential": [unknown(i, j, 0), -unknown(i, j, 1)]} for i, j in at
    ]
    job = {
        "version": 1,
        "bodies": {
            "lower": {"matrices": body},
            "upper": {"matrices": body | {"mass": "lattice/heavier.mtx", "damping_factor": 0.5}},
        },
    }
    job["contact"] = {"friction": 0.5, "points": [{"direction": [1, 0.2]}] * len(at)}
    job["analyses"] = {"modes": {"count": 8}, "stability": {}}
    return job


# The cylinders as tests/golden has them.
TINY = (
    both("mesh.cylinder.element_size", 0.004)
    | both("mesh.cylinder.growth", 2.5)
    | both("mesh.cylinder.max_element_size", 0.1)
)
TINY |= {"contact.patch": {"half_length": 0.012, "half_width": 0.012}, "analyses.modes.count": 4}
