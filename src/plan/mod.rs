//! Plan of a job: its steps, size and memory, for `railsqueal check` and for the refusal of a job that cannot fit
//! before anything is meshed.

mod memory;
mod text;

use crate::body::matrices::BodyMatrices;
use crate::case::meshes::{cylinder_spec, Meshes};
use crate::case::surfaces;
use crate::case::wheel_rail_geometry::PlacedContact;
use crate::job::{self, fe_inputs, Job, MeshSource, SweepPlan};
use crate::memory::Limit;
use crate::mesh::{cylinder, CellKind};
use crate::scratch::free;
use crate::{Error, Result};
use std::cell::OnceCell;
use std::fmt;
use std::path::PathBuf;

/// Size of one body of the job.
#[derive(Debug, Clone, PartialEq)]
pub struct BodySize {
    /// "lower", "upper", or "others." and its name.
    pub name: String,
    /// Nodes of its mesh.
    pub nodes: u64,
    /// Cells of its mesh.
    pub cells: u64,
    /// Mean number of nodes that a node shares a cell with, itself included.
    pub neighbours: f64,
    /// Degrees of freedom before supports are taken off.
    pub dofs: u64,
    /// Nodes of its contact grid; 0 without contact.
    pub contact_nodes: u64,
}

/// Neighbours of a node within a mesh of eight-node hexahedra, itself included.
const HEXAHEDRAL: f64 = 27.0;

/// The plan of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The bodies, lower first.
    pub bodies: Vec<BodySize>,
    /// True if both bodies are described alike, so that one is computed.
    pub alike: bool,
    /// Number of ranks.
    pub ranks: usize,
    /// Steps of the run, in order, one line each.
    pub steps: Vec<String>,
    /// Consumers of memory at the peak, byte; summed over the ranks.
    pub shared: Vec<(&'static str, f64)>,
    /// Consumers of memory on rank 0 alone, byte.
    pub on_root: Vec<(&'static str, f64)>,
    /// Folder of factors on the disk, if any, and how large they are, byte; summed over the ranks.
    pub on_disk: Option<(PathBuf, f64)>,
}

/// Sizes of the bodies of a job. Counts the built-in cylinder without meshing it; mesh files are read into `meshes`.
/// For one rank. An error has the faults of all bodies.
pub fn sizes(job: &Job, meshes: &Meshes) -> Result<Vec<BodySize>> {
    // Where a wheel stands is the same for both bodies.
    let standing = OnceCell::new();
    let placed = || standing.get_or_init(|| contact_nodes(job)).clone();
    let of = |(name, body): &(String, &job::Body)| size((job, meshes), (name, body), placed);
    let all: Vec<_> = job.all_bodies().iter().map(of).collect();
    Error::all(all.iter().map(|s| s.as_ref().map(drop).map_err(Error::clone)))?;
    let mut sizes = all.into_iter().collect::<Result<Vec<_>>>()?;
    if let Some(nodes) = surfaces::nodes(job, meshes)? {
        sizes.iter_mut().for_each(|s| s.contact_nodes = nodes as u64);
    }
    if job.is_disc_with_pads() {
        let cells = job.contacts.iter().map(|contact| contact.cells.len() as u64).sum();
        for size in &mut sizes {
            (size.name, size.contact_nodes) = (job.bodies.name_of(&size.name).to_owned(), cells);
        }
    }
    Ok(sizes)
}

/// Nodes of the grids of a wheel on its rail.
fn contact_nodes(job: &Job) -> Result<u64> {
    let all = PlacedContact::all(job)?;
    Ok(all.iter().map(|one| one.nodes() as u64).sum())
}

/// Size of the body `name` of a job; `placed` counts the nodes of the contact grids of a wheel on its rail.
fn size(
    (job, meshes): (&Job, &Meshes),
    (key, body): (&str, &job::Body),
    placed: impl Fn() -> Result<u64>,
) -> Result<BodySize> {
    let named = |e: Error| e.context(format!("bodies.{key}.mesh"));
    let name = key.to_owned();
    if let Some(m) = &body.matrices {
        let dofs = BodyMatrices::order(key, m)? as u64;
        return Ok(BodySize {
            name,
            nodes: 0,
            cells: 0,
            neighbours: HEXAHEDRAL,
            dofs,
            contact_nodes: m.contacts.len() as u64,
        });
    }
    if body.profile.is_some() && !body.is_meshed() {
        let contact_nodes = placed()?;
        let [nodes, cells] = match &body.mesh {
            Some(_) => meshes.section_size(body).map_err(named)?.map(|n| n as u64),
            None => [0, 0],
        };
        return Ok(BodySize { name, nodes, cells, neighbours: HEXAHEDRAL, dofs: 3 * nodes, contact_nodes });
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
            Ok(BodySize { name, nodes, cells, neighbours: HEXAHEDRAL, dofs: 3 * nodes, contact_nodes: contact as u64 })
        }
        MeshSource::Revolved(_) | MeshSource::Extruded(_) => {
            let grid = |contact| crate::case::swept::grid(contact, body).map_err(named);
            let is_touched = |one: &&job::Contact| key == "lower" || job.upper_at(one).is_some_and(|(at, _)| at == key);
            let contacts = job.contact.iter().flat_map(job::Contact::all).filter(is_touched);
            let grids = contacts.map(grid).collect::<Result<Vec<_>>>()?;
            let contact: usize = grids.iter().flatten().map(|g| g.x.len() * g.y.len()).sum();
            let [nodes, cells] = meshes.section_size(body).map_err(named)?.map(|n| n as u64);
            Ok(BodySize { name, nodes, cells, neighbours: HEXAHEDRAL, dofs: 3 * nodes, contact_nodes: contact as u64 })
        }
        MeshSource::File(file) => {
            let read = meshes.mesh(job, key, body)?;
            let mesh = &read.mesh;
            for group in &body.fixed {
                mesh.require_group(group, &format!("bodies.{key}.fixed: {}", file.path().display()))?;
            }
            for (i, support) in body.supports.iter().enumerate() {
                let key = format!("bodies.{key}.supports.{i}.group: {}", file.path().display());
                mesh.require_group(&support.group, &key)?;
            }
            let of_mesh = || read.grid.as_ref().and_then(|g| g.as_ref().ok()).map_or(0, |g| g.len() as u64);
            let contact = if body.profile.is_some() { placed()? } else { of_mesh() };
            let (nodes, cells) = (mesh.nodes.len() as u64, mesh.cells.len() as u64);
            let neighbours = match mesh.cells.iter().all(|c| c.kind == CellKind::Hex8) {
                true => HEXAHEDRAL,
                false => mesh.neighbours(),
            };
            Ok(BodySize { name, nodes, cells, neighbours, dofs: 3 * nodes, contact_nodes: contact })
        }
    }
}

