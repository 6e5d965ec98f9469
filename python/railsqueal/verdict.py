"""The verdict on a result in a sentence: what squeals and what would end it, or what is least damped.

The program writes it as `/verdict`. Files of earlier programs have none, and motions in time without a stability
analysis neither: for these `derived` finds it by the same rules.
"""

from dataclasses import dataclass, field

import numpy as np

from . import growth
from .labels import number, quantity
from .mode_names import ModeNames
from .result import Floats, Integers, Result, lookup
from .tables import BODIES, OSCILLATION, ComplexModes, Cycles, History, Modes, Sweep, growing

SQUEAL, RELAXATION, QUIET, NONE = "squeal", "relaxation", "quiet", "none"
# Other squealing frequencies that the sentence names.
OTHERS = 5
# Largest shift of the contact, m, loss factor, and relative change of friction that are proposed.
SHIFT, LOSS_FACTOR, FRICTION = 10e-3, 0.1, 0.5


@dataclass(frozen=True)
class Verdict:
    """One sentence, and further ones on sweeps and motions in time."""

    kind: str  # squeal, relaxation, quiet, or none where the result cannot tell
    sentence: str
    notes: list[str] = field(default_factory=list)


def verdict(result: Result) -> Verdict:
    """The verdict on a result: the one that the program wrote, else one from the tables."""
    if "verdict/sentence" not in result:
        return derived(result)
    kind, sentence = result.texts("verdict/kind")[0], result.texts("verdict/sentence")[0]
    return Verdict(kind, named_keys(result, sentence), [named_keys(result, n) for n in result.texts("verdict/notes")])


def named_keys(result: Result, text: str) -> str:
    """A sentence of the program with the names of the swept keys in place of the keys."""
    if not Sweep.present(result) or ", with " not in text:
        return text
    table = Sweep.from_result(result)
    places = range(len(table.status))
    # The longest first: values may begin alike.
    given = sorted(((key_values(result, table, k), k) for k in places), key=lambda item: -len(item[0]))
    for words, k in given:
        if words in text:
            return text.replace(words, point(result, table, k))
    return text


def key_values(result: Result, table: Sweep, place: int) -> str:
    """Keys and values of a point as the program writes them."""
    parts = []
    for key in table.keys:
        given, units = value(table, key, place), result.units(f"sweep/values/{key}")
        shown = number(given) if isinstance(given, float) else given
        unit = "" if units in ("1", "-") or not isinstance(given, float) else f" {units}"
        parts.append(f"{key} = {shown}{unit}")
    return ", ".join(parts)


def derived(result: Result) -> Verdict:
    """The verdict on a result from its tables, by its stability, else by its transient, else by its sweep."""
    notes = [text for text in (swept(result), loudest_cycle(result), left_out(result)) if text]
    if ComplexModes.present(result):
        kind, sentence = by_stability(result)
    elif History.present(result):
        kind, sentence = by_transient(result)
    elif Sweep.present(result):
        return Verdict(sweep_kind(result), notes[0], notes[1:])
    else:
        kind, sentence = NONE, computed(result)
    if kind != SQUEAL and Sweep.present(result) and sweep_kind(result) == SQUEAL:
        # The point of the job itself may be quiet where others of the sweep are not.
        return Verdict(SQUEAL, notes[0], [f"The point of the job itself: {sentence}", *notes[1:]])
    return Verdict(kind, sentence, notes)


def squealing(table: ComplexModes) -> Integers:
    """Places of the eigenvalues that grow and oscillate, the fastest growth first."""
    places = np.flatnonzero(table.grows & table.oscillates & table.distinct)
    return np.asarray(places[np.argsort(-table.growth_rate[places], kind="stable")])


def relaxing(table: ComplexModes) -> Integers:
    """Places of the eigenvalues that grow without oscillation, the fastest growth first."""
    places = np.flatnonzero(table.grows & ~table.oscillates & table.distinct)
    return np.asarray(places[np.argsort(-table.growth_rate[places], kind="stable")])


