//! Two bodies on one interface: compliance, residual and modes of both together.

use super::broadcast;
use crate::body::rotation::RotationTerms;
use crate::body::{Convolution, ModalMatrix, ModeLabel, ReducedBody, Side};
use crate::grid::Interface;
use crate::parallel::World;
use crate::{Error, Result};
use faer::{Mat, MatRef};
use std::sync::Arc;

/// Two bodies on one interface: combined compliance and modes.
///
/// ```
/// use faer::Mat;
/// use railsqueal::body::ReducedBody;
/// use railsqueal::model::CoupledModel;
///
/// // One node that a mode of 100 Hz and 4 kg moves along x; all modes together yield by 1 µm/N there.
/// let omega = 2.0 * std::f64::consts::PI * 100.0;
/// let mode = Mat::from_fn(3, 1, |row, _| if row == 0 { 0.5 } else { 0.0 });
/// let compliance = Mat::from_fn(3, 3, |i, j| if i == j { 1e-6 } else { 0.0 });
/// let lower = ReducedBody::new(vec![omega], vec![2.0 * 0.01 * omega], mode, compliance);
/// let rigid = ReducedBody::new(Vec::new(), Vec::new(), Mat::zeros(3, 0), Mat::zeros(3, 3));
/// let model = CoupledModel::new(&lower, &rigid)?;
/// assert_eq!((model.lower_modes, model.omega.len()), (1, 1));
/// // What the mode does not bring is left to the residual compliance.
/// let left = model.influence()[(0, 0)] - 0.25 / (omega * omega);
/// assert!((model.residual[(0, 0)] - left).abs() < 1e-18 && model.residual[(1, 1)] == 1e-6);
/// # Ok::<(), railsqueal::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct CoupledModel {
    /// W = C1 + E C2 E, m/N, `[3n, 3n]`; its transpose where bodies rotate, see [`influence`](Self::influence).
    pub compliance: Mat<f64>,
    /// Local part of W for a state of rest, where the bodies are placed as they are under the load: that of
    /// half-spaces, m/N, `[3n, 3n]`.
    pub local: Option<Mat<f64>>,
    /// W for a state of rest, where that is a convolution: of half-spaces alone, whose `compliance` is not made and
    /// empty, or found in the matrix.
    pub convolution: Option<Convolution>,
    /// Residual S = W − Ψ K⁻¹ Ψᵀ, m/N, `[3n, 3n]`.
    pub residual: Mat<f64>,
    /// Ψ = [Φ1, E Φ2], 1/√kg, `[3n, m1 + m2]`.
    pub modes: Mat<f64>,
    /// Mark of models whose Ψ is the same, as those of one study; none where that is not known.
    pub modes_mark: Option<Arc<()>>,
    /// Factors of Ψ, where it was made from them.
    pub functions: Option<ModeFactors>,
    /// Angular frequencies, rad/s, `[m1 + m2]`: the lower body's, then the upper one's.
    pub omega: Vec<f64>,
    /// Modal stiffness, 1/s², in the same order; that of bodies that rotate included.
    pub stiffness: ModalMatrix,
    /// Modal damping, 1/s, in the same order; with gyroscopic terms of bodies that rotate.
    pub damping: ModalMatrix,
    /// Terms of rotation in both; none of bodies at rest.
    pub turning: Option<RotationTerms>,
    /// Rates at which the lower body, which turns under the upper one, carries the modes past contact points fixed in
    /// space, 1/(√kg s), `[3n, m1 + m2]`; none where the material of both bodies passes alike.
    pub carried: Option<Mat<f64>>,
    /// m1.
    pub lower_modes: usize,
    /// Names of the modes of the lower and of the upper body; empty where that is not known.
    pub names: [Vec<ModeLabel>; 2],
    /// Highest frequency up to which the modes of both bodies are known, Hz.
    pub reach: f64,
}

/// Modes by the few functions of which they consist over a contact, Ψ = Π ψ̂.
#[derive(Debug, Clone)]
pub struct ModeFactors {
    /// Π, the functions at the contact rows, `[3n, r]`.
    pub functions: Mat<f64>,
    /// ψ̂, their amplitudes in each mode, `[r, m1 + m2]`.
    pub amplitudes: Mat<f64>,
}

