"""Writes track_decay_rolland.csv: decay rates of EN 15461 of the rail 60E1 (UIC 60) on pads by the program rolland, for
comparison with analyses.track_decay.

Its semi-analytical Timoshenko beam with torsion and warping on a continuous layer (TBCont1LKosto, after C.
Kostovasilis) has the mobilities along the rail as a sum of residues. The pads are viscous, as those of a job are: at
each frequency their loss factor is that of the dashpots. Excitation and response are at the top of the head, 91.1 mm
above the centroid, in either direction; pads hold the foot, 80.9 mm below it. A third octave has 6 frequencies, and
the direct response is 0.04 m from the force.

Needs rolland 26.8 (Python 3.12 or later) and numpy:

    python3 docs/data/track_decay_rolland.py > docs/data/track_decay_rolland.csv
"""

from importlib.metadata import version

import numpy as np
from rolland.components import ContPad, Slab
from rolland.database.rail.db_rail import UIC60
from rolland.methods.semi_analytical.kosto import TBCont1LKosto
from rolland.track import ContSlabSingleRailTrack

BAYS = [0, 0.25, 0.5, 0.75, 1, 1.25, 1.5, 1.75, 2, 2.25, 2.5, 3, 3.5, 4, 5, 6, 7, 8, 10, 12, 16, 20, 24, 30, 36, 42]
POSITIONS = 0.6 * np.array([*BAYS, 48, 54, 66])
BANDS = [250, 315, 400, 500, 630, 800, 1000, 1250, 1600, 2000]
OFFSET, LINES = 0.04, 6
# Each metre of track: stiffness vertical, lateral and along, N/m²; loss factor at the resonance of the rail on it.
PAD = (120e6 / 0.6, 40e6 / 0.6, 40e6 / 0.6)
LOSS, MASS = 0.2, 60.2
# Rolland has the loss factor of the rail in E alone, a job in the shear as well: here the rail has none.
UIC60.etar = 0.0
# A slab has to be given; the one layer lies on rigid ground.
SLAB = Slab(
    ms=250, Is_z=1, Is_y=1, Is_x=1, rhos=2500, lengs=2.5, equ_wdths=0.3, heights=0.2, z_st=0.1, z_sb=0.1, equi_sm=False
)


def mobility(frequency, direction):
    """Mobilities at the positions."""
    omega = 2 * np.pi * frequency
    # c = η √(s m): the loss factor ωc/s of a viscous layer.
    vertical, lateral, along = (omega * LOSS * np.sqrt(s * MASS) / s for s in PAD)
    pad = ContPad(
        sp_z=PAD[0],
        sp_y=PAD[1],
        sp_x=PAD[2],
        etap_z=vertical,
        etap_y=lateral,
        etap_x=along,
        etap_r=vertical,
        wdthp=0.15,
    )
    found = TBCont1LKosto(
        track=ContSlabSingleRailTrack(rail=UIC60, pad=pad, slab=SLAB, z_f=80.9e-3, y_f=0.0),
        f=np.array([frequency]),
        force_dir=direction,
        x_resp=np.maximum(POSITIONS, OFFSET),
        z_e=-91.1e-3,
        z_f=80.9e-3,
        damp_type="hysteretic",
    )
    return found.mobility


def rate(band, direction):
    """Decay rate of a third octave, dB/m: Formula 1 of the standard."""
    centre = 1000 * 10 ** (round(10 * np.log10(band / 1000)) / 10)
    low, high = centre / 10**0.05, centre * 10**0.05
    lines = low + (high - low) * (np.arange(LINES) + 0.5) / LINES
    squares = sum(np.abs(mobility(f, direction)) ** 2 for f in lines)
    edges = np.concatenate([[0], 0.5 * (POSITIONS[1:] + POSITIONS[:-1])])
    ends = np.append(edges[1:], POSITIONS[-1] + 0.5 * (POSITIONS[-1] - POSITIONS[-2]))
    return 4.343 / (squares / squares[0] * (ends - edges)).sum()


def main():
    """Prints the table."""
    print(f"# rolland {version('rolland')}, numpy {np.__version__}: python3 docs/data/track_decay_rolland.py")
    print("frequency_Hz,vertical_dB/m,lateral_dB/m")
    for band in BANDS:
        print(f"{band},{rate(band, 'vertical'):.4f},{rate(band, 'lateral'):.4f}")


main()
