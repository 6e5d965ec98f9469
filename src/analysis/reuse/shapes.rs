//! The whole mode shapes of an earlier run, which it wrote for ParaView, or kept in double precision because it did
//! not come to its end: found again on the mesh of this run by their positions.

use crate::analysis::RunOptions;
use crate::body::fe::BodyModes;
use crate::body::{Fields, Side, TraceModes};
use crate::case::bodies::BuiltBodies;
use crate::output::{companion, Reader, Values, SHAPES};
use crate::parallel::World;
use crate::{Error, Result};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Largest difference between a mode in the file and the same mode in the reduced model at the contact, relative to
/// its largest component there: the shapes are in single precision.
const SAME: f64 = 1e-5;

/// The same where the shapes are in double precision.
const SAME_DOUBLE: f64 = 1e-12;

/// The file with the mode shapes that belongs to the result file `reused`.
pub fn file(reused: &Path) -> PathBuf {
    shape_file(reused).unwrap_or_else(|| companion(reused, "free_modes.vtkhdf"))
}

/// Shape file of a run that did not come to its end, whose model is the file `reused`, where there is one.
pub fn shape_file(reused: &Path) -> Option<PathBuf> {
    Some(companion(reused, "shapes.h5")).filter(|path| path.is_file())
}

/// Shape file of the run that is continued, or whose model is taken up, where there is one.
pub fn of_unfinished(options: &RunOptions) -> Option<PathBuf> {
    let own = companion(&options.output, SHAPES);
    let own = Some(own).filter(|path| options.resume && path.is_file());
    own.or_else(|| options.reuse.as_deref().and_then(shape_file))
}

/// Collective: gives each of [`BuiltBodies::unique`] its mode shapes from the `file` of the run that gave the `modes`
/// of these bodies, which rank 0 has; in double precision if `whole`. What stands against it is an error with a message
/// for the user.
pub fn read(
    world: &World,
    (file, whole): (&Path, bool),
    bodies: &mut BuiltBodies,
    modes: Option<&[TraceModes]>,
) -> Result<()> {
    let same = if whole { SAME_DOUBLE } else { SAME };
    let BuiltBodies { places, unique } = bodies;
    for (index, body) in unique.iter_mut().enumerate() {
        let side = places.iter().find(|p| p.body == index).map_or(Side::Lower, |p| p.side);
        let known = || {
            let found = modes.and_then(|m| m.get(index));
            found.ok_or_else(|| Error::Input(format!("{}: the reduced model is of other bodies", file.display())))
        };
        let omega = world.on_root(|| Ok(known()?.omega.clone()))?;
        let omega = world.broadcast(omega.unwrap_or_default());
        let name = body.name().to_owned();
        let none = || Error::Defect(format!("body \"{name}\" has no mesh"));
        let fields = body.fields_mut().ok_or_else(none)?;
        let vectors = world.agree(vectors(file, fields, (&name, side), omega.len()))?;
        fields.replace_shapes(Some(BodyModes { omega, residual: Vec::new(), vectors }));
        let contact = fields.contact_modes()?;
        world.on_root(|| {
            let there = known()?.rows.as_ref();
            let (Some(there), Some(here)) = (there, contact.filter(|c| there.is_some_and(|t| t.shape() == c.shape())))
            else {
                return Err(Error::Input(format!("{}: its modes are not those of the reduced model", file.display())));
            };
            for k in 0..there.ncols() {
                let rows = || 0..there.nrows();
                let largest = rows().map(|i| there[(i, k)].abs()).fold(0.0, f64::max);
                let apart = rows().map(|i| (there[(i, k)] - here[(i, k)]).abs()).fold(0.0, f64::max);
                if apart > same * largest || apart.is_nan() {
                    return Err(Error::Input(format!(
                        "{}: mode {} of body {} is not that of the reduced model at the contact: it is {:.1e} \
                         of its size away from it",
                        file.display(),
                        k + 1,
                        name,
                        apart / largest
                    )));
                }
            }
            Ok(())
        })?;
    }
    Ok(())
}

/// This rank's degrees of freedom of the `count` modes of a body in one place.
fn vectors(file: &Path, body: &dyn Fields, (name, side): (&str, Side), count: usize) -> Result<Vec<Vec<f64>>> {
    let reader = Reader::open(file)?;
    let wrong = |what: &str| Error::Input(format!("{}: {what}", file.display()));
    let bytes = |read: (Vec<usize>, Values), path: &str| match read.1 {
        Values::I8(v) => Ok(v),
        _ => Err(wrong(&format!("{path} does not hold numbers of one byte"))),
    };
    let number = side.index() as i8 + 1;
    let body_of_step = bytes(reader.verified("/modes/body")?, "/modes/body")?;
    let steps: Vec<usize> = (0..body_of_step.len()).filter(|&s| body_of_step[s] == number).collect();
    if steps.len() != count {
        return Err(wrong(&format!("it has {} modes of body {}, the reduced model {count}", steps.len(), name)));
    }
    // The same mesh gives the same coordinates to the last bit, whatever the number of ranks; the upper body is
    // reflected in z there.
    let mirror = side.reflection(2);
    let key = |p: [f64; 3]| p.map(|v| (v + 0.0).to_bits());
    let labels = "/VTKHDF/PointData/body";
    let body_of_point = bytes(reader.verified_rows(labels)?, labels)?;
    let (_, Values::F64(points)) = reader.verified_rows("/VTKHDF/Points")? else {
        return Err(wrong("/VTKHDF/Points does not hold numbers of double precision"));
    };
    let place: HashMap<[u64; 3], usize> = points
        .chunks_exact(3)
        .enumerate()
        .filter(|(at, _)| body_of_point.get(*at) == Some(&number))
        .map(|(at, p)| (key([p[0], p[1], mirror * p[2]]), at))
        .collect();
    let at = |n: usize| place.get(&key(body.mesh().coords[n])).copied();
    let total = body_of_point.len();
    let mut vectors = Vec::with_capacity(count);
    for step in steps {
        let shape = reader.rows("/VTKHDF/PointData/shape", step * total..(step + 1) * total)?;
        let component = |at: usize, c: usize| if c == 2 { mirror * shape[3 * at + 2] } else { shape[3 * at + c] };
        let vector = body.of_nodes(&|n| at(n).map(|at| [0, 1, 2].map(|c| component(at, c))));
        vectors.push(vector.ok_or_else(|| wrong(&format!("it has not all nodes of the mesh of body {name}")))?);
    }
    Ok(vectors)
}
