//! The bodies of a job: meshed on rank 0, compared, distributed and assembled. Mirror images are built once.

use super::meshes::{Meshed, Meshes};
use super::positioned_mesh::in_contact_frame;
use super::surfaces;
use crate::body::averaged_trace::MeshContact;
use crate::body::elements::{Elements, StaticMethod};
use crate::body::fe::{BodyModes, FeBody};
use crate::body::matrices::BodyMatrices;
use crate::body::matrix_body::MatrixBody;
use crate::body::near_contacts::ContactPosition;
use crate::body::rigid::Rigid;
use crate::body::{ElasticBody, Fields, FullSystem, Side};
use crate::eigen::sparse;
use crate::fem::rotation::Axis;
use crate::fem::{assembly, ElasticMaterial};
use crate::grid::{ContactGrid, Transfer};
use crate::job::{self, Compliance, EigenSolver, Job, LinearSolver, MeshSource, Profile};
use crate::mesh::Mesh;
use crate::output::{sha256, BodyPart, PointField, ResultFile};
use crate::parallel::World;
use crate::petsc::session::Petsc;
use crate::progress::Progress;
use crate::summary::Summary;
use crate::{Error, Result};

/// Who computes the modes of the job.
pub(crate) fn eigen_method(job: &Job) -> sparse::Method {
    match job.solver.eigen {
        EigenSolver::Blocks => sparse::Method::Blocks,
        EigenSolver::Slepc => sparse::Method::Slepc,
    }
}

/// A place, lower or upper, and the body that fills it.
pub struct Place {
    /// "lower" or "upper", as in the job and the results.
    pub name: &'static str,
    /// Side of the contact.
    pub side: Side,
    /// Index in [`BuiltBodies::unique`].
    pub body: usize,
    /// Grids of the contacts on the body, on rank 0; none without contact.
    pub grids: Vec<ContactGrid>,
    /// Position of each of them, where all lie on one surface of the body; none where they do not, or that is not
    /// known.
    pub positions: Vec<ContactPosition>,
    /// Nodes of a contact grid that are no nodes of the body's mesh as they lie on its surface, in the frame of the
    /// mesh in lower form, m, `[nx*ny]`, on rank 0.
    pub laid: Vec<[f64; 3]>,
    /// Material of finite elements.
    pub material: Option<ElasticMaterial>,
    /// Checksum of the mesh, on rank 0.
    pub(super) checksum: String,
}

impl Place {
    /// Grid of the first contact, on rank 0, if there is one.
    pub fn grid(&self) -> Option<&ContactGrid> {
        self.grids.first()
    }

    /// Vectors in the plane of the contact as the mesh of the body has them in lower form, from their components
    /// along x and y of the contact.
    pub(crate) fn on_mesh(&self, vectors: &[[f64; 2]]) -> Vec<[f64; 3]> {
        let tilt = self.grid().and_then(|g| g.transfer.as_ref()).map_or(0.0, Transfer::tilt);
        vectors.iter().map(|&[x, y]| in_contact_frame([x, y, 0.0], -tilt)).collect()
    }

    /// The place of a body by matrices, that with the index `body`.
    pub(super) fn by_matrices((name, side): (&'static str, Side), body: usize) -> Self {
        let (grids, laid, checksum) = (Vec::new(), Vec::new(), String::new());
        Self { name, side, body, grids, positions: Vec::new(), laid, material: None, checksum }
    }

    /// The place of a body without a mesh, that with the index `body`.
    pub(crate) fn meshless(
        (name, side): (&'static str, Side),
        body: usize,
        grids: Vec<ContactGrid>,
        material: ElasticMaterial,
    ) -> Self {
        let (positions, laid, checksum) = (Vec::new(), Vec::new(), String::new());
        Self { name, side, body, grids, positions, laid, material: Some(material), checksum }
    }
}

/// The bodies of a job.
pub struct BuiltBodies<'p> {
    /// The places, lower first.
    pub places: Vec<Place>,
    /// The bodies that differ; empty when no analysis needs them.
    pub unique: Vec<Box<dyn ElasticBody + 'p>>,
}

impl<'p> BuiltBodies<'p> {
    /// No bodies, where what they give comes from elsewhere.
    pub fn none() -> Self {
        Self { places: Vec::new(), unique: Vec::new() }
    }

