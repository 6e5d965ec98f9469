//! Modes of a swept body, order by order, and the proof that none is missing.

use super::krylov;
use super::skyline_ldlt::SkylineFactor;
use super::{blocks, Forms, LineLoad, Prestress, RotationBlocks, LOADS};
use crate::{Error, Result};
use faer::{Mat, MatRef};
use std::f64::consts::PI;

/// Eigenvalues smaller than this part of the shift are rigid-body motions.
const RIGID: f64 = 1e-6;
/// Orders without modes below the limit after which higher ones are not looked at.
const EMPTY: usize = 2;
/// Limits this much apart, relatively, are tried where one meets an eigenvalue.
const ASIDE: f64 = 1e-8;

/// The modes of one order of Fourier. For n ≥ 1 each stands for a pair, one of either family.
#[derive(Debug, Clone)]
pub struct FourierModes {
    /// Number of nodal diameters n.
    pub order: usize,
    /// Angular frequencies, rad/s, ascending; 0 for rigid-body motions.
    pub omega: Vec<f64>,
    /// Amplitudes of the section, 1/√kg, `[amplitudes, m]`, with ΦᵀMΦ = 1 all round.
    pub vectors: Mat<f64>,
    /// |K_n φ − ω²Mφ| / (|ω² − σ| |Mφ|), `[m]`, with the shift σ of the method.
    pub residual: Vec<f64>,
}

impl FourierModes {
    /// An order without modes.
    fn none(forms: &Forms, order: usize) -> Self {
        Self { order, omega: Vec::new(), vectors: Mat::zeros(forms.order(), 0), residual: Vec::new() }
    }
}

/// Modes of an order as contact and rotation need them: numbers alone, for all ranks.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactModeData {
    /// Number of nodal diameters n.
    pub order: usize,
    /// Angular frequencies, rad/s, ascending, `[m]`.
    pub omega: Vec<f64>,
    /// Relative residuals, `[m]`.
    pub residual: Vec<f64>,
    /// Shares of U, V and W, radial, along the circle and axial, in the kinetic energy, `[m]`.
    pub shares: Vec<[f64; 3]>,
    /// ψ̂ = Γ⁻¹⟨ωπ, φ⟩ over the circles of the contacts, of the family about each contact that each of its nine loads
    /// moves, `[9T, m]`.
    pub contact: Mat<f64>,
    /// Rotation at 1 rad/s.
    pub rotation: RotationBlocks,
    /// Σ φᵀKφ of what has a loss factor of its own, layers and springs of rings, 1/s², `[m]`: their share of the strain
    /// energy times ω².
    pub stored: Vec<f64>,
    /// Σ η_l ΦᵀK_lΦ of these layers, 1/s², `[m, m]`.
    pub lost: Mat<f64>,
    /// ΦᵀCΦ of the dashpots of rings that the section carries, 1/s, `[m, m]`.
    pub viscous: Mat<f64>,
    /// Parity of a mode of a mirror-symmetric section, 1 or −1 but for rounding, `[m]`; 0 of another one.
    pub parity: Vec<f64>,
    /// Mean displacement at each bearing, 1/√kg, `[bearings, m]`; see `Forms::at_bearings`.
    pub bearings: Mat<f64>,
    /// (U, W) at the nodes of the outline, 1/√kg, interleaved, `[2 · nodes, m]`; see `with_outline`.
    pub outline: Mat<f64>,
    /// Amplitudes of the whole section, 1/√kg, `[amplitudes, m]`; as the ones before.
    pub vectors: Mat<f64>,
}

