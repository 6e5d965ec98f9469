//! Contacts of a body that lie near each other on one surface: they act on each other through one half-space.
//!
//! The effect of one contact on another falls like the inverse of their distance, and nine functions describe it over a
//! contact only where the contact is small against the distance. Nearer contacts c and d have the half-space between
//! them as each has it by itself, also where the surface bends, as from the root of a flange to its face. They lie on a
//! half-space with the mean of their normals, the second one `apart` from the first along x and y. Their own directions
//! are turned against it by half the angle between them, Q_c and Q_d: points on either side of where they meet move
//! alike. The functions describe what is left,
//!
//! C_cd = Q_c W_hs(x_i − x_j − apart) Q_dᵀ + π_c (A_cd − A_hs,cd) π_dᵀ,
//!
//! with A_hs,cd of that half-space under the loads of both, so that forces and moments on both do to each other what
//! they do on the body. On a plane surface this is one contact on two grids.

use super::half_space::HalfSpace;
use super::hybrid::{expansions, half_spaces, rows, Lines};
use crate::swept::compliance::scaled;
use crate::swept::{HalfSpaceLoad, LoadPatch, Square, LOADS};
use crate::{Error, Result};
use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

/// Position of a contact: a point, m, and the unit normal out of the body there, in one frame for all of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactPosition {
    /// Point, m.
    pub point: [f64; 3],
    /// Normal out of the body.
    pub normal: [f64; 3],
}

/// Two contacts that act on each other through one half-space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearPair {
    /// Their numbers, from 0, ascending.
    pub contacts: [usize; 2],
    /// Place of the second one from the first along x and y, m.
    pub apart: [f64; 2],
    /// Angle of the frame of the second one against that of the first about x, rad.
    pub bend: f64,
}

/// Distance of two contacts over the larger half side of their grids below which the half-space acts between them.
const NEAR: f64 = 3.0;
/// Distance of two contacts over the larger radius of their circles below which nine means do not describe what one
/// does to the other.
const ROUGH: f64 = 3.0;
/// Largest angle between the normals of places of which one grid might span both, rad.
const ALIKE: f64 = 0.2;
/// Largest angle between the normals of places on one surface that may bend, such as the root of a flange, rad.
const BENT: f64 = 1.0;
/// Distance over the sides of rectangles beyond which a force on them acts as one at a point.
const FAR: f64 = 10.0;
/// Cells across a patch of loads.
const ACROSS: usize = 16;
/// Nodes of all grids together to which they are thinned for their stiffness.
const THINNED: usize = 900;

impl ContactPosition {
    /// Position at the angle `along` about an axle, rad, from the place (r, y) of a section, m, whose normal is turned
    /// by `angle`, rad, from the radius to smaller y.
    pub fn round([r, y]: [f64; 2], along: f64, angle: f64) -> Self {
        let ((s, c), (lean, up)) = (along.sin_cos(), angle.sin_cos());
        Self { point: [r * s, y, r * c], normal: [up * s, -lean, up * c] }
    }

    /// The same at the distance `along`, m, on a line.
    pub fn straight([z, y]: [f64; 2], along: f64, angle: f64) -> Self {
        let (lean, up) = angle.sin_cos();
        Self { point: [along, y, z], normal: [0.0, -lean, up] }
    }

    /// Distance, m.
    pub fn distance(&self, other: &Self) -> f64 {
        (0..3).map(|c| (self.point[c] - other.point[c]).powi(2)).sum::<f64>().sqrt()
    }

    /// Angle between the normals, rad.
    pub fn angle(&self, other: &Self) -> f64 {
        (0..3).map(|c| self.normal[c] * other.normal[c]).sum::<f64>().clamp(-1.0, 1.0).acos()
    }

    /// Angle of the normal of the `other` one against this one about x, rad, positive where the surface rises along y.
    fn bend(&self, other: &Self) -> f64 {
        let lean = |of: &Self| (-of.normal[1]).atan2(of.normal[0].hypot(of.normal[2]));
        lean(other) - lean(self)
    }

