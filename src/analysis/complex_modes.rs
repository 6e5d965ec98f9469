//! Complex modes as motions of the bodies: recovered from the reduced model or taken from the full one, their
//! energies, and the file that shows them over a period.

use super::{run::Run, RunOptions};
use crate::body::{Fields, FullSystem};
use crate::case::bodies::BuiltBodies;
use crate::case::display_modes::Pictures;
use crate::case::stability_problem::StabilityResult;
use crate::job;
use crate::model::CoupledModel;
use crate::output::{companion, BodyPart, FieldKind, FieldSpec, Sequence, SequenceFile, Table};
use crate::parallel::World;
use crate::stability::full::{FullPair, FullResult};
use crate::stability::grows;
use crate::stability::reduced::{reactions, Eigenpair};
use crate::Result;
use num_complex::Complex;

type C = Complex<f64>;

/// A complex mode of both bodies.
struct Shape {
    /// λ, 1/s.
    value: C,
    /// Its place in the list of eigenvalues, on rank 0.
    place: usize,
    /// This rank's degrees of freedom of the lower and the upper body, in lower form.
    motion: [Vec<C>; 2],
    /// Reactions of the closed nodes, N, `[3k]`, on every rank.
    forces: Vec<C>,
    /// Power of the damping of each body with this motion over |λ|²: uᴴ C u, N·s/m·m².
    damping: [f64; 2],
    /// Contribution of rotation to uᴴ K u of each body.
    stiffening: [f64; 2],
}

/// Energy of a complex mode.
struct Energy {
    /// Share of each body in kinetic and strain energy.
    body: [f64; 2],
    /// Share of each body, normal and tangential, in the squared motion of the closed nodes.
    contact: [[f64; 2]; 2],
    /// Growth rate from the damping of the lower and the upper body and from the contact forces, 1/s.
    growth: [f64; 3],
}

/// Collective: recovers and writes the selected complex modes. The `full` system is preferred where it is given.
pub(super) fn run(
    run: &mut Run,
    stability: &job::Stability,
    bodies: &BuiltBodies,
    reduced: Option<(&StabilityResult, &CoupledModel)>,
    full: Option<&FullResult>,
) -> Result<()> {
    let world = run.world();
    let shapes = match full {
        Some(full) => of_full(full, reduced, stability.shapes as usize),
        None => of_reduced(world, bodies, reduced, stability.shapes as usize)?,
    };
    if shapes.is_empty() {
        return Ok(());
    }
    let nodes: Vec<u64> =
        world.broadcast(reduced.map(|r| r.0.contact.nodes.iter().map(|n| n.node as u64).collect()).unwrap_or_default());
    let energies = shapes.iter().map(|s| energy(world, bodies, &nodes, s)).collect::<Result<Vec<_>>>()?;
    run.file.tables(tables(&shapes, &energies));
    let shown: Vec<(C, usize)> = shapes.iter().map(|s| (s.value, s.place)).collect();
    let at_nodes = |shape: usize, place: usize| {
        let body = fields(bodies, place)?;
        let part = |of: fn(&C) -> f64| {
            let u: Vec<f64> = shapes[shape].motion[place].iter().map(of).collect();
            body.at_nodes(&u).into_flattened()
        };
        Ok([part(|v| v.re), part(|v| v.im)])
    };
    let sequence = write(world, stability.phases as usize, &bodies.parts(), &shown, at_nodes, run.options)?;
    run.file.attach(sequence)
}

/// Number of eigenvalues, listed by falling growth rate with their backward errors, that are shown.
fn selected(pairs: impl Iterator<Item = (C, f64)>, least: usize) -> usize {
    let grown: Vec<bool> = pairs.map(|(value, error)| grows(value, error)).collect();
    grown.iter().filter(|g| **g).count().max(least).min(grown.len())
}

fn of_full(full: &FullResult, reduced: Option<(&StabilityResult, &CoupledModel)>, least: usize) -> Vec<Shape> {
    if least == 0 {
        return Vec::new();
    }
    let pairs = &full.spectrum.pairs;
    let before = reduced.map_or(0, |r| r.0.spectrum.eigenpairs.len());
    let count = selected(pairs.iter().map(|p| (p.value, p.residuals.backward_error)), least);
    let shape = |(i, p): (usize, &FullPair)| Shape {
        value: p.value,
        place: before + i,
        motion: p.motion.clone(),
        forces: p.forces.clone(),
        damping: p.damping,
        stiffening: p.stiffening,
    };
    pairs.iter().take(count).enumerate().map(shape).collect()
}

