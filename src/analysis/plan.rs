//! What a job would compute, how large it is, and how much memory it needs: `railsqueal check`, and the refusal of a job
//! that cannot fit before anything is meshed.

use super::bodies::{cylinder_spec, mesh_of, Meshed};
use super::reduction::fe_inputs;
use crate::body::matrix_market;
use crate::job::{self, Compliance, Job, LinearSolver, Load, MeshSource, ModesExtent, SweepPlan};
use crate::mesh::{cylinder, msh};
use crate::{Error, Result};
use std::fmt;

/// Size of one body of the job.
#[derive(Debug, Clone, PartialEq)]
pub struct BodySize {
    /// "lower" or "upper".
    pub name: &'static str,
    /// Nodes of its mesh.
    pub nodes: u64,
    /// Hexahedra of its mesh.
    pub cells: u64,
    /// Degrees of freedom before supports are taken off.
    pub dofs: u64,
    /// Nodes of its contact grid; 0 without contact.
    pub contact_nodes: u64,
}

/// The plan of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The bodies, lower first.
    pub bodies: Vec<BodySize>,
    /// True if both bodies are described alike, so that one is computed.
    pub alike: bool,
    /// Number of ranks.
    pub ranks: usize,
    /// What is computed, in order, one line each.
    pub steps: Vec<String>,
    /// What takes memory at the peak and how much, byte; summed over the ranks.
    pub shared: Vec<(&'static str, f64)>,
    /// What takes memory on rank 0 alone, byte.
    pub on_root: Vec<(&'static str, f64)>,
}

/// Sizes of the bodies of a job. Counts the built-in cylinder without meshing it; reads mesh files. For one rank.
pub fn sizes(job: &Job) -> Result<Vec<BodySize>> {
    job.bodies().into_iter().map(|(name, body)| size(job, name, body)).collect()
}

fn size(job: &Job, name: &'static str, body: &job::Body) -> Result<BodySize> {
    let named = |e: Error| e.context(format!("bodies.{name}.mesh"));
    if let Some(m) = &body.matrices {
        let dofs = matrix_market::read(&m.stiffness)?.n as u64;
        return Ok(BodySize { name, nodes: 0, cells: 0, dofs, contact_nodes: m.contacts.len() as u64 });
    }
    match body.elements()?.0 {
        MeshSource::Cylinder(c) => {
            let (nodes, cells) = cylinder::count(&cylinder_spec(c, job.contact.as_ref())).map_err(named)?;
            let across = |half: f64| 2.0 * (half / c.element_size - 1e-9).ceil() + 1.0;
            let contact = job
                .contact
                .as_ref()
                .and_then(|k| k.patch)
                .map_or(0.0, |p| across(p.half_length) * across(p.half_width));
            Ok(BodySize { name, nodes, cells, dofs: 3 * nodes, contact_nodes: contact as u64 })
        }
        MeshSource::File(path) => {
            let Meshed { mesh, grid } = mesh_of(job, name, body)?;
            for group in &body.fixed {
                msh::require_group(&mesh, group, &format!("bodies.{name}.fixed: {}", path.display()))?;
            }
            let contact = grid.map_or(0, |g| g.nodes.len() as u64);
            let (nodes, cells) = (mesh.nodes.len() as u64, mesh.cells.len() as u64);
            Ok(BodySize { name, nodes, cells, dofs: 3 * nodes, contact_nodes: contact })
        }
    }
}

// Memory model. Nested dissection of a three-dimensional mesh fills of the order n^(4/3) entries (A. George, SIAM J. Numer.
// Anal. 10, 1973). The constants are from runs of graded cylinders of 128 to 226 thousand degrees of freedom on 1 and 2 ranks, whose
// largest resident sets the estimates exceed by 10 to 14 %.

/// Memory of a real Cholesky factorisation with MUMPS, byte per n^(4/3): 111 to 126 on one rank.
const FACTOR: f64 = 125.0;
/// What a factorisation takes more on many ranks than on one, as a share; half of it on two.
const FACTOR_SPREAD: f64 = 0.2;
/// Neighbours of a node of a hexahedral mesh, itself included.
const NEIGHBOURS: f64 = 27.0;
/// Bytes of an entry of a distributed matrix: value and column.
const ENTRY: f64 = 16.0;
/// Program, MPI and libraries, per rank.
const BASE: f64 = 120e6;

impl Plan {
    /// The plan of `job` for bodies of the given sizes.
    pub fn new(job: &Job, bodies: Vec<BodySize>, ranks: usize) -> Self {
        let alike = job.bodies.lower.is_some() && job.bodies.lower == job.bodies.upper;
        let unique = if alike { &bodies[..1] } else { &bodies[..] };
        let half_space = job.contact.as_ref().is_some_and(|c| c.compliance == Compliance::HalfSpace);
        let elements = job.analyses.modes.is_some() || !half_space;
        let direct = job.solver.linear == LinearSolver::Mumps || job.analyses.modes.is_some();

        let mut shared = vec![("program and libraries", BASE * ranks as f64)];
        let mut on_root = vec![("meshes before distribution", bodies.iter().map(mesh_bytes).sum())];
        if elements {
            shared.push(("distributed meshes", unique.iter().map(mesh_bytes).sum()));
            let matrices = |b: &BodySize| 2.0 * b.dofs as f64 * 3.0 * NEIGHBOURS * ENTRY;
            shared.push(("stiffness and mass matrices", unique.iter().map(matrices).sum()));
            let spread = 1.0 + FACTOR_SPREAD * (1.0 - 1.0 / ranks as f64);
            let solver = |b: &BodySize| match direct {
                true => FACTOR * spread * (b.dofs as f64).powf(4.0 / 3.0),
                // Complex hierarchy of multigrid and vectors of the iteration, from a run of 1.08 million degrees of freedom on two ranks (8.7 GB in all).
                false => 4.0 * b.dofs as f64 * 3.0 * NEIGHBOURS * ENTRY,
            };
            shared.push((if direct { "factorisation" } else { "multigrid" }, unique.iter().map(solver).sum()));
        }
        if let Some(modes) = &job.analyses.modes {
            let count = match modes.extent() {
                ModesExtent::Count(n) => n as f64,
                ModesExtent::MaxFrequency(_) => 100.0,
            };
            // The Krylov basis has about twice as many vectors, complex as SLEPc is; the modes are kept real.
            let basis = |b: &BodySize| (2.0 * count + 16.0) * b.dofs as f64 * 16.0;
            shared.push(("eigenvectors", unique.iter().map(basis).sum()));
        }
        let rows = 3.0 * bodies.iter().map(|b| b.contact_nodes).max().unwrap_or(0) as f64;
        if !job.analyses.on_contact().is_empty() {
            // The compliance of each body, their sum, and the matrices of the contact solver.
            let copies = 4.0 + unique.len() as f64;
            on_root.push(("compliance of the contact", copies * rows * rows * 8.0));
        }
        if job.analyses.stability.as_ref().is_some_and(|s| s.full.is_some()) {
            full_stability(job, &bodies, alike, ranks, &mut shared);
        }
        Self { steps: steps(job, &bodies, alike), bodies, alike, ranks, shared, on_root }
    }

    /// Estimated peak memory of each rank other than 0, byte.
    pub fn per_rank(&self) -> f64 {
        self.shared.iter().map(|(_, bytes)| bytes).sum::<f64>() / self.ranks as f64
    }

    /// Estimated peak memory of rank 0, byte.
    pub fn root(&self) -> f64 {
        self.per_rank() + self.on_root.iter().map(|(_, bytes)| bytes).sum::<f64>()
    }

    /// Estimated peak memory of the node of rank 0, byte, where `ranks_here` of the ranks run.
    pub fn node(&self, ranks_here: usize) -> f64 {
        self.root() + self.per_rank() * ranks_here.saturating_sub(1) as f64
    }

    /// An error if the node of rank 0, where `ranks_here` ranks run, has less memory than the plan needs there.
    pub fn fits(&self, ranks_here: usize, limit: &Limit) -> Result<()> {
        let need = self.node(ranks_here);
        if need <= limit.bytes {
            return Ok(());
        }
        let mut parts: Vec<(&str, f64)> = self.shared.clone();
        parts.iter_mut().for_each(|p| p.1 *= ranks_here as f64 / self.ranks as f64);
        parts.extend(&self.on_root);
        let largest = parts.iter().max_by(|a, b| a.1.total_cmp(&b.1)).map(|p| (p.0, p.1)).unwrap_or_default();
        let dofs: u64 = self.bodies.iter().map(|b| b.dofs).sum();
        Err(Error::Memory(format!(
            "the job needs about {} on this node ({} of {} ranks, {dofs} degrees of freedom; most of it: {}, {}), but {} gives {}.\n  \
             Use a larger element_size or a smaller patch, \"gamg\" as solver.linear, more nodes, or raise solver.memory_limit if the estimate is too high",
            size_text(need),
            ranks_here,
            self.ranks,
            largest.0,
            size_text(largest.1),
            limit.source,
            size_text(limit.bytes)
        )))
    }
}

/// What stability on the full system takes beside the rest: a factorisation per body and shift, complex (twice the bytes) for a
/// body that is damped unlike the lower one, responses to unit forces on the contact rows, and the Krylov basis with the eigenvectors.
fn full_stability(job: &Job, bodies: &[BodySize], alike: bool, ranks: usize, shared: &mut Vec<(&'static str, f64)>) {
    let damping: Vec<_> = job.bodies().iter().map(|(_, b)| (b.damping.alpha, b.damping.beta)).collect();
    let spread = 1.0 + FACTOR_SPREAD * (1.0 - 1.0 / ranks as f64);
    let (mut factors, mut responses, mut unknowns) = (0.0, 0.0, 0.0);
    for (i, body) in bodies.iter().enumerate() {
        let n = body.dofs as f64;
        unknowns += n;
        if i > 0 && alike {
            continue;
        }
        let numbers = if i > 0 && damping[i] != damping[0] { 2.0 } else { 1.0 };
        factors += numbers * FACTOR * spread * n.powf(4.0 / 3.0);
        // The ellipse in the patch, twice while MUMPS solves for them.
        let rows = 3.0 * std::f64::consts::FRAC_PI_4 * body.contact_nodes as f64;
        responses += 2.0 * numbers * rows * n * 8.0;
    }
    let count = job.analyses.stability.as_ref().and_then(|s| s.full.as_ref()).map_or(0, |f| f.count) as f64;
    shared.push(("factorisations at a shift", factors));
    shared.push(("responses of the contact rows", responses));
    shared.push(("eigenvectors, full system", (4.0 * count + 16.0) * unknowns * 16.0));
}

/// Largest strain of the contact surfaces, about, for which linear elasticity is used.
const MAX_STRAIN: f64 = 0.05;

/// An error if the load strains the surfaces of two built-in cylinders beyond small strain. The measure is the largest
/// Hertz pressure over the combined modulus E*, (2/π) a/R for a circular contact (K. L. Johnson, Contact Mechanics,
/// 1985, eqs. 4.22–4.24); an elliptic contact is taken as the circular one of the same geometric mean curvature, a plain cylinder
/// as a line contact across the width (eq. 4.45).
pub fn small_strain(job: &Job) -> Result<()> {
    let (Some(contact), [(_, lower), (_, upper)]) = (&job.contact, &job.bodies()[..]) else { return Ok(()) };
    let (Some(MeshSource::Cylinder(a)), Some(MeshSource::Cylinder(b))) = (&lower.mesh, &upper.mesh) else {
        return Ok(());
    };
    let compliance = |m: &job::Material| (1.0 - m.poisson * m.poisson) / m.young;
    let modulus = 1.0 / (compliance(lower.elements()?.1) + compliance(upper.elements()?.1));
    let along = 1.0 / a.outer_radius + 1.0 / b.outer_radius;
    let across = a.crown_radius.map_or(0.0, |r| 1.0 / r) + b.crown_radius.map_or(0.0, |r| 1.0 / r);
    let curvature = (along * across).sqrt();
    let (key, strain) = match contact.load() {
        Load::Normal(n) if across > 0.0 => {
            ("normal_load", (6.0 * n * curvature * curvature / modulus / std::f64::consts::PI.powi(3)).cbrt())
        }
        Load::Normal(n) => {
            let width = a.thickness.min(b.thickness);
            ("normal_load", (n * along / (std::f64::consts::PI * width * modulus)).sqrt())
        }
        // A line contact has no approach of its own: the curvature along the rolling direction bounds it.
        Load::Approach(d) if across > 0.0 => ("approach", 2.0 / std::f64::consts::PI * (d * curvature).sqrt()),
        Load::Approach(d) => ("approach", 2.0 / std::f64::consts::PI * (d * along).sqrt()),
    };
    if strain <= MAX_STRAIN {
        return Ok(());
    }
    let value = contact.normal_load.or(contact.approach).unwrap_or_default();
    Err(Error::Job(format!(
        "contact.{key}: found {value:e}, which would strain the surfaces by about {:.3} %; the bodies are linear elastic at small strain, \
         taken to hold up to {} %. Reduce it",
        100.0 * strain,
        100.0 * MAX_STRAIN
    )))
}

/// The first point of a sweep on each set of finite elements.
pub fn models(sweep: &SweepPlan) -> Vec<&Job> {
    let mut seen: Vec<serde_json::Value> = Vec::new();
    let mut new = |inputs: serde_json::Value| {
        let is = !seen.contains(&inputs);
        if is {
            seen.push(inputs);
        }
        is
    };
    sweep.points.iter().filter(|p| new(fe_inputs(p))).collect()
}

fn mesh_bytes(b: &BodySize) -> f64 {
    // Coordinates, cells, numbering and the graph of the partition.
    b.nodes as f64 * 64.0 + b.cells as f64 * 160.0
}

fn steps(job: &Job, bodies: &[BodySize], alike: bool) -> Vec<String> {
    let mut steps = Vec::new();
    let once = if alike { " (the bodies are described alike: computed once)" } else { "" };
    if let Some(modes) = &job.analyses.modes {
        steps.push(match modes.extent() {
            ModesExtent::Count(n) => format!("modes: the {n} lowest of each body{once}"),
            ModesExtent::MaxFrequency(f) => format!("modes: all of each body up to {f} Hz{once}"),
        });
    }
    if let (true, Some(contact)) = (job.by_matrices() && job.analyses.stability.is_some(), &job.contact) {
        let points = contact.points.as_ref().map_or(0, Vec::len);
        steps.push(format!("stability of steady sliding on the modes, {points} contact points"));
    } else if let (false, Some(contact)) = (job.analyses.on_contact().is_empty(), &job.contact) {
        let nodes = bodies.iter().map(|b| b.contact_nodes).max().unwrap_or(0);
        let source = match contact.compliance {
            Compliance::Fe => format!("finite elements{once}"),
            Compliance::HalfSpace => "elastic half-spaces".into(),
        };
        steps.push(format!("compliance of {nodes} contact nodes ({} rows) from {source}", 3 * nodes));
        let load = match contact.load() {
            Load::Normal(n) => format!("normal load {n} N"),
            Load::Approach(d) => format!("approach {d} m"),
        };
        let c = contact.creepage;
        let given = format!(
            "{load}, friction {}, speed {} m/s, creepages {} {} {} 1/m",
            contact.friction, contact.speed, c.longitudinal, c.lateral, c.spin,
        );
        if let Some(steady) = &job.analyses.steady {
            steps.push(format!("steady rolling: {given}, tolerance {:e}", steady.tolerance));
        }
        if let Some(receptance) = &job.analyses.receptance {
            let count = receptance.frequency.numbers().map_or(0, |f| f.len());
            steps.push(format!("receptances of the contact point at {count} frequencies"));
        }
        if job.analyses.stability.is_some() {
            steps.push(format!("stability of steady sliding on the modes: {given}"));
            if let Some(full) = job.analyses.stability.as_ref().and_then(|s| s.full.as_ref()) {
                steps.push(format!(
                    "stability of the full system: all eigenvalues up to {} Hz by successive shifts, compared with those of the modes",
                    full.max_frequency
                ));
            }
        }
        if let Some(t) = &job.analyses.transient {
            let count = (t.duration / t.step).round();
            steps.push(format!("transient on the modes: {count} steps of {} s, {} s", t.step, t.duration));
            if t.sound_power.is_some() {
                steps.push("sound power radiated in it, in third octaves".into());
            }
        }
    }
    if let Some(sweep) = &job.sweep {
        let models = models(sweep).len();
        steps.push(format!(
            "sweep of {}: {} points on {models} {} model{}",
            sweep.keys.join(", "),
            sweep.points.len(),
            if job.by_matrices() { "reduced" } else { "finite-element" },
            if models == 1 { "" } else { "s" }
        ));
    }
    steps
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "bodies")?;
        for b in &self.bodies {
            let contact =
                if b.contact_nodes > 0 { format!(", {} contact nodes", b.contact_nodes) } else { String::new() };
            let (nodes, cells, dofs) = (b.nodes, b.cells, b.dofs);
            if nodes == 0 {
                writeln!(f, "  {:<6} matrices of {dofs} degrees of freedom, {} contacts", b.name, b.contact_nodes)?;
                continue;
            }
            writeln!(
                f,
                "  {:<6} {nodes} nodes, {cells} hexahedra, {dofs} degrees of freedom less the supports{contact}",
                b.name
            )?;
        }
        writeln!(f, "what is computed")?;
        self.steps.iter().try_for_each(|s| writeln!(f, "  {s}"))?;
        writeln!(f, "estimated memory, {} rank{}", self.ranks, if self.ranks == 1 { "" } else { "s" })?;
        for (name, bytes) in self.shared.iter().filter(|p| p.1 > 0.0) {
            writeln!(f, "  {name:<28} {:>10}  over all ranks", size_text(*bytes))?;
        }
        for (name, bytes) in self.on_root.iter().filter(|p| p.1 > 0.0) {
            writeln!(f, "  {name:<28} {:>10}  on rank 0", size_text(*bytes))?;
        }
        if self.ranks == 1 {
            return writeln!(f, "  {:<28} {:>10}", "in all", size_text(self.root()));
        }
        writeln!(f, "  {:<28} {:>10}", "rank 0", size_text(self.root()))?;
        writeln!(f, "  {:<28} {:>10}", "each other rank", size_text(self.per_rank()))
    }
}

