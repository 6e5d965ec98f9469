//! Results that are kept in the tree (`tests/golden`, written by `scripts/golden tree`): what the program writes
//! today has the same datasets with the same shapes, units and descriptions, and the same values. `scripts/golden
//! compare` does this with many more jobs.

use super::program::*;
use hdf5::types::{FloatSize, TypeDescriptor};
use num_complex::Complex64;
use std::collections::BTreeMap;
use std::path::Path;

/// Largest distance of two values, relative to the largest of their dataset.
const LIMIT: f64 = 1e-10;

/// A dataset: its attributes, its shape, its values.
#[derive(Debug, PartialEq)]
struct Dataset {
    attributes: Vec<String>,
    shape: Vec<usize>,
    values: Values,
}

#[derive(Debug, PartialEq)]
enum Values {
    Whole(Vec<i64>),
    Real(Vec<f64>),
    Complex(Vec<Complex64>),
    Text(Vec<String>),
}

fn read(dataset: &hdf5::Dataset) -> hdf5::Result<Dataset> {
    let attribute = |name: &str| -> hdf5::Result<String> {
        let text: hdf5::types::VarLenUnicode = dataset.attr(name)?.read_scalar()?;
        Ok(format!("{name}: {text}"))
    };
    let values = match dataset.dtype()?.to_descriptor()? {
        TypeDescriptor::Integer(_) | TypeDescriptor::Unsigned(_) => Values::Whole(dataset.read_raw()?),
        TypeDescriptor::Float(FloatSize::U8) => Values::Real(dataset.read_raw()?),
        TypeDescriptor::Compound(_) => Values::Complex(dataset.read_raw()?),
        TypeDescriptor::VarLenUnicode => {
            let text: Vec<hdf5::types::VarLenUnicode> = dataset.read_raw()?;
            Values::Text(text.iter().map(|t| t.to_string()).collect())
        }
        other => panic!("{}: a dataset of {other}", dataset.name()),
    };
    let mut names = dataset.attr_names()?;
    names.sort();
    // Of the last bits, which may differ, and names of dimensions, which have come since.
    names.retain(|n| n != "sha256" && n != "DIMENSION_LABELS");
    let attributes = names.iter().map(|n| attribute(n)).collect::<hdf5::Result<_>>()?;
    Ok(Dataset { attributes, shape: dataset.shape(), values })
}

/// All datasets below a group by their paths, provenance and fields left out.
fn datasets(group: &hdf5::Group, into: &mut BTreeMap<String, Dataset>) {
    for dataset in group.datasets().expect("datasets") {
        let read = read(&dataset).unwrap_or_else(|e| panic!("{}: {e}", dataset.name()));
        into.insert(dataset.name(), read);
    }
    for inner in group.groups().expect("groups") {
        if !["/provenance", "/VTKHDF"].contains(&inner.name().as_str()) {
            datasets(&inner, into);
        }
    }
}

fn all(file: &hdf5::File) -> BTreeMap<String, Dataset> {
    let mut found = BTreeMap::new();
    datasets(file, &mut found);
    found
}

/// The largest distance of two lists, over `measure` or else over the largest of the first.
fn distance<T: Copy + std::ops::Sub<Output = T>>(a: &[T], b: &[T], size: fn(T) -> f64, measure: Option<f64>) -> f64 {
    let largest = measure.unwrap_or_else(|| a.iter().map(|x| size(*x)).fold(0.0, f64::max));
    let apart = a.iter().zip(b).map(|(x, y)| size(*x - *y)).fold(0.0, |m: f64, d| if d <= m { m } else { d });
    match apart {
        0.0 => 0.0,
        _ => apart / largest,
    }
}

/// Columns of modes (`[rows, modes]`) with the sign that brings them nearest to the kept ones.
fn signed(kept: &[f64], found: &[f64], modes: usize) -> Vec<f64> {
    let product = |k: usize| (k..kept.len()).step_by(modes).map(|i| kept[i] * found[i]).sum::<f64>();
    let signs: Vec<f64> = (0..modes).map(|k| product(k).signum()).collect();
    found.iter().enumerate().map(|(i, v)| signs[i % modes] * v).collect()
}