    /// Place of the `other` one along x and y on a surface that is common to both, m.
    fn apart(&self, other: &Self) -> [f64; 2] {
        let [x, y, z] = [0, 1, 2].map(|c| other.point[c] - self.point[c]);
        [x, y.signum() * y.hypot(z)]
    }

    /// The pair of the contact here and the `other` one, with their numbers and grids.
    fn paired(&self, other: &Self, contacts: [usize; 2], grids: [&Lines; 2]) -> NearPair {
        NearPair { contacts, apart: beside_each_other(grids, self.apart(other)), bend: self.bend(other) }
    }
}

/// The contacts on `grids` that act on each other through one half-space, with circles of these `radii`, m, and remarks
/// on the others. An error where two of them are one: their circles overlap, with normals that differ by less than 0.2
/// rad.
pub fn near_pairs(
    positions: &[ContactPosition],
    radii: &[f64],
    grids: &[Lines],
) -> Result<(Vec<NearPair>, Vec<String>)> {
    let half = |[x, y]: &Lines| {
        let half = |lines: &[f64]| 0.5 * (lines[lines.len() - 1] - lines[0]);
        half(x).max(half(y))
    };
    let (mut pairs, mut remarks) = (Vec::new(), Vec::new());
    for (d, there) in positions.iter().enumerate() {
        for (c, here) in positions[..d].iter().enumerate() {
            let (distance, angle) = (here.distance(there), here.angle(there));
            let least = radii[c] + radii[d];
            let [a, b] = [c + 1, d + 1];
            if distance < least && angle < ALIKE {
                return Err(Error::Job(format!(
                    "contacts {a} and {b} of the body: found {:.2} mm between them, with normals that differ by \
                     {angle:.3} rad; expected at least {:.2} mm, the radii of their circles, or {ALIKE} rad: take \
                     them as one contact, on one grid that spans both, or make the grids smaller",
                    1e3 * distance,
                    1e3 * least
                )));
            }
            if angle < BENT && distance < NEAR * half(&grids[c]).max(half(&grids[d])) {
                pairs.push(here.paired(there, [c, d], [&grids[c], &grids[d]]));
            } else if angle >= BENT && distance < ROUGH * radii[c].max(radii[d]) {
                remarks.push(format!(
                    "contacts {a} and {b} lie {:.2} mm apart, less than three radii of their circles, with normals \
                     that differ by {angle:.2} rad: their compliance with each other is rough",
                    1e3 * distance
                ));
            }
        }
    }
    Ok((pairs, remarks))
}

/// The contacts on `grids` of a half-space that act on each other: all whose normals differ by less than 1 rad, on one
/// surface that may bend. None of those whose position is not known.
pub(super) fn on_one_surface(positions: &[Option<ContactPosition>], grids: &[Lines]) -> Vec<NearPair> {
    let pair = |[c, d]: [usize; 2]| {
        let (here, there) = (positions[c]?, positions[d]?);
        (here.angle(&there) < BENT).then(|| here.paired(&there, [c, d], [&grids[c], &grids[d]]))
    };
    (0..positions.len()).flat_map(|d| (0..d).map(move |c| [c, d])).filter_map(pair).collect()
}

/// Ends of the rectangles around the nodes of a line, m.
pub(super) fn ends(lines: &[f64]) -> [f64; 2] {
    let last = lines.len() - 1;
    [lines[0] - 0.5 * (lines[1] - lines[0]), lines[last] + 0.5 * (lines[last] - lines[last - 1])]
}

