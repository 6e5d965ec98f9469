//! The meshes of a job's bodies, built or read.

use crate::grid::ContactGrid;
use crate::job::{self, Job, MeshFile, MeshSource, Motion};
use crate::mesh::cylinder::{self, CylinderSpec};
use crate::mesh::{file, motion, quality, CellKind, Mesh, MeshPieces};
use crate::{Error, Result};
use std::cell::RefCell;
use std::rc::Rc;

/// A mesh in lower form, with its contact grid where the job has a contact.
#[derive(Debug)]
pub struct Meshed {
    /// The mesh.
    pub mesh: Mesh,
    /// The grid of its group `contact`, where there is a contact, or why that is none.
    pub grid: Option<Result<ContactGrid>>,
    /// Items left out of its file, or taken for something else.
    pub remarks: Vec<String>,
}

/// A mesh file as a job takes it, whether it is the upper body, whether there is a contact.
type Key = (MeshFile, bool, bool);

/// Inputs of the size of a section: itself, the groups that hold it, its springs and its bearings.
type SectionKey = (Option<MeshSource>, Vec<String>, Vec<job::Support>, Option<job::Suspension>);

/// Cylinders and sizes of sections that are kept: those of the two bodies of a job.
const KEPT: usize = 2;

/// Reads each mesh file once: what was read to plan a run is there when its bodies are built, and so are the cylinders
/// that were made last. Sections are measured once. For rank 0, but for the sections.
#[derive(Debug, Default)]
pub struct Meshes {
    files: RefCell<Vec<(Key, Rc<Meshed>)>>,
    cylinders: RefCell<Vec<(CylinderSpec, Rc<Meshed>)>>,
    sections: RefCell<Vec<(SectionKey, [usize; 2])>>,
}

/// Keeps `made` beside the one that was made before it.
fn keep<T>(kept: &RefCell<Vec<T>>, made: T) {
    let mut all = kept.borrow_mut();
    if all.len() == KEPT {
        all.remove(0);
    }
    all.push(made);
}