impl CoupledModel {
    /// Combines the lower and the upper body (both in lower form). Rigid-body modes (ω = 0) have no part in the
    /// compliance.
    pub fn new(lower: &ReducedBody, upper: &ReducedBody) -> Result<Self> {
        for (name, b) in [("lower", lower), ("upper", upper)] {
            let m = b.omega.len();
            let orders = [b.stiffness.order(), b.damping.order(), b.contact_modes.ncols()];
            if orders != [m; 3] || b.contact_modes.nrows() != b.compliance.nrows() {
                return Err(Error::Defect(format!(
                    "reduced {name} body: {m} frequencies, stiffness, damping and modes of {orders:?}, contact \
                     modes {:?}, compliance {:?}",
                    b.contact_modes.shape(),
                    b.compliance.shape()
                )));
            }
        }
        let compliance = combined_compliance(lower.compliance.as_ref(), upper.compliance.as_ref())?;
        let (rows, m1, m2) = (compliance.nrows(), lower.omega.len(), upper.omega.len());
        let modes = Mat::from_fn(rows, m1 + m2, |i, k| {
            if k < m1 {
                lower.contact_modes[(i, k)]
            } else {
                Side::Upper.sign(i) * upper.contact_modes[(i, k - m1)]
            }
        });
        let omega: Vec<f64> = lower.omega.iter().chain(&upper.omega).copied().collect();
        let (stiffness, damping) = (lower.stiffness.joined(&upper.stiffness), lower.damping.joined(&upper.damping));
        let reach = lower.reach.min(upper.reach) / (2.0 * std::f64::consts::PI);
        let residual = match &stiffness {
            ModalMatrix::Diagonal(_) => {
                let scaled =
                    Mat::from_fn(rows, m1 + m2, |i, k| if omega[k] > 0.0 { modes[(i, k)] / omega[k] } else { 0.0 });
                &compliance - &scaled * scaled.transpose()
            }
            ModalMatrix::Blocks(_) => &compliance - &modes * stiffness.statics(modes.transpose()),
        };
        let turning =
            RotationTerms::joined((lower.turning.as_ref(), &lower.damping), (upper.turning.as_ref(), &upper.damping));
        let compliance = if turning.is_some() { compliance.transpose().to_owned() } else { compliance };
        let names = [lower.names.clone(), upper.names.clone()];
        Ok(Self {
            compliance,
            local: None,
            convolution: None,
            residual,
            modes,
            modes_mark: None,
            functions: None,
            omega,
            stiffness,
            damping,
            turning,
            carried: None,
            lower_modes: m1,
            names,
            reach,
        })
    }