/// The place `apart` of one grid from another, m, moved by the shorter way until no rectangles of their nodes overlap:
/// the plane grids of contacts on a round surface reach over each other.
fn beside_each_other([one, other]: [&Lines; 2], apart: [f64; 2]) -> [f64; 2] {
    // Move that makes the second grid begin where the first one ends, the way that it lies.
    let [along, across] = [0, 1].map(|c| {
        let (own, theirs) = (ends(&one[c]), ends(&other[c]).map(|end| end + apart[c]));
        match apart[c] < 0.0 {
            true => own[0] - theirs[1],
            false => own[1] - theirs[0],
        }
    });
    let overlaps = |c: usize, by: f64| by != 0.0 && (by < 0.0) == (apart[c] < 0.0);
    match overlaps(0, along) && overlaps(1, across) {
        true if along.abs() < across.abs() => [apart[0] + along, apart[1]],
        true => [apart[0], apart[1] + across],
        false => apart,
    }
}

impl HalfSpace {
    /// Displacements on the grid of the first contact of a pair under forces on that of the second, m/N: the mean of
    /// what forces on either do to the other, so that it is reciprocal on grids of different spacings.
    pub(super) fn between(&self, [one, other]: [&Lines; 2], pair: &NearPair) -> Result<Mat<f64>> {
        let sides = |grid: &Lines| Ok::<_, Error>([dual_sides(&grid[0])?, dual_sides(&grid[1])?]);
        let (own, theirs) = (sides(one)?, sides(other)?);
        let mut all = Mat::zeros(rows(one), rows(other));
        let (nx, mx) = (one[0].len(), other[0].len());
        let turn = Turn::of(pair.bend);
        for j in 0..mx * other[1].len() {
            for i in 0..nx * one[1].len() {
                let at = [0, 1].map(|c| {
                    let [own, theirs] = [[i % nx, i / nx][c], [j % mx, j / mx][c]];
                    one[c][own] - other[c][theirs] - pair.apart[c]
                });
                let sides = [[own[0][i % nx], own[1][i / nx]], [theirs[0][j % mx], theirs[1][j / mx]]];
                let found = turn.framed(self.reciprocal(at, sides));
                for b in 0..3 {
                    (0..3).for_each(|a| all[(3 * i + a, 3 * j + b)] = found[a][b]);
                }
            }
        }
        Ok(all)
    }

    /// Displacement at `at` from a rectangle under forces on it, the mean of both directions; `sides` are those of the
    /// rectangle that is displaced and of the one that is loaded, m. From far away forces act at a point.
    fn reciprocal(&self, at: [f64; 2], [own, theirs]: [[f64; 2]; 2]) -> [[f64; 3]; 3] {
        if at[0].hypot(at[1]) > FAR * own.iter().chain(&theirs).fold(0.0, |m: f64, side| m.max(*side)) {
            return self.point(at);
        }
        let ahead = self.influence(at, theirs);
        let back = self.influence(at.map(|v| -v), own);
        std::array::from_fn(|a| std::array::from_fn(|b| 0.5 * (ahead[a][b] + back[b][a])))
    }

    /// Displacement at the offset `at`, m, from a point force, m/N, as [`influence`](Self::influence) has it.
    fn point(&self, [x, y]: [f64; 2]) -> [[f64; 3]; 3] {
        let (square, nu) = (x * x + y * y, self.poisson);
        let size = square.sqrt();
        let unit = 1.0 / (2.0 * std::f64::consts::PI * self.shear() * size);
        let along = |a: f64, b: f64| nu * a * b / square;
        let lean = |a: f64| (0.5 - nu) * a / size;
        [
            [1.0 - nu + along(x, x), along(x, y), -lean(x)],
            [along(x, y), 1.0 - nu + along(y, y), -lean(y)],
            [lean(x), lean(y), 1.0 - nu],
        ]
        .map(|row| row.map(|v| v * unit))
    }

