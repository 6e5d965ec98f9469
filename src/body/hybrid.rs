//! The contacts of a body whose compliance is that of a half-space and, at each contact, a motion that is constant or
//! goes with x and y ("hybrid"). The nine functions π of each of T contacts make a matrix of order 9T, which couples
//! the contacts; the half-space acts within each of them. Rows are stacked over the contacts.

use super::half_space::HalfSpace;
use super::near_contacts::{add_between, ends, near_pairs, ContactPosition, NearPair};
use super::positivity::refuse_negative;
use crate::parallel::World;
use crate::swept::compliance::{pair_of, put, sum};
use crate::swept::{rotate_load_pairs_between, Constant, Forms, LoadPatch, Path, SectionContact};
use crate::{Error, Result};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};

pub use crate::swept::{Square, LOADS};

/// Part of the smaller half side of a grid that the circle of the loads has as its radius: about a contact that the
/// grid holds with room to spare.
pub const CIRCLE: f64 = 2.0 / 3.0;
/// A second patch of loads, a wider circle or a smaller rectangle, shows how little the constant depends on it.
pub const WIDER: f64 = 1.5;
/// A difference between both patches of more than this part of the contact's own compliance is called large.
const LARGE: f64 = 0.01;

/// Lines of a contact grid along x and y, m.
pub type Lines = [Vec<f64>; 2];

/// Σ ψ̂ψ̂ᵀ/ω²: what modes with ψ̂ = `seen`, `[9T, m]`, and the angular frequencies `omega`, rad/s, have of the
/// compliance, `[9T, 9T]`.
pub(super) fn statics(omega: &[f64], seen: MatRef<'_, f64>) -> Mat<f64> {
    let mut sum = Mat::<f64>::zeros(seen.nrows(), seen.nrows());
    for (k, w) in omega.iter().enumerate().filter(|(_, w)| **w > 0.0) {
        for j in 0..seen.nrows() {
            for i in 0..seen.nrows() {
                sum[(i, j)] += seen[(i, k)] * seen[(j, k)] / (w * w);
            }
        }
    }
    sum
}

/// Radius of the circle of the loads on a grid with these lines along x and y, m.
pub(crate) fn circle_radius(grid: [&[f64]; 2]) -> f64 {
    let half = |lines: &[f64]| 0.5 * (lines[lines.len() - 1] - lines[0]);
    CIRCLE * half(grid[0]).min(half(grid[1]))
}

/// The rectangle that the nodes of a grid stand for, as a patch of loads.
fn rectangle([x, y]: &Lines) -> LoadPatch {
    let ([back, front], [low, high]) = (ends(x), ends(y));
    LoadPatch::Rectangle { half: [0.5 * (front - back), 0.5 * (high - low)], middle: 0.5 * (low + high) }
}

/// Number of contact rows of a grid, 3n.
pub(super) fn rows([x, y]: &Lines) -> usize {
    3 * x.len() * y.len()
}

/// π = (1, x, y) of the contact rows on a grid of lines along x and y, m, `[3n, 9]`.
pub fn expansion(grid: &Lines) -> Mat<f64> {
    expansions(std::slice::from_ref(grid))
}

/// π of the rows of several contacts, stacked, and of the nine functions of each: block diagonal, `[3n, 9T]`.
pub(crate) fn expansions(grids: &[Lines]) -> Mat<f64> {
    let mut pi = Mat::zeros(grids.iter().map(rows).sum(), LOADS * grids.len());
    let mut first = 0;
    for (c, [x, y]) in grids.iter().enumerate() {
        for row in 0..rows(&grids[c]) {
            let node = row / 3;
            let factors = [1.0, x[node % x.len()], y[node / x.len()]];
            factors.into_iter().enumerate().for_each(|(m, f)| pi[(first + row, LOADS * c + 3 * m + row % 3)] = f);
        }
        first += rows(&grids[c]);
    }
    pi
}