def by_stability(result: Result) -> tuple[str, str]:
    """Kind and sentence of an examination of stability."""
    table, names = ComplexModes.from_result(result), ModeNames.from_result(result)
    growing_modes, relaxation = squealing(table), relaxing(table)
    lowest = infinite_from(result)
    low = table.frequency[growing_modes] < lowest
    unstable = growing_modes[~low]
    ends = below(table, growing_modes[low], lowest)
    apart = ""
    if len(relaxation):
        count = "one eigenvalue grows" if len(relaxation) == 1 else f"{len(relaxation)} eigenvalues grow"
        fastest = f"{'at' if len(relaxation) == 1 else 'the fastest at'} {rate(table, int(relaxation[0]))}"
        apart = f"{count} without oscillation (stick–slip relaxation), {fastest}"
    if len(unstable):
        first = int(unstable[0])
        parts = [f"Squeals at {hertz(table.frequency[first])}: " + described(table, names, first)]
        if len(unstable) > 1:
            parts.append(f"also at {listed(table.frequency[unstable[1:]])}")
        heard = loudness(result, names)
        if heard:
            parts.append(heard)
        cure = cures(result, table, names, unstable)
        if cure:
            parts.append(cure)
        if apart:
            parts.append(f"apart from these, {apart}")
        if ends:
            parts.append(ends)
        return SQUEAL, "; ".join(parts) + "."
    limit = searched(result, table)
    damped = "; ".join(text for text in (ends, least_damped(table, names)) if text)
    if apart:
        return RELAXATION, f"No squealing mode found{limit}, but {apart}{'; ' + damped if damped else ''}."
    return QUIET, f"No squeal found{limit}{'; ' + damped if damped else ''}."


def infinite_from(result: Result) -> float:
    """Frequency below which growth depends on the ends of a rail of finite length, Hz; 0 without a rail."""
    paths = [f"modes/{body}/infinite_from" for body in BODIES.values()]
    return max((result.number(path) for path in paths if path in result), default=0.0)


def below(table: ComplexModes, low: Integers, lowest: float) -> str:
    """Growth of modes below the frequency `lowest`, Hz, in words; empty without such modes."""
    if not len(low):
        return ""
    return (
        f"growth at {listed(table.frequency[low])} ({rate(table, int(low[0]))}) depends on the ends of the rail, "
        f"which is one of infinite length from {hertz(lowest)} on"
    )


def listed(frequency: Floats) -> str:
    """Frequencies as `985, 358 and 344 Hz`, at most `OTHERS` of them."""
    words = [hertz(f).removesuffix(" Hz") for f in frequency[:OTHERS]]
    if len(frequency) > OTHERS:
        return f"{', '.join(words)} Hz and {len(frequency) - OTHERS} more frequencies"
    return f"{', '.join(words[:-1])} and {words[-1]} Hz" if len(words) > 1 else f"{words[0]} Hz"


def described(table: ComplexModes, names: ModeNames, place: int) -> str:
    """Name, growth rate and damping ratio of a mode."""
    name = names.dominant(table, place)
    said = f"growth rate {rate(table, place)} (damping ratio {percent(table.damping_ratio[place])})"
    return f"{name}, {said}" if name else said


def least_damped(table: ComplexModes, names: ModeNames) -> str:
    """The oscillating mode with the smallest damping ratio, in words."""
    places = np.flatnonzero(table.oscillates & table.distinct & ~table.grows & (table.frequency > 0.1))
    if not len(places):
        return ""
    place = int(places[np.argmin(table.damping_ratio[places])])
    name = names.dominant(table, place)
    named = f"{hertz(table.frequency[place])}{', ' + name if name else ''}"
    return f"least damped: {named}, damping ratio {percent(table.damping_ratio[place])}"


def searched(result: Result, table: ComplexModes) -> str:
    """Frequency up to which eigenvalues were looked for."""
    for path in (
        "analyses.stability.full.max_frequency",
        "analyses.stability.max_frequency",
        "analyses.modes.max_frequency",
    ):
        limit = lookup(result.job, path)
        if isinstance(limit, (int, float)) and limit > 0:
            return f" up to {limit / 1000:g} kHz"
    highest = float(table.frequency.max(initial=0.0))
    return f" up to {highest / 1000:.2g} kHz" if highest > 0 else ""


def rate(table: ComplexModes, place: int) -> str:
    """A growth rate to two digits."""
    return f"{rounded(table.growth_rate[place])} 1/s"


def rounded(value: float) -> str:
    """A number to two digits, the last one shown if it is 0, with a true minus sign."""
    text = f"{value:#.2g}" if 1e-4 <= abs(value) < 10 else f"{float(f'{value:.2g}'):g}"
    return text.rstrip(".").replace("-", "−")


