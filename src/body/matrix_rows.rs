//! From the files of a job to the matrices of a body: one order of rows for mass, damping and stiffness, their unit,
//! supports, and the contact rows.

use super::matrices::{BodyMatrices, ContactRow, ASYMMETRY};
use super::matrix_files::dofs::{self, Dof};
use super::matrix_files::{self, Format, LabelledMatrix, Source};
use super::matrix_market::Csr;
use crate::job::{self, Component, MatrixDirection, MatrixFile, MatrixFormat};
use crate::{Error, Result};
use std::collections::BTreeSet;
use std::path::Path;

/// The rows of all matrices of a body, before supports take rows out.
struct Rows {
    order: usize,
    /// Node and direction of each row, where they are known.
    dofs: Option<Vec<Dof>>,
}

impl Rows {
    /// The rows by the stiffness and the file of degrees of freedom.
    fn new(given: &job::Matrices, stiffness: &LabelledMatrix) -> Result<Self> {
        let Some(file) = given.dofs_file() else {
            return Ok(Self { order: stiffness.matrix.n, dofs: stiffness.dofs.clone() });
        };
        let dofs = dofs::read(&file)?;
        Ok(Self { order: dofs.len(), dofs: Some(dofs) })
    }

    /// Number of a degree of freedom.
    fn find(&self, dof: Dof) -> Option<usize> {
        self.dofs.as_ref()?.iter().position(|d| *d == dof)
    }

    /// Name of a row in messages.
    fn name(&self, row: usize) -> String {
        self.dofs.as_ref().and_then(|d| d.get(row)).map_or_else(|| (row + 1).to_string(), Dof::to_string)
    }

    /// A matrix in the order of these rows.
    fn place(&self, path: &Path, given: LabelledMatrix, stiffness: &Path) -> Result<Csr> {
        let LabelledMatrix { matrix, dofs } = given;
        let fail = |what: String| Error::Input(format!("{}: {what}", path.display()));
        let Some(own) = dofs else {
            if matrix.n == self.order {
                return Ok(matrix);
            }
            return Err(fail(format!(
                "a matrix of order {}, but {} is of order {}; the matrices of a body must have the same order",
                matrix.n,
                stiffness.display(),
                self.order
            )));
        };
        if self.dofs.as_ref() == Some(&own) {
            return Ok(matrix);
        }
        let Some(all) = &self.dofs else {
            return Err(fail(format!(
                "the rows are nodes and directions here, and numbers in {}; name the file that lists node and \
                 direction of each row (matrices.dofs)",
                stiffness.display()
            )));
        };
        let mut numbers: Vec<(Dof, usize)> = all.iter().copied().zip(0..).collect();
        numbers.sort_unstable();
        let number = |dof: &Dof| match numbers.binary_search_by_key(dof, |n| n.0) {
            Ok(k) => Ok(numbers[k].1),
            Err(_) => Err(fail(format!(
                "found {dof}, which is none of the {} degrees of freedom of {}; write all matrices of the same model",
                all.len(),
                stiffness.display()
            ))),
        };
        let places = own.iter().map(number).collect::<Result<Vec<usize>>>()?;
        let entry = |i: usize| {
            let (cols, values) = matrix.row(i);
            cols.iter().zip(values).map(|(&j, &v)| (places[i], places[j as usize], v)).collect::<Vec<_>>()
        };
        Ok(Csr::from_entries(self.order, (0..matrix.n).flat_map(entry).collect()))
    }

    /// Rows of a node that a key of the job names.
    fn of_node(&self, key: &str, node: i64) -> Result<Vec<usize>> {
        let Some(dofs) = &self.dofs else {
            return Err(Error::Job(format!(
                "{key}: found node {node}, but the matrices number their rows only; name the file that lists node and \
                 direction of each row (matrices.dofs), or give rows"
            )));
        };
        let rows: Vec<usize> = (0..dofs.len()).filter(|&i| dofs[i].node == node).collect();
        if rows.is_empty() {
            let nodes: BTreeSet<i64> = dofs.iter().map(|d| d.node).collect();
            let ends = (nodes.first().copied().unwrap_or(0), nodes.last().copied().unwrap_or(0));
            return Err(Error::Job(format!(
                "{key}: found node {node}, expected one of the {} nodes {} to {} that the matrices have; nodes that \
                 the other program held or condensed have no rows",
                nodes.len(),
                ends.0,
                ends.1
            )));
        }
        Ok(rows)
    }
}