    /// Collective: meshes, distributes and assembles the bodies of the job. Warnings about them are those of
    /// [`preflight`](super::preflight).
    pub fn build(
        petsc: &'p Petsc<'p>,
        job: &Job,
        meshes: &Meshes,
        progress: &mut Progress,
        summary: &mut Summary,
    ) -> Result<Self> {
        if job.is_disc_with_pads() {
            return super::disc_and_pads::build(petsc, job, meshes, progress, summary);
        }
        if job.by_matrices() {
            return Self::of_matrices(petsc, job, progress, summary);
        }
        let world = petsc.world();
        if job.placement().is_some() {
            return super::wheel_rail_geometry::build(petsc, job, meshes, progress, summary);
        }
        if job.is_swept() {
            return super::swept::build(world, job, progress, summary);
        }
        progress.stage("meshing");
        let given = job.bodies();
        let meshed = world
            .on_root(|| given.iter().map(|(name, body)| meshes.mesh(job, name, body)).collect::<Result<Vec<_>>>())?;
        // Two bodies that are mirror images are one in lower form: same mesh, material and supports.
        let same = given.len() == 2 && {
            let described = given[0].1.material == given[1].1.material
                && given[0].1.rotation == given[1].1.rotation
                && given[0].1.modes == given[1].1.modes
                && same_groups(&given[0].1.fixed, &given[1].1.fixed)
                && given[0].1.supports == given[1].1.supports;
            let meshes = world.is_root() && meshed.as_ref().is_some_and(|m| m[0].mesh.identical(&m[1].mesh));
            world.broadcast(vec![u8::from(described && meshes)]) == [1]
        };
        let meshed_refs: Vec<&Meshed> = meshed.iter().flatten().map(|m| &**m).collect();
        let meeting = world.on_root(|| match meshed_refs[..] {
            [lower, upper] if !job.analyses.on_contact().is_empty() => surfaces::meet(job, [lower, upper]),
            _ => Ok(surfaces::SurfacePairing::default()),
        })?;
        for line in meeting.iter().flat_map(|m| &m.lines) {
            summary.line(line.clone());
        }
        let mut places = Vec::new();
        for (i, (name, body)) in given.iter().enumerate() {
            let mine = meshed.as_ref().map(|m| &m[i]);
            let grid = meeting.as_ref().and_then(|m| m.grids.get(i).cloned());
            let laid = world.on_root(|| match (mine, &grid) {
                (Some(m), Some(grid)) if job.output.fields => surfaces::beside_nodes(&m.mesh, grid, 0.0),
                _ => Ok(Vec::new()),
            })?;
            places.push(Place {
                name,
                side: Side::named(name)?,
                body: if same { 0 } else { i },
                grids: grid.into_iter().collect(),
                positions: Vec::new(),
                laid: laid.unwrap_or_default(),
                material: Some(material_of(body)?),
                checksum: mine.map(|m| m.mesh.checksum()).unwrap_or_default(),
            });
        }
        let mut bodies = Self { places, unique: Vec::new() };
        if !needs_elements(job) {
            return Ok(bodies);
        }
        progress.stage("distribution and assembly");
        for (i, (name, body)) in given.iter().enumerate() {
            if bodies.unique.len() > bodies.places[i].body {
                summary.line(format!("body {name}: the mirror image of the lower one, computed once"));
                continue;
            }
            let mesh = meshed.as_ref().map(|m| &m[i].mesh);
            let grid = bodies.places[i].grid();
            let contacts: Vec<MeshContact> =
                grid.map(|grid| MeshContact::Grid { grid, along: 0.0 }).into_iter().collect();
            let axis = body.axle().filter(|_| body.rotates()).map(Axis::below);
            bodies.unique.push(Box::new(of_elements((petsc, summary), job, (name, body), (mesh, &contacts), axis)?));
        }
        Ok(bodies)
    }