impl Meshes {
    /// The mesh of the body `name` of a job; that of a file is kept.
    pub fn mesh(&self, job: &Job, name: &str, body: &job::Body) -> Result<Rc<Meshed>> {
        let named = |e: Error| e.context(format!("bodies.{name}.mesh"));
        let on_grid = |mesh: Mesh, contact: bool, remarks: Vec<String>| {
            let grid = contact.then(|| ContactGrid::from_mesh(&mesh, "contact").map_err(named));
            Rc::new(Meshed { mesh, grid, remarks })
        };
        match body.elements()?.0 {
            MeshSource::Cylinder(c) => {
                let spec = cylinder_spec(c, job.contact.as_ref());
                if let Some((_, made)) = self.cylinders.borrow().iter().find(|(s, _)| *s == spec) {
                    return Ok(made.clone());
                }
                let mesh = cylinder_mesh(&spec).map_err(named)?;
                let contact = mesh.groups.contains_key("contact");
                let made = on_grid(mesh, contact, Vec::new());
                keep(&self.cylinders, (spec, made.clone()));
                Ok(made)
            }
            MeshSource::Revolved(_) | MeshSource::Extruded(_) => {
                Err(Error::Defect("a mesh is asked for of a body that is swept".into()))
            }
            MeshSource::File(file) => {
                // Pads have cells in place of a grid, lie where they are, and are several.
                let pads = job.is_disc_with_pads();
                let key = (file.clone(), name == "upper" && !pads, job.contact.is_some() && !pads);
                if let Some((_, read)) = self.files.borrow().iter().find(|(k, _)| *k == key) {
                    return Ok(read.clone());
                }
                let pieces = if pads { MeshPieces::Several } else { MeshPieces::One };
                let (mut mesh, remarks) = read(file, pieces).map_err(named)?;
                let bodies = job.bodies();
                let called = |b: &'_ job::Body| -> Vec<String> {
                    b.fixed.iter().chain(b.supports.iter().map(|s| &s.group)).cloned().collect()
                };
                let faces = job.contacts.iter().filter_map(|contact| contact.pad_face.clone());
                let names: Vec<String> = bodies.iter().flat_map(|(_, b)| called(b)).chain(faces).collect();
                mesh.add_aliases(names.iter());
                // Files hold a body where it is.
                let read = on_grid(if key.1 { mesh.reflected() } else { mesh }, key.2, remarks);
                self.files.borrow_mut().push((key, read.clone()));
                Ok(read)
            }
        }
    }

    /// Nodes and elements of the section of a swept body, as the modes see it.
    pub(crate) fn section_size(&self, body: &job::Body) -> Result<[usize; 2]> {
        let key = (body.mesh.clone(), body.fixed.clone(), body.supports.clone(), body.suspension.clone());
        if let Some((_, size)) = self.sections.borrow().iter().find(|(k, _)| *k == key) {
            return Ok(*size);
        }
        let size = super::swept::size(body)?;
        keep(&self.sections, (key, size));
        Ok(size)
    }

    /// The mesh of a body in lower form where the job puts it, whether or not there can be a contact: to be looked at.
    pub(crate) fn as_it_lies(&self, job: &Job, name: &str, body: &job::Body) -> Result<Mesh> {
        let fitting = self.mesh(job, name, body);
        match (&body.mesh, fitting) {
            (_, Ok(meshed)) => Ok(meshed.mesh.clone()),
            (Some(MeshSource::File(file)), Err(_)) => {
                let mesh = read(file, MeshPieces::One).map_err(|e| e.context(format!("bodies.{name}.mesh")))?.0;
                Ok(if name == "upper" { mesh.reflected() } else { mesh })
            }
            (_, Err(error)) => Err(error),
        }
    }

    /// Gives back the memory of what was read.
    pub fn forget(&self) {
        self.files.borrow_mut().clear();
        self.cylinders.borrow_mut().clear();
    }
}

/// The mesh of a cylinder, or `Error::Job` where its elements fold: it is not the mesh then that is to be repaired,
/// but what it is made from.
fn cylinder_mesh(spec: &CylinderSpec) -> Result<Mesh> {
    let mesh = cylinder::build(spec)?;
    let Some(place) = folded(&mesh) else { return Ok(mesh) };
    // Steps between sizes are the smaller the nearer the growth is to one.
    let gentle = [1.6, 1.3].into_iter().filter(|&g| g < spec.growth).find(|&growth| {
        cylinder::build(&CylinderSpec { growth, ..spec.clone() }).is_ok_and(|mesh| folded(&mesh).is_none())
    });
    let advice = match gentle {
        Some(growth) => format!("with a growth of {growth} they would not"),
        None => "take a smaller patch, a smaller growth or a smaller max_element_size".into(),
    };
    Err(Error::Job(format!(
        "cylinder: elements fold at ({}) m: a patch of half_length {} m and half_width {} m (contact.patch), \
         growth {} and max_element_size {} m do not go \
         together; {advice}",
        place.map(|v| format!("{v:.3}")).join(", "),
        spec.patch_half_length,
        spec.patch_half_width,
        spec.growth,
        spec.largest()
    )))
}

/// First node, m, of an inverted or degenerate element of the mesh, if there is one.
fn folded(mesh: &Mesh) -> Option<[f64; 3]> {
    let positive = |x: &[[f64; 3]], kind: CellKind| quality::jacobian_range(kind, x)[0] > 0.0;
    let bad = mesh.cells.iter().map(|c| (c.kind, c.places(&mesh.nodes))).find(|(kind, x)| !positive(x, *kind));
    bad.map(|(_, x)| x[0])
}

/// No body is longer, m: where one is, its file is in another unit.
const LONGEST: f64 = 500.0;

