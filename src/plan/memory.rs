//! How much memory a job needs.

use super::BodySize;
use crate::body::Convolution;
use crate::eigen::quadratic::BLOCK;
use crate::job::{
    self, contact_radius, Compliance, EigenSolver, Job, LinearSolver, Modes, ModesExtent, TransientModel,
};

// Memory model. Nested dissection of a three-dimensional mesh fills of the order n^(4/3) entries (A. George, SIAM J.
// Numer. Anal. 10, 1973). The constants are from runs of graded cylinders of 128 to 226 thousand degrees of freedom
// on 1 and 2 ranks, whose largest resident sets the estimates exceed by 10 to 14 %.

/// Memory of a real Cholesky factorisation with MUMPS, byte per n^(4/3): 111 to 126 on one rank.
const FACTOR: f64 = 125.0;
/// Additional memory of a factorisation on many ranks over that on one, as a share; half of it on two.
const FACTOR_SPREAD: f64 = 0.2;
/// Memory that stays in use of a factorisation whose factors go to the disk, as a share of what it takes otherwise: the
/// fronts that are not yet eliminated, and buffers. On one rank 0.11 to 0.14 for flat rings of 190 to 960 thousand
/// degrees of freedom, 0.28 for thick ones of 140 to 340 thousand.
const OUT_OF_CORE: f64 = 0.3;
/// And so much more on many ranks, half of it on two: 0.44 to 0.48 for the thick rings.
const OUT_OF_CORE_SPREAD: f64 = 0.4;
/// Bytes of an entry of a distributed matrix: value and column.
const ENTRY: f64 = 16.0;
/// Half of stiffness and mass, the triangle of the stiffness that MUMPS is given, and what it keeps of that: byte per
/// entry of the stiffness (6 + 2 + 8 + 6).
const MATRICES: f64 = 22.0;
/// More modes than this are found in slices.
const SLICED: f64 = crate::eigen::sparse::SLICED as f64;
/// Memory of steady rolling per a contact node beside the compliance where that is a convolution, byte: from runs of 12
/// 100 and 23 409 nodes.
const SOLVER: f64 = 5000.0;
/// Program, MPI and libraries, per rank.
const BASE: f64 = 120e6;

