"""Names and units of the keys of a job, for axis titles, tables and sentences. No raw key is shown to readers.

A key is named by the longest suffix of its dotted path that is listed in `NAMES`; indices and bodies do not count. Keys
that are not listed get their last two components in words, with the SI unit of the result file.
"""

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

BODY_WORDS = {"lower": "lower body", "upper": "upper body"}
# Suffix of the path: name, symbol, SI unit, displayed unit, and displayed units in one SI unit.
NAMES: dict[str, tuple[str, str, str, str, float]] = {
    "contact.friction": ("coefficient of friction", "μ", "1", "", 1),
    "friction_zones.friction": ("coefficient of friction in a zone", "μ", "1", "", 1),
    "friction_zones.from_angle": ("contact angle from which a zone begins", "δ", "rad", "rad", 1),
    "friction_zones.rail": ("rail of a zone of friction", "", "-", "", 1),
    "around.friction": ("coefficient of friction of a further body", "μ", "1", "", 1),
    "contact.normal_load": ("normal load", "N", "N", "kN", 1e-3),
    "contact.vertical_load": ("vertical load of the wheel", "Q", "N", "kN", 1e-3),
    "contact.lateral_force": ("lateral force on the wheel", "Y", "N", "kN", 1e-3),
    "contact.torque": ("torque on the axle", "T", "N m", "N m", 1),
    "contact.approach": ("approach", "δ", "m", "µm", 1e6),
    "contact.speed": ("rolling speed", "V", "m/s", "m/s", 1),
    "around.angle": ("angle of a further body around the lower one", "θ", "rad", "rad", 1),
    "around.body": ("further body", "", "-", "", 1),
    "around.normal_load": ("normal load of a further body", "N", "N", "kN", 1e-3),
    "contact.from.wheel": ("wheel", "", "-", "", 1),
    "contact.compliance": ("compliance of the contact", "", "-", "", 1),
    "contact.quadrature": ("quadrature of the contact laws", "", "-", "", 1),
    "creepage.longitudinal": ("longitudinal creepage", "ξ", "1", "%", 100),
    "creepage.lateral": ("lateral creepage", "η", "1", "%", 100),
    "creepage.spin": ("spin", "φ", "1/m", "1/m", 1),
    "placement.side": ("rail that the wheel is on", "", "-", "", 1),
    "placement.radius": ("nominal rolling radius", "", "m", "mm", 1e3),
    "placement.cant": ("inclination of the rail", "", "rad", "rad", 1),
    "placement.lateral": ("lateral shift of the wheelset", "", "m", "mm", 1e3),
    "placement.yaw": ("yaw of the wheelset (angle of attack)", "", "rad", "mrad", 1e3),
    "placement.roll": ("roll of the wheelset", "", "rad", "mrad", 1e3),
    "placement.gauge": ("gauge", "", "m", "mm", 1e3),
    "placement.speed": ("speed", "V", "m/s", "m/s", 1),
    "placement.gauge_depth": ("depth of the gauge below the head", "", "m", "mm", 1e3),
    "placement.circles": ("distance of the running circles", "", "m", "mm", 1e3),
    "placement.loaded": ("placement under load", "", "-", "", 1),
    "placement.touch_near": ("place on the profile of the wheel near which it touches", "", "m", "mm", 1e3),
    "placement.angular_speed": ("angular speed of the wheelset", "", "rad/s", "rad/s", 1),
    "placement.curvature": ("curvature of the track", "", "1/m", "1/m", 1),
    "patch.half_length": ("half-length of the contact grid", "", "m", "mm", 1e3),
    "patch.half_width": ("half-width of the contact grid", "", "m", "mm", 1e3),
    "patch.spacing": ("spacing of the contact grid", "", "m", "mm", 1e3),
    "grid.spacing": ("spacing of the contact grid", "", "m", "mm", 1e3),
    "curve.radius": ("radius of the curve", "R", "m", "m", 1),
    "curve.direction": ("direction of the curve", "", "-", "", 1),
    "curve.speed": ("speed of the vehicle", "V", "m/s", "m/s", 1),
    "curve.cant": ("cant of the track", "", "m", "mm", 1e3),
    "curve.cant_deficiency": ("cant deficiency", "", "m", "mm", 1e3),
    "curve.gauge": ("gauge", "", "m", "mm", 1e3),
    "curve.gauge_widening": ("gauge widening", "", "m", "mm", 1e3),
    "curve.gauge_depth": ("depth of the gauge below the head", "", "m", "mm", 1e3),
    "curve.rail_cant": ("inclination of the rails", "", "rad", "rad", 1),
    "curve.creep_law": ("creep force law of the vehicle", "", "-", "", 1),
    "vehicle.wheelbase": ("wheelbase", "", "m", "m", 1),
    "vehicle.axle_load": ("axle load", "", "N", "kN", 1e-3),
    "primary.longitudinal": ("longitudinal stiffness of the primary suspension", "", "N/m", "MN/m", 1e-6),
    "primary.lateral": ("lateral stiffness of the primary suspension", "", "N/m", "MN/m", 1e-6),
    "primary.yaw": ("yaw stiffness of the primary suspension", "", "N m/rad", "MN m/rad", 1e-6),
    "vehicle.wheel_radius": ("wheel radius", "", "m", "mm", 1e3),
    "vehicle.back_to_back": ("back-to-back distance", "", "m", "mm", 1e3),
    "material.young": ("Young's modulus", "E", "Pa", "GPa", 1e-9),
    "material.poisson": ("Poisson's ratio", "ν", "1", "", 1),
    "material.density": ("density", "ρ", "kg/m³", "kg/m³", 1),
    "damping.alpha": ("Rayleigh damping, factor of the mass", "α", "1/s", "1/s", 1),
    "damping.beta": ("Rayleigh damping, factor of the stiffness", "β", "s", "s", 1),
    "modal.by_mode": ("loss factors, mode by mode", "", "1", "", 1),
    "modal.by_diameter": ("loss factors for n = 0, 1, 2, … nodal diameters", "", "1", "", 1),
    "modal.by_frequency": ("loss factors by frequency", "", "-", "", 1),
    "axle_distance": ("distance of the axle from the contact", "", "m", "mm", 1e3),
    "mesh.file.path": ("mesh file", "", "-", "", 1),
    "inner_radius": ("inner radius", "", "m", "mm", 1e3),
    "outer_radius": ("rolling radius", "", "m", "mm", 1e3),
    "cylinder.thickness": ("width", "", "m", "mm", 1e3),
    "crown_radius": ("transversal radius of the running surface", "", "m", "mm", 1e3),
    "contact_offset": ("contact offset", "", "m", "mm", 1e3),
    "element_size": ("element size at the contact", "", "m", "mm", 1e3),
    "cylinder.growth": ("largest ratio of neighbouring element sizes", "", "1", "", 1),
    "max_element_size": ("largest element size", "", "m", "mm", 1e3),
    "wheel.web": ("shape of the web", "", "-", "", 1),
    "wheel.diameter": ("diameter of the running circle", "", "m", "mm", 1e3),
    "web_thickness": ("thickness of the web", "", "m", "mm", 1e3),
    "web_position": ("position of the web", "", "m", "mm", 1e3),
    "web_offset": ("offset of the web", "", "m", "mm", 1e3),
    "wheel.bore": ("diameter of the bore", "", "m", "mm", 1e3),
    "hub_diameter": ("diameter of the hub", "", "m", "mm", 1e3),
    "hub_length": ("length of the hub", "", "m", "mm", 1e3),
    "hub_position": ("position of the hub", "", "m", "mm", 1e3),
    "rim_width": ("width of the rim", "", "m", "mm", 1e3),
    "rim_thickness": ("thickness of the rim", "", "m", "mm", 1e3),
    "flange_height": ("height of the flange", "", "m", "mm", 1e3),
    "flange_thickness": ("thickness of the flange", "", "m", "mm", 1e3),
    "layer.inner_diameter": ("inner diameter of the layer", "", "m", "mm", 1e3),
    "layer.thickness": ("thickness of the layer", "", "m", "mm", 1e3),
    "layer.loss_factor": ("loss factor of the layer", "η", "1", "", 1),
    "extruded.length": ("length of rail that is modelled", "", "m", "m", 1),
    "pad.vertical": ("vertical pad stiffness", "", "N/m", "MN/m", 1e-6),
    "pad.lateral": ("lateral pad stiffness", "", "N/m", "MN/m", 1e-6),
    "pad.loss_factor": ("loss factor of the pads", "η", "1", "", 1),
    "track.spacing": ("distance of the sleepers", "", "m", "m", 1),
    "track.pad_length": ("length of a pad", "", "m", "mm", 1e3),
    "track.position": ("distance of the contact from a sleeper", "", "m", "m", 1),
    "sleeper.mass": ("mass of a sleeper", "", "kg", "kg", 1),
    "ballast.vertical": ("vertical ballast stiffness", "", "N/m", "MN/m", 1e-6),
    "ballast.lateral": ("lateral ballast stiffness", "", "N/m", "MN/m", 1e-6),
    "ballast.loss_factor": ("loss factor of the ballast", "η", "1", "", 1),
    "track.loss_factor": ("loss factor of the rail", "η", "1", "", 1),
    "ends.length": ("length of an absorbing end", "", "m", "m", 1),
    "ends.damping": ("damping of the absorbing ends", "", "1/s", "1/s", 1),
    "ends.longitudinal": ("dashpots of the absorbing ends over impedance", "", "1", "", 1),
    "absorbers.mass": ("moving mass of the absorbers", "", "kg", "kg", 1),
    "absorbers.frequency": ("tuning of the absorbers", "", "Hz", "Hz", 1),
    "absorbers.loss_factor": ("loss factor of the absorbers", "η", "1", "", 1),
    "absorbers.count": ("number of absorbers", "", "1", "", 1),
    "ring_dampers.diameter": ("wire diameter of the ring damper", "", "m", "mm", 1e3),
    "ring_dampers.frequency": ("frequency of the ring damper", "", "Hz", "Hz", 1),
    "ring_dampers.loss_factor": ("loss factor of the ring damper", "η", "1", "", 1),
    "static": ("coefficient of friction at rest", "", "1", "", 1),
    "kinetic": ("coefficient of friction at high slip velocity", "", "1", "", 1),
    "second_decay_velocity": ("second decay velocity of friction", "", "m/s", "m/s", 1),
    "decay_velocity": ("decay velocity of friction", "", "m/s", "m/s", 1),
    "half_velocity": ("slip velocity at half the fall of friction", "", "m/s", "m/s", 1),
    "end_velocity": ("slip velocity at the end of the fall of friction", "", "m/s", "m/s", 1),
    "memory_length": ("memory length of friction", "", "m", "µm", 1e6),
    "memory_velocity": ("memory velocity of friction", "", "m/s", "m/s", 1),
}
# Words of the job for what they are.
WORDS = {
    "shen_hedrick_elkins": "Shen, Hedrick and Elkins",
    "polach": "Polach",
    "fastsim": "FASTSIM",
    "linear": "linear",
    "fe": "finite elements",
    "half_space": "elastic half-spaces",
    "hybrid": "half-space and structure (hybrid)",
    "nodal": "at the nodes",
    "metro_bogie": "metro bogie",
}