/// Low-rank compliance of a body at its contact rows: at each contact it yields as a half-space does, and by motions
/// that are constant or go with x and y, as its modes move.
#[derive(Debug, Clone, PartialEq)]
pub struct Compact {
    /// The half-space.
    pub half_space: HalfSpace,
    /// Contacts that act on each other through it.
    pub near: Vec<NearPair>,
    /// Compliance beside it that the modes have no part in, m/N and so on, `[9T, 9T]`.
    pub beside: Mat<f64>,
    /// The modes, 1/√kg and 1/(√kg m), `[9T, m]`.
    pub seen: Mat<f64>,
}

/// The whole contact rows of a body in few numbers: files keep them in place of matrices.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactFunctions {
    /// The half-space.
    pub half_space: HalfSpace,
    /// Contacts that act on each other through it.
    pub near: Vec<NearPair>,
    /// Compliance beside it, that of the modes included, m/N and so on, `[9T, 9T]`.
    pub constant: Mat<f64>,
    /// The modes, 1/√kg and 1/(√kg m), `[9T, m]`.
    pub seen: Mat<f64>,
}

impl ContactFunctions {
    /// Static compliance of the contact rows on `grids`, m/N, `[3n, 3n]`, and the modes there, 1/√kg, `[3n, m]`, to
    /// the last bit those of [`Hybrid`].
    pub fn on_grids(&self, grids: &[Lines]) -> Result<(Mat<f64>, Mat<f64>)> {
        Ok((matrix(&self.half_space, &self.constant, (grids, &self.near))?, expansions(grids) * &self.seen))
    }
}

/// The contact rows of a body, on every rank.
#[derive(Debug, Clone)]
pub struct Hybrid {
    /// Grid of each of T contacts.
    grids: Vec<Lines>,
    half_space: HalfSpace,
    /// Contacts that act on each other through it, and remarks on the others.
    near: Vec<NearPair>,
    remarks: Vec<String>,
    /// Compliance beside the half-space, m/N and so on, `[9T, 9T]`; none before it is made.
    constant: Option<Mat<f64>>,
    /// Addition to that from elsewhere, as it is with the modes.
    beside: Mat<f64>,
    /// The modes at the contacts, once they are known, and their part of it.
    seen: Mat<f64>,
    modal: Mat<f64>,
}

impl Hybrid {
    /// Compliance of a body of the material of `half_space` with the lines of the grid of each contact, m.
    pub fn new(half_space: HalfSpace, grids: Vec<Lines>) -> Self {
        let order = LOADS * grids.len();
        let none = || Mat::zeros(order, order);
        Self {
            half_space,
            near: Vec::new(),
            remarks: Vec::new(),
            constant: None,
            beside: none(),
            seen: Mat::zeros(order, 0),
            modal: none(),
            grids,
        }
    }

    /// Number of contact rows, 3n.
    pub fn rows(&self) -> usize {
        self.grids.iter().map(rows).sum()
    }

    /// Says where the contacts of a section are, each with the angle of its grid against its loads, rad: which of them
    /// act on each other through the half-space.
    pub fn place(&mut self, path: Path, contacts: &[SectionContact], tilts: &[f64]) -> Result<()> {
        let position = |(contact, tilt): (&SectionContact, &f64)| {
            let (along, angle) = (contact.along(), tilt + contact.angle());
            match path {
                Path::Axle => ContactPosition::round(contact.touched(), along, angle),
                Path::Line(_) => ContactPosition::straight(contact.origin(), along, angle),
            }
        };
        self.find_near(&contacts.iter().zip(tilts).take(self.grids.len()).map(position).collect::<Vec<_>>())
    }

    /// Finds the contacts that act on each other through the half-space by the `positions` of all.
    pub(super) fn find_near(&mut self, positions: &[ContactPosition]) -> Result<()> {
        let radii: Vec<f64> = self.grids.iter().map(|[x, y]| circle_radius([x, y])).collect();
        (self.near, self.remarks) = near_pairs(positions, &radii, &self.grids)?;
        Ok(())
    }