/// Source of a matrix of the job.
fn source(file: &MatrixFile) -> Source<'_> {
    let (name, format) = match file {
        MatrixFile::Path(_) => (None, None),
        MatrixFile::Keys(keys) => (keys.name.as_deref(), keys.format),
    };
    let format = format.map(|f| match f {
        MatrixFormat::MatrixMarket => Format::MatrixMarket,
        MatrixFormat::Abaqus => Format::Abaqus,
        MatrixFormat::Calculix => Format::CalculiX,
        MatrixFormat::Dmig => Format::Dmig,
        MatrixFormat::Op4 => Format::Op4,
        MatrixFormat::HarwellBoeing => Format::HarwellBoeing,
    });
    Source { path: file.path(), name, format }
}

impl BodyMatrices {
    /// Reads the files of the body `name` and checks that they fit each other, the supports and the contact rows.
    ///
    /// # Errors
    /// `Error::Input` with the file, `Error::Job` with the key.
    pub fn read(name: &str, given: &job::Matrices) -> Result<Self> {
        let (path_m, path_k) = (given.mass.path(), given.stiffness.path());
        let stiffness = matrix_files::read(&source(&given.stiffness))?;
        let rows = Rows::new(given, &stiffness)?;
        let mut k = rows.place(path_k, stiffness, &given.dofs_file().unwrap_or_else(|| path_k.clone()))?;
        let placed = |file: &MatrixFile| rows.place(file.path(), matrix_files::read(&source(file))?, path_k);
        let mut m = placed(&given.mass)?;
        let mut c = given.damping.as_ref().map(placed).transpose()?;
        symmetric(&rows, path_m, &m)?;
        symmetric(&rows, path_k, &k)?;
        definite(&rows, path_m, &m)?;
        // Forces are the same; lengths of coordinates, of whatever kind, are those of the contact rows.
        for matrix in [Some(&mut m), Some(&mut k), c.as_mut()].into_iter().flatten() {
            matrix.values.iter_mut().for_each(|v| *v /= given.scale);
        }
        let held = held(name, given, &rows)?;
        add_springs(name, given, &rows, (&mut k, &mut c))?;
        let contacts = contact_rows(name, given, &rows)?;
        let place = |row: usize| (!held.contains(&row)).then(|| row - held.range(..row).count());
        let free = |row: ContactRow| row.into_iter().filter_map(|(dof, f)| Some((place(dof)?, f))).collect();
        let contacts = contacts.into_iter().map(|c| c.map(free)).collect();
        if let Some(i) = (0..k.n).find(|&i| m.get(i, i) == 0.0 && k.get(i, i) == 0.0 && !held.contains(&i)) {
            return Err(Error::Input(format!(
                "{}: row {} has neither stiffness nor mass on its diagonal",
                path_k.display(),
                rows.name(i)
            )));
        }
        if held.len() == k.n {
            return Err(Error::Job(format!(
                "bodies.{name}.matrices.supports: all rows are clamped, expected some that move"
            )));
        }
        refuse_penalties(&rows, path_k, &k, &held)?;
        let [mass, stiffness] = [&m, &k].map(|a| without(a, &held));
        Ok(Self { mass, damping: c.map(|c| without(&c, &held)), stiffness, contacts })
    }

    /// Order of the matrices of the body `name`, by its stiffness and supports.
    pub fn order(name: &str, given: &job::Matrices) -> Result<usize> {
        let stiffness = matrix_files::read(&source(&given.stiffness))?;
        let rows = Rows::new(given, &stiffness)?;
        Ok(rows.order - held(name, given, &rows)?.len())
    }
}

/// Refuses a matrix that is not symmetric.
fn symmetric(rows: &Rows, path: &Path, matrix: &Csr) -> Result<()> {
    match matrix.asymmetry().filter(|a| a.2 > ASYMMETRY) {
        Some((i, j, d)) => {
            let (i, j) = (rows.name(i), rows.name(j));
            Err(Error::Input(format!(
                "{}: not symmetric: entries ({i}, {j}) and ({j}, {i}) differ by {d:.1e} of the largest entry",
                path.display()
            )))
        }
        None => Ok(()),
    }
}