    /// Collective: reads the bodies of a job that gives them by matrices; one that is not given is rigid.
    fn of_matrices(petsc: &'p Petsc<'p>, job: &Job, progress: &mut Progress, summary: &mut Summary) -> Result<Self> {
        let world = petsc.world();
        let contacts = job.contact.as_ref().and_then(|c| c.points.as_ref()).map_or(0, Vec::len);
        let given = job.bodies();
        let mut bodies = Self::none();
        for (index, side) in Side::BOTH.into_iter().enumerate() {
            let name = side.name();
            bodies.places.push(Place::by_matrices((name, side), index));
            let Some((_, body)) = given.iter().find(|(n, _)| *n == name) else {
                bodies.unique.push(Box::new(Rigid::new(world, name, 3 * contacts)));
                continue;
            };
            progress.stage(format!("matrices of body {name}"));
            let body = MatrixBody::new(petsc, name, world.on_root(|| matrices_of(name, body))?)?;
            let dofs = body.dofs();
            summary.line(format!("body {name}: {dofs} degrees of freedom, {} contacts", body.rows() / 3));
            bodies.unique.push(Box::new(body.with_modes_by(eigen_method(job))));
        }
        Ok(bodies)
    }

    /// Returns whether the bodies can be shown on meshes.
    pub(crate) fn on_meshes(&self) -> bool {
        !self.unique.is_empty() && self.unique.iter().all(|b| b.fields().is_some())
    }

    /// Collective: whether the bodies meet on a grid whose nodes are none of their meshes.
    pub(crate) fn on_common_grid(&self, world: &World) -> bool {
        let beside = self.places.iter().any(|p| !p.laid.is_empty());
        world.max(f64::from(u8::from(beside))) > 0.0
    }

    /// Collective: factorises, or prepares to iterate with, the stiffness of each body.
    pub fn factorise(&mut self, job: &Job, progress: &mut Progress, summary: &mut Summary) -> Result<()> {
        let doing = match job.solver.linear {
            LinearSolver::Mumps => "factorisation",
            LinearSolver::Gamg => "multigrid",
        };
        for body in &mut self.unique {
            progress.stage(format!("{doing}, body {}", body.name()));
            if let Some(made) = body.factorise()? {
                summary.value(&format!("solver of {}", body.name()), made);
            }
        }
        Ok(())
    }

    /// Frees the mode shapes.
    pub(crate) fn forget_shapes(&mut self) {
        self.unique.iter_mut().filter_map(|b| b.fields_mut()).for_each(|f| drop(f.replace_shapes(None)));
    }

    /// The motions of the body with this index in [`BuiltBodies::unique`] on its mesh.
    pub fn fields(&self, body: usize) -> Result<&dyn Fields> {
        let found = self.unique.get(body).and_then(|b| b.fields());
        found.ok_or_else(|| Error::Defect("motions on a mesh are asked for of a body without one".into()))
    }

    /// The matrices of each of [`BuiltBodies::unique`].
    pub fn full_systems(&self) -> Result<Vec<&dyn FullSystem>> {
        let missing = || Error::Defect("matrices are asked for of a body without them".into());
        self.unique.iter().map(|b| b.full_system().ok_or_else(missing)).collect()
    }

    /// The mode shapes of each of [`BuiltBodies::unique`]; none where they were not computed.
    pub fn shapes(&self) -> Vec<&BodyModes> {
        self.unique.iter().filter_map(|b| b.shapes()).collect()
    }

    /// The mode shapes of the body with this index in [`BuiltBodies::unique`].
    pub(crate) fn shapes_of(&self, body: usize) -> Result<&BodyModes> {
        let found = self.unique.get(body).and_then(|b| b.shapes());
        found.ok_or_else(|| Error::Defect("a body has no mode shapes".into()))
    }

    /// The places' shares of the meshes, for writing.
    pub fn parts(&self) -> Vec<BodyPart<'_>> {
        let part = |p: &Place| {
            let part = self.unique.get(p.body)?.fields()?.mesh();
            Some(BodyPart { part, upper: p.side == Side::Upper })
        };
        self.places.iter().filter_map(part).collect()
    }

    /// On rank 0: the contact grid of the body with this index in [`BuiltBodies::unique`].
    pub(crate) fn grid_of(&self, body: usize) -> Option<&ContactGrid> {
        self.places.iter().find(|p| p.body == body).and_then(Place::grid)
    }

    /// Collective: writes the meshes alone.
    pub(crate) fn write_shapes(&self, file: &mut ResultFile) -> Result<()> {
        if !self.on_meshes() {
            return Ok(());
        }
        file.fields(&self.parts(), &[] as &[PointField])
    }

