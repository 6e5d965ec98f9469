"""Called by benches/compare: studies by name."""

import sys
from pathlib import Path

# Tables of pages are written as the studies of scripts/validate write theirs.
sys.path.append(str(Path(__file__).resolve().parents[2] / "scripts" / "studies"))

import algebra  # noqa: E402
import full  # noqa: E402
import modes  # noqa: E402
import scaling  # noqa: E402
import steady  # noqa: E402
import steps  # noqa: E402
import uncertainty  # noqa: E402
import wheels  # noqa: E402
import whole  # noqa: E402

# Half an hour each, or a large disk.
LONG = ("largest", "out-of-core")
STUDIES = {
    "modes": modes.sizes,
    "many-modes": modes.many,
    "wheels": wheels.wheels,
    "out-of-core": modes.out_of_core,
    "full": full.beside,
    "rotation": steps.turning,
    "steps": steps.in_squeal,
    "half-spaces": steps.on_half_spaces,
    "siconos": steps.beside_siconos,
    "steady": steady.cold,
    "creep-curve": steady.curves,
    "two-cylinders": whole.two_cylinders,
    "former": whole.former,
    "wheel-on-rail": whole.wheel_on_rail,
    "sweeps": whole.sweeps,
    "places": whole.places,
    "limit-cycles": whole.limit_cycles,
    "uncertain-samples": uncertainty.samples,
    "orderings": algebra.orderings,
    "solves": algebra.solves,
    "blocks": algebra.blocks,
    "multigrid": algebra.multigrid,
    "low-rank": algebra.low_rank,
    "scaling": scaling.ranks,
    "largest": whole.largest,
}


def main():
    if sys.argv[1:] == ["list"]:
        print("\n".join(STUDIES))
        return
    wanted = sys.argv[1:] or [name for name in STUDIES if name not in LONG]
    unknown = [name for name in wanted if name not in STUDIES]
    if unknown:
        sys.exit(f"benches/compare: no study {', '.join(unknown)}; there are {', '.join(STUDIES)}")
    for name in wanted:
        print(f"== {name}", flush=True)
        STUDIES[name]()


if __name__ == "__main__":
    main()