/// Refuses a mass that is negative for some motion.
fn definite(rows: &Rows, path: &Path, m: &Csr) -> Result<()> {
    match indefinite(m) {
        Some((i, j)) => Err(Error::Input(format!(
            "{}: the mass is negative for some motion: found {:e} in row {}, column {}, with {:e} and {:e} on the \
             diagonal; expected a matrix that is positive semidefinite. Look for a wrong sign",
            path.display(),
            m.get(i, j),
            rows.name(i),
            rows.name(j),
            m.get(i, i),
            m.get(j, j)
        ))),
        None => Ok(()),
    }
}

/// An entry by which a symmetric matrix is not positive semidefinite: one below 0 on the diagonal, or one that is
/// larger than the geometric mean of those on the diagonal.
fn indefinite(m: &Csr) -> Option<(usize, usize)> {
    let diagonal: Vec<f64> = (0..m.n).map(|i| m.get(i, i)).collect();
    let scale = diagonal.iter().fold(0.0, |s: f64, d| s.max(d.abs()));
    let tiny = ASYMMETRY * scale;
    if let Some(i) = (0..m.n).find(|&i| diagonal[i] < -tiny) {
        return Some((i, i));
    }
    (0..m.n).find_map(|i| {
        let row = m.indptr[i]..m.indptr[i + 1];
        let large = |&k: &usize| {
            let j = m.cols[k] as usize;
            j > i && m.values[k].abs() > (diagonal[i].max(0.0) * diagonal[j].max(0.0)).sqrt() * (1.0 + ASYMMETRY) + tiny
        };
        row.into_iter().find(large).map(|k| (i, m.cols[k] as usize))
    })
}

/// Refuses entries on the diagonal of K by which another program holds degrees of freedom: so large that nothing of the
/// others is left in double precision.
fn refuse_penalties(rows: &Rows, path: &Path, k: &Csr, held: &BTreeSet<usize>) -> Result<()> {
    let free = (0..k.n).filter(|i| !held.contains(i)).map(|i| (k.get(i, i), i)).filter(|d| d.0 > 0.0);
    let mut diagonal: Vec<(f64, usize)> = free.collect();
    diagonal.sort_by(|a, b| a.0.total_cmp(&b.0));
    let Some(&(usual, _)) = diagonal.get(diagonal.len() / 2) else { return Ok(()) };
    let large: Vec<&(f64, usize)> = diagonal.iter().filter(|d| d.0 > PENALTY * usual).collect();
    match large.iter().min_by_key(|d| d.1) {
        Some((value, row)) => Err(Error::Input(format!(
            "{}: found {value:e} on the diagonal of row {}, where {usual:.1e} is usual, and so in {} rows: the other \
             program holds them. Clamp their nodes in the job (matrices.supports, clamped), or write the matrices \
             without boundary conditions",
            path.display(),
            rows.name(*row),
            large.len()
        ))),
        None => Ok(()),
    }
}

/// Entries on the diagonal of K that are so many times the median hold degrees of freedom.
const PENALTY: f64 = 1e15;

/// Rows that supports clamp.
fn held(name: &str, given: &job::Matrices, rows: &Rows) -> Result<BTreeSet<usize>> {
    let mut held = BTreeSet::new();
    for (i, support) in given.supports.iter().enumerate() {
        for &node in support.nodes.iter().filter(|_| !support.clamped.is_empty()) {
            let key = format!("bodies.{name}.matrices.supports.{i}");
            rows.of_node(&format!("{key}.nodes"), node)?;
            for component in &support.clamped {
                held.insert(row_of(rows, &format!("{key}.clamped"), node, *component)?);
            }
        }
    }
    Ok(held)
}

/// Row of a component at a node.
fn row_of(rows: &Rows, key: &str, node: i64, component: Component) -> Result<usize> {
    let dof = Dof { node, direction: component as u8 + 1 };
    rows.find(dof).ok_or_else(|| missing(rows, key, dof))
}

/// The fault of a degree of freedom that the matrices do not have.
fn missing(rows: &Rows, key: &str, dof: Dof) -> Error {
    let all = rows.dofs.iter().flatten().filter(|d| d.node == dof.node);
    let there: Vec<String> = all.map(Dof::to_string).collect();
    Error::Job(format!(
        "{key}: found {dof}, which the matrices do not have; of this node they have {}",
        if there.is_empty() { "nothing".into() } else { there.join(", ") }
    ))
}

