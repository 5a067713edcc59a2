"""Fig. 3 of Keskekler et al. (arXiv:2304.01419): linear and nonlinear responses of the drum.

The drum is driven as in the paper, F_r = J_r (beta + gamma q_r) cos(omega t), with the modal forces
J_r of a laser spot off its centre and one ladder of levels for beta and gamma together.  The mode r
doubles its period around omega = 2 omega_r where gamma exceeds 2 k_r/(Q |J_r|).

Two variants stand side by side.  The clamped plate with E = 410 GPa has the paper's linear spectrum
(11 modes from 20 to 90 MHz, f21, f02, f03 being modes 4, 6, 15).  Its doubled branch of f01 meets
f21 only near 3.4 f01.  With bending switched off the spectrum is a membrane's, and the meeting lies
near 2.5 f01, where the paper has it.  No parameter is tuned to the paper's nonlinear figure:
position and size of the spot and the levels are round numbers.  demos/dependence.py changes them.

    python demos/fig3.py [DIRECTORY]     leaves linear.png, nonlinear.png, and for each variant
                                         rom.h5 and response.h5 (also of the set with f03)
"""

import sys
from math import tau
from pathlib import Path

import phenomena as ph

import nanorom
from nanorom.files.whole import make_directory
from nanorom.plots import comparison_figure, linear_figure
from nanorom.rom.patterns import aimed

VARIANTS = {"plate": "clamped plate, E = 410 GPa", "membrane": "bending switched off"}
MODES = 18  # reduced, to have f03 in both; the first 11 respond
SPOT = {"direct_pattern": "spot", "position": ["1.0 um", "0.6 um"], "radius": "1.0 um"}
LADDER = (1.2, 1.6, 2.0, 2.4, 2.8)  # gamma by the threshold of f01
F03_STEP = 1.6  # the step of the ladder that is repeated with f03
BETA = 60.0  # Pa at the centre of the spot, per step of the ladder
LINEAR = 0.1  # Pa at the centre of the spot, for the linear response
RANGE = ("0.95 f1", "4.25 f1")  # of the plate: 20 to 90 MHz
TOLERANCE = 1e-7  # of the orbits: the picture shows less
HELD_BACK = 0.95  # of where f01 alone would go
SURGE_STEP = 0.2  # levels between which the surge is found
PAPER = {  # what the paper says, row by row
    "modes in 20 to 90 MHz": "11",
    "numbers of f21, f02, f03": "4, 6, 15",
    "PD at 2 f01 opens": "seen",
    "PD at 2 f11 opens": "seen",
    "f01 at half drive meets f21": f"near {ph.PAPER_NS}",
    "held back (locked) at": "near f21",
    "nm of f01 per level": "falls near f21",
    "barrier breaks at level": "seen",
    "peak then": f"{ph.PAPER_PEAK}",
    "NS point": f"{ph.PAPER_NS}",
    "most excited beside f01": "modes 4, 6, 15",
}


def reduced(variant, count=MODES):
    """The drum of demos/drum.toml with or without bending under the spot; its lowest modes."""
    scene = nanorom.Scene.from_file(Path(__file__).with_name("drum.toml"))
    thickness = scene.plate.thickness
    plate = nanorom.Plate(thickness=thickness, model="auto" if variant == "plate" else variant)
    spot = nanorom.Drive(1.0, **SPOT)
    return nanorom.reduce(scene.with_(plate=plate, modes=count, drive=spot))


def levels(model, ladder):
    """The drive of a ladder."""
    gamma = ph.threshold(model, nanorom.Drive(1.0, **SPOT))[0]
    return nanorom.Drive(
        [BETA * step for step in ladder],
        [gamma * step for step in ladder],
        parametric_pattern="paper",
        **SPOT,
    )