/// On rank 0: those of the reduced model that are shown, with their places in the list of eigenvalues.
fn chosen(found: Option<&StabilityResult>, least: usize) -> Vec<(usize, &Eigenpair)> {
    let Some(found) = found.filter(|_| least > 0) else { return Vec::new() };
    // Real eigenvalues do not oscillate: they have no period to be shown over.
    let all = found.spectrum.eigenpairs.iter().enumerate();
    let oscillating: Vec<(usize, &Eigenpair)> = all.filter(|(_, e)| e.value.im > 0.0).collect();
    let count = selected(oscillating.iter().map(|(_, e)| (e.value, e.backward_error)), least);
    oscillating.into_iter().take(count).collect()
}

/// Collective: writes the selected complex modes of bodies that are swept from a section, on the meshes that show their
/// modes: what the contact yields by itself is not seen there. False where there are such modes and no meshes.
pub(super) fn draw(
    run: &mut Run,
    stability: &job::Stability,
    bodies: &BuiltBodies,
    reduced: Option<(&StabilityResult, &CoupledModel)>,
) -> Result<bool> {
    let world = run.world();
    let pictures = Pictures::new(world, bodies, |_| true);
    let chosen = chosen(reduced.map(|r| r.0), stability.shapes as usize);
    let values = world.broadcast(chosen.iter().map(|(_, e)| e.value).collect::<Vec<C>>());
    if pictures.is_empty() || values.is_empty() {
        return Ok(values.is_empty());
    }
    let places = world.broadcast(chosen.iter().map(|(place, _)| *place as u64).collect::<Vec<u64>>());
    let shown: Vec<(C, usize)> = values.into_iter().zip(places.into_iter().map(|p| p as usize)).collect();
    let at_nodes = |shape: usize, picture: usize| {
        Ok(chosen.get(shape).map_or([Vec::new(), Vec::new()], |(_, pair)| pictures.moved(picture, &pair.modal)))
    };
    let text =
        "Place in the list of eigenvalues, from 0, of each complex mode that is written as a motion of the bodies.";
    let list: Vec<i64> = shown.iter().map(|s| s.1 as i64).collect();
    run.file.tables([Table::list("/stability/shape", "1", text, list)]);
    let sequence = write(world, stability.phases as usize, &pictures.parts(), &shown, at_nodes, run.options)?;
    run.file.attach(sequence)?;
    Ok(true)
}

/// Motion from the modal amplitudes and, statically, the residual compliance under the reactions: u = Φq + (I − ΦΦᵀM)
/// K⁻¹BᵀR.
fn of_reduced(
    world: &World,
    bodies: &BuiltBodies,
    reduced: Option<(&StabilityResult, &CoupledModel)>,
    least: usize,
) -> Result<Vec<Shape>> {
    let chosen = chosen(reduced.map(|r| r.0), least);
    let count = world.broadcast(vec![chosen.len() as u64])[0] as usize;
    let mut shapes = Vec::new();
    for i in 0..count {
        let on_root = world.on_root(|| {
            let (Some((found, model)), Some(pair)) = (reduced, chosen.get(i)) else {
                return Err(crate::Error::Defect("complex modes: no reduced model on rank 0".into()));
            };
            let (place, pair) = *pair;
            Ok((reactions(model, &found.contact, pair)?, pair, place, model, &found.contact))
        })?;
        let forces = world.broadcast(on_root.as_ref().map(|r| r.0.clone()).unwrap_or_default());
        let modal = world.broadcast(on_root.as_ref().map(|r| r.1.modal.clone()).unwrap_or_default());
        let value = world.broadcast(on_root.as_ref().map(|r| vec![r.1.value]).unwrap_or_default())[0];
        let mut motion = [Vec::new(), Vec::new()];
        let (mut damping, mut stiffening) = ([0.0; 2], [0.0; 2]);
        let mut first = 0;
        for place in 0..2 {
            let index = bodies.places[place].body;
            let phi = &bodies.shapes_of(index)?.vectors;
            // Reactions on all contact rows of this body in its lower form.
            let part = |of: fn(&C) -> f64| -> Vec<f64> {
                let Some((forces, _, _, model, contact)) = &on_root else { return Vec::new() };
                let mut all = vec![0.0; model.modes.nrows()];
                for (j, f) in forces.iter().enumerate() {
                    all[3 * contact.nodes[j / 3].node + j % 3] = of(f);
                }
                bodies.places[place].side.orient(&all)
            };
            let parts = [part(|f| f.re), part(|f| f.im)];
            let u = recovered(world, bodies, index, &modal[first..first + phi.len()], &parts)?;
            if let Some((_, _, _, model, _)) = &on_root {
                // Bodies do not couple: with the amplitudes of one alone the form is that of its own damping.
                let span = first..first + phi.len();
                let own: Vec<C> =
                    modal.iter().enumerate().map(|(k, q)| if span.contains(&k) { *q } else { C::default() }).collect();
                damping[place] = model.damping.form(&own);
                // The symmetric part of a stiffness keeps energy, the skew one does work.
                let elastic: C = own.iter().zip(model.stiffness.times(&own)).map(|(q, k)| q.conj() * k).sum();
                stiffening[place] =
                    elastic.re - own.iter().zip(&model.omega).map(|(q, w)| q.norm_sqr() * w * w).sum::<f64>();
                damping[place] += value.im * elastic.im / value.norm_sqr();
            }
            first += phi.len();
            motion[place] = u;
        }
        shapes.push(Shape { value, place: on_root.map_or(0, |r| r.2), motion, forces, damping, stiffening });
    }
    Ok(shapes)
}

