"""One look and one way of naming for all pictures. Colours: Okabe and Ito, told apart by colour-blind readers too."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..errors import USAGE, WRITING, ResultError
from ..result import Result, lookup

BLUE, ORANGE, GREEN, RED, SKY, PURPLE = "#0072B2", "#E69F00", "#009E73", "#D55E00", "#56B4E9", "#CC79A7"
GREY = "#666666"
# One colour for one quantity in all pictures: directions, states of the contact, parts of a growth rate.
LONGITUDINAL, LATERAL, NORMAL = GREEN, ORANGE, BLUE
STICK, SLIP = SKY, ORANGE
PARTS = {"damping": GREY, "friction": RED, "creep": SKY, "tilting": PURPLE}
# Their names, as the summary and the report have them.
NAMES_OF_PARTS = {"damping": "structural damping", "creep": "creep damping", "tilting": "contact tilt"}
FORMATS = ("png", "pdf", "svg")
# Place of a legend below the figure. `apply` makes pictures as large as what is drawn; "outside lower center" would
# do the same from matplotlib 3.7 on, Debian 12 has 3.6.
BELOW: dict[str, Any] = {"loc": "upper center", "bbox_to_anchor": (0.5, 0.0)}


@dataclass(frozen=True)
class Canvas:
    """Place of pictures: `DIRECTORY/STEM-NAME.FORMAT`, in each of the formats."""

    directory: Path
    stem: str
    formats: Sequence[str] = ("png",)
    resolution: int = 200  # dots per inch

    def __post_init__(self) -> None:
        unknown = [f for f in self.formats if f not in FORMATS]
        if unknown or not self.formats:
            raise ResultError(
                f"no picture format {', '.join(unknown) or 'given'}; there are {', '.join(FORMATS)}", USAGE
            )

    def path(self, name: str, ending: str) -> Path:
        """Path of a file of this canvas."""
        return self.directory / f"{self.stem}-{name}.{ending}"

    def save(self, figure: Figure, name: str) -> list[Path]:
        """Writes a picture, and forgets it."""
        made = []
        try:
            for ending in self.formats:
                made.append(self.path(name, ending))
                figure.savefig(made[-1], dpi=self.resolution)
        except OSError as error:
            raise ResultError(f"cannot write {made[-1]}: {error}", WRITING) from error
        finally:
            plt.close(figure)
        return made


def apply() -> None:
    """The look."""
    plt.rcParams.update(
        {
            "font.size": 10,
            "axes.titlesize": 10,
            "axes.labelsize": 10,
            "axes.spines.top": False,
            "axes.spines.right": False,
            "legend.frameon": False,
            "legend.fontsize": 9,
            "lines.linewidth": 1.6,
            "figure.dpi": 100,
            "savefig.bbox": "tight",
            "savefig.facecolor": "white",
            "svg.fonttype": "none",
        }
    )


def heading(result: Result) -> str:
    """The title of the job on a line of its own, if it has one."""
    title = lookup(result.job, "title")
    return f"{title}\n" if title else ""


def legend(figure: Figure, sources: Sequence[Axes], handles: Sequence[Any] = (), columns: int = 3) -> None:
    """One legend below the figure, where no curve is; equal labels of several axes once."""
    entries: dict[str, Any] = {}
    for axes in sources:
        for handle, label in zip(*axes.get_legend_handles_labels()):
            entries.setdefault(label, handle)
    for handle in handles:
        entries.setdefault(str(handle.get_label()), handle)
    if entries:
        figure.legend(list(entries.values()), list(entries), ncols=columns, **BELOW)