/// Memory that may be used on this node, and who says so.
#[derive(Debug, Clone, PartialEq)]
pub struct Limit {
    /// Byte.
    pub bytes: f64,
    /// Where the figure comes from, for messages.
    pub source: String,
}

impl Limit {
    /// The limit that the job sets, or else what the system and the control groups leave.
    pub fn of(job: &Job) -> Limit {
        match job.solver.memory_limit {
            Some(bytes) => Limit { bytes, source: "solver.memory_limit".into() },
            None => Limit::of_system(),
        }
    }

    /// The least of the memory the kernel calls available and what is left in the control group of this process and those above it.
    pub fn of_system() -> Limit {
        let read = |path: &str| std::fs::read_to_string(path).ok();
        let mut limit = Limit { bytes: f64::INFINITY, source: "the system".into() };
        if let Some(bytes) = read("/proc/meminfo").as_deref().and_then(mem_available) {
            limit = Limit { bytes, source: "the system (MemAvailable)".into() };
        }
        for (max, used) in control_groups(&read("/proc/self/cgroup").unwrap_or_default()) {
            let (Some(max), Some(used)) = (read(&max).and_then(|t| number(&t)), read(&used).and_then(|t| number(&t)))
            else {
                continue;
            };
            // Without a limit version 1 shows a number near 2^63.
            if max < 1e18 && max - used < limit.bytes {
                limit = Limit { bytes: (max - used).max(0.0), source: "the control group of this process".into() };
            }
        }
        limit
    }
}