    /// On rank 0: name and checksum of every input.
    pub fn checksums(&self, job: &Job) -> Result<Vec<(String, String)>> {
        let mut sums = Vec::new();
        for (name, body) in job.all_bodies() {
            if let Some(m) = &body.matrices {
                for (_, path) in m.files() {
                    sums.push((path.display().to_string(), sha256(&path)?));
                }
                continue;
            }
            if let Some(Profile::File(file)) = &body.profile {
                sums.push((file.path.display().to_string(), sha256(&file.path)?));
            }
            if let Some((_, file)) = body.section_file() {
                sums.push((file.display().to_string(), sha256(file)?));
            }
            let Some(place) = self.places.iter().find(|p| p.name == name) else { continue };
            if let Some(MeshSource::File(file)) = &body.mesh {
                sums.push((file.path().display().to_string(), sha256(file.path())?));
            }
            // A built-in section is all in the job.
            if !place.checksum.is_empty() {
                sums.push((format!("mesh of body {}", place.name), place.checksum.clone()));
            }
        }
        let rough = job.contact.as_ref().and_then(|c| c.roughness.as_ref());
        for (_, path) in rough.into_iter().flat_map(|r| r.files()) {
            sums.push((path.display().to_string(), sha256(path)?));
        }
        Ok(sums)
    }
}

/// Collective: the body `name` of finite elements of a mesh in lower form with its contacts, both on rank 0, that
/// turns about `axis`, if any.
pub(super) fn of_elements<'p>(
    (petsc, summary): (&'p Petsc<'p>, &mut Summary),
    job: &Job,
    (name, body): (&str, &job::Body),
    (mesh, contacts): (Option<&Mesh>, &[MeshContact]),
    axis: Option<Axis>,
) -> Result<Elements<'p>> {
    let world = petsc.world();
    let fe = FeBody::held(world, name, mesh, contacts, material_of(body)?, (&body.fixed[..], &body.supports[..]))?;
    refuse_unborne(job, &fe)?;
    let volume = assembly::volume(world, &fe.part);
    summary.line(format!(
        "body {name}: {} nodes, {} degrees of freedom, volume {volume:.6e} m³, mass {:.6e} kg",
        fe.part.ranges[world.size],
        fe.dofs.total(),
        volume * fe.material.density
    ));
    fe.effect.lines.iter().for_each(|line| summary.line(format!("body {name}: {line}")));
    let method = match job.solver.linear {
        LinearSolver::Mumps => StaticMethod::Direct,
        LinearSolver::Gamg => StaticMethod::Iterative,
    };
    let elements = Elements::new(petsc, fe, method).with_modes_by(eigen_method(job));
    match (axis, &body.mesh) {
        (Some(axis), Some(MeshSource::Cylinder(_))) => Ok(elements.made_round(axis)),
        (Some(axis), _) => elements.rotating(axis),
        (None, _) => Ok(elements),
    }
}

/// Returns whether some analysis of the job works on finite elements.
pub(crate) fn needs_elements(job: &Job) -> bool {
    let half_space = job.contact.as_ref().is_some_and(|c| c.compliance == Compliance::HalfSpace);
    (!job.by_matrices() || job.is_disc_with_pads()) && (job.analyses.modes.is_some() || !half_space)
}

/// Refuses a static load on a body that supports leave free to move away from it.
fn refuse_unborne(job: &Job, body: &FeBody) -> Result<()> {
    match job.static_load().filter(|_| !body.supported) {
        Some(what) => Err(Error::Job(format!(
            "bodies.{0}.supports: rigid motions left free: {1}, but {what} is a static problem whose load \
             nothing bears; clamp a group \
             (bodies.{0}.fixed), or add springs in the directions that are missing",
            body.name,
            body.rigid.len()
        ))),
        None => Ok(()),
    }
}

fn same_groups(a: &[String], b: &[String]) -> bool {
    a.iter().all(|g| b.contains(g)) && b.iter().all(|g| a.contains(g))
}

/// On rank 0: the matrices of a body.
pub(super) fn matrices_of(name: &str, body: &job::Body) -> Result<BodyMatrices> {
    let Some(given) = &body.matrices else {
        return Err(Error::Defect(format!("body {name} has no matrices")));
    };
    BodyMatrices::read(name, given)
}

pub(crate) fn material_of(body: &job::Body) -> Result<ElasticMaterial> {
    let m = body.elastic()?;
    Ok(ElasticMaterial { young: m.young, poisson: m.poisson, density: m.density })
}
