"""Tables of the pages that the program makes and no other study: written where `<!-- study: … -->` stands."""

from pages import put
from program import ROOT, both, run
from report import table

DOCS = ROOT / "docs"


def closed_nodes():
    """The lateral force of `two-cylinders.json` on half-spaces, a patch of 12 mm, by the number of closed nodes."""
    found = {}
    for size in (3.2e-3, 2.6e-3, 2.2e-3, 1.6e-3, 1.2e-3, 8e-4, 5.7e-4):
        sets = both("mesh.cylinder.element_size", size) | {
            "contact.compliance": "half_space",
            "contact.patch.half_length": 0.006,
            "contact.patch.half_width": 0.006,
            "analyses.modes": "null",
        }
        tables, _ = run("two-cylinders.json", sets, ranks=1, only="steady")
        force, closed = tables["contact/force"], int((tables["contact/state"] > 0).sum())
        found[closed] = abs(force[1]) / (0.3 * abs(force[2]))
    head = ["closed nodes", *map(str, sorted(found))]
    put(DOCS / "theory.md", "closed-nodes", table(head, [["lateral force over μN", *(f"{found[n]:.3f}" for n in sorted(found))]]))


def modes_of_a_rail():
    """Growth rates of `wheel-on-rail.json` by the highest frequency of the modes that are kept."""
    waves = (965, 985, 358)
    rows = []
    for highest in (1100, 2500, 4000, 6000):
        tables, _ = run("wheel-on-rail.json", {"analyses.modes.max_frequency": highest}, groups=("stability",))
        rates, hertz = tables["stability/growth_rate"], tables["stability/frequency"]
        near = [max((g for g, f in zip(rates, hertz) if abs(f - wave) < 8), default=float("nan")) for wave in waves]
        rows.append([highest, *(f"{g:.3f}" for g in near)])
    head = ["modes up to, Hz", *(f"{wave} Hz, 1/s" for wave in waves)]
    put(DOCS / "wheel-on-rail.md", "modes-of-a-rail", table(head, rows))


def written():
    """All of them."""
    closed_nodes()
    modes_of_a_rail()
    return {}