@dataclass(frozen=True)
class Quantity:
    """Name of a key, its symbol, and the unit it is shown in: `factor` times the SI value."""

    name: str
    symbol: str
    unit: str
    factor: float

    @property
    def axis(self) -> str:
        """Title of an axis: name, symbol and unit."""
        name = f"{self.name} {self.symbol}".strip()
        unit = f"({self.unit})" if "/" in self.unit or " " in self.unit else self.unit
        return f"{name} / {unit}" if unit else name

    def text(self, value: Any) -> str:
        """A value in the unit of the quantity, in words where it is no number."""
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            return f"{number(self.factor * value)} {self.unit}".strip()
        if isinstance(value, (list, tuple)) and value and all(isinstance(v, (int, float)) for v in value):
            return f"{', '.join(number(self.factor * v) for v in value)} {self.unit}".strip()
        return words(value)

    def statement(self, value: Any) -> str:
        """Name and value, such as `normal load N = 60 kN`."""
        name = f"{self.name} {self.symbol}".strip()
        return f"{name} {'=' if isinstance(value, (int, float)) else ':'} {self.text(value)}".replace(" :", ":")


def number(value: float) -> str:
    """A number with up to six digits; a true minus sign."""
    return "none" if not math.isfinite(value) else f"{value:.6g}".replace("-", "−")