/// The rows of eigenvalues that oscillate. Overdamped motion of the contact moves the bodies by rounding only, and so
/// are the shares of their modes in it.
fn of_oscillations(rows: &[f64], kept: &BTreeMap<String, Dataset>) -> Vec<f64> {
    let Values::Complex(values) = &kept["/stability/eigenvalue"].values else { panic!("eigenvalues are complex") };
    let width = rows.len() / values.len();
    let kept = rows.chunks_exact(width).zip(values).filter(|(_, v)| v.im.abs() > v.re.abs());
    kept.flat_map(|(row, _)| row.iter().copied()).collect()
}

/// The largest value of a dataset that is the measure of another one's small differences of large numbers.
fn measure(path: &str, kept: &BTreeMap<String, Dataset>) -> Option<f64> {
    let largest = |path: &str| match &kept[path].values {
        Values::Real(v) => v.iter().fold(0.0, |m: f64, x| m.max(x.abs())),
        Values::Complex(v) => v.iter().fold(0.0, |m: f64, x| m.max(x.norm())),
        _ => panic!("{path} is no measure"),
    };
    match path {
        // On a patch of some 10 mm.
        "/contact/moment_z" => Some(0.01 * largest("/contact/force")),
        "/stability/growth_rate" => Some(largest("/stability/eigenvalue")),
        "/stability/damping_ratio" => Some(1.0),
        _ => None,
    }
}

/// Datasets that have come since the results were kept.
const SINCE: [&str; 5] =
    ["/stability/criterion/", "/stability/confirmation/", "/stability/unstable", "/contact/centre", "/verdict/"];

fn compare(name: &str) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let kept = hdf5::File::open(root.join("tests/golden").join(format!("{name}.h5"))).expect("the kept results");
    let job: hdf5::types::VarLenUnicode = kept.attr("job").expect("the job").read_scalar().expect("the job's text");
    let folder = Folder::with("");
    // Files beside the job, by the same relative paths.
    std::fs::create_dir(folder.path("jobs")).expect("a folder for the job");
    std::fs::write(folder.path("jobs/job.json"), job.as_str()).expect("the job");
    std::os::unix::fs::symlink(root.join("meshes"), folder.path("meshes")).expect("the meshes");
    std::os::unix::fs::symlink(root.join("jobs/hulten"), folder.path("jobs/hulten")).expect("the matrices");
    railsqueal(1, &["run", &folder.text("jobs/job.json")]).good();

    let mut found = all(&hdf5::File::open(folder.path("jobs/job.h5")).expect("the results"));
    found.retain(|path, _| !SINCE.iter().any(|group| path.starts_with(group)));
    let kept = all(&kept);
    assert_eq!(found.keys().collect::<Vec<_>>(), kept.keys().collect::<Vec<_>>(), "{name}: datasets");
    for (path, kept_one) in &kept {
        let new = &found[path];
        assert_eq!((&new.attributes, &new.shape), (&kept_one.attributes, &kept_one.shape), "{name}: {path}");
        // Residuals tell where an iteration stopped.
        let residual = ["residual", "backward_error", "constraint_violation"].iter().any(|r| path.ends_with(r));
        let apart = match (&kept_one.values, &new.values) {
            (Values::Real(a), Values::Real(b)) if residual => {
                let largest = |v: &[f64]| v.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
                assert!(largest(b) <= (10.0 * largest(a)).max(1e-11), "{name}: {path} has grown: {a:?}, {b:?}");
                continue;
            }
            (Values::Real(a), Values::Real(b)) if path.ends_with("contact_modes") => {
                distance(a, &signed(a, b, new.shape[1]), f64::abs, None)
            }
            (Values::Real(a), Values::Real(b)) if path == "/stability/participation" => {
                let [a, b] = [a, b].map(|v| of_oscillations(v, &kept));
                distance(&a, &b, f64::abs, None)
            }
            (Values::Real(a), Values::Real(b)) => distance(a, b, f64::abs, measure(path, &kept)),
            (Values::Complex(a), Values::Complex(b)) => distance(a, b, Complex64::norm, None),
            (a, b) => {
                assert_eq!(a, b, "{name}: {path}");
                continue;
            }
        };
        assert!(apart <= LIMIT, "{name}: {path} is {apart:.1e} away: {:?}, {:?}", kept_one.values, new.values);
    }
}

#[test]
fn masses_on_a_belt() {
    compare("hulten");
}

#[test]
fn blocks_from_mesh_files() {
    compare("blocks");
}

#[test]
fn two_cylinders() {
    compare("two-cylinders");
}
