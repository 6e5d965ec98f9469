//! The shape functions of an interface, the points of quadrature of its cells, and its consistent matrix H = ∫NᵀN.

use crate::grid::ContactPatch;
use crate::quadrature::GAUSS_3;

/// The points of quadrature of a cell: the shape functions of its corners (0, 0), (1, 0), (0, 1), (1, 1) there, and
/// weights as parts of its area.
pub(super) type Rule = [([f64; 4], f64); 9];

/// A grid with bilinear shape functions.
///
/// On a rectilinear grid H is the product of the matrices of its two lines, and so is its inverse.
#[derive(Debug, Clone)]
pub struct ConsistentSurface {
    /// Nodes along x and y.
    shape: [usize; 2],
    /// Lengths of the intervals along x and y, m.
    lengths: [Vec<f64>; 2],
    /// Inverses of the matrices of the lines along x and y, 1/m, `[nx, nx]` and `[ny, ny]`, symmetric.
    inverse: [Vec<f64>; 2],
    rule: Rule,
}

impl ConsistentSurface {
    /// Surface of a patch.
    pub fn new(s: &ContactPatch) -> Self {
        let lengths = [&s.x, &s.y].map(|line| line.windows(2).map(|w| w[1] - w[0]).collect::<Vec<f64>>());
        let inverse = [inverse_of_line(&lengths[0]), inverse_of_line(&lengths[1])];
        let rule = std::array::from_fn(|k| {
            let ((x, v), (y, w)) = (GAUSS_3[k % 3], GAUSS_3[k / 3]);
            let ([a, b], [c, d]) = ([0.5 * (1.0 - x), 0.5 * (1.0 + x)], [0.5 * (1.0 - y), 0.5 * (1.0 + y)]);
            ([a * c, b * c, a * d, b * d], 0.25 * v * w)
        });
        Self { shape: [s.x.len(), s.y.len()], lengths, inverse, rule }
    }

    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.shape[0] * self.shape[1]
    }

    /// An entry of H⁻¹, 1/m².
    pub fn inverse(&self, i: usize, j: usize) -> f64 {
        let [nx, ny] = self.shape;
        self.inverse[0][nx * (i % nx) + j % nx] * self.inverse[1][ny * (i / nx) + j / nx]
    }

    /// H⁻¹R of all nodes for the forces R, N, three a node: Pa, `[3n]`.
    pub fn field(&self, forces: &[f64]) -> Vec<f64> {
        let [nx, ny] = self.shape;
        let mut along = vec![0.0; forces.len()];
        for (node, f) in forces.chunks_exact(3).enumerate().filter(|(_, f)| f.iter().any(|&v| v != 0.0)) {
            let (ix, line) = (node % nx, node - node % nx);
            for (jx, h) in self.inverse[0][nx * ix..][..nx].iter().enumerate() {
                (0..3).for_each(|c| along[3 * (line + jx) + c] += h * f[c]);
            }
        }
        let mut field = vec![0.0; forces.len()];
        for (iy, line) in along.chunks_exact(3 * nx).enumerate().filter(|(_, l)| l.iter().any(|&v| v != 0.0)) {
            for (out, h) in field.chunks_exact_mut(3 * nx).zip(&self.inverse[1][ny * iy..][..ny]) {
                out.iter_mut().zip(line).for_each(|(o, v)| *o += h * v);
            }
        }
        field
    }

    /// All cells: their corners, and their areas, m².
    pub(super) fn cells(&self) -> impl Iterator<Item = ([usize; 4], f64)> + '_ {
        let nx = self.shape[0];
        self.lengths[1].iter().enumerate().flat_map(move |(iy, b)| {
            self.lengths[0].iter().enumerate().map(move |(ix, a)| {
                let i = ix + nx * iy;
                ([i, i + 1, i + nx, i + nx + 1], a * b)
            })
        })
    }

    /// The points of each cell.
    pub(super) fn rule(&self) -> Rule {
        self.rule
    }

    /// Corners, ascending, of the cells with a point at which the pressure is not that of an open contact, p > ρ g:
    /// `pressure` in Pa, ρ in Pa/m, and the gap of a node, m, where it is known; cells of nodes of which it is not
    /// are left out.
    pub fn pressed(&self, pressure: impl Fn(usize) -> f64, rho: f64, gap: impl Fn(usize) -> Option<f64>) -> Vec<usize> {
        let mut out = Vec::new();
        for (corners, _) in self.cells() {
            let [Some(a), Some(b), Some(c), Some(d)] = corners.map(&gap) else { continue };
            let gaps = [a, b, c, d];
            let at: [f64; 4] = std::array::from_fn(|k| pressure(corners[k]) - rho * gaps[k]);
            let positive = |shape: &[f64; 4]| shape.iter().zip(at).map(|(n, v)| n * v).sum::<f64>() > 0.0;
            if at.iter().any(|&v| v > 0.0) && self.rule.iter().any(|(shape, _)| positive(shape)) {
                out.extend(corners);
            }
        }
        out.sort_unstable();
        out.dedup();
        out
    }

    /// `nodes` and their neighbours but for those on the border of the grid, ascending.
    pub(crate) fn with_neighbours(&self, nodes: impl Iterator<Item = usize>) -> Vec<usize> {
        let [nx, ny] = self.shape;
        let mut mark = vec![false; nx * ny];
        for i in nodes {
            let (ix, iy) = (i % nx, i / nx);
            mark[i] = true;
            for jy in iy.saturating_sub(1).max(1)..(iy + 2).min(ny - 1) {
                for jx in ix.saturating_sub(1).max(1)..(ix + 2).min(nx - 1) {
                    mark[jx + nx * jy] = true;
                }
            }
        }
        (0..nx * ny).filter(|&i| mark[i]).collect()
    }
}