impl ContactModeData {
    /// Modal data of `modes` of `forms`, with the loads of their order at the contacts, and the centrifugal prestress
    /// of a body that rotates.
    pub fn new(forms: &Forms, modes: &FourierModes, loads: &[LineLoad], prestress: Option<&Prestress>) -> Self {
        let mass = forms.mass(modes.order, modes.vectors.as_ref());
        let share = |k: usize, c: usize| -> f64 {
            (c..mass.nrows()).step_by(3).map(|i| modes.vectors[(i, k)] * mass[(i, k)]).sum()
        };
        let count = modes.omega.len();
        let (mut stored, mut lost) = (Mat::zeros(count, count), Mat::zeros(count, count));
        for (k, layer) in forms.section.layers.iter().enumerate().filter(|(_, layer)| layer.loss > 0.0) {
            let energy = forms.strain_energy(modes.order, k + 1, modes.vectors.as_ref());
            lost += faer::Scale(layer.loss) * &energy;
            stored += energy;
        }
        let rings = forms.ring_loss(modes.order, modes.vectors.as_ref());
        Self {
            order: modes.order,
            omega: modes.omega.clone(),
            residual: modes.residual.clone(),
            shares: (0..modes.omega.len()).map(|k| std::array::from_fn(|c| share(k, c))).collect(),
            contact: turned_freely((modes.order, &modes.omega), contact_functions(modes.vectors.as_ref(), loads)),
            rotation: blocks(forms, modes, prestress),
            stored: (0..modes.omega.len()).map(|k| stored[(k, k)] + rings.stored[k]).collect(),
            lost,
            viscous: rings.viscous,
            parity: vec![0.0; modes.omega.len()],
            bearings: forms.at_bearings(modes.order, modes.vectors.as_ref()),
            outline: Mat::zeros(0, modes.omega.len()),
            vectors: Mat::zeros(0, modes.omega.len()),
        }
    }

    /// The same with the parity of each mode.
    pub(crate) fn with_parity(mut self, parity: Vec<f64>) -> Self {
        self.parity = parity;
        self
    }

    /// The same with the modes' amplitudes, and with what the air sees of them, at these nodes of the section.
    pub(crate) fn with_outline(mut self, forms: &Forms, modes: &FourierModes, nodes: &[usize]) -> Self {
        self.outline = Mat::from_fn(2 * nodes.len(), modes.omega.len(), |i, j| {
            forms.amplitude(nodes[i / 2]).map_or(0.0, |first| modes.vectors[(first + 2 * (i % 2), j)])
        });
        self.vectors = modes.vectors.clone();
        self
    }

    /// Families of an order: two that are each other turned, one of order 0.
    pub fn families(order: usize) -> usize {
        if order == 0 {
            1
        } else {
            2
        }
    }

    /// Modes of both families.
    pub fn count(&self) -> usize {
        Self::families(self.order) * self.omega.len()
    }

    /// As one list of numbers.
    pub(crate) fn to_numbers(&self) -> Vec<f64> {
        let m = self.omega.len();
        let tall = [&self.contact, &self.bearings, &self.outline, &self.vectors];
        let rows = tall.map(|matrix| matrix.nrows() as f64);
        let mut list = [&[self.order as f64, m as f64], &rows[..]].concat();
        list.extend(self.omega.iter().chain(&self.residual));
        list.extend(self.shares.as_flattened().iter().chain(&self.stored).chain(&self.parity));
        let rotation = &self.rotation;
        let squares = [&rotation.coupling, &rotation.stiffness, &self.lost, &self.viscous];
        for matrix in squares.into_iter().chain(tall) {
            list.extend(matrix.col_iter().flat_map(|c| c.iter().copied().collect::<Vec<f64>>()));
        }
        list
    }

