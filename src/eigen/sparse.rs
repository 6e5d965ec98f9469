//! Distributed sparse matrices and their factorisations as operators of the methods, and the choice between the
//! method here and SLEPc's.

use super::{check, enough, lowest, nearest, FoundModes, MovableShift, Pencil, Shifted, Sizes};
use crate::parallel::World;
use crate::petsc::csr::DistCsr;
use crate::petsc::operator::Operator;
use crate::petsc::{eps, Factor, FactorOptions, Petsc, Symmetry};
use crate::{Error, Result};
use faer::MatRef;
use std::cell::OnceCell;

/// Who computes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Method {
    /// The block method of this program.
    #[default]
    Blocks,
    /// SLEPc's Krylov–Schur method with single vectors.
    Slepc,
}

/// Settings of the computation.
#[derive(Debug, Clone)]
pub struct ModesOptions {
    /// Shift σ that was factorised; the eigenvalues nearest to it are sought.
    pub sigma: f64,
    /// Number of eigenpairs.
    pub count: usize,
    /// Who computes.
    pub method: Method,
    /// Prefix of SLEPc's options, such as `"lower_"`.
    pub prefix: String,
}

/// K and M in distributed rows. Products with K are asked for at the end only; what they need is made then.
pub struct DistributedMatrices<'a> {
    world: &'a World,
    stiffness: &'a DistCsr,
    /// K ready for products, once one was asked for.
    ready: OnceCell<Operator<'a>>,
    mass: Operator<'a>,
    matrix: &'a DistCsr,
    /// Local rows of what is known beforehand, column by column, and the number of columns.
    known: (Vec<f64>, usize),
}

impl<'a> DistributedMatrices<'a> {
    /// Collective: K and M made ready for products.
    pub fn new(world: &'a World, stiffness: &'a DistCsr, mass: &'a DistCsr) -> Self {
        let (mass, matrix) = (mass.operator(world), mass);
        Self { world, stiffness, ready: OnceCell::new(), mass, matrix, known: (Vec::new(), 0) }
    }

    /// The same with eigenvectors that are known beforehand, orthonormal in M, this rank's rows of each.
    pub(crate) fn knowing(self, vectors: &[Vec<f64>]) -> Self {
        Self { known: (vectors.concat(), vectors.len()), ..self }
    }
}

impl Pencil for DistributedMatrices<'_> {
    fn world(&self) -> &World {
        self.world
    }

    fn order(&self) -> u64 {
        self.stiffness.order()
    }

    fn n_local(&self) -> usize {
        self.stiffness.n_local()
    }

    fn stiffness(&self, x: &[f64], y: &mut [f64], columns: usize) {
        let ready = self.ready.get_or_init(|| self.stiffness.operator(self.world));
        ready.apply_block(self.world, x, y, columns);
    }

    fn mass(&self, x: &[f64], y: &mut [f64], columns: usize) {
        self.mass.apply_block(self.world, x, y, columns);
    }

    fn known_vectors(&self) -> MatRef<'_, f64> {
        MatRef::from_column_major_slice(&self.known.0, self.n_local(), self.known.1)
    }
}

/// A factor of K − σM.
pub struct ShiftedFactor<'f, 'w> {
    /// The factor.
    pub factor: &'f mut Factor<'w>,
    /// σ.
    pub sigma: f64,
}

impl Shifted for ShiftedFactor<'_, '_> {
    fn sigma(&self) -> f64 {
        self.sigma
    }

    fn solve(&mut self, x: &mut [f64], columns: usize) -> Result<()> {
        self.factor.solve(x, columns)
    }

    fn below(&self) -> u64 {
        self.factor.negative_pivots()
    }

    fn sizes(&self, count: usize) -> Sizes {
        sizes(self.factor, count)
    }
}

fn sizes(factor: &Factor, count: usize) -> Sizes {
    match factor.on_disk() {
        true => Sizes::few_passes(count),
        false => Sizes::for_count(count),
    }
}

/// Factors of K − σM for one shift after another.
pub struct ShiftedFactors<'a> {
    world: &'a World,
    stiffness: &'a DistCsr,
    mass: &'a DistCsr,
    /// The factor at the shift and the number of entries of what was factorised, which tells whether the pattern is
    /// still that.
    now: Option<(Factor<'a>, usize)>,
    sigma: f64,
}