    /// W, m/N, `[3n, 3n]`: symmetric of bodies at rest; that of bodies that rotate is not, since damping acts on what
    /// only turns, and is kept by rows.
    pub fn influence(&self) -> MatRef<'_, f64> {
        match self.turning {
            Some(_) => self.compliance.transpose(),
            None => self.compliance.as_ref(),
        }
    }

    /// The influence matrix of a state of rest: W, or what of it acts beside the deflection that the placement has
    /// already.
    pub fn at_rest(&self) -> MatRef<'_, f64> {
        self.local.as_ref().map_or(self.influence(), Mat::as_ref)
    }

    /// Looks whether what a state of rest sees of W on the grid of `interface` is a convolution.
    pub(crate) fn find_convolution(&mut self, interface: &Interface) {
        if let Some(patch) = interface.only().filter(|_| !interface.are_points()) {
            self.convolution = Convolution::found_in(self.at_rest(), &patch.x, &patch.y);
        }
    }

    /// Displacement of the bodies at the contact rows under the reactions `reaction`, N, `[3n]`, that has no part in a
    /// state of rest, m, `[3n]`; none where all of it has.
    pub fn deflection(&self, reaction: &[f64]) -> Option<Vec<f64>> {
        let local = self.local.as_ref()?;
        let force = faer::ColRef::from_slice(reaction);
        Some((self.influence() * force - local * force).iter().copied().collect())
    }

    /// Makes the compliance anew from the residual and the modes, which have changed.
    pub(super) fn renew_compliance(&mut self) {
        let whole = &self.residual + &self.modes * self.stiffness.statics(self.modes.transpose());
        self.compliance = match self.turning {
            Some(_) => whole.transpose().to_owned(),
            None => whole,
        };
        if self.local.is_none() {
            self.convolution = self.convolution.take().and_then(|c| c.found_again(self.influence()));
        }
    }

    /// The pair with the contact `distance` (m) farther along +y on the body of `side`: its modes are those there, to
    /// first order by their gradient along y on the patches of `interface`, in the same directions (x, y, n). Gap and
    /// residual compliance stay.
    pub fn with_contact_moved(&self, interface: &Interface, side: Side, distance: f64) -> Self {
        let gradient = |row: usize, k: usize| -> f64 {
            let (node, c) = (row / 3, row % 3);
            let (patch, ix, iy) = interface.place(node);
            let y = &patch.y;
            // Three neighbouring lines, the own one among them: exact for parabolas.
            let first = iy.saturating_sub(1).min(y.len() - 3);
            let weight = |j: usize| {
                let [p, q] = [first + (j + 1) % 3, first + (j + 2) % 3];
                let j = first + j;
                (2.0 * y[iy] - y[p] - y[q]) / ((y[j] - y[p]) * (y[j] - y[q]))
            };
            (0..3).map(|j| weight(j) * self.modes[(3 * patch.node(ix, first + j) + c, k)]).sum()
        };
        let columns = match side {
            Side::Lower => 0..self.lower_modes,
            Side::Upper => self.lower_modes..self.omega.len(),
        };
        let mut moved = Self { functions: None, modes_mark: None, ..self.clone() };
        for k in columns {
            for row in 0..self.modes.nrows() {
                moved.modes[(row, k)] += distance * gradient(row, k);
            }
        }
        moved.renew_compliance();
        moved
    }

    /// Collective: the pair of rank 0 on every rank.
    pub fn broadcast(world: &World, root: Option<&CoupledModel>) -> Self {
        let list = |of: &dyn Fn(&CoupledModel) -> Vec<f64>| world.broadcast(root.map(of).unwrap_or_default());
        Self {
            compliance: broadcast(world, root.map(|p| &p.compliance)),
            local: Some(broadcast(world, root.and_then(|p| p.local.as_ref()))).filter(|m| m.nrows() > 0),
            convolution: Convolution::from_numbers(&list(&|p| {
                p.convolution.as_ref().map_or(Vec::new(), Convolution::numbers)
            })),
            residual: broadcast(world, root.map(|p| &p.residual)),
            modes: broadcast(world, root.map(|p| &p.modes)),
            modes_mark: Some(Arc::default()),
            functions: None,
            omega: list(&|p| p.omega.clone()),
            stiffness: ModalMatrix::broadcast(world, root.map(|p| &p.stiffness)),
            damping: ModalMatrix::broadcast(world, root.map(|p| &p.damping)),
            turning: RotationTerms::broadcast(world, root.and_then(|p| p.turning.as_ref())),
            carried: Some(broadcast(world, root.and_then(|p| p.carried.as_ref()))).filter(|m| m.nrows() > 0),
            names: [0, 1].map(|i| ModeLabel::broadcast(world, root.map(|p| &p.names[i][..]))),
            reach: list(&|p| vec![p.reach]).first().copied().unwrap_or(0.0),
            lower_modes: list(&|p| vec![p.lower_modes as f64]).first().map_or(0, |&n| n as usize),
        }
    }
}

/// Influence matrix of the interface, W = C1 + E C2 E with E = diag(−1, −1, 1) at each node, from the compliances of
/// the lower body 1 and the upper body 2, both in lower form with rows (x, y, n), `[3n, 3n]`, m/N. With the nodal
/// reactions R = (tx, ty, p) on body 1 it gives (w_x, w_y, gap change) = W R. Symmetric positive definite when C1 and
/// C2 are.
pub fn combined_compliance(lower: MatRef<'_, f64>, upper: MatRef<'_, f64>) -> Result<Mat<f64>> {
    if lower.nrows() != lower.ncols() || lower.nrows() % 3 != 0 || upper.shape() != lower.shape() {
        return Err(Error::Defect(format!(
            "compliances of {:?} and {:?} entries cannot be combined on one interface",
            lower.shape(),
            upper.shape()
        )));
    }
    Ok(Mat::from_fn(lower.nrows(), lower.ncols(), |i, j| {
        lower[(i, j)] + Side::Upper.sign(i) * Side::Upper.sign(j) * upper[(i, j)]
    }))
}