/// The inverse of ∫NᵀN of a line of linear elements with the given lengths, m, column after column, by Gauss's
/// elimination on three diagonals.
fn inverse_of_line(lengths: &[f64]) -> Vec<f64> {
    let n = lengths.len() + 1;
    let beside = |i: usize| lengths.get(i).copied().unwrap_or(0.0);
    let diagonal = |i: usize| (beside(i) + if i > 0 { beside(i - 1) } else { 0.0 }) / 3.0;
    // Pivots of the elimination; the matrix is dominated by its diagonal.
    let mut pivots = vec![diagonal(0)];
    for i in 1..n {
        let off = lengths[i - 1] / 6.0;
        pivots.push(diagonal(i) - off * off / pivots[i - 1]);
    }
    let mut out = vec![0.0; n * n];
    for (j, column) in out.chunks_exact_mut(n).enumerate() {
        column[j] = 1.0;
        for i in j + 1..n {
            column[i] = -lengths[i - 1] / 6.0 / pivots[i - 1] * column[i - 1];
        }
        column[n - 1] /= pivots[n - 1];
        for i in (0..n - 1).rev() {
            column[i] = (column[i] - lengths[i] / 6.0 * column[i + 1]) / pivots[i];
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Interface;

    /// On an uneven grid H⁻¹ takes the forces ∫Nᵀ(N f) of any nodal field f back to it.
    #[test]
    fn the_inverse_takes_integrals_back_to_fields() {
        let x = vec![-2.0, -1.2, -0.5, 0.0, 0.3, 1.0];
        let y = vec![-1.0, 0.1, 0.7, 1.1];
        let s = Interface::new(x, y, vec![0.0; 24]).unwrap();
        let surface = ConsistentSurface::new(&s.patches[0]);
        let field: Vec<f64> = (0..72).map(|k| (1.7 * k as f64).sin()).collect();
        let mut forces = vec![0.0; 72];
        for (corners, area) in surface.cells() {
            for (shape, weight) in surface.rule() {
                for c in 0..3 {
                    let value: f64 = (0..4).map(|k| shape[k] * field[3 * corners[k] + c]).sum();
                    (0..4).for_each(|k| forces[3 * corners[k] + c] += weight * area * shape[k] * value);
                }
            }
        }
        let back = surface.field(&forces);
        for (k, (a, b)) in back.iter().zip(&field).enumerate() {
            assert!((a - b).abs() < 1e-12, "component {k}: {a}, {b}");
        }
        let entry: f64 = (0..24).map(|j| surface.inverse(7, j) * forces[3 * j]).sum();
        assert!((entry - field[21]).abs() < 1e-12);
        // The nodal areas are the sums of the rows of H: a uniform field is that of the areas.
        let areas: Vec<f64> = s.weight.iter().flat_map(|&w| [w, 0.0, 2.0 * w]).collect();
        let uniform = surface.field(&areas);
        assert!(uniform.chunks_exact(3).all(|f| (f[0] - 1.0).abs() < 1e-12 && (f[2] - 2.0).abs() < 1e-12));
    }

    #[test]
    fn neighbours_stay_off_the_border() {
        let s = Interface::paraboloid(6, 5, [1.0, 1.0], [1.0, 1.0]).unwrap();
        let surface = ConsistentSurface::new(&s.patches[0]);
        assert_eq!(surface.with_neighbours([7].into_iter()), [7, 8, 13, 14]);
        assert_eq!(surface.with_neighbours([0, 15].into_iter()), [0, 7, 8, 9, 10, 14, 15, 16, 20, 21, 22]);
    }
}