def percent(ratio: float) -> str:
    """A damping ratio in per cent to two digits."""
    return f"{rounded(100 * ratio)} %"


def hertz(value: float) -> str:
    """A frequency without digits that do not matter."""
    return f"{value:.0f} Hz" if value >= 100 else f"{value:.3g} Hz"


def extra_loss_factor(table: ComplexModes, names: ModeNames, place: int) -> tuple[str, float] | None:
    """Body with most of a mode's energy, and the additional loss factor that its modes need: 2|ζ| over its share."""
    per_body: dict[str, float] = {}
    for body, _, share in names.shares(table, place):
        per_body[body] = per_body.get(body, 0.0) + share
    if not per_body:
        return None
    body = max(per_body, key=lambda b: per_body[b])
    return (body, -2 * float(table.damping_ratio[place]) / per_body[body]) if per_body[body] > 0.5 else None


def cures(result: Result, table: ComplexModes, names: ModeNames, unstable: Integers) -> str:
    """Changes that would each end all growth, by linear estimates: loss factor, shift of the contact, friction."""
    wanted = [extra_loss_factor(table, names, int(k)) for k in unstable]
    parts = []
    if all(wanted) and len({w[0] for w in wanted if w}) == 1:
        body, most = max((w for w in wanted if w), key=lambda w: w[1])
        if most <= LOSS_FACTOR:
            parts.append(f"with a loss factor of the {names.bodies[body]} that is higher by {rounded(most)}")
    shift = needed_shift(result, table, unstable)
    if shift:
        parts.append(shift)
    friction = needed_friction(result, table, unstable)
    if friction:
        parts.append(friction)
    return f"quiet {' or '.join(parts)} (linear estimate)" if parts else ""


def needed_shift(result: Result, table: ComplexModes, unstable: Integers) -> str:
    """Shift of the contact on the upper body that would end all growth; empty without one within `SHIFT`."""
    most = needed_change(result, table, unstable, "upper_position")
    if most is None or abs(most) > SHIFT:
        return ""
    return f"with the contact on the upper body {number(round(1e3 * most, 1))} mm further in y"


def needed_friction(result: Result, table: ComplexModes, unstable: Integers) -> str:
    """Friction that would end all growth; empty without one that is lower by at most `FRICTION` of it."""
    less = needed_change(result, table, unstable, "friction")
    if less is None or not -FRICTION <= less < 0:
        return ""
    given = lookup(result.job, "contact.friction")
    # The sensitivity is that to the friction of all contacts.
    alike = not (lookup(result.job, "contact.friction_zones") or lookup(result.job, "contact.around"))
    if alike and isinstance(given, (int, float)):
        return f"with friction below {rounded(given * (1 + less))}"
    return f"with friction lower by {rounded(-100 * less)} %"


def needed_change(result: Result, table: ComplexModes, unstable: Integers, name: str) -> float | None:
    """Change of a parameter that would end all growth; none where modes need changes of opposite signs."""
    path = f"stability/sensitivity/{name}"
    if path not in result:
        return None
    slope = result.complexes(path).real
    if any(int(k) >= len(slope) or not np.isfinite(slope[k]) or slope[k] == 0 for k in unstable):
        return None
    changes: Floats = np.array([-table.growth_rate[k] / slope[k] for k in unstable])
    return float(changes[np.argmax(np.abs(changes))]) if len(set(np.sign(changes))) == 1 else None


def loudness(result: Result, names: ModeNames) -> str:
    """Frequency and sound power of the motion in time, of the louder body; empty without sound power."""
    path = "transient/sound_power"
    levels = {
        b: result.number(f"{path}/{b}/total_level_a") for b in BODIES.values() if f"{path}/{b}/total_level_a" in result
    }
    if not levels:
        return ""
    body = max(levels, key=lambda b: levels[b])
    if not np.isfinite(levels[body]):
        return ""
    return f"about {levels[body]:.0f} dB(A) of sound power, most from the {names.bodies[body]}"