def main(directory="results/fig3", ladder=LADDER, sweep=RANGE, variants=tuple(VARIANTS), f03=True):
    """Compute the variants, print where each has what the paper names; return the responses."""
    directory = Path(directory)
    models, fulls, responses, forces, columns = {}, {}, {}, {}, {}
    for variant in variants:
        title = VARIANTS[variant]
        folder = make_directory(directory / variant)
        fulls[title] = full = reduced(variant)
        models[title] = model = full.select(full.label[:11])
        model.save(folder / "rom.h5")
        describe(title, full, levels(full, ladder))
        range_ = nanorom.Sweep(*sweep, tolerance=TOLERANCE)
        response = nanorom.respond(model, levels(model, ladder), range_)
        response.save(folder / "response.h5")
        responses[title] = response
        forces[title] = LINEAR * aimed(full, levels(full, ladder)).drive["spot"]
        print_ladder(model, ladder, response)
        columns[title] = column(full, model, ladder, response)
        if f03:
            with_f03(full, folder, F03_STEP)
    print_table(columns)
    position = (1.0e-6, 0.6e-6)
    limits = {t: (0.75 * m.frequency[0], 1.03 * m.frequency[11]) for t, m in fulls.items()}
    linear_figure(fulls, forces, limits, position, directory / "linear.png")
    names = [f"γ = {step:g} γ₁" for step in ladder]
    resonances = {title: names_of_resonances(model) for title, model in models.items()}
    comparison_figure(responses, names, resonances, directory / "nonlinear.png")
    print(f"\npictures in {directory}: linear.png, nonlinear.png")
    return responses


def names_of_resonances(model):
    """Names and places by f01 of direct and principal parametric resonances."""
    shown = [r for r, label in enumerate(model.label) if label[1:3] in ("01", "11", "21", "02")]
    ratio = dict(zip(model.label, model.frequency / model.frequency[0]))
    twice = {f"2 {label}": 2 * ratio[label] for label in ("f01", "f11s", "f11c")}
    return {model.label[r]: ratio[model.label[r]] for r in shown} | twice


def describe(title, model, drive):
    """Print every parameter."""
    print(f"\n=== {title}")
    print("R = 2.5 um, h = 10 nm, E = 410 GPa, nu = 0.16, rho = 2267 kg/m^3,")
    print("T_x = 0.321, T_y = 0.257 N/m, Q = 180; spot of 1/e^2 radius 1 um at (1.0, 0.6) um")
    beta, gamma = drive.direct, drive.parametric
    print("beta  (Pa):  ", "  ".join(f"{b:9.1f}" for b in beta))
    print("gamma (Pa/m):", "  ".join(f"{g:9.2e}" for g in gamma))
    force = aimed(model, drive).drive["spot"]
    limit = ph.threshold(model, drive)
    print("number  mode   f (MHz)   f/f01  J_r (um^2)  J_r/J_01  threshold of gamma by that of f01")
    for r in range(model.size):
        row = f"{model.number[r]:6}  {model.label[r]:5} {model.frequency[r] / 1e6:8.4f}"
        row += f" {model.frequency[r] / model.frequency[0]:7.4f} {1e12 * force[r]:11.4f}"
        print(f"{row} {force[r] / force[0]:9.3f} {limit[r] / limit[0]:8.2f}")


def print_ladder(model, ladder, response):
    """How far the doubled branch of f01 goes, level by level."""
    print("\nlevel (gamma by threshold of f01); frequencies by f01")
    print("level  stable from 2 f01 to   highest stable   f01 alone   f01 (nm)   per level (nm)")
    for step, diagram in zip(ladder, response.diagrams):
        found = ph.reach(diagram, model)
        if found is not None:
            amplitude = 1e9 * found.amplitude
            print(
                f"{step:5.2f} {found.first:14.3f} ({found.lost:2}) {found.peak:16.3f}"
                f" {ph.alone(step):11.3f} {amplitude:10.2f} {amplitude / step:13.2f}"
            )