def plain(path: str) -> str:
    """The path without the numbers of list entries."""
    return ".".join(part for part in path.split(".") if not part.isdigit())


def quantity(path: str, units: str = "1", bodies: dict[str, str] | None = BODY_WORDS) -> Quantity:
    """The quantity of a key by its dotted path; `units` are those of the result file, for keys that are not listed.

    `bodies` are the names of both bodies, or None where the name of the body is not to be added.
    """
    parts = plain(path).split(".")
    place = ""
    if bodies and parts[0] == "bodies" and len(parts) > 2:
        place = f" of {parts[2]}" if parts[1] == "others" else f" of the {bodies.get(parts[1], parts[1])}"
    for begin in range(len(parts)):
        found = NAMES.get(".".join(parts[begin:]))
        if found:
            name, symbol, _, unit, factor = found
            return Quantity(name + place, symbol, unit, factor)
    kept = [p for p in parts if p not in ("bodies", "lower", "upper", "analyses", "contact", "mesh")] or parts
    name = " ".join(kept[-2:]).replace("_", " ")
    return Quantity(name + place, "", "" if units in ("1", "-") else units, 1.0)


def words(value: Any) -> str:
    """A value that is no number: a word of the job, or an object given as JSON."""
    if isinstance(value, str) and value[:1] in "{[":
        try:
            value = json.loads(value)
        except ValueError:
            return str(value)
    if isinstance(value, dict):
        if len(value) == 1:
            (kind, inner), *_ = value.items()
            said = words(inner)
            return f"{kind.replace('_', ' ')}: {said}" if said else kind.replace("_", " ")
        return ", ".join(f"{key.replace('_', ' ')} {member(key, inner)}" for key, inner in value.items())
    if isinstance(value, list):
        return ", ".join(f"({words(v)})" if isinstance(v, list) else words(v) for v in value)
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, (int, float)):
        return number(value)
    return WORDS.get(str(value), str(value)) if value is not None else ""