impl Plan {
    /// The plan of `job` for bodies of the given sizes.
    pub fn new(job: &Job, bodies: Vec<BodySize>, ranks: usize) -> Self {
        Self::with(job, bodies, ranks, job.sweep.is_some())
    }

    /// The plan of the finite elements that a point of a sweep needs, and of the points on them.
    pub fn of_point(point: &Job, bodies: Vec<BodySize>, ranks: usize) -> Self {
        Self::with(point, bodies, ranks, true)
    }

    fn with(job: &Job, bodies: Vec<BodySize>, ranks: usize, swept: bool) -> Self {
        let alike = job.bodies.lower.is_some() && job.bodies.lower == job.bodies.upper;
        let memory::Estimate { shared, on_root, on_disk } = memory::estimate(job, &bodies, alike, ranks, swept);
        let on_disk = job.solver.out_of_core.clone().map(|place| (place, on_disk));
        Self { on_disk, steps: text::lines(job, &bodies, alike), bodies, alike, ranks, shared, on_root }
    }

    /// Estimated peak memory of each rank other than 0, byte.
    pub(crate) fn per_rank(&self) -> f64 {
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

    /// An error if the disk of the node of rank 0, where `ranks_here` ranks run, has less space than the factors need
    /// there.
    pub fn fits_disk(&self, ranks_here: usize) -> Result<()> {
        let Some((place, bytes)) = &self.on_disk else { return Ok(()) };
        let (need, free) = (bytes * ranks_here as f64 / self.ranks as f64, free(place)?);
        match need <= free {
            true => Ok(()),
            false => Err(Error::Io(format!(
                "solver.out_of_core: the factors need about {} of disk on this node ({ranks_here} of {} ranks), \
                 {} has {} free; name another folder",
                size_text(need),
                self.ranks,
                place.display(),
                size_text(free)
            ))),
        }
    }

    /// An error if rank 0 needs more than its process may have.
    pub fn fits_process(&self, limit: &Limit) -> Result<()> {
        let need = self.root();
        match need <= limit.bytes {
            true => Ok(()),
            false => Err(Error::Memory(format!(
                "the job needs about {} in the process of rank 0, but {} leaves {}.\n  Raise it (ulimit -v \
                 unlimited), use a larger element_size, or \
                 more ranks; with solver.memory_limit that limit counts instead",
                size_text(need),
                limit.source,
                size_text(limit.bytes)
            ))),
        }
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
            "the job needs about {} on this node ({} of {} ranks, {dofs} degrees of freedom; most of it: {}, \
             {}), but {} gives {}.\n  \
             Use a larger element_size or a smaller patch, solver.out_of_core, \"gamg\" as solver.linear, more \
             nodes, or raise solver.memory_limit if the estimate is too high",
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

/// The first point of a sweep on each set of finite elements.
pub fn models(sweep: &SweepPlan) -> Vec<&Job> {
    let mut seen = std::collections::HashSet::new();
    sweep.points.iter().filter(|p| seen.insert(fe_inputs(p).to_string())).collect()
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "bodies")?;
        let width = self.bodies.iter().map(|b| b.name.len()).fold(6, usize::max);
        for b in &self.bodies {
            let contact =
                if b.contact_nodes > 0 { format!(", {} contact nodes", b.contact_nodes) } else { String::new() };
            let (nodes, cells, dofs) = (b.nodes, b.cells, b.dofs);
            if dofs == 0 && nodes == 0 {
                writeln!(f, "  {:<width$} half-space, {} contact nodes", b.name, b.contact_nodes)?;
                continue;
            }
            if nodes == 0 {
                writeln!(
                    f,
                    "  {:<width$} matrices of {dofs} degrees of freedom, {} contacts",
                    b.name, b.contact_nodes
                )?;
                continue;
            }
            writeln!(
                f,
                "  {:<width$} {nodes} nodes, {cells} cells, {dofs} degrees of freedom less the supports{contact}",
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
        if let Some((place, bytes)) = &self.on_disk {
            writeln!(
                f,
                "  {:<28} {:>10}  in {}, not in memory",
                "factors on the disk",
                size_text(*bytes),
                place.display()
            )?;
        }
        if self.ranks == 1 {
            return writeln!(f, "  {:<28} {:>10}", "in all", size_text(self.root()));
        }
        writeln!(f, "  {:<28} {:>10}", "rank 0", size_text(self.root()))?;
        writeln!(f, "  {:<28} {:>10}", "each other rank", size_text(self.per_rank()))
    }
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
    use crate::job::example::two_cylinders as job;

    pub(super) fn plan(sets: &[&str], ranks: usize) -> Plan {
        let job = job(sets);
        Plan::new(&job, sizes(&job, &Meshes::default()).unwrap(), ranks)
    }

    #[test]
    fn the_contact_grid_is_counted_as_it_is_built() {
        for sets in [vec![], vec!["contact.patch.half_length=0.0065", "contact.patch.half_width=0.0071"]] {
            let job = job(&sets);
            let counted = sizes(&job, &Meshes::default()).unwrap();
            let Some(MeshSource::Cylinder(c)) = &job.bodies.lower.as_ref().unwrap().mesh else { panic!("no cylinder") };
            let mesh = cylinder::build(&cylinder_spec(c, job.contact.as_ref())).unwrap();
            let grid = crate::grid::ContactGrid::from_mesh(&mesh, "contact").unwrap();
            assert_eq!(counted[0].contact_nodes, grid.nodes().len() as u64, "{sets:?}");
            assert_eq!((counted[0].nodes, counted[0].cells), (mesh.nodes.len() as u64, mesh.cells.len() as u64));
        }
    }

    #[test]
    fn a_plan_that_does_not_fit_is_a_memory_error_with_both_figures() {
        let plan = plan(&["solver.memory_limit=1e8"], 1);
        let limit = Limit::or_system(job(&["solver.memory_limit=1e8"]).solver.memory_limit);
        let error = plan.fits(1, &limit).unwrap_err();
        assert_eq!(error.exit_code(), 7);
        for part in ["solver.memory_limit gives 100 MB", "needs about", "factorisation", "element_size"] {
            assert!(error.to_string().contains(part), "{part}: {error}");
        }
        assert!(plan.fits(1, &Limit { bytes: 1e12, source: "a test".into() }).is_ok());
        let error = plan.fits_process(&Limit { bytes: 1e8, source: "a test".into() }).unwrap_err();
        assert!(error.exit_code() == 7 && error.to_string().contains("a test leaves 100 MB"), "{error}");
        assert!(plan.fits_process(&Limit::of_process()).is_ok());
    }

    #[test]
    fn half_spaces_need_no_factorisation() {
        let plan = plan(&["contact.compliance=half_space", "analyses.modes=null", "analyses.stability=null"], 1);
        assert!(plan.shared.iter().all(|s| s.0 != "factorisation"), "{plan}");
        assert!(plan.to_string().contains("elastic half-spaces"), "{plan}");
        // Nor a matrix.
        let of = |name: &str| plan.on_root.iter().find(|s| s.0 == name).map(|s| s.1);
        let nodes = plan.bodies[0].contact_nodes as f64;
        assert_eq!(of("compliance of the contact"), None);
        assert!(of("convolutions of the contact").is_some_and(|b| b > 1e3 * nodes && b < 1e4 * nodes), "{plan}");
    }
}
