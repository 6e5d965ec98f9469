//! Positivity of what is left of the compliance of a body without its modes.
//!
//! C + π D πᵀ with a positive C is positive just where 1 + LᵀDL is, LLᵀ = πᵀC⁻¹π. With several contacts C has a block
//! for each, and so has πᵀC⁻¹π; D couples them. Of contacts near each other, between which C acts as well, πᵀC⁻¹π is
//! that of grids with fewer lines.

use super::convolution::{Convolution, Product};
use super::half_space::HalfSpace;
use super::hybrid::{expansion, matrix, Compact, Lines, Square, LOADS};
use super::near_contacts::stiffness;
use crate::dense::dot;
use crate::parallel::World;
use crate::{Error, Result};
use faer::Mat;

/// Residual of the forces that move a grid as its functions do, over what is wanted, and steps to get there at the
/// most.
const PRECISE: f64 = 1e-10;
const STEPS: usize = 1000;
/// An eigenvalue this near to 0 tells nothing of its sign.
const NEAR: f64 = 1e-6;

/// Collective: an error where what is left of the compliance of a body without its modes is not positive definite, of
/// `bodies` with their names, over all contacts on the `grids` together. What counts is what rank 0 knows.
pub fn refuse_negative(world: &World, bodies: &[(&str, &Compact)], grids: &[Lines]) -> Result<()> {
    // Of half-spaces of one Poisson's ratio one is as good as the other, and so are grids.
    let mut known: Vec<(f64, usize, Option<Square>)> = Vec::new();
    for (name, Compact { half_space, near, beside, .. }) in bodies {
        let order = beside.nrows();
        let numbers = (0..order * order).map(|k| beside[(k % order, k / order)]).collect();
        let left: Vec<f64> = world.broadcast(numbers);
        let left = Mat::from_fn(order, order, |i, j| left[i + order * j]);
        if !near.is_empty() {
            let is_positive = || -> Result<bool> {
                let held = stiffness(half_space.poisson, (grids, near))?.map(|k| half_space.young * k);
                match held.and_then(|held| stays_positive(&held, &left)) {
                    Some(positive) => Ok(positive),
                    None => Ok(matrix(half_space, &left, (grids, near))?.llt(faer::Side::Lower).is_ok()),
                }
            };
            let positive = world.max(f64::from(u8::from(world.on_root(is_positive)? == Some(true)))) > 0.0;
            refuse(name, grids.len(), positive)?;
            continue;
        }
        let mut punches = Vec::new();
        for (c, grid) in grids.iter().enumerate() {
            let same = |of: &&(f64, usize, Option<Square>)| of.0 == half_space.poisson && grids[of.1] == *grid;
            let punch = match known.iter().find(same) {
                Some(&(_, _, punch)) => punch,
                None => {
                    let punch = punch(world, half_space.poisson, grid)?;
                    known.push((half_space.poisson, c, punch));
                    punch
                }
            };
            punches.push(punch.map(|p| p.map(|row| row.map(|v| v * half_space.young))));
        }
        let punches: Option<Vec<Square>> = punches.into_iter().collect();
        let positive = match punches.and_then(|punches| stays_positive(&diagonal(&punches), &left)) {
            Some(positive) => positive,
            None => {
                let dense = || Ok(matrix(half_space, &left, (grids, near))?.llt(faer::Side::Lower).is_ok());
                world.max(f64::from(u8::from(world.on_root(dense)? == Some(true)))) > 0.0
            }
        };
        refuse(name, grids.len(), positive)?;
    }
    Ok(())
}

/// An error where what is left of a body with some contacts is not `positive`.
fn refuse(name: &str, contacts: usize, positive: bool) -> Result<()> {
    if positive {
        return Ok(());
    }
    let near = match contacts {
        1 => "",
        _ => {
            ". Where contacts meet on a bent surface, such as flange root and flange, what they do to each other is \
             known roughly: there take one of them, contact.places = \"one\""
        }
    };
    Err(Error::NotConverged(format!(
        "compliance of body \"{name}\": what is left of it without its modes is not positive definite; \
         ask for fewer modes, or make the contact grid smaller (contact.patch, contact.grid){near}"
    )))
}

/// Matrix with these blocks on its diagonal, `[9T, 9T]`.
fn diagonal(blocks: &[Square]) -> Mat<f64> {
    let order = LOADS * blocks.len();
    let of = |i: usize, j: usize| if i / LOADS == j / LOADS { blocks[i / LOADS][i % LOADS][j % LOADS] } else { 0.0 };
    Mat::from_fn(order, order, of)
}