    /// Means of the displacement under the loads on a patch, m/N and so on, Γ⁻¹BΓ⁻¹ of this half-space.
    pub(crate) fn under_loads(&self, patch: LoadPatch) -> Square {
        let load = HalfSpaceLoad { patch, shear: self.shear(), poisson: self.poisson };
        match patch {
            LoadPatch::Circle { .. } => {
                let known = load.sum();
                scaled([patch; 2], |i, j| known[i][j])
            }
            LoadPatch::Rectangle { .. } => {
                let own = NearPair { contacts: [0, 0], apart: [0.0; 2], bend: 0.0 };
                let [coarse, fine] = [ACROSS, 2 * ACROSS].map(|across| self.between_loads([patch; 2], &own, across));
                // The error falls like the size of the cells.
                std::array::from_fn(|i| std::array::from_fn(|j| 2.0 * fine[i][j] - coarse[i][j]))
            }
        }
    }

    /// Means of the displacement on the patch of the first contact of a pair under the loads on that of the second,
    /// m/N and so on, Γ⁻¹BΓ⁻¹ of this half-space, with so many cells `across` either patch.
    fn between_loads(&self, patches: [LoadPatch; 2], pair: &NearPair, across: usize) -> Square {
        let cells = patches.map(|patch| cells(patch, across));
        let sides = patches.map(|patch| patch.half().map(|a| 2.0 * a / across as f64));
        // Of each patch the weights of the functions 1, x and y that its means belong to, as `LoadPatch::functions`.
        let weights = [0, 1].map(|k| {
            let (cells, own): (&Vec<([f64; 2], f64)>, f64) = (&cells[k], patches[k].middle());
            let about = |[x, y]: [f64; 2]| [1.0, x, y - own];
            let moment = |m: usize| -> f64 { cells.iter().map(|(p, w)| w * about(*p)[m].powi(2)).sum() };
            let moments = [0, 1, 2].map(moment);
            let dual = |(p, w): &([f64; 2], f64)| {
                let [one, x, y] = [0, 1, 2].map(|m| w * about(*p)[m] / moments[m]);
                [one - own * y, x, y]
            };
            cells.iter().map(dual).collect::<Vec<_>>()
        });
        let (mut found, turn) = ([[0.0; LOADS]; LOADS], Turn::of(pair.bend));
        for ((p, _), own) in cells[0].iter().zip(&weights[0]) {
            for ((q, _), theirs) in cells[1].iter().zip(&weights[1]) {
                let u = self.reciprocal([0, 1].map(|c| p[c] - q[c] - pair.apart[c]), sides);
                let u = turn.framed(u);
                for (i, row) in found.iter_mut().enumerate() {
                    for (j, entry) in row.iter_mut().enumerate() {
                        *entry += own[i / 3] * theirs[j / 3] * u[i % 3][j % 3];
                    }
                }
            }
        }
        found
    }
}

/// Half the angle between the frames of two contacts, as cosine and sine.
#[derive(Debug, Clone, Copy)]
struct Turn {
    cos: f64,
    sin: f64,
}

impl Turn {
    /// Half of the angle `bend`, rad.
    fn of(bend: f64) -> Self {
        let (sin, cos) = (0.5 * bend).sin_cos();
        Self { cos, sin }
    }

    /// Displacements under forces, (x, y, n), of the frame between both contacts, in those of the first and of the
    /// second one: QᵀWQᵀ with Q that turns by half the angle, [`rotate_loads`](crate::swept::rotate_loads).
    fn framed(&self, found: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
        let Self { cos, sin } = *self;
        let columns = found.map(|[x, y, n]| [x, cos * y - sin * n, sin * y + cos * n]);
        let [x, y, n] = columns;
        [x, std::array::from_fn(|k| cos * y[k] + sin * n[k]), std::array::from_fn(|k| cos * n[k] - sin * y[k])]
    }
}

/// Cells of a patch of loads: their middles, m, and the parts of the weight ω of [`LoadPatch`] on them.
fn cells(patch: LoadPatch, across: usize) -> Vec<([f64; 2], f64)> {
    let [a, b] = patch.half();
    let middle = |k: usize| (k as f64 + 0.5) * 2.0 / across as f64 - 1.0;
    let all = (0..across * across).map(|k| [middle(k % across), middle(k / across)]);
    let weight = |[x, y]: [f64; 2]| match patch {
        LoadPatch::Circle { .. } => (1.0 - x * x - y * y).max(0.0).sqrt(),
        LoadPatch::Rectangle { .. } => 1.0,
    };
    let weighted: Vec<_> = all.map(|p| (p, weight(p))).filter(|(_, w)| *w > 0.0).collect();
    let sum: f64 = weighted.iter().map(|(_, w)| w).sum();
    weighted.into_iter().map(|([x, y], w)| ([a * x, patch.middle() + b * y], w / sum)).collect()
}