impl<'a> ShiftedFactors<'a> {
    /// For K and M; nothing is factorised before the first shift is known.
    pub fn new(pencil: &DistributedMatrices<'a>) -> Self {
        Self { world: pencil.world, stiffness: pencil.stiffness, mass: pencil.matrix, now: None, sigma: f64::NAN }
    }

    fn factor(&self) -> Result<&Factor<'a>> {
        self.now
            .as_ref()
            .map(|(factor, _)| factor)
            .ok_or_else(|| Error::Defect("a solve before the first shift".into()))
    }
}

impl Shifted for ShiftedFactors<'_> {
    fn sigma(&self) -> f64 {
        self.sigma
    }

    fn solve(&mut self, x: &mut [f64], columns: usize) -> Result<()> {
        match &mut self.now {
            Some((factor, _)) => factor.solve(x, columns),
            None => self.factor().map(|_| ()),
        }
    }

    fn below(&self) -> u64 {
        self.factor().map_or(0, Factor::negative_pivots)
    }

    fn sizes(&self, count: usize) -> Sizes {
        self.factor().map_or(Sizes::for_count(count), |factor| sizes(factor, count))
    }
}

impl MovableShift for ShiftedFactors<'_> {
    fn move_to(&mut self, sigma: f64) -> Result<()> {
        let shifted = self.stiffness.minus_scaled(sigma, self.mass);
        let entries = self.world.sum_u64(shifted.cols.len() as u64) as usize;
        let name = format!("K - {sigma:.6e} M");
        self.sigma = sigma;
        match &mut self.now {
            Some((factor, before)) if *before == entries => factor.renew(&shifted, &name),
            _ => {
                self.now = None;
                self.now = Some((
                    Factor::new(self.world, &shifted, FactorOptions::new(Symmetry::Indefinite), &name)?,
                    entries,
                ));
                Ok(())
            }
        }
    }
}

/// Collective: the lowest pairs beside those that `pencil` knows, as many as the `options` ask for; the known ones
/// lie below the shift of `first`, as that says.
pub(crate) fn beside_known(
    petsc: &Petsc,
    pencil: &DistributedMatrices,
    first: &mut dyn Shifted,
    options: &ModesOptions,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<FoundModes> {
    let count = options.count;
    if options.method == Method::Slepc {
        return by_slepc(petsc, pencil, first, options, progress);
    }
    match count > SLICED {
        true => lowest(pencil, first, &mut ShiftedFactors::new(pencil), count, progress),
        false => nearest(pencil, first, count, progress),
    }
}

/// More pairs than this are sought by spectrum slicing.
pub const SLICED: usize = 150;

/// Collective: the eigenpairs of K x = λ M x nearest to the shift. `factor` is that of K − σM; K and M are symmetric,
/// M positive definite. `progress` is told converged and wanted pairs.
pub fn modes(
    petsc: &Petsc,
    factor: &mut Factor,
    pencil: &DistributedMatrices,
    options: &ModesOptions,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<FoundModes> {
    let ModesOptions { sigma, count, method, .. } = options;
    if *method == Method::Blocks {
        let mut first = ShiftedFactor { factor, sigma: *sigma };
        // Above the lowest eigenvalue the nearest ones lie on both sides.
        return match *count > SLICED && first.below() == 0 {
            true => lowest(pencil, &mut first, &mut ShiftedFactors::new(pencil), *count, progress),
            false => nearest(pencil, &mut first, *count, progress),
        };
    }
    by_slepc(petsc, pencil, &mut ShiftedFactor { factor, sigma: *sigma }, options, progress)
}

/// Collective: the pairs nearest to the shift of `first` by SLEPc, beside those that `pencil` knows.
fn by_slepc(
    petsc: &Petsc,
    pencil: &DistributedMatrices,
    first: &mut dyn Shifted,
    ModesOptions { count, prefix, .. }: &ModesOptions,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<FoundModes> {
    if *count == 0 || pencil.order() == 0 {
        return Ok(FoundModes::default());
    }
    enough(*count, pencil.order() - pencil.known.1 as u64)?;
    let sigma = first.sigma();
    let wanted = eps::EpsSettings { sigma, known: &pencil.known.0, count: *count, prefix };
    let mut inverse = |x: &mut [f64]| first.solve(x, 1);
    let found = eps::pairs(petsc, &mut inverse, &pencil.mass, &wanted, progress)?;
    let mut modes = check::checked(pencil, sigma, &found.lambda, found.vectors)?;
    (modes.iterations, modes.solves) = (found.restarts, found.solves);
    Ok(modes)
}