def member(key: str, value: Any) -> str:
    """A value of an object with the unit of its key, where that is listed by its own name."""
    if isinstance(value, (int, float)) and not isinstance(value, bool) and key in NAMES:
        return quantity(key).text(value)
    return words(value)


def leaves(given: Any, path: str) -> Iterator[tuple[str, Any]]:
    """Paths and values of an object; lists of numbers and words stay whole, null and empty ones are left out."""
    if isinstance(given, dict):
        for key, inner in given.items():
            yield from leaves(inner, f"{path}.{key}")
    elif isinstance(given, list) and any(isinstance(v, dict) for v in given):
        for k, inner in enumerate(given):
            yield from leaves(inner, f"{path}.{k + 1}")
    elif given is not None and given != []:
        yield path, given


def body_words(job: dict[str, Any]) -> dict[str, str]:
    """Names of both bodies: wheel and rail where one is a swept rail or they are placed, else lower and upper body."""
    bodies = job.get("bodies")
    made = dict(BODY_WORDS)
    if not isinstance(bodies, dict):
        return made
    kinds = {}
    for body in made:
        given = bodies.get(body)
        mesh = given.get("mesh") if isinstance(given, dict) else None
        kinds[body] = next(iter(mesh)) if isinstance(mesh, dict) and mesh else ""
    placed = isinstance(job.get("contact"), dict) and (job["contact"].get("placement") or job["contact"].get("from"))
    if placed or "extruded" in (kinds["lower"], kinds["upper"]):
        return {"lower": "rail", "upper": "wheel"}
    return made