    /// All those of lists put one after the other, by orders.
    pub fn from_numbers(mut numbers: &[f64]) -> Result<Vec<Self>> {
        let mut all = Vec::new();
        while !numbers.is_empty() {
            let [m, seen, rings, rows, amplitudes] = [1, 2, 3, 4, 5].map(|k| numbers.get(k).map_or(0, |n| *n as usize));
            let length = 6 + 7 * m + 4 * m * m + (seen + rings + rows + amplitudes) * m;
            if numbers.len() < length {
                return Err(Error::Defect(format!("modes of an order: {} numbers of {length}", numbers.len())));
            }
            let (mine, rest) = numbers.split_at(length);
            let (list, matrices) = mine[6..].split_at(7 * m);
            let matrix = |rows: usize, first: usize| Mat::from_fn(rows, m, |i, j| matrices[first + i + rows * j]);
            all.push(Self {
                order: mine[0] as usize,
                omega: list[..m].to_vec(),
                residual: list[m..2 * m].to_vec(),
                shares: list[2 * m..5 * m].chunks_exact(3).map(|c| std::array::from_fn(|k| c[k])).collect(),
                rotation: RotationBlocks { coupling: matrix(m, 0), stiffness: matrix(m, m * m) },
                stored: list[5 * m..6 * m].to_vec(),
                parity: list[6 * m..].to_vec(),
                lost: matrix(m, 2 * m * m),
                viscous: matrix(m, 3 * m * m),
                contact: matrix(seen, 4 * m * m),
                bearings: matrix(rings, 4 * m * m + seen * m),
                outline: matrix(rows, 4 * m * m + (seen + rings) * m),
                vectors: matrix(amplitudes, 4 * m * m + (seen + rings + rows) * m),
            });
            numbers = rest;
        }
        all.sort_by_key(|s| s.order);
        Ok(all)
    }
}

/// ψ̂ of modes with these amplitudes at the contacts that have the loads of their order, `[9T, m]`.
pub(crate) fn contact_functions(vectors: MatRef<'_, f64>, loads: &[LineLoad]) -> Mat<f64> {
    let mut seen = Mat::zeros(LOADS * loads.len(), vectors.ncols());
    for (c, line) in loads.iter().enumerate() {
        for (k, column) in vectors.col_iter().enumerate() {
            let found = line.functions(&line.means(column));
            (0..LOADS).for_each(|a| seen[(LOADS * c + a, k)] = found[a]);
        }
    }
    seen
}

/// Loads xe_y and xe_n: of all motions of order 0 torsion alone moves them.
const TILTED: [usize; 2] = [4, 5];

/// ψ̂ of modes of a body of revolution, `[9T, m]`, of an order, with the angular frequencies `omega`, rad/s: of a free
/// rotation of the whole body about its axle without the tilt φx of the tangent plane by the angle φ.
///
/// Having turned, the body touches as before. Its displacement φ × r is one of its surface along x, whose rate is a
/// creep velocity. The tilt is of the second order, φ times the slope of the surface, as what a displacement along the
/// slope makes of the gap; that balances it, and is left out everywhere. φ grows without bounds.
pub(crate) fn turned_freely((order, omega): (usize, &[f64]), mut seen: Mat<f64>) -> Mat<f64> {
    for k in (0..omega.len()).filter(|&k| order == 0 && omega[k] == 0.0) {
        (0..seen.nrows()).filter(|row| TILTED.contains(&(row % LOADS))).for_each(|row| seen[(row, k)] = 0.0);
    }
    seen
}

/// The result of `factor` at ω² of the `limit`, rad/s, or a little above it, where the limit meets an eigenvalue.
pub(super) fn near_limit<T>(limit: f64, factor: impl Fn(f64) -> Result<T>) -> Result<T> {
    let mut found = factor(limit * limit);
    for step in 1..4 {
        if found.is_ok() {
            break;
        }
        found = factor(limit * limit * (1.0 + f64::from(step) * ASIDE));
    }
    found
}

/// Number of eigenvalues of the order `n` below ω = `limit`, rad/s, from the inertia of K_n − ω²M.
pub fn below(forms: &Forms, n: usize, limit: f64) -> Result<usize> {
    Ok(near_limit(limit, |square| forms.factor(n, square))?.negative())
}