    /// The patches of the loads, one of each contact: circles, and rectangles of contacts near each other. A rectangle
    /// covers its grid. An even load on it yields little more than a rigid punch on the grid does, and the whole is
    /// positive definite where the body yields more than the difference of both. Slopes under loads on a small circle,
    /// extended to the ends of a slender grid, would reach beyond the other contact.
    pub fn patches(&self) -> Vec<LoadPatch> {
        let is_near = |c: usize| self.near.iter().any(|pair| pair.contacts.contains(&c));
        let of = |(c, grid): (usize, &Lines)| match is_near(c) {
            true => rectangle(grid),
            false => LoadPatch::Circle { radius: circle_radius([&grid[0], &grid[1]]) },
        };
        self.grids.iter().enumerate().map(of).collect()
    }

    /// Collective: makes what is added to the half-space from the `forms` of a section that is meshed for loads at its
    /// `contacts`. The frame of each grid is turned by one of `tilts`, rad, against that of its loads. Returns a line
    /// for the summary.
    pub fn make(
        &mut self,
        world: &World,
        forms: &Forms,
        contacts: &[SectionContact],
        tilts: &[f64],
    ) -> Result<Option<String>> {
        let patches = self.patches();
        if patches.is_empty() {
            return Ok(None);
        }
        let second = |patch: &LoadPatch| match patch {
            LoadPatch::Circle { .. } => patch.times(WIDER),
            LoadPatch::Rectangle { .. } => patch.times(1.0 / WIDER),
        };
        let others: Vec<LoadPatch> = patches.iter().map(second).collect();
        // Beside a corner there is room for the one alone.
        let both = Constant::of_contacts(forms, &[patches.clone(), others.clone()], contacts);
        let constant = both.or_else(|_| Constant::of_contacts(forms, std::slice::from_ref(&patches), contacts))?;
        let mut made = in_grids(world, &constant, tilts)?;
        made.iter_mut().zip([&patches, &others]).for_each(|(all, set)| self.take_off_known(all, set));
        let beside = self.keep_first(&made, &patches)?;
        let solved = format!(
            "section of {} unknowns solved at {} of the Fourier orders up to {}; {beside}",
            forms.order(),
            constant.blocks.len(),
            constant.blocks.iter().map(|b| b.0 + b.1 / 2).max().unwrap_or(0)
        );
        Ok(Some([vec![solved], self.remarks.clone()].concat().join("; ")))
    }

    /// Takes what the half-space does between near contacts off `all` that loads on the `patches` do to each other,
    /// `[9T, 9T]`.
    fn take_off_known(&self, all: &mut Mat<f64>, patches: &[LoadPatch]) {
        for pair in &self.near {
            let (known, [c, d]) = (pair.share(&self.half_space, patches), pair.contacts);
            for i in 0..LOADS {
                for j in 0..LOADS {
                    all[(LOADS * c + i, LOADS * d + j)] -= known[i][j];
                    all[(LOADS * d + j, LOADS * c + i)] -= known[i][j];
                }
            }
        }
    }