/// Collective: πᵀC⁻¹π of a half-space of 1 Pa and of a Poisson's ratio on a grid, m and so on: by the forces that
/// move all nodes as the functions π do; none where the grid is not uniform, or they are not found.
fn punch(world: &World, poisson: f64, grid: &Lines) -> Result<Option<Square>> {
    let half_space = HalfSpace { young: 1.0, poisson };
    let Some(c) = Convolution::of_half_space(&half_space, &grid[0], &grid[1])? else { return Ok(None) };
    let pi = expansion(grid);
    let mut product = c.exact();
    let mut found = [[0.0; LOADS]; LOADS];
    let mut all = true;
    for k in (world.rank..LOADS).step_by(world.size) {
        match forces(&mut product, pi.col_as_slice(k)) {
            Some(forces) => (0..LOADS).for_each(|l| found[k][l] = dot(pi.col_as_slice(l), &forces)),
            None => all = false,
        }
    }
    let sums = world.sum_all(found.as_flattened());
    let all = world.max(f64::from(u8::from(!all))) == 0.0;
    let mean = |i: usize, j: usize| 0.5 * (sums[LOADS * i + j] + sums[LOADS * j + i]);
    Ok(all.then(|| std::array::from_fn(|i| std::array::from_fn(|j| mean(i, j)))))
}

/// The forces under which all nodes move by `motion`, by conjugate gradients; none where these do not get there.
fn forces(product: &mut Product<'_, f64>, motion: &[f64]) -> Option<Vec<f64>> {
    let mut found = vec![0.0; motion.len()];
    let (mut rest, mut way, mut moved) = (motion.to_vec(), motion.to_vec(), motion.to_vec());
    let mut square = dot(&rest, &rest);
    let small = PRECISE * PRECISE * square;
    for _ in 0..STEPS {
        if square <= small {
            return Some(found);
        }
        product.times(&way, &mut moved);
        let step = square / dot(&way, &moved);
        found.iter_mut().zip(&way).for_each(|(f, w)| *f += step * w);
        rest.iter_mut().zip(&moved).for_each(|(r, m)| *r -= step * m);
        let before = std::mem::replace(&mut square, dot(&rest, &rest));
        way.iter_mut().zip(&rest).for_each(|(w, r)| *w = r + square / before * *w);
    }
    None
}

/// Returns whether 1 + LᵀDL, LLᵀ = `held`, D = `left`, is positive definite; none where that is not certain.
fn stays_positive(held: &Mat<f64>, left: &Mat<f64>) -> Option<bool> {
    let factor = held.llt(faer::Side::Lower).ok()?;
    let grown = factor.L().transpose() * (left * factor.L());
    let values = grown.self_adjoint_eigenvalues(faer::Side::Lower).ok()?;
    let lowest = 1.0 + values.into_iter().fold(f64::INFINITY, f64::min);
    (lowest.abs() > NEAR).then_some(lowest > 0.0)
}

#[cfg(test)]
mod tests {
    use super::super::hybrid::add_functions;
    use super::*;

    /// The forces that hold a grid as the functions do are those of the dense inverse; the sign of what is left is
    /// that of its Cholesky factor, on either side of where it changes.
    #[test]
    fn what_is_left_is_positive_where_its_factor_is() {
        let line = |n: i32, h: f64| (-n..=n).map(|i| f64::from(i) * h).collect::<Vec<f64>>();
        let grid = [line(4, 1e-3), line(3, 0.8e-3)];
        let steel = HalfSpace { young: 210e9, poisson: 0.3 };
        let (c, pi) = (steel.compliance(&grid[0], &grid[1]).unwrap(), expansion(&grid));
        let convolution = Convolution::of_half_space(&steel, &grid[0], &grid[1]).unwrap().unwrap();
        let mut product = convolution.exact();
        let found = Mat::from_fn(pi.nrows(), LOADS, {
            let all: Vec<Vec<f64>> = (0..LOADS).map(|k| forces(&mut product, pi.col_as_slice(k)).unwrap()).collect();
            move |i, k| all[k][i]
        });
        assert!((&c * &found - &pi).norm_max() < 1e-8, "{:e}", (&c * &found - &pi).norm_max());
        let dense = pi.transpose() * &found;
        let punch: Square = std::array::from_fn(|i| std::array::from_fn(|j| 0.5 * (dense[(i, j)] + dense[(j, i)])));
        let stiff = |k: usize| 1.0 / punch[k][k];
        let mut answers = [0, 0];
        for part in [-0.2, -0.9, -1.1] {
            for k in 0..LOADS {
                // Of which the half-space alone would need just as much, beside one that yields more.
                let mut left = Mat::<f64>::zeros(LOADS, LOADS);
                left[(k, k)] = part * stiff(k);
                left[(2, 2)] += 0.3 * stiff(2);
                let mut whole = c.clone();
                add_functions(&mut whole, &pi, left.as_ref());
                let factor = whole.llt(faer::Side::Lower).is_ok();
                assert_eq!(stays_positive(&diagonal(&[punch]), &left), Some(factor), "{k} {part}");
                assert!(factor || part < -1.0, "{k} {part}");
                answers[usize::from(factor)] += 1;
            }
        }
        assert_eq!(answers, [8, 19], "all but the one that yields more");
    }
}