fn number(text: &str) -> Option<f64> {
    text.trim().parse().ok()
}

/// MemAvailable of /proc/meminfo, byte.
fn mem_available(text: &str) -> Option<f64> {
    let line = text.lines().find(|l| l.starts_with("MemAvailable:"))?;
    let kib: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib * 1024.0)
}

/// Files with the limit and the use of the memory control groups of this process, from its own upwards (versions 1 and 2).
fn control_groups(text: &str) -> Vec<(String, String)> {
    let mut files = Vec::new();
    for line in text.lines() {
        let mut fields = line.splitn(3, ':');
        let (Some(_), Some(controllers), Some(path)) = (fields.next(), fields.next(), fields.next()) else { continue };
        let (root, max, used) = if controllers.is_empty() {
            ("/sys/fs/cgroup", "memory.max", "memory.current")
        } else if controllers.split(',').any(|c| c == "memory") {
            ("/sys/fs/cgroup/memory", "memory.limit_in_bytes", "memory.usage_in_bytes")
        } else {
            continue;
        };
        let mut path = path.trim_end_matches('/');
        loop {
            files.push((format!("{root}{path}/{max}"), format!("{root}{path}/{used}")));
            match path.rfind('/') {
                Some(at) => path = &path[..at],
                None => break,
            }
        }
    }
    files
}