    /// Keeps the compliance that `yielding`, Γ⁻¹BΓ⁻¹ of loads on sets of `patches`, leaves beside the half-spaces; said
    /// in words, for the summary.
    pub fn complete(&mut self, yielding: &[Mat<f64>], patches: &[Vec<LoadPatch>]) -> Result<String> {
        let beside = |(b, set): (&Mat<f64>, &Vec<LoadPatch>)| -> Mat<f64> {
            let mut all = b.clone();
            for (c, &patch) in set.iter().enumerate() {
                let (known, own) = (self.half_space.under_loads(patch), pair_of(b.as_ref(), [c, c]));
                put(&mut all, [c, c], &std::array::from_fn(|i| std::array::from_fn(|j| own[i][j] - known[i][j])));
            }
            self.take_off_known(&mut all, set);
            all
        };
        let made: Vec<Mat<f64>> = yielding.iter().zip(patches).map(beside).collect();
        let first = patches.first().cloned().unwrap_or_default();
        let size = |patch: &LoadPatch| match patch.half().map(|a| 1e3 * a) {
            [_, radius] if matches!(patch, LoadPatch::Circle { .. }) => format!("a disc of {radius:.2} mm"),
            [a, b] => format!("a rectangle of {:.2} by {:.2} mm", 2.0 * a, 2.0 * b),
        };
        let over: Vec<String> = first.iter().map(size).collect();
        let beside = self.keep_first(&made, &first)?;
        let means = format!("means over {}; {beside}", over.join(" and "));
        Ok([vec![means], self.remarks.clone()].concat().join("; "))
    }

    /// Keeps the first of `made`, what is added to the half-space by loads on the `patches` and on other ones; in
    /// words.
    fn keep_first(&mut self, made: &[Mat<f64>], patches: &[LoadPatch]) -> Result<String> {
        let Some(all) = made.first() else { return Err(Error::Defect("no compliance beside the half-space".into())) };
        self.constant = Some(all.clone());
        let mut texts = Vec::new();
        for (c, patch) in patches.iter().enumerate() {
            let of = |all: &Mat<f64>| pair_of(all.as_ref(), [c, c]);
            let text = self.in_words(&of(all), made.get(1).map(of).as_ref(), *patch);
            texts.push(if patches.len() == 1 { text } else { format!("contact {}: {text}", c + 1) });
        }
        for d in 1..patches.len() {
            for c in 0..d {
                let a = pair_of(all.as_ref(), [c, d]);
                let part = |i: usize, j: usize| 1e12 * a[i][j];
                texts.push(format!(
                    "between contacts {} and {} xx {:.2}, yy {:.2}, nn {:.2}, yn {:.2}, ny {:.2} pm/N",
                    c + 1,
                    d + 1,
                    part(0, 0),
                    part(1, 1),
                    part(2, 2),
                    part(1, 2),
                    part(2, 1)
                ));
            }
        }
        Ok(texts.join("; "))
    }

    /// Describes the compliance of one contact beside the half-space, with that of a second patch, where there is
    /// one.
    fn in_words(&self, a: &Square, other: Option<&Square>, patch: LoadPatch) -> String {
        let pico = |v: f64| 1e12 * v;
        let mut text = format!(
            "compliance added to the half-space xx {:.1}, yy {:.1}, nn {:.1}, yn {:.1} pm/N",
            pico(a[0][0]),
            pico(a[1][1]),
            pico(a[2][2]),
            pico(a[1][2])
        );
        if let Some(other) = other {
            // Displacements of the middle under forces.
            let off = |c: usize, d: usize| (other[c][d] - a[c][d]).abs();
            let largest = |all: &[(usize, usize)]| all.iter().map(|&(c, d)| off(c, d)).fold(0.0, f64::max);
            let (normal, along) = (largest(&[(0, 2), (1, 2), (2, 2)]), largest(&[(0, 0), (0, 1), (1, 1)]));
            let own = 0.6 / (self.half_space.plane() * (patch.half()[0] * patch.half()[1]).sqrt());
            text += &format!(
                "; estimated error {:.1} pm/N (normal, {:.2} % of the contact's own compliance), {:.1} pm/N \
                 (tangential){}",
                pico(normal),
                100.0 * normal / own,
                pico(along),
                if normal > LARGE * own { "; this is large: the surface is not that of a half-space" } else { "" }
            );
        }
        text
    }

    /// The modes with ψ̂ = `seen`, `[9T, m]`, and the angular frequencies `omega`, rad/s, at the contact rows, 1/√kg,
    /// `[3n, m]`. Keeps their share of the compliance.
    pub fn of_modes(&mut self, omega: &[f64], seen: &Mat<f64>) -> Mat<f64> {
        self.modal = statics(omega, seen.as_ref());
        self.seen = seen.clone();
        expansions(&self.grids) * seen
    }