/// The mesh of a file, in some `pieces`, where the job puts it, in m, and remarks on what was read.
fn read(file: &MeshFile, pieces: MeshPieces) -> Result<(Mesh, Vec<String>)> {
    let (mut mesh, remarks) = file::read(file.path(), pieces)?;
    let linear = mesh.cells.iter().filter(|c| c.kind == CellKind::Tet4).count();
    if linear > 0 && !file.linear_tetrahedra() {
        return Err(Error::Input(format!(
            "{}: {linear} of {} cells are 4-node tetrahedra, which lock: they are far too stiff in bending, \
             frequencies and contact are wrong; \
             expected tetrahedra of 10 nodes (gmsh -order 2), or mesh.file = {{\"path\": …, \
             \"linear_tetrahedra\": true}} to take them all the same",
            file.path().display(),
            mesh.cells.len()
        )));
    }
    let scale = file.scale();
    if scale != 1.0 {
        mesh.nodes.iter_mut().flatten().for_each(|v| *v *= scale);
    }
    for step in file.transform() {
        mesh.nodes.iter_mut().for_each(|x| *x = moved(*x, step));
    }
    let length = |c: usize| {
        let at = || mesh.nodes.iter().map(|p| p[c]);
        at().fold(f64::NEG_INFINITY, f64::max) - at().fold(f64::INFINITY, f64::min)
    };
    let longest = (0..3).map(length).fold(0.0, f64::max);
    if longest > LONGEST {
        return Err(Error::Input(format!(
            "{}: the mesh is {longest:.4} m long, with the file's unit taken for {scale} m; expected less than \
             {LONGEST} m. Is it in millimetres? Give \
             mesh.file = {{\"path\": …, \"scale\": 0.001}}",
            file.path().display()
        )));
    }
    Ok((mesh, remarks))
}

/// A point behind a step of a transform, m.
fn moved(x: [f64; 3], step: &Motion) -> [f64; 3] {
    match step {
        Motion::Translate(by) => [0, 1, 2].map(|c| x[c] + by[c]),
        Motion::Rotate(turn) => motion::rotated(x, turn.about, turn.axis, turn.angle),
    }
}