/// Adds springs and dashpots of the supports to the diagonals of K and C.
fn add_springs(name: &str, given: &job::Matrices, rows: &Rows, (k, c): (&mut Csr, &mut Option<Csr>)) -> Result<()> {
    let (mut springs, mut dashpots) = (Vec::new(), Vec::new());
    for (i, support) in given.supports.iter().enumerate() {
        for (what, values, list) in
            [("stiffness", support.stiffness, &mut springs), ("damping", support.damping, &mut dashpots)]
        {
            let Some(values) = values else { continue };
            for &node in &support.nodes {
                let key = format!("bodies.{name}.matrices.supports.{i}");
                rows.of_node(&format!("{key}.nodes"), node)?;
                let components = [Component::X, Component::Y, Component::Z];
                for (component, value) in components.into_iter().zip(values).filter(|(_, v)| *v > 0.0) {
                    list.push((row_of(rows, &format!("{key}.{what}"), node, component)?, value));
                }
            }
        }
    }
    if !springs.is_empty() {
        *k = with_diagonal(k, &springs);
    }
    if !dashpots.is_empty() {
        let none = || Csr::from_entries(k.n, Vec::new());
        *c = Some(with_diagonal(&c.take().unwrap_or_else(none), &dashpots));
    }
    Ok(())
}

/// Entries of a matrix.
fn entries(a: &Csr) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
    (0..a.n).flat_map(|i| {
        let (cols, values) = a.row(i);
        cols.iter().zip(values).map(move |(&j, &v)| (i, j as usize, v))
    })
}

/// A matrix with values added to its diagonal.
fn with_diagonal(a: &Csr, values: &[(usize, f64)]) -> Csr {
    Csr::from_entries(a.n, entries(a).chain(values.iter().map(|&(i, v)| (i, i, v))).collect())
}

/// A matrix without the rows and columns that are held.
fn without(a: &Csr, held: &BTreeSet<usize>) -> Csr {
    if held.is_empty() {
        return a.clone();
    }
    let mut place = vec![None; a.n];
    for (new, old) in (0..a.n).filter(|i| !held.contains(i)).enumerate() {
        place[old] = Some(new);
    }
    let kept = entries(a).filter_map(|(i, j, v)| Some((place[i]?, place[j]?, v)));
    Csr::from_entries(a.n - held.len(), kept.collect())
}

/// The contact rows before supports take rows out.
fn contact_rows(name: &str, given: &job::Matrices, rows: &Rows) -> Result<Vec<[ContactRow; 3]>> {
    let one = |(i, contact): (usize, &job::MatrixContact)| {
        let own = || format!("bodies.{name}.matrices.contacts.{i}");
        let key = contact.made_of.clone().unwrap_or_else(own);
        let row = |direction: Option<&MatrixDirection>, what: &str| match direction {
            Some(direction) => contact_row(rows, contact, &key, (*direction, what)),
            None => Ok(ContactRow::new()),
        };
        Ok([
            row(contact.tangential.first(), "tangential.0")?,
            row(contact.tangential.get(1), "tangential.1")?,
            row(Some(&contact.normal), "normal")?,
        ])
    };
    given.contacts.iter().enumerate().map(one).collect()
}

/// The row of one direction of a contact.
fn contact_row(
    rows: &Rows,
    contact: &job::MatrixContact,
    key: &str,
    (direction, what): (MatrixDirection, &str),
) -> Result<ContactRow> {
    let (Some(node), Some(vector)) = (contact.node, direction.vector()) else {
        let MatrixDirection::Row(row) = direction else {
            return Err(Error::Job(format!("{key}.node: missing; {key}.{what} is a direction at a node")));
        };
        if row == 0 {
            return Ok(ContactRow::new());
        }
        let number = row.unsigned_abs() as usize;
        if number > rows.order {
            return Err(Error::Job(format!(
                "{key}.{what}: found row {number}, but the matrices have the rows 1 to {}",
                rows.order
            )));
        }
        return Ok(vec![(number - 1, if row < 0 { -1.0 } else { 1.0 })]);
    };
    let mut terms = ContactRow::new();
    for (which, node, sign) in [("node", Some(node), 1.0), ("against", contact.against, -1.0)] {
        let Some(node) = node else { continue };
        rows.of_node(&format!("{key}.{which}"), node)?;
        for (direction, coefficient) in (1..).zip(vector).filter(|(_, v)| *v != 0.0) {
            let dof = Dof { node, direction };
            let row = rows.find(dof).ok_or_else(|| missing(rows, &format!("{key}.{what}"), dof))?;
            terms.push((row, sign * coefficient));
        }
    }
    Ok(terms)
}