/// All modes of the order `n` up to ω = `limit`, rad/s; as many as the inertia of K_n − ω²M says.
pub fn of_order(forms: &Forms, n: usize, limit: f64) -> Result<FourierModes> {
    let count = below(forms, n, limit)?;
    if count == 0 {
        return Ok(FourierModes::none(forms, n));
    }
    with_factor(forms, n, (limit, count), forms.factor(n, forms.shift())?)
}

/// The `count` modes of the order `n` up to ω = `limit`, rad/s, with the factor of K_n − σM at the shift of `forms`.
pub(super) fn with_factor(
    forms: &Forms,
    n: usize,
    (limit, count): (f64, usize),
    factor: SkylineFactor,
) -> Result<FourierModes> {
    if count == 0 {
        return Ok(FourierModes::none(forms, n));
    }
    let sigma = forms.shift();
    let factor = factor.positive("K − σM of a section")?;
    let pairs = krylov::lowest(forms, n, sigma, &factor, count)?;
    let found = pairs.lambda.iter().filter(|&&l| l <= limit * limit * (1.0 + 4.0 * ASIDE)).count();
    if found != count {
        return Err(Error::NotConverged(format!(
            "modes of order {n}: {count} eigenvalues lie below {:.3} Hz by the inertia of the shifted matrix, \
             but {found} were found",
            limit / (2.0 * PI)
        )));
    }
    let vectors = pairs.vectors.as_ref().subcols(0, count).to_owned();
    let lambda = &pairs.lambda[..count];
    let mass = forms.mass(n, vectors.as_ref());
    let residual = forms.dynamic(n, 0.0, vectors.as_ref());
    let size = |k: usize| {
        let off = residual.col(k).iter().zip(mass.col(k).iter()).map(|(r, m)| (r - lambda[k] * m).powi(2)).sum::<f64>();
        off.sqrt() / ((lambda[k] - sigma).abs() * mass.col(k).norm_l2())
    };
    let residual = (0..count).map(size).collect();
    let root = |&l: &f64| if l.abs() <= RIGID * sigma.abs() { 0.0 } else { l.max(0.0).sqrt() };
    Ok(FourierModes { order: n, omega: lambda.iter().map(root).collect(), vectors, residual })
}

/// Collects the results of `of` of each order, where `size` of it is not 0, until it finds nothing in some orders on
/// end; it is given the orders to look at, as many as `together`.
pub(crate) fn by_orders<T>(
    together: usize,
    size: impl Fn(&T) -> usize,
    mut of: impl FnMut(Vec<usize>) -> Result<Vec<T>>,
) -> Result<Vec<T>> {
    let mut all = Vec::new();
    let (mut next, mut empty) = (0, 0);
    // Beyond n = 2 the lowest frequency of an order rises with it.
    while empty < EMPTY || next <= 3 {
        for found in of((next..next + together.max(1)).collect())? {
            empty = if size(&found) == 0 { empty + 1 } else { 0 };
            all.extend(Some(found).filter(|f| size(f) > 0));
        }
        next += together.max(1);
    }
    Ok(all)
}

/// A limit, rad/s, below which there are `count` modes at least, both families counted; `below` counts those below a
/// limit.
pub(crate) fn limit_of(forms: &Forms, count: usize, mut below: impl FnMut(f64) -> Result<usize>) -> Result<f64> {
    let most = 2 * forms.order();
    if count > most {
        return Err(Error::Job(format!(
            "analyses.modes.count: found {count}, expected at most {most}, which the section has at two orders"
        )));
    }
    let mut limit = 4.0 * forms.shift().abs().sqrt();
    loop {
        let found = below(limit)?;
        if found >= count {
            return Ok(limit);
        }
        // The number of modes of a plate goes with the frequency, that of a solid with its cube.
        let ratio = (count + 4) as f64 / found.max(1) as f64;
        limit *= ratio.sqrt().clamp(1.1, 3.0);
    }
}