/// The built-in cylinder as the job describes it, with the patch of its contact.
pub fn cylinder_spec(c: &job::Cylinder, contact: Option<&job::Contact>) -> CylinderSpec {
    let patch = contact.and_then(|k| k.patch);
    CylinderSpec {
        inner_radius: c.inner_radius,
        outer_radius: c.outer_radius,
        thickness: c.thickness,
        crown_radius: c.crown_radius,
        contact_offset: c.contact_offset,
        element_size: c.element_size,
        growth: c.growth,
        max_element_size: c.max_element_size,
        patch_half_length: patch.map_or(0.0, |p| p.half_length),
        patch_half_width: patch.map_or(0.0, |p| p.half_width),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Elements that fold are a fault of the job, in its keys; a growth that is named would do.
    #[test]
    fn a_cylinder_that_folds_is_told_by_its_keys() {
        let c = |key: &str, value: &str| ["lower", "upper"].map(|b| format!("bodies.{b}.mesh.cylinder.{key}={value}"));
        let with = |growth: &str| {
            let sets = [c("element_size", "0.002"), c("growth", growth), c("max_element_size", "0.05")].concat();
            let mut sets: Vec<&str> = sets.iter().map(String::as_str).collect();
            sets.push("contact.patch.half_length=0.2");
            let job = crate::job::example::two_cylinders(&sets);
            let lower = job.bodies.lower.clone().expect("a body");
            Meshes::default().mesh(&job, "lower", &lower).map(drop)
        };
        let error = with("2").expect_err("it folds");
        assert_eq!(error.exit_code(), 2, "{error}");
        for word in ["bodies.lower.mesh", "half_length 0.2 m", "growth 2 "] {
            assert!(error.message().contains(word), "{word} not in: {error}");
        }
        let named =
            error.message().split("with a growth of ").nth(1).expect("a growth that would do").split(' ').next();
        with(named.expect("a number")).expect("as was said");
    }

    /// A file that is gone was read before, until it is forgotten.
    #[test]
    fn a_file_is_read_once() {
        let folder = tempfile::tempdir().expect("a folder");
        let meshes_of_the_tree = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("meshes");
        let mut text: serde_json::Value =
            serde_json::from_slice(include_bytes!("../../jobs/blocks.json")).expect("a job");
        for (name, file) in [("lower", "block-lower.msh"), ("upper", "block-upper.msh")] {
            std::fs::copy(meshes_of_the_tree.join(file), folder.path().join(file)).expect("a copy");
            text["bodies"][name]["mesh"] = serde_json::json!({ "file": file });
        }
        let path = folder.path().join("job.json");
        let job = Job::from_bytes(text.to_string().as_bytes(), &path, &[], None).expect("the job of the blocks");
        let meshes = Meshes::default();
        let all =
            || job.bodies().into_iter().map(|(name, body)| meshes.mesh(&job, name, body)).collect::<Result<Vec<_>>>();
        let first = all().expect("two files");
        assert!(first.iter().all(|m| matches!(m.grid, Some(Ok(_)))));
        for file in ["block-lower.msh", "block-upper.msh"] {
            std::fs::remove_file(folder.path().join(file)).expect("a file to remove");
        }
        let second = all().expect("what was read");
        assert!(first.iter().zip(&second).all(|(a, b)| Rc::ptr_eq(a, b)));
        meshes.forget();
        assert_eq!(all().expect_err("no file").exit_code(), 3);
    }

    /// Tetrahedra of four nodes are refused unless they are asked for; a file's unit.
    #[test]
    fn linear_tetrahedra_are_asked_for_and_lengths_have_a_unit() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/msh/tet4-4.1.msh");
        let error = read(&MeshFile::Path(path.clone()), MeshPieces::One).expect_err("they lock");
        assert_eq!(error.exit_code(), 3);
        for word in ["tet4-4.1.msh", "lock", "10 nodes", "linear_tetrahedra"] {
            assert!(error.message().contains(word), "{word} not in: {error}");
        }
        let keys = job::MeshFileKeys { path, scale: 1e-3, linear_tetrahedra: true, transform: Vec::new() };
        let mesh = read(&MeshFile::Keys(keys.clone()), MeshPieces::One).expect("they are asked for").0;
        assert!((mesh.volume() / 6e-12 - 1.0).abs() < 1e-12, "{} m³", mesh.volume());
        // A tetrahedron has some 6 edges, of which 5 or 6 cells share each.
        assert!((5.0..12.0).contains(&mesh.neighbours()), "{}", mesh.neighbours());
        // In the order of the list: the block of 0.3 x 0.2 x 0.1 mm is turned about y first, and moved then.
        let turn = job::Turn { axis: [0.0, 1.0, 0.0], angle: std::f64::consts::FRAC_PI_2, about: [0.0; 3] };
        let transform = vec![Motion::Rotate(turn), Motion::Translate([1.0, 0.0, -2.0])];
        let moved = read(&MeshFile::Keys(job::MeshFileKeys { transform, ..keys.clone() }), MeshPieces::One)
            .expect("elsewhere")
            .0;
        assert!(mesh.nodes.iter().zip(&moved.nodes).all(|(a, b)| *b == [a[2] + 1.0, a[1], -a[0] - 2.0]));
        assert!((moved.volume() / 6e-12 - 1.0).abs() < 1e-9 && moved.cells == mesh.cells);
        let error = read(&MeshFile::Keys(job::MeshFileKeys { scale: 3e3, ..keys }), MeshPieces::One)
            .expect_err("a unit of 3 km");
        for word in ["tet4-4.1.msh", "900.0000 m", "millimetres", "scale"] {
            assert!(error.exit_code() == 3 && error.message().contains(word), "{word} not in: {error}");
        }
    }
}
