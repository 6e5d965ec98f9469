//! Contacts of a body that lie near each other on one surface: they act on each other through one half-space.
//!
//! The effect of one contact on another falls like the inverse of their distance, and nine functions describe it over a
//! contact only where the contact is small against the distance. Nearer contacts c and d with almost the same normal
//! have the half-space between them as each has it by itself: both keep their own directions x, y and n, and the second
//! one lies `apart` from the first along x and y. The functions describe what is left,
//!
//! C_cd = W_hs(x_i − x_j − apart) + π_c (A_cd − A_hs,cd) π_dᵀ,
//!
//! with A_hs,cd of the half-space under the loads of both. On a plane surface this is one contact on two grids.

use super::half_space::HalfSpace;
use super::hybrid::{expansions, half_spaces, rows, Lines};
use crate::swept::{LoadCircle, Square, LOADS};
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
}

/// Distance of two contacts over the larger half side of their grids below which the half-space acts between them.
const NEAR: f64 = 3.0;
/// Distance of two contacts over the radius of the wider one's circle below which nine means do not describe what one
/// does to the other.
const ROUGH: f64 = 3.0;
/// Largest angle between the normals of places on one surface, rad.
const ALIKE: f64 = 0.2;
/// Distance over the sides of rectangles beyond which a force on them acts as one at a point.
const FAR: f64 = 10.0;
/// Squares across a circle of loads.
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

    /// Place of the `other` one along x and y on a surface that is common to both, m.
    fn apart(&self, other: &Self) -> [f64; 2] {
        let [x, y, z] = [0, 1, 2].map(|c| other.point[c] - self.point[c]);
        [x, y.signum() * y.hypot(z)]
    }
}