def column(full, model, ladder, response):
    """This variant's entries of the table."""
    drive = levels(model, [1.0])
    limit = ph.threshold(model, drive) / ph.threshold(model, drive)[0]
    opened = {label: ph.opening(model, drive, label) for label in ("f01", "f11s", "f11c")}
    inside = (full.frequency > 20e6) & (full.frequency < 90e6)
    number = dict(zip(full.label, full.number))
    found = [(step, ph.reach(diagram, model)) for step, diagram in zip(ladder, response.diagrams)]
    found = [(step, reach) for step, reach in found if reach is not None]
    broken, surge = surge_level(model, found)
    torus = [(reach.torus, step) for step, reach in found if reach.torus == reach.torus]
    near = min(torus, key=lambda entry: abs(entry[0] - ph.PAPER_NS), default=None)
    resonance = [ph.internal_resonance(model, label) for label in ("f21c", "f21s")]
    f11 = [f"{opened[m][0] * limit[model.label.index(m)]:.4f} ({m})" for m in ("f11c", "f11s")]
    locked = [reach.first for step, reach in found if reach.first < HELD_BACK * ph.alone(step)]
    responsivity = [f"{1e9 * reach.amplitude / step:.0f}" for step, reach in found]
    text = {
        "modes in 20 to 90 MHz": f"{inside.sum()}{'+' if inside[-1] else ''}",
        "numbers of f21, f02, f03": ", ".join(f"{number[m]}" for m in ("f21c", "f02", "f03")),
        "PD at 2 f01 opens": f"at level {opened['f01'][0]:.5f}, {2 * opened['f01'][1]:.4f} f01",
        "PD at 2 f11 opens": f"at levels {' and '.join(f11)}",
        "f01 at half drive meets f21": " and ".join(beside(w, ph.PAPER_NS) for w in resonance),
        "held back (locked) at": f"{min(locked):.3f} to {max(locked):.3f}" if locked else "nowhere",
        "nm of f01 per level": ", ".join(responsivity),
        "barrier breaks at level": f"{broken:.2f}" if surge else f"above {ladder[-1]:g}",
        "peak then": f"{beside(surge.peak, ph.PAPER_PEAK)}, then rising to "
        f"{beside(found[-1][1].peak, ph.PAPER_PEAK)} at level {found[-1][0]:g}"
        if surge
        else beside(max(reach.peak for _, reach in found), ph.PAPER_PEAK),
        "NS point": f"{beside(near[0], ph.PAPER_NS)} at level {near[1]:g}" if near else "none",
    }
    points = [ph.nearest_torus(diagram, model) for diagram in response.diagrams]
    points = [point for point in points if point is not None]
    if points:
        best = min(points, key=lambda p: abs(p.omega / tau / full.frequency[0] - ph.PAPER_NS))
        text["most excited beside f01"] = ph.most_excited(model, best.orbit, 5)
    return text


def beside(value, paper):
    """A value and its difference from the paper's."""
    return f"{value:.3f} ({value / paper - 1:+.1%})"


def surge_level(model, found):
    """(level, Reach) of the first surge, between steps of the ladder by bisection; (nan, None)."""
    surged = [place for place, (_, reach) in enumerate(found) if reach.surged]
    if not surged:
        return float("nan"), None
    high, reach = found[surged[0]]
    low = found[surged[0] - 1][0] if surged[0] else high
    while high - low > 1.001 * SURGE_STEP:
        middle = round(0.5 * (low + high), 10)
        sweep = nanorom.Sweep("1.95 f1", "2.05 f1", tolerance=TOLERANCE)
        response = nanorom.respond(model, levels(model, [middle]), sweep)
        tried = ph.reach(response.diagrams[0], model)
        if tried is not None and tried.surged:
            high, reach = middle, tried
        else:
            low = middle
    return high, reach


def print_table(columns):
    """The phenomena that the paper names, the paper's values beside those of each variant."""
    print("\nfrequencies by f01, levels by the threshold of f01")
    for row, paper in PAPER.items():
        print(f"\n{row}\n    {'paper':28} {paper}")
        for title, entries in columns.items():
            print(f"    {title:28} {entries.get(row, '-')}")
    print("\nin brackets: by the paper's; what they depend on: demos/dependence.py")


def with_f03(full, folder, step):
    """The doubled branch of f01 at one level once more, with f03 among the modes."""
    number = full.number[full.label.index("f03")]
    model = full.select([*full.label[:11], "f03"])
    model.save(folder / "rom-f03.h5")
    sweep = nanorom.Sweep("1.95 f1", "2.05 f1", tolerance=TOLERANCE)
    response = nanorom.respond(model, levels(model, [step]), sweep)
    response.save(folder / "response-f03.h5")
    print(f"\nwith f03 (mode {number}) as twelfth mode:", end="")
    print_ladder(model, [step], response)
    torus = ph.nearest_torus(response.diagrams[0], model)
    if torus is not None:
        ratio = torus.omega / tau / model.frequency[0]
        print(f"NS point at {ratio:.4f} f01, modes there: {ph.most_excited(model, torus.orbit, 6)}")


if __name__ == "__main__":
    main(*sys.argv[1:2])