impl NearPair {
    /// The half-space's part Γ⁻¹BΓ⁻¹ of what the loads on the `patches` of both contacts do to each other.
    pub(super) fn share(&self, half_space: &HalfSpace, patches: &[LoadPatch]) -> Square {
        half_space.between_loads(self.contacts.map(|c| patches[c]), self, ACROSS)
    }
}

/// Adds what `near` contacts do to each other through the half-space to a matrix of the contact rows on `grids`,
/// m/N, `[3n, 3n]`; a body whose components along x and y have the other sign has the `sign` −1 in them.
pub(crate) fn add_between(
    all: &mut Mat<f64>,
    half_space: &HalfSpace,
    (grids, near): (&[Lines], &[NearPair]),
    sign: f64,
) -> Result<()> {
    let first = |c: usize| grids[..c].iter().map(rows).sum::<usize>();
    for pair in near {
        let [c, d] = pair.contacts;
        let between = half_space.between([&grids[c], &grids[d]], pair)?;
        let (one, other) = (first(c), first(d));
        for (j, column) in between.col_iter().enumerate() {
            for (i, v) in column.iter().enumerate() {
                // Normal and tangential components change their sign against each other.
                let v = if (i % 3 == 2) == (j % 3 == 2) { *v } else { sign * v };
                all[(one + i, other + j)] += v;
                all[(other + j, one + i)] += v;
            }
        }
    }
    Ok(())
}

/// πᵀC⁻¹π of a half-space of a Poisson's ratio and 1 Pa that the contacts on `grids` share, thinned to some of their
/// lines, m and so on, `[9T, 9T]`; none where that is not positive.
pub(super) fn stiffness(poisson: f64, (grids, near): (&[Lines], &[NearPair])) -> Result<Option<Mat<f64>>> {
    let nodes = grids.iter().map(rows).sum::<usize>() / 3;
    let stride = (nodes as f64 / THINNED as f64).sqrt().ceil().max(1.0) as usize;
    let thin = |lines: &Vec<f64>| -> Vec<f64> {
        // Rectangles that cover what those of all lines cover.
        let [first, last] = ends(lines);
        let count = lines.len().div_ceil(stride).max(3);
        (0..count).map(|k| first + (last - first) * (k as f64 + 0.5) / count as f64).collect()
    };
    let grids: Vec<Lines> = grids.iter().map(|[x, y]| [thin(x), thin(y)]).collect();
    let half_space = HalfSpace { young: 1.0, poisson };
    let mut all = half_spaces(&half_space, &grids)?;
    add_between(&mut all, &half_space, (&grids, near), 1.0)?;
    let pi = expansions(&grids);
    let Ok(factor) = all.llt(Side::Lower) else { return Ok(None) };
    Ok(Some(pi.transpose() * factor.solve(&pi)))
}

/// Sides of the rectangles around the nodes of a line, m.
pub(super) fn dual_sides(x: &[f64]) -> Result<Vec<f64>> {
    let n = x.len();
    if n < 2 || x.windows(2).any(|w| w[1] <= w[0] || !(w[1] - w[0]).is_finite()) {
        return Err(Error::Defect("half-space: grid positions must ascend, two at the least".into()));
    }
    Ok((0..n)
        .map(|i| match i {
            0 => x[1] - x[0],
            _ if i + 1 == n => x[i] - x[i - 1],
            _ => 0.5 * (x[i + 1] - x[i - 1]),
        })
        .collect())
}

#[cfg(test)]
mod tests;