/// Collective: the motion of the body with this index in [`BuiltBodies::unique`] from its modal amplitudes, `[m]` on
/// every rank, and the real and the imaginary part of the forces on its contact rows in lower form, N, `[3n]` on rank
/// 0.
pub(super) fn recovered(
    world: &World,
    bodies: &BuiltBodies,
    index: usize,
    modal: &[C],
    forces: &[Vec<f64>; 2],
) -> Result<Vec<C>> {
    let (body, phi) = (bodies.fields(index)?, &bodies.shapes_of(index)?.vectors);
    let [re, im] = [body.statics(&forces[0], 1)?, body.statics(&forces[1], 1)?];
    let mut u: Vec<C> = re.into_iter().zip(im).map(|(re, im)| C::new(re, im)).collect();
    let mut mu = vec![C::default(); u.len()];
    bodies.full_systems()?[index].mass().operator(world).apply(world, &u, &mut mu);
    let products: Vec<C> = phi.iter().map(|p| p.iter().zip(&mu).map(|(p, m)| p * m).sum()).collect();
    let products = world.sum_all(&products);
    for ((p, statics), q) in phi.iter().zip(products).zip(modal) {
        let amplitude = q - statics;
        u.iter_mut().zip(p).for_each(|(u, p)| *u += amplitude * p);
    }
    Ok(u)
}

/// The motions of the body in a place.
fn fields<'a>(bodies: &'a BuiltBodies, place: usize) -> Result<&'a dyn Fields> {
    bodies.fields(bodies.places[place].body)
}

/// Collective: uᴴ M u and uᴴ K u.
fn forms(world: &World, body: &dyn FullSystem, u: &[C]) -> (f64, f64) {
    let product = |matrix: &crate::petsc::csr::DistCsr| {
        let mut au = vec![C::default(); u.len()];
        matrix.operator(world).apply(world, u, &mut au);
        world.sum(u.iter().zip(&au).map(|(u, a)| (u.conj() * a).re).sum())
    };
    (product(body.mass()), product(body.stiffness()))
}