def by_transient(result: Result) -> tuple[str, str]:
    """Kind and sentence of a motion in time without an examination of stability."""
    history, names = History.from_result(result), ModeNames.from_result(result)
    moving = growth.signal(history)
    span = growth.period(moving)
    phase = growth.exponential(*growth.envelope(moving, 2 * span))
    if phase is None:
        return (
            NONE,
            f"The motion in time shows no exponential growth; its strongest periodic part is at {hertz(1 / span)}.",
        )
    heard = loudness(result, names)
    at = growth.frequency(moving, phase.begin, phase.end)
    sentence = (
        f"Squeals: the motion grows at {rounded(phase.rate)} 1/s at {hertz(at)} and is at {hertz(1 / span)} in the end"
    )
    return SQUEAL, f"{sentence}{'; ' + heard if heard else ''}."


def sweep_kind(result: Result) -> str:
    """Squeal where an eigenvalue of any point grows and oscillates, relaxation where one grows without oscillation."""
    table = Sweep.from_result(result)
    grows = growing(table.eigenvalue)
    oscillates = np.abs(table.eigenvalue.imag) > OSCILLATION * np.abs(table.eigenvalue)
    if (grows & oscillates).any():
        return SQUEAL
    return RELAXATION if grows.any() or (table.unstable > 0).any() else QUIET


def swept(result: Result) -> str:
    """Points of a sweep that squeal, and the one with the fastest growth; empty without a sweep."""
    if not Sweep.present(result):
        return ""
    table = Sweep.from_result(result)
    computed, failed = int((table.status == 0).sum()), int((table.status != 0).sum())
    missing = f"; {failed} {'point' if failed == 1 else 'points'} failed" if failed else ""
    unstable = int((table.unstable > 0).sum())
    if not unstable:
        return f"Sweep: no growth at any of {computed} points{missing}."
    growth_rate = np.where(table.unstable > 0, table.growth_rate, np.nan)
    place = int(np.nanargmax(growth_rate)) if np.isfinite(growth_rate).any() else -1
    said = f"Sweep: growth at {unstable} of {computed} points{missing}"
    if place < 0:
        return said + "."
    at = point(result, table, place)
    kind = (
        f"at {hertz(table.frequency[place])}"
        if table.frequency[place] > 1e-3
        else "without oscillation (stick–slip relaxation)"
    )
    return f"{said}; fastest {rounded(float(growth_rate[place]))} 1/s {kind}, with {at}."


def loudest_cycle(result: Result) -> str:
    """The loudest limit cycle of a sweep, by the sound power of its louder body; empty without sound power."""
    if not Cycles.present(result):
        return ""
    levels = Cycles.from_result(result).loudest()
    if levels is None or not np.isfinite(levels).any():
        return ""
    cycles, table = Cycles.from_result(result), Sweep.from_result(result)
    branch, place = np.unravel_index(int(np.argmax(np.where(np.isfinite(levels), levels, -np.inf))), levels.shape)
    level, frequency = levels[branch, place], hertz(float(cycles.frequency[branch, place]))
    at = point(result, table, int(place))
    return f"Limit cycles: the loudest has {level:.0f} dB(A) of sound power at {frequency}, with {at}."


def point(result: Result, table: Sweep, place: int) -> str:
    """Values of the swept keys at a point, by name."""
    units = {key: result.units(f"sweep/values/{key}") for key in table.keys}
    return ", ".join(quantity(key, units[key]).statement(value(table, key, place)) for key in table.keys)


def value(table: Sweep, key: str, place: int) -> float | str:
    """Value of a swept key at a point: a number or a word."""
    given = table.values[key]
    return float(given[place]) if given.dtype.kind == "f" else str(given[place])


def computed(result: Result) -> str:
    """Sentence on a result without stability analysis: what it has."""
    groups = {
        "curving/": "the vehicle in its curve",
        "modes/": "free modes",
        "receptance/": "receptances of the contact",
        "contact/pressure": "steady rolling",
        "creep_curve/": "a creep curve",
    }
    names = result.names()
    found = [words for begin, words in groups.items() if any(name.startswith(begin) for name in names)]
    said = " and ".join([", ".join(found[:-1]), found[-1]] if len(found) > 1 else found) or "nothing else"
    return f"No statement on squeal, as the job has no stability analysis; computed: {said}."


def left_out(result: Result) -> str:
    """Bodies without modes, which the verdict says nothing about."""
    if not ComplexModes.present(result) or not Modes.bodies(result):
        return ""
    names = ModeNames.from_result(result).bodies
    still = [names[b] for b in BODIES.values() if f"modes/{b}/frequency" not in result]
    return f"The {still[0]} has no modes in this result." if len(still) == 1 else ""