    /// Sets the compliance beside the half-space, which was computed before.
    pub(crate) fn adopt(&mut self, constant: Mat<f64>) {
        self.constant = Some(constant);
    }

    /// Adds compliance of the body at its contacts beside what the forms of its section say, m/N and so on, `[9T, 9T]`;
    /// the last one given counts.
    pub fn add(&mut self, beside: Mat<f64>) {
        self.beside = beside;
    }

    /// Lines of the grid of each contact along x and y, m.
    pub(super) fn grids(&self) -> &[Lines] {
        &self.grids
    }

    /// ψ̂ of the modes, `[9T, m]`, once they are known.
    pub(super) fn contact_modes(&self) -> &Mat<f64> {
        &self.seen
    }

    fn constant(&self, name: &str) -> Result<Mat<f64>> {
        let missing = || Error::Defect(format!("body \"{name}\" has no compliance: it is not factorised"));
        let constant = self.constant.as_ref().ok_or_else(missing)?;
        Ok(constant + &self.beside)
    }

    /// Data that the contact rows of the body `name` need, after its modes are known.
    pub fn compact(&self, name: &str) -> Result<Compact> {
        let beside = self.constant(name)? - &self.modal;
        Ok(Compact { half_space: self.half_space, near: self.near.clone(), beside, seen: self.seen.clone() })
    }

    /// The contact rows of the body `name` in few numbers, after its modes are known.
    pub fn functions(&self, name: &str) -> Result<ContactFunctions> {
        let (near, seen) = (self.near.clone(), self.seen.clone());
        Ok(ContactFunctions { half_space: self.half_space, near, constant: self.constant(name)?, seen })
    }

    /// Collective: static compliance of the contact rows of the body `name`, m/N, `[3n, 3n]` on rank 0. What is left
    /// of it without the modes has to be positive.
    pub fn compliance(&self, world: &World, name: &str) -> Result<Option<Mat<f64>>> {
        let constant = self.constant(name)?;
        refuse_negative(world, &[(name, &self.compact(name)?)], &self.grids)?;
        world.on_root(|| matrix(&self.half_space, &constant, (&self.grids, &self.near)))
    }

    /// Collective: static displacement of the contact rows of the body `name`, m, `[3n]` on rank 0, under forces on
    /// them, N.
    pub fn response(&self, world: &World, name: &str, forces: &[f64]) -> Result<Vec<f64>> {
        let constant = self.constant(name)?;
        let found = world.on_root(|| {
            let pi = expansions(&self.grids);
            let all = faer::ColRef::from_slice(forces);
            let mut moved = &pi * (constant * (pi.transpose() * all));
            let mut first = 0;
            for grid in &self.grids {
                let c = self.half_space.compliance(&grid[0], &grid[1])?;
                let own = c * all.subrows(first, rows(grid));
                own.iter().enumerate().for_each(|(i, u)| moved[first + i] += u);
                first += rows(grid);
            }
            if !self.near.is_empty() {
                let mut between = Mat::zeros(self.rows(), self.rows());
                add_between(&mut between, &self.half_space, (&self.grids, &self.near), 1.0)?;
                moved += between * all;
            }
            Ok(moved.iter().copied().collect())
        })?;
        Ok(found.unwrap_or_default())
    }
}

/// Circles of the loads at a contact, all on one mesh of the section.
#[derive(Debug, Clone, Copy)]
pub struct LoadCircles<'a> {
    /// Radius of the circle that the section is meshed for, m.
    pub mesh: f64,
    /// Radii of the circles, m.
    pub radii: &'a [f64],
}