/// Collective. Multiplying the equation of motion with conj(λ) uᴴ gives, exactly,
/// σ Σ (|λ|² uᴴMu + uᴴKu) = Re(conj(λ) yᴴR) − |λ|² Σ uᴴCu: what the growth rate is made of. Where a body rotates, K
/// has the stiffness that this adds, and C the work of the damping on what only turns.
fn energy(world: &World, bodies: &BuiltBodies, nodes: &[u64], shape: &Shape) -> Result<Energy> {
    let square = shape.value.norm_sqr();
    let mut sizes = [0.0; 2];
    let mut contact = [[0.0; 2]; 2];
    let mut work = C::default();
    let systems = bodies.full_systems()?;
    for place in 0..2 {
        let body = systems[bodies.places[place].body];
        let (m, k) = forms(world, body, &shape.motion[place]);
        sizes[place] = square * m + k + shape.stiffening[place];
        let u = body.trace().everywhere(world, &shape.motion[place]);
        for (i, &node) in nodes.iter().enumerate() {
            for c in 0..3 {
                let turned = bodies.places[place].side.sign(c);
                let v = u[3 * node as usize + c];
                contact[place][usize::from(c < 2)] += v.norm_sqr();
                work += turned * v.conj() * shape.forces[3 * i + c];
            }
        }
    }
    let total: f64 = sizes.iter().sum();
    let moved: f64 = contact.as_flattened().iter().sum();
    Ok(Energy {
        body: sizes.map(|s| s / total),
        contact: contact.map(|b| b.map(|v| v / moved)),
        growth: [
            -square * shape.damping[0] / total,
            -square * shape.damping[1] / total,
            (shape.value.conj() * work).re / total,
        ],
    })
}

fn tables(shapes: &[Shape], energies: &[Energy]) -> Vec<Table> {
    let n = shapes.len();
    let flat = |of: &dyn Fn(&Energy) -> Vec<f64>| energies.iter().flat_map(of).collect::<Vec<f64>>();
    vec![
        Table::list(
            "/stability/shape",
            "1",
            "Place in the list of eigenvalues, from 0, of each complex mode that is written as a motion of the bodies.",
            shapes.iter().map(|s| s.place as i64).collect::<Vec<_>>(),
        ),
        Table::new(
            "/stability/body_energy",
            "1",
            "Share of the lower and of the upper body in the kinetic and strain energy of each complex mode.",
            &[n, 2],
            flat(&|e| e.body.to_vec()),
        ),
        Table::new(
            "/stability/contact_motion",
            "1",
            "Share of the lower and of the upper body, normal and tangential, in the squared motion of the \
             closed nodes.",
            &[n, 2, 2],
            flat(&|e| e.contact.as_flattened().to_vec()),
        ),
        Table::new(
            "/stability/growth_parts",
            "1/s",
            "Parts of the growth rate: damping of the lower body, of the upper body, work of the contact \
             forces.",
            &[n, 3],
            flat(&|e| e.growth.to_vec()),
        ),
    ]
}

/// Collective: the file with every mode over its period, without growth. At the first phase the largest displacement
/// is real, a quarter period on minus the imaginary part is shown. `shapes` are the eigenvalues, 1/s, with their
/// places in the list; `at_nodes(shape, part)`, collective, gives real and imaginary parts of one at this rank's
/// local nodes of a part.
fn write<'w>(
    world: &'w World,
    phases: usize,
    parts: &[BodyPart],
    shapes: &[(C, usize)],
    at_nodes: impl Fn(usize, usize) -> Result<[Vec<f64>; 2]>,
    options: &RunOptions,
) -> Result<SequenceFile<'w>> {
    let steps = shapes.len() * phases;
    let times: Vec<f64> = (0..steps).map(|i| i as f64 / phases as f64).collect();
    let of_step = |of: &dyn Fn(&(C, usize)) -> f64| (0..steps).map(|i| of(&shapes[i / phases])).collect::<Vec<f64>>();
    let tables = [
        Table::list(
            "/modes/frequency",
            "Hz",
            "Frequency of the mode of each step.",
            of_step(&|s| s.0.im / (2.0 * std::f64::consts::PI)),
        ),
        Table::list("/modes/growth_rate", "1/s", "Growth rate of the mode of each step.", of_step(&|s| s.0.re)),
        Table::list(
            "/modes/eigenvalue",
            "1",
            "Place of the mode of each step in /stability/eigenvalue of the main file, from 0.",
            (0..steps).map(|i| shapes[i / phases].1 as i64).collect::<Vec<_>>(),
        ),
        Table::list(
            "/modes/phase",
            "1",
            "Time of each step as a part of the period.",
            (0..steps).map(|i| (i % phases) as f64 / phases as f64).collect::<Vec<_>>(),
        ),
    ];
    let text = "Motion of a complex mode at one moment of its period, growth left out; the largest displacement \
     of the mode is 1.";
    let spec = FieldSpec::new("motion", "1", text, FieldKind::Vector);
    let description = "Periods shown so far: mode k of the file, from 0, takes k to k + 1.";
    let sequence = Sequence {
        fields: vec![spec],
        values: &times,
        units: "1",
        description,
        tables: &tables,
        summed: false,
        single: true,
    };
    let path = companion(&options.output, "modes.vtkhdf");
    let mut file = SequenceFile::create(world, &path, options.force || options.resume, parts, sequence)?;
    for number in 0..shapes.len() {
        let at_nodes = (0..parts.len()).map(|part| at_nodes(number, part)).collect::<Result<Vec<_>>>()?;
        let unit = unit(world, parts, &at_nodes);
        for phase in 0..phases {
            let turn = unit * C::from_polar(1.0, 2.0 * std::f64::consts::PI * phase as f64 / phases as f64);
            let real = |[re, im]: &[Vec<f64>; 2]| -> Vec<f64> {
                re.iter().zip(im).map(|(re, im)| (C::new(*re, *im) * turn).re).collect()
            };
            let moved: Vec<Vec<f64>> = at_nodes.iter().map(real).collect();
            file.step(number * phases + phase, &[moved.iter().map(Vec::as_slice).collect()])?;
        }
    }
    Ok(file)
}