/// A number of bytes for people.
fn size_text(bytes: f64) -> String {
    match bytes {
        b if b >= 1e12 => format!("{:.1} TB", b / 1e12),
        b if b >= 1e9 => format!("{:.1} GB", b / 1e9),
        b => format!("{:.0} MB", (b / 1e6).max(1.0)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn job(sets: &[&str]) -> Job {
        let sets: Vec<String> = sets.iter().map(|s| s.to_string()).collect();
        let bytes = include_bytes!("../../jobs/two-cylinders.json");
        Job::from_bytes(bytes, Path::new("job.json"), &sets, None).unwrap()
    }

    fn plan(sets: &[&str], ranks: usize) -> Plan {
        let job = job(sets);
        Plan::new(&job, sizes(&job).unwrap(), ranks)
    }

    #[test]
    fn the_contact_grid_is_counted_as_it_is_built() {
        for sets in [vec![], vec!["contact.patch.half_length=0.0065", "contact.patch.half_width=0.0071"]] {
            let job = job(&sets);
            let counted = sizes(&job).unwrap();
            let Some(MeshSource::Cylinder(c)) = &job.bodies.lower.as_ref().unwrap().mesh else { panic!("no cylinder") };
            let (mesh, grid) = cylinder::build(&cylinder_spec(c, job.contact.as_ref())).unwrap();
            assert_eq!(counted[0].contact_nodes, grid.unwrap().nodes.len() as u64, "{sets:?}");
            assert_eq!((counted[0].nodes, counted[0].cells), (mesh.nodes.len() as u64, mesh.cells.len() as u64));
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

    #[test]
    fn a_plan_that_does_not_fit_is_a_memory_error_with_both_figures() {
        let plan = plan(&["solver.memory_limit=1e8"], 1);
        let limit = Limit::of(&job(&["solver.memory_limit=1e8"]));
        let error = plan.fits(1, &limit).unwrap_err();
        assert_eq!(error.exit_code(), 7);
        for part in ["solver.memory_limit gives 100 MB", "needs about", "factorisation", "element_size"] {
            assert!(error.to_string().contains(part), "{part}: {error}");
        }
        assert!(plan.fits(1, &Limit { bytes: 1e12, source: "a test".into() }).is_ok());
    }

    #[test]
    fn strain_is_hertz_pressure_over_modulus() {
        // The paper's cylinders: 1401.0 MPa at 70 kN, E* = 112.64 GPa. The strain grows with the cube root of the load.
        let strain: f64 = 1401.0e6 / (205e9 / 2.0 / (1.0 - 0.09));
        let limit = 70e3 * (MAX_STRAIN / strain).powi(3);
        let at = |load: f64| small_strain(&job(&[&format!("contact.normal_load={load}")]));
        assert!(at(0.999 * limit).is_ok());
        let error = at(1.001 * limit).unwrap_err();
        assert_eq!(error.exit_code(), 2);
        assert!(error.to_string().contains("about 5.0"), "{error}");
        // Hertz' approach is a²/R = (π strain / 2)² R with R = 1/curvature = 0.25 m.
        let approach = (std::f64::consts::PI * MAX_STRAIN / 2.0).powi(2) * 0.25;
        let at = |d: f64| small_strain(&job(&["contact.normal_load=null", &format!("contact.approach={d}")]));
        assert!(at(0.999 * approach).is_ok());
        assert!(at(1.001 * approach).is_err());
    }

    #[test]
    fn half_spaces_need_no_factorisation() {
        let plan = plan(&["contact.compliance=half_space", "analyses.modes=null", "analyses.stability=null"], 1);
        assert!(plan.shared.iter().all(|s| s.0 != "factorisation"), "{plan}");
        assert!(plan.to_string().contains("elastic half-spaces"), "{plan}");
    }

    #[test]
    fn the_kernel_files_are_read() {
        let text = "MemTotal:       32861560 kB\nMemAvailable:    1024 kB\n";
        assert_eq!(mem_available(text), Some(1048576.0));
        assert_eq!(mem_available("nothing"), None);
        let two: Vec<String> = control_groups("0::/user/job\n").into_iter().map(|f| f.0).collect();
        assert_eq!(
            two,
            ["/sys/fs/cgroup/user/job/memory.max", "/sys/fs/cgroup/user/memory.max", "/sys/fs/cgroup/memory.max"]
        );
        let one = control_groups("12:cpu,cpuacct:/a\n5:memory:/b\n");
        assert_eq!(one[0].1, "/sys/fs/cgroup/memory/b/memory.usage_in_bytes");
        assert_eq!(one.len(), 2);
        assert!(Limit::of_system().bytes > 0.0);
    }
}
