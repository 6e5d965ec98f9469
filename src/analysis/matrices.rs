//! Jobs whose bodies are given by matrices: reduction, modes and stability, without a mesh.

use super::interface::friction;
use super::reduction::ModalPair;
use super::report::Summary;
use super::stability::{self, dense};
use crate::body::matrices::{reduce, Matrices, SignedRow};
use crate::body::modes::Extent;
use crate::body::ReducedBody;
use crate::contact::SlidingContact;
use crate::job::{self, Job, ModesExtent};
use crate::output::{sha256, ResultFile, Table};
use crate::petsc::session::Petsc;
use crate::progress::Progress;
use crate::{Error, Result};
use faer::Mat;

/// Collective: the analyses of the job. Reading a job makes sure that these are modes, and stability with contact points.
pub fn run(
    petsc: &Petsc,
    job: &Job,
    file: &mut ResultFile,
    progress: &mut Progress,
    summary: &mut Summary,
) -> Result<()> {
    let world = petsc.world();
    let Some(modes) = &job.analyses.modes else { return Ok(()) };
    let extent = match modes.extent() {
        ModesExtent::Count(n) => Extent::Count(n),
        ModesExtent::MaxFrequency(f) => Extent::MaxFrequency(f),
    };
    let mut reduced = Vec::new();
    for (name, body) in job.bodies() {
        progress.stage(format!("matrices of body {name}"));
        let matrices = world.on_root(|| read(name, body))?;
        if let Some(m) = &matrices {
            summary.line(format!("body {name}: {} degrees of freedom, {} contacts", m.stiffness.n, m.contacts.len()));
        }
        progress.stage(format!("modes, body {name}"));
        let step = &mut |done, of| progress.step("modes", done, of);
        let Some(found) = reduce(petsc, name, matrices.as_ref(), extent, step)? else { continue };
        let frequency: Vec<f64> = found.body.omega.iter().map(|w| w / (2.0 * std::f64::consts::PI)).collect();
        let listed: Vec<String> = frequency.iter().take(6).map(|f| format!("{f:.2}")).collect();
        summary.value(&format!("modes of {name}"), format!("{}; Hz: {} ...", frequency.len(), listed.join(", ")));
        let text = "Frequencies of the free-interface modes, ascending; 0 is a rigid-body mode.";
        file.table(Table::list(&format!("/modes/{name}/frequency"), "Hz", text, frequency));
        reduced.push((name, found, matrices));
    }
    let (Some(wanted), Some(contact)) = (&job.analyses.stability, &job.contact) else { return Ok(()) };
    progress.stage("stability of steady sliding");
    let found = world.on_root(|| {
        let sliding = sliding(contact)?;
        let of = |place: &str| reduced.iter().find(|r| r.0 == place).map(|r| &r.1);
        let rigid = rigid(sliding.nodes.len());
        let body = |place: &str| of(place).map_or(&rigid, |found| &found.body);
        let mut pair = ModalPair::new(body("lower"), body("upper"))?;
        pair.set_damping(of("lower").and_then(|f| f.damping.as_ref()), of("upper").and_then(|f| f.damping.as_ref()));
        // A body of which all modes are kept sets no limit.
        let reach = reduced.iter().map(|r| r.1.reach()).fold(f64::INFINITY, f64::min);
        let spectrum = stability::spectrum(wanted, &pair, &sliding, reach)?;
        let place = |name: &str| {
            let found = reduced.iter().find(|r| r.0 == name)?;
            Some((found.2.as_ref()?, &found.1))
        };
        let full = match &wanted.full {
            Some(full) => Some(dense::run(full, ["lower", "upper"].map(place), &sliding, &pair, &spectrum)?),
            None => None,
        };
        Ok((pair, spectrum, full))
    })?;
    if let Some((pair, spectrum, full)) = &found {
        file.tables(spectrum.tables(pair, full.as_ref()));
        spectrum.summarise(pair, summary);
        if let Some(full) = full {
            full.summarise(summary);
        }
    }
    Ok(())
}

/// On rank 0: name and checksum of every matrix file.
pub fn checksums(job: &Job) -> Result<Vec<(String, String)>> {
    let given = job.bodies().into_iter().filter_map(|(_, body)| body.matrices.as_ref());
    let files = given.flat_map(|m| [Some(&m.mass), m.damping.as_ref(), Some(&m.stiffness)]).flatten();
    files.map(|path| Ok((path.display().to_string(), sha256(path)?))).collect()
}

/// On rank 0: the matrices of a body.
fn read(name: &str, body: &job::Body) -> Result<Matrices> {
    let Some(given) = &body.matrices else {
        return Err(Error::Defect(format!("body {name} has no matrices")));
    };
    let signed = |row: i64| -> SignedRow {
        (row != 0).then(|| (row.unsigned_abs() as usize - 1, if row < 0 { -1.0 } else { 1.0 }))
    };
    let rows = |c: &job::MatrixContact| {
        let along = |k: usize| c.tangential.get(k).and_then(|&row| signed(row));
        [along(0), along(1), signed(c.normal)]
    };
    let contacts = given.contacts.iter().map(rows).collect();
    Matrices::read(name, &given.mass, given.damping.as_deref(), &given.stiffness, contacts)
}

/// A body that does not move.
fn rigid(contacts: usize) -> ReducedBody {
    ReducedBody {
        omega: Vec::new(),
        damping: Vec::new(),
        contact_modes: Mat::zeros(3 * contacts, 0),
        compliance: Mat::zeros(3 * contacts, 3 * contacts),
    }
}

/// The sliding contact that the points of the job describe.
fn sliding(contact: &job::Contact) -> Result<SlidingContact> {
    let Some(points) = &contact.points else {
        return Err(Error::Defect("bodies given by matrices without contact points".into()));
    };
    let law = friction(contact);
    // Without a force the velocity only divides nothing.
    let velocity: Vec<f64> = points.iter().map(|p| p.slip_velocity.unwrap_or(1.0)).collect();
    let direction = |p: &job::ContactPoint| {
        let d = [p.direction.first().copied().unwrap_or(0.0), p.direction.get(1).copied().unwrap_or(0.0)];
        let norm = d[0].hypot(d[1]);
        [d[0] / norm, d[1] / norm]
    };
    // A falling law without a velocity is taken at rest, and has no slope there.
    let given = |p: &job::ContactPoint, v: f64| p.slip_velocity.map_or(0.0, |_| v);
    Ok(SlidingContact {
        nodes: (0..points.len()).collect(),
        force: points.iter().map(|p| p.force.unwrap_or(0.0)).collect(),
        direction: points.iter().map(direction).collect(),
        friction: points.iter().zip(&velocity).map(|(p, &v)| law.coefficient(given(p, v))).collect(),
        slope: points.iter().zip(&velocity).map(|(_, &v)| law.slope(v)).collect(),
        velocity,
        convection: vec![Vec::new(); points.len()],
    })
}