/// The contacts on `grids` that act on each other through one half-space, with loads on the `circles`, and remarks on
/// them. An error where two of them are one: their circles overlap, with normals that differ by less than 0.2 rad.
pub fn near_pairs(
    positions: &[ContactPosition],
    circles: &[LoadCircle],
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
            let least = circles[c].radius + circles[d].radius;
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
            if angle < ALIKE && distance < NEAR * half(&grids[c]).max(half(&grids[d])) {
                let apart = beside_each_other([&grids[c], &grids[d]], here.apart(there));
                pairs.push(NearPair { contacts: [c, d], apart });
            } else if angle >= ALIKE && distance < ROUGH * circles[c].radius.max(circles[d].radius) {
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

/// Ends of the rectangles around the nodes of a line, m.
fn ends(lines: &[f64]) -> [f64; 2] {
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
    /// Displacements on one grid under forces on another, whose origin lies `apart` from that of the first, m/N: the
    /// mean of what forces on either do to the other, so that it is reciprocal on grids of different spacings.
    pub(super) fn between(&self, [one, other]: [&Lines; 2], apart: [f64; 2]) -> Result<Mat<f64>> {
        let sides = |grid: &Lines| Ok::<_, Error>([dual_sides(&grid[0])?, dual_sides(&grid[1])?]);
        let (own, theirs) = (sides(one)?, sides(other)?);
        let mut all = Mat::zeros(rows(one), rows(other));
        let (nx, mx) = (one[0].len(), other[0].len());
        for j in 0..mx * other[1].len() {
            for i in 0..nx * one[1].len() {
                let at = [one[0][i % nx] - other[0][j % mx] - apart[0], one[1][i / nx] - other[1][j / mx] - apart[1]];
                let sides = [[own[0][i % nx], own[1][i / nx]], [theirs[0][j % mx], theirs[1][j / mx]]];
                let found = self.reciprocal(at, sides);
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

    /// Means of the displacement on one circle of loads under the loads of another, whose middle lies `apart` from that
    /// of the first, m/N and so on, Γ⁻¹BΓ⁻¹ of this half-space.
    fn between_loads(&self, circles: [LoadCircle; 2], apart: [f64; 2]) -> Square {
        let squares = circles.map(squares);
        let sides = circles.map(|circle| [2.0 * circle.radius / ACROSS as f64; 2]);
        // Of each circle the weights of its loads, divided by their moments.
        let weights = squares.each_ref().map(|squares| {
            let moment = |m: usize| -> f64 { squares.iter().map(|(p, w)| w * function(*p, m).powi(2)).sum() };
            let moments = [0, 1, 2].map(moment);
            squares.iter().map(|(p, w)| [0, 1, 2].map(|m| w * function(*p, m) / moments[m])).collect::<Vec<_>>()
        });
        let mut found = [[0.0; LOADS]; LOADS];
        for ((p, _), own) in squares[0].iter().zip(&weights[0]) {
            for ((q, _), theirs) in squares[1].iter().zip(&weights[1]) {
                let u = self.reciprocal([p[0] - q[0] - apart[0], p[1] - q[1] - apart[1]], sides);
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

/// Squares of a circle of loads: their middles, m, and the parts of the weight ω = 3 √(1 − r²/b²)/(2πb²) on them.
fn squares(circle: LoadCircle) -> Vec<([f64; 2], f64)> {
    let side = 2.0 / ACROSS as f64;
    let middle = |k: usize| (k as f64 + 0.5) * side - 1.0;
    let all = (0..ACROSS * ACROSS).map(|k| [middle(k % ACROSS), middle(k / ACROSS)]);
    let weighted = all.map(|p| (p, (1.0 - p[0] * p[0] - p[1] * p[1]).max(0.0).sqrt())).filter(|(_, w)| *w > 0.0);
    let weighted: Vec<_> = weighted.collect();
    let sum: f64 = weighted.iter().map(|(_, w)| w).sum();
    weighted.into_iter().map(|(p, w)| (p.map(|v| v * circle.radius), w / sum)).collect()
}

/// 1, x or y at a place.
fn function([x, y]: [f64; 2], m: usize) -> f64 {
    [1.0, x, y][m]
}

impl NearPair {
    /// The half-space's part Γ⁻¹BΓ⁻¹ of what the loads on `circles` of both contacts do to each other.
    pub(super) fn share(&self, half_space: &HalfSpace, circles: &[LoadCircle]) -> Square {
        half_space.between_loads(self.contacts.map(|c| circles[c]), self.apart)
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
    for NearPair { contacts: [c, d], apart } in near {
        let between = half_space.between([&grids[*c], &grids[*d]], *apart)?;
        let (one, other) = (first(*c), first(*d));
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
mod tests {
    use super::*;
    use crate::swept::HalfSpaceLoad;

    const STEEL: HalfSpace = HalfSpace { young: 210e9, poisson: 0.3 };

    fn grid(half: [f64; 2], lines: [usize; 2]) -> Lines {
        let line = |c: usize| -> Vec<f64> {
            (0..lines[c]).map(|k| half[c] * (2.0 * k as f64 / (lines[c] - 1) as f64 - 1.0)).collect()
        };
        [line(0), line(1)]
    }

    /// Contacts on one tread are refused where their circles overlap, those on tread and flange are told, those far
    /// away are left to the functions; those beside each other along the circumference have their distance and angle.
    #[test]
    fn near_contacts_are_refused_or_told() {
        let circles = [LoadCircle { radius: 4e-3 }, LoadCircle { radius: 5e-3 }];
        let grids = [grid([6e-3, 6e-3], [5, 5]), grid([8e-3, 7.5e-3], [5, 5])];
        // With half a spacing at either end they reach over each other by 2.875 mm at 14 mm.
        let moved = beside_each_other([&grids[0], &grids[1]], [2e-3, -0.014]);
        assert!(moved[0] == 2e-3 && (moved[1] + 0.016875).abs() < 1e-15, "{moved:?}");
        assert_eq!(beside_each_other([&grids[0], &grids[1]], [0.02, 0.01]), [0.02, 0.01]);
        let tread = ContactPosition::round([0.46, 0.0], 0.0, 0.0);
        let beside =
            |y: f64, angle: f64| near_pairs(&[tread, ContactPosition::round([0.46, y], 0.0, angle)], &circles, &grids);
        assert_eq!(beside(0.025, 0.0).unwrap(), (Vec::new(), Vec::new()));
        let (pairs, told) = beside(-0.014, 0.0).unwrap();
        assert!(told.is_empty() && pairs[0].contacts == [0, 1] && (pairs[0].apart[1] + 0.016875).abs() < 1e-15);
        let error = beside(0.008, 0.1).unwrap_err();
        assert!(error.exit_code() == 2 && error.message().contains("8.00 mm between them"), "{error}");
        let (pairs, told) = beside(0.014, 1.2).unwrap();
        assert!(pairs.is_empty() && told.len() == 1 && told[0].contains("differ by 1.20 rad"), "{told:?}");
        let ahead = ContactPosition::round([0.46, 0.0], 0.5, 0.0);
        assert!(
            (tread.distance(&ahead) - 0.92 * 0.25f64.sin()).abs() < 1e-15 && (tread.angle(&ahead) - 0.5).abs() < 1e-12
        );
        let along =
            ContactPosition::straight([0.0, 0.01], 0.3, 0.0).distance(&ContactPosition::straight([0.0; 2], 0.0, 0.0));
        assert!((along - 0.3f64.hypot(0.01)).abs() < 1e-15);
    }

    /// The loads of a circle on itself are those of the closed form; those of another one far away are a point force.
    #[test]
    fn loads_act_on_each_other_through_the_half_space() {
        let circle = LoadCircle { radius: 3e-3 };
        let own = STEEL.between_loads([circle; 2], [0.0; 2]);
        let load = HalfSpaceLoad { patch: circle, shear: STEEL.shear(), poisson: STEEL.poisson };
        let (known, moments) = (load.sum(), circle.moments());
        for i in 0..LOADS {
            for j in 0..LOADS {
                let scale = (known[i][i] * known[j][j]).sqrt() / (moments[i] * moments[j]);
                let wanted = known[i][j] / (moments[i] * moments[j]);
                assert!((own[i][j] - wanted).abs() < 0.03 * scale, "{i} {j}: {:e} {wanted:e}", own[i][j]);
            }
        }
        let apart = [0.08, -0.06];
        let far = STEEL.between_loads([circle, LoadCircle { radius: 2e-3 }], apart);
        let point = STEEL.point(apart.map(|v| -v));
        for i in 0..3 {
            for j in 0..3 {
                assert!((far[i][j] - point[i][j]).abs() < 2e-3 * point[2][2], "{i} {j}");
            }
        }
    }

    /// A plane body whose loads do to each other what the half-space does has nothing left beside it; its contacts are
    /// held as they hold each other on one surface, and one pulls the other where it yields less than that.
    #[test]
    fn contacts_on_a_plane_hold_each_other() {
        let grids = [grid([4e-3, 2e-3], [9, 9]), grid([3e-3, 3e-3], [7, 7])];
        let near = |apart: [f64; 2]| vec![NearPair { contacts: [0, 1], apart }];
        let held = |apart| stiffness(0.3, (&grids, &near(apart))).unwrap().unwrap();
        let (beside, far) = (held([0.0, 7e-3]), held([0.0, 7.0]));
        assert!(far[(2, LOADS + 2)].abs() < 1e-3 * far[(2, 2)]);
        // Both sink together under less force than alone.
        let together = |k: &Mat<f64>| k[(2, 2)] + 2.0 * k[(2, LOADS + 2)] + k[(LOADS + 2, LOADS + 2)];
        let ratio = together(&beside) / together(&far);
        assert!((0.5..0.9).contains(&ratio), "{ratio}");
        let mut all = half_spaces(&STEEL, &grids).unwrap();
        add_between(&mut all, &STEEL, (&grids, &near([0.0, 7e-3])), 1.0).unwrap();
        assert!(all.llt(Side::Lower).is_ok());
        // The other sign of motions along x and y changes normal against tangential motion alone.
        let mut turned = Mat::zeros(all.nrows(), all.ncols());
        add_between(&mut turned, &STEEL, (&grids, &near([0.0, 7e-3])), -1.0).unwrap();
        let first = rows(&grids[0]);
        for (i, j) in [(0, first), (2, first + 2), (1, first + 2), (2, first + 1), (4, first + 5)] {
            let sign = if (i % 3 == 2) == (j % 3 == 2) { 1.0 } else { -1.0 };
            assert!((turned[(i, j)] - sign * all[(i, j)]).abs() < 1e-18, "{i} {j}");
        }
    }
}