/// Consumers of memory at the peak, byte.
pub(super) struct Estimate {
    /// Summed over the ranks.
    pub shared: Vec<(&'static str, f64)>,
    /// On rank 0 alone.
    pub on_root: Vec<(&'static str, f64)>,
    /// Bytes on the disk, of all ranks.
    pub on_disk: f64,
}

/// The estimate of `job` for bodies of the given sizes, `alike` if one stands for both; `swept` if there are points
/// of a sweep to solve.
pub(super) fn estimate(job: &Job, bodies: &[BodySize], alike: bool, ranks: usize, swept: bool) -> Estimate {
    let unique = if alike { &bodies[..1] } else { bodies };
    let half_space = job.contact.as_ref().is_some_and(|c| c.compliance == Compliance::HalfSpace);
    let elements = job.analyses.modes.is_some() || !half_space;
    let direct = job.solver.linear == LinearSolver::Mumps || job.analyses.modes.is_some();

    let mut shared = vec![("program and libraries", BASE * ranks as f64)];
    let mut on_root = vec![("meshes before distribution", bodies.iter().map(mesh_bytes).sum())];
    if elements {
        shared.push(("distributed meshes", unique.iter().map(mesh_bytes).sum()));
        let matrices = |b: &BodySize| b.dofs as f64 * 3.0 * b.neighbours * MATRICES;
        shared.push(("stiffness and mass matrices", unique.iter().map(matrices).sum()));
        // Entries of a row for each neighbour: motions along the normal apart from those across couple all components.
        let absorbs = |name: &str| -> f64 {
            let found = job.bodies().into_iter().find(|(n, _)| job.bodies.name_of(n) == name);
            let ends = found.map_or(&[][..], |(_, b)| &b.supports[..]).iter().filter_map(|s| s.absorbing);
            ends.map(|a| if a.longitudinal.unwrap_or(0.0) > 0.0 { 3.0 } else { 1.0 }).fold(0.0, f64::max)
        };
        let damping: f64 = unique.iter().map(|b| absorbs(&b.name) * b.dofs as f64 * b.neighbours * ENTRY).sum();
        if damping > 0.0 {
            shared.push(("damping matrices", damping));
        }
        let spread = 1.0 + FACTOR_SPREAD * (1.0 - 1.0 / ranks as f64);
        let solver = |b: &BodySize| match direct {
            true => FACTOR * spread * (b.dofs as f64).powf(4.0 / 3.0),
            // Complex hierarchy of multigrid and vectors of the iteration, from a run of 1.08 million degrees of
            // freedom on two ranks (8.7 GB in all).
            false => 4.0 * b.dofs as f64 * 3.0 * b.neighbours * ENTRY,
        };
        shared.push((if direct { "factorisation" } else { "multigrid" }, unique.iter().map(solver).sum()));
        if full_transient(job) {
            // Bodies of one stiffness that are damped alike share the factor of their steps as well; it stays in
            // memory, whatever is on the disk.
            let damped: Vec<_> = job.bodies().into_iter().map(|(_, b)| (b.damping.alpha, b.damping.beta)).collect();
            let apart = if damped.windows(2).all(|d| d[0] == d[1]) { unique } else { bodies };
            shared.push(("factorisation of the steps", apart.iter().map(solver).sum()));
        }
    }
    if let Some(modes) = &job.analyses.modes {
        let count = mode_count(modes);
        // SLEPc's basis is complex; that of the block method is shorter where there are so many modes that they are
        // found in slices, each with a factorisation beside the first.
        let columns = match job.solver.eigen {
            EigenSolver::Slepc => 2.0 * (2.0 * count + 16.0),
            EigenSolver::Blocks if count > SLICED => count + 270.0,
            EigenSolver::Blocks if job.solver.out_of_core.is_some() => 2.0 * count + 200.0,
            EigenSolver::Blocks => 2.0 * count + 70.0,
        };
        let basis: f64 = unique.iter().map(|b| b.dofs as f64 * 8.0 * columns).sum();
        if direct && job.solver.eigen == EigenSolver::Blocks && count > SLICED {
            let largest = unique.iter().map(|b| b.dofs as f64).fold(0.0, f64::max);
            shared.push(("factorisations of slices", 1.3 * FACTOR * largest.powf(4.0 / 3.0)));
        }
        let full = full_stability(job, bodies, alike, ranks);
        if full.iter().map(|(_, bytes)| bytes).sum::<f64>() > basis {
            // The basis is gone by then.
            shared.push(("free modes", unique.iter().map(|b| count * b.dofs as f64 * 8.0).sum()));
            shared.extend(full);
        } else {
            shared.push(("eigenvectors", basis));
        }
    }
    let rows = 3.0 * bodies.iter().map(|b| b.contact_nodes).max().unwrap_or(0) as f64;
    if half_space && !job.analyses.on_contact().is_empty() {
        // Convolutions in place of matrices, and what the solver has for each closed node: its vectors, and the
        // factors of its grid line.
        let nodes = rows / 3.0;
        on_root.push(("convolutions of the contact", Convolution::bytes(nodes) + SOLVER * nodes));
    } else if !job.analyses.on_contact().is_empty() {
        // The compliance of each body, their sum, and the matrices of the contact solver.
        let copies = 4.0 + unique.len() as f64;
        on_root.push(("compliance of the contact", copies * rows * rows * 8.0));
    }
    if full_transient(job) {
        // The influence of each body and of both, its copy in the stepper, the residual compliance that is zero and
        // the rows that are picked.
        on_root.push(("contact of the full transient", 6.0 * rows * rows * 8.0));
    }
    if job.analyses.stability.as_ref().is_some_and(|s| s.sensitivities) && !job.is_reduced_anew() {
        // W and S of the bodies with a parameter changed, ahead and behind.
        on_root.push(("sensitivities", 4.0 * rows * rows * 8.0));
    }
    if swept && !job.is_reduced_anew() {
        // Every rank solves points of its own: it has W, S and the modes at the contact of both bodies, and beside
        // them what of W a state of rest sees, or a copy of W on its way there.
        let modes = job.analyses.modes.as_ref().map_or(0.0, mode_count);
        shared.push(("reduced model of the sweep", ranks as f64 * (3.0 * rows + 2.0 * modes) * rows * 8.0));
    }
    let mut on_disk = 0.0;
    if job.solver.out_of_core.is_some() {
        let stays = OUT_OF_CORE + OUT_OF_CORE_SPREAD * (1.0 - 1.0 / ranks as f64);
        for (name, bytes) in &mut shared {
            if FACTORS.contains(name) {
                on_disk += *bytes;
                *bytes *= stays;
            }
        }
    }
    Estimate { shared, on_root, on_disk }
}

/// Items of the memory that are factors, which may go to the disk.
const FACTORS: [&str; 3] = ["factorisation", "factorisations of slices", "factorisations at a shift"];

/// Returns whether all degrees of freedom move in time.
fn full_transient(job: &Job) -> bool {
    job.analyses.transient.as_ref().is_some_and(|t| t.model == TransientModel::Full)
}

/// Modes of each body, about.
fn mode_count(modes: &Modes) -> f64 {
    match modes.extent() {
        ModesExtent::Count(n) => n as f64,
        ModesExtent::MaxFrequency(_) => 100.0,
    }
}

/// Additional memory of stability on the full system: a factorisation per body and shift, complex (twice the bytes) for
/// a body that is damped unlike the lower one, responses to unit forces on the contact rows and on modes that are
/// damped or turn, and the Krylov basis with the eigenvectors.
fn full_stability(job: &Job, bodies: &[BodySize], alike: bool, ranks: usize) -> Vec<(&'static str, f64)> {
    let Some(wanted) = job.analyses.stability.as_ref().and_then(|s| s.full.as_ref()) else { return Vec::new() };
    let damping: Vec<_> = job.bodies().iter().map(|(_, b)| (b.damping.alpha, b.damping.beta)).collect();
    let spread = 1.0 + FACTOR_SPREAD * (1.0 - 1.0 / ranks as f64);
    let (mut factors, mut responses, mut unknowns) = (0.0, 0.0, 0.0);
    for (i, body) in bodies.iter().enumerate() {
        let n = body.dofs as f64;
        unknowns += n;
        if i > 0 && alike {
            continue;
        }
        // Dashpots of supports make it complex, as does damping that is unlike that of the other body.
        let dashpots = job.bodies().get(i).is_some_and(|(_, b)| b.supports.iter().any(job::Support::damps));
        let numbers = if dashpots || (i > 0 && damping[i] != damping[0]) { 2.0 } else { 1.0 };
        factors += numbers * FACTOR * spread * n.powf(4.0 / 3.0);
        let rows = 3.0 * closed_nodes(job, body.contact_nodes as f64);
        // What is given in the space of the modes: damping of each, or rotation, which has its image of each beside
        // it; loads and responses.
        let given = job.bodies().get(i).map_or(0.0, |(_, b)| match (b.rotates(), &b.damping.modal) {
            (true, _) => 2.0,
            (false, Some(_)) => 1.0,
            (false, None) => 0.0,
        });
        let modal = given * job.analyses.modes.as_ref().map_or(0.0, mode_count);
        responses += (numbers * (rows + modal) + modal) * n * 8.0;
    }
    // The basis with the eigenvectors; where blocks are solved for, some of those. Where bodies rotate the pairs are
    // improved in a space of half as many vectors, with their images.
    let (count, block) = (f64::from(wanted.count), BLOCK as f64);
    let columns = match job.solver.eigen {
        EigenSolver::Slepc => 4.0 * count + 16.0,
        EigenSolver::Blocks if job.bodies().iter().any(|(_, b)| b.rotates()) => 13.0 * count + 11.0 * block,
        EigenSolver::Blocks => 5.0 * count + 11.0 * block,
    };
    vec![
        ("factorisations at a shift", factors),
        ("responses of the contact rows", responses),
        ("eigenvectors, full system", columns * unknowns * 16.0),
    ]
}

/// Nodes of a patch of `all` nodes that are closed in sliding or upstream of a closed one, about: those in Hertz's
/// circle and a fifth more (89 on `jobs/curve.json`, where the circle holds 75), and two on each grid line through
/// it; the ellipse in the patch where the bodies do not tell.
fn closed_nodes(job: &Job, all: f64) -> f64 {
    let ellipse = std::f64::consts::FRAC_PI_4 * all;
    let size = job.contact_spacing();
    match (contact_radius(job), size) {
        (Some(radius), Some(h)) => {
            let lines = radius / h;
            (1.2 * std::f64::consts::PI * lines * lines + 4.0 * lines + 4.0).min(ellipse)
        }
        _ => ellipse,
    }
}

fn mesh_bytes(b: &BodySize) -> f64 {
    // Coordinates, cells, numbering and the graph of the partition.
    b.nodes as f64 * 64.0 + b.cells as f64 * 160.0
}

#[cfg(test)]
mod tests {
    use super::super::tests::plan;
    use super::super::{BodySize, Plan};
    use crate::job::Job;
    use std::path::Path;

    /// W, S and the modes at the contact lie on every rank that solves points, beside what rank 0 has: on n ranks n
    /// times.
    #[test]
    fn a_sweep_has_its_reduced_model_on_every_rank() {
        let sweep = "analyses.sweep={\"keys\": {\"contact.friction\": [0.2, 0.3]}}";
        let stays = ["analyses.modes.count=40", "contact.creepage.lateral=0.01"];
        let nodes = plan(&stays, 1).bodies[0].contact_nodes as f64;
        let least = (2.0 * 3.0 * nodes + 2.0 * 40.0) * 3.0 * nodes * 8.0;
        for ranks in [1, 4] {
            let (without, with) = (plan(&stays, ranks), plan(&[sweep, stays[0], stays[1]], ranks));
            for (before, after) in [(without.per_rank(), with.per_rank()), (without.root(), with.root())] {
                assert!(after - before >= least && after - before < 2.0 * least, "{} of {least} byte", after - before);
            }
            let all = |p: &Plan| p.node(ranks);
            assert!(all(&with) - all(&without) >= ranks as f64 * least, "on all {ranks} ranks");
        }
    }

    #[test]
    fn memory_grows_as_the_mesh_is_refined_and_is_shared_by_the_ranks() {
        let set = |h: &str| ["lower", "upper"].map(|b| format!("bodies.{b}.mesh.cylinder.element_size={h}"));
        let at = |h: &str, ranks| {
            let sets = set(h);
            plan(&[&sets[0], &sets[1]], ranks)
        };
        let (coarse, fine) = (at("0.002", 1), at("0.0005", 1));
        assert!(fine.root() > 2.0 * coarse.root(), "{} {}", fine.root(), coarse.root());
        let two = at("0.0005", 2);
        assert!(two.per_rank() < 0.6 * fine.per_rank(), "{} {}", two.per_rank(), fine.per_rank());
        assert_eq!(two.node(1), two.root());
        assert_eq!(two.node(2), two.root() + two.per_rank());
    }

    #[test]
    fn bodies_that_differ_cost_twice() {
        let (one, two) = (plan(&[], 1), plan(&["bodies.upper.material.young=1e11"], 1));
        assert!(one.alike && !two.alike);
        let factor = |p: &Plan| p.shared.iter().find(|s| s.0 == "factorisation").unwrap().1;
        assert_eq!(factor(&two), 2.0 * factor(&one));
    }

    #[test]
    fn the_full_system_is_counted_and_unlike_damping_costs_more() {
        let full = ["analyses.stability={\"full\": {\"max_frequency\": 500}}", "contact.creepage.lateral=0.01"];
        let of = |p: &Plan, name: &str| p.shared.iter().find(|s| s.0 == name).map_or(0.0, |s| s.1);
        let (without, with) = (plan(&[], 1), plan(&full, 1));
        let name = "factorisations at a shift";
        assert_eq!(of(&without, name), 0.0);
        assert_eq!(of(&with, name), of(&with, "factorisation"), "one real factorisation for two mirror images");
        let unlike = plan(&[full[0], full[1], "bodies.upper.damping.alpha=7"], 1);
        assert_eq!(of(&unlike, name), 3.0 * of(&with, name), "a real and a complex one");
        assert!(with.to_string().contains("full system: all eigenvalues up to 500 Hz"), "{with}");
    }

    /// Two unlike bodies of 127 620 degrees of freedom, 225 contact nodes of which 89 were closed, 60 modes and all
    /// eigenvalues of the full system up to 2 kHz, twenty about each shift, took 4.8 GB on one rank, at rest.
    #[test]
    fn the_largest_run_of_the_full_system_is_estimated_within_a_fifth() {
        let sets = [
            "analyses.stability.full={\"max_frequency\": 2000}",
            "bodies.lower.rotation=none",
            "bodies.upper.rotation=none",
        ];
        let sets = sets.map(str::to_owned);
        let bytes = include_bytes!("../../jobs/curve.json");
        let job = Job::from_bytes(bytes, Path::new("job.json"), &sets, None).unwrap();
        let body = |name: &str| BodySize {
            name: name.into(),
            nodes: 42_540,
            cells: 36_000,
            neighbours: 27.0,
            dofs: 127_620,
            contact_nodes: 225,
        };
        let need = Plan::new(&job, vec![body("lower"), body("upper")], 1).root();
        assert!(need > 4.8e9 && need < 1.2 * 4.8e9, "{need:e}");
    }
}