/// The factor that makes the largest component of a motion 1, the same on all ranks and in every run: of components
/// that are equal up to rounding, as those of a mode of a symmetric body are, the one at the last place.
fn unit(world: &World, parts: &[BodyPart], at_nodes: &[[Vec<f64>; 2]]) -> C {
    let components = || at_nodes.iter().flat_map(|[re, im]| re.iter().zip(im).map(|(re, im)| C::new(*re, *im)));
    let largest = world.max(components().map(|v| v.norm()).fold(0.0, f64::max));
    if !(largest > 0.0) {
        return C::default();
    }
    let places = parts.iter().enumerate().flat_map(|(number, part)| {
        let nodes = part.part.coords.iter();
        nodes.flat_map(move |x| [0, 1, 2].map(|c| [number as f64, x[0], x[1], x[2], f64::from(c)]))
    });
    let nothing = [f64::NEG_INFINITY; PLACE + 2];
    let own =
        last(components().zip(places), largest).map_or(nothing, |(v, [a, b, c, d, e])| [a, b, c, d, e, v.re, v.im]);
    let everywhere = world.all_gather(&own);
    let found = everywhere.chunks_exact(PLACE + 2).max_by(|a, b| before(&a[..PLACE], &b[..PLACE]));
    found.map_or(C::default(), |f| 1.0 / C::new(f[PLACE], f[PLACE + 1]))
}

/// Numbers that say where a component is: part, coordinates, direction.
const PLACE: usize = 5;
/// Components are equal where they differ by less than this part of the largest.
const ALIKE: f64 = 1e-6;

/// The component at the last place of those that are as large as the `largest`.
fn last(components: impl Iterator<Item = (C, [f64; PLACE])>, largest: f64) -> Option<(C, [f64; PLACE])> {
    components.filter(|(v, _)| v.norm() >= (1.0 - ALIKE) * largest).max_by(|a, b| before(&a.1, &b.1))
}

/// Order of places, by the first number that differs.
fn before(a: &[f64], b: &[f64]) -> std::cmp::Ordering {
    let differing = a.iter().zip(b).map(|(a, b)| a.total_cmp(b)).find(|o| o.is_ne());
    differing.unwrap_or(std::cmp::Ordering::Equal)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Differences of the order of rounding do not decide; smaller components do not count.
    #[test]
    fn of_equal_components_the_last_place_counts() {
        let at = |x: f64, direction: f64| [0.0, x, 0.0, 0.0, direction];
        let of = |re: f64, im: f64| C::new(re, im);
        for wobble in [-1e-12, 0.0, 1e-12] {
            let all = [
                (of(0.6 + wobble, 0.8), at(-1.0, 2.0)),
                (of(-0.6, -0.8 - wobble), at(1.0, 0.0)),
                (of(-0.6, -0.8), at(1.0, -1.0)),
                (of(0.99, 0.0), at(2.0, 0.0)),
            ];
            let largest = all.iter().map(|(v, _)| v.norm()).fold(0.0, f64::max);
            let (v, place) = last(all.into_iter(), largest).unwrap();
            assert_eq!((v.re, place), (-0.6, at(1.0, 0.0)));
        }
        assert!(last([(C::default(), at(0.0, 0.0))].into_iter(), 1.0).is_none());
    }
}