/// Collective: compliance beside the half-space of a `contact` of a section with these `forms` under loads on a circle
/// of each of the `radii`, m/N and so on, `[9, 9]`. Its frame is turned by `tilt`, rad, against that of its loads.
pub(super) fn of_circles(
    world: &World,
    forms: &Forms,
    (contact, tilt): (&SectionContact, f64),
    radii: &[f64],
) -> Result<Vec<Mat<f64>>> {
    let circles: Vec<LoadPatch> = radii.iter().map(|&radius| LoadPatch::Circle { radius }).collect();
    in_grids(world, &Constant::for_contact(forms, &circles, contact)?, &[tilt])
}

/// Collective: the sums of `constant`, `[9T, 9T]`, in the frames of the grids, which are turned by `tilts`, rad.
pub(super) fn in_grids(world: &World, constant: &Constant, tilts: &[f64]) -> Result<Vec<Mat<f64>>> {
    let mine = (world.rank..constant.blocks.len()).step_by(world.size);
    let mut memory = Vec::new();
    let parts = world.agree(mine.map(|k| constant.block(k, &mut memory)).collect::<Result<Vec<_>>>())?;
    let mut own = constant.singles();
    if !world.is_root() {
        own.iter_mut().for_each(|a| a.fill(0.0));
    }
    let order = LOADS * tilts.len();
    let numbers: Vec<f64> = sum(parts.into_iter().chain([own])).iter().flat_map(numbers).collect();
    let all = world.sum_all(&numbers);
    let framed = |a: &[f64]| in_frames(&Mat::from_fn(order, order, |i, j| a[i + order * j]), tilts);
    Ok(all.chunks_exact(order * order).map(framed).collect())
}

/// Entries of a matrix, column by column.
fn numbers(matrix: &Mat<f64>) -> Vec<f64> {
    matrix.col_iter().flat_map(|column| column.iter().copied().collect::<Vec<f64>>()).collect()
}

/// Values between the loads of all contacts, `[9T, 9T]`, with each contact in a frame that is turned by one of `tilts`,
/// rad.
fn in_frames(all: &Mat<f64>, tilts: &[f64]) -> Mat<f64> {
    let mut turned = all.clone();
    for (c, &one) in tilts.iter().enumerate() {
        for (d, &other) in tilts.iter().enumerate() {
            put(&mut turned, [c, d], &rotate_load_pairs_between(&pair_of(all.as_ref(), [c, d]), [one, other]));
        }
    }
    turned
}

/// A half-space at each contact, stacked, block diagonal, m/N, `[3n, 3n]`.
pub fn half_spaces(half_space: &HalfSpace, grids: &[Lines]) -> Result<Mat<f64>> {
    let size = grids.iter().map(rows).sum();
    let mut all = Mat::zeros(size, size);
    let mut first = 0;
    for grid in grids {
        let own = half_space.compliance(&grid[0], &grid[1])?;
        if grids.len() == 1 {
            return Ok(own);
        }
        all.as_mut().submatrix_mut(first, first, rows(grid), rows(grid)).copy_from(&own);
        first += rows(grid);
    }
    Ok(all)
}

/// A half-space at each contact, between contacts that are `near`, and what is `beside` it at the contact rows, m/N,
/// `[3n, 3n]`.
pub(super) fn matrix(
    half_space: &HalfSpace,
    beside: &Mat<f64>,
    (grids, near): (&[Lines], &[NearPair]),
) -> Result<Mat<f64>> {
    let mut c = half_spaces(half_space, grids)?;
    add_between(&mut c, half_space, (grids, near), 1.0)?;
    add_functions(&mut c, &expansions(grids), beside.as_ref());
    Ok(c)
}

/// Adds π D πᵀ, D = `beside`, to a matrix of the contact rows, `[3n, 3n]`.
pub(crate) fn add_functions(c: &mut Mat<f64>, pi: &Mat<f64>, beside: MatRef<'_, f64>) {
    let half = pi * beside;
    matmul(c.as_mut(), Accum::Add, half.as_ref(), pi.transpose(), 1.0, Par::Seq);
}
