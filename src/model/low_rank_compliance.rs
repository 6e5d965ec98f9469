//! The model of a sweep on bodies that the contact sees by few numbers: every rank makes it by itself.

use super::{adapt, CoupledModel, IntrinsicDamping, SharedModel};
use crate::body::hybrid::{add_functions, expansions, Compact, Lines, LOADS};
use crate::body::near_contacts::add_between;
use crate::body::{Convolution, ModalMatrix, Side, TraceModes};
use crate::grid::Interface;
use crate::job::Job;
use crate::parallel::World;
use crate::{Error, Result};
use faer::Mat;
use std::f64::consts::PI;

impl SharedModel {
    /// Collective: the model of the lower and the upper body of `job` on the grid of `interface`, from their modes
    /// and what their contact rows need, both in lower form and the same on every rank but for damping, which is on
    /// rank 0. The rows are those of the `grids` of all contacts. A state of rest sees the half-spaces alone.
    pub(crate) fn of_compact(
        world: &World,
        job: &Job,
        (interface, grids): (Interface, &[Lines]),
        parts: [(&TraceModes, &Compact); 2],
    ) -> Result<Self> {
        let own = parts.map(|(modes, _)| {
            let matrix = modes.damping.clone().map(ModalMatrix::from);
            IntrinsicDamping::broadcast(world, Some(&IntrinsicDamping { matrix, springs: modes.springs.clone() }))
        });
        let rotation = parts.map(|(modes, _)| modes.rotation.clone());
        let [(lower, of_lower), (upper, of_upper)] = parts;
        let missing = || Error::Defect("a model of few numbers on a grid that is not uniform".into());
        let order = LOADS * grids.len();
        for (name, of) in [("lower", of_lower), ("upper", of_upper)] {
            if of.beside.nrows() != order || of.seen.nrows() != order {
                return Err(Error::Defect(format!(
                    "model of few numbers: the {name} body has {} functions at its contacts, {order} expected",
                    of.beside.nrows()
                )));
            }
        }
        let convolution =
            |of: &Compact, [x, y]: &Lines| Convolution::of_half_space(&of.half_space, x, y)?.ok_or_else(missing);
        let combined = |grid| Convolution::combined(&convolution(of_lower, grid)?, &convolution(of_upper, grid)?);
        let mut convolutions = grids.iter().map(combined).collect::<Result<Vec<_>>>()?;
        let pi = expansions(grids);
        let JoinedCompliance { beside, seen } = JoinedCompliance::join([of_lower, of_upper]);
        let first = of_lower.seen.ncols();
        let omega: Vec<f64> = lower.omega.iter().chain(&upper.omega).copied().collect();
        let local = stacked(&convolutions);
        // E W E: motions along x and y of the upper body have the other sign.
        let near = [(of_lower, 1.0), (of_upper, Side::Upper.sign(0))];
        let with = |functions: &Mat<f64>| -> Result<Mat<f64>> {
            let mut matrix = local.clone();
            for (of, sign) in near {
                add_between(&mut matrix, &of.half_space, (grids, &of.near), sign)?;
            }
            add_functions(&mut matrix, &pi, functions.as_ref());
            Ok(matrix)
        };
        let mut pair = CoupledModel {
            compliance: Mat::zeros(0, 0),
            residual: with(&beside)?,
            local: None,
            // Of several contacts the matrix alone.
            convolution: if convolutions.len() == 1 { convolutions.pop() } else { None },
            modes: &pi * &seen,
            modes_mark: Some(Default::default()),
            functions: None,
            stiffness: ModalMatrix::squares(&omega),
            damping: vec![0.0; omega.len()].into(),
            turning: None,
            carried: None,
            lower_modes: first,
            names: [lower.names.clone(), upper.names.clone()],
            reach: lower.reach.min(upper.reach) / (2.0 * PI),
            omega,
        };
        let mut last = Default::default();
        adapt(&mut pair, job, (&own, &rotation), &mut last)?;
        let modal = &seen * pair.stiffness.statics(seen.transpose());
        // By rows where bodies rotate.
        let turned = pair.turning.is_some();
        let modal = |i: usize, j: usize| if turned { modal[(j, i)] } else { modal[(i, j)] };
        let whole = Mat::from_fn(order, order, |i, j| beside[(i, j)] + modal(i, j));
        pair.compliance = with(&whole)?;
        pair.local = Some(local);
        Ok(Self { interface, pair, own, rotation, last })
    }
}

/// Low-rank compliance and modes of both bodies at the contact.
#[derive(Debug, Clone)]
pub(super) struct JoinedCompliance {
    /// Compliance beside the half-spaces that the modes have no part in, `[9T, 9T]`.
    pub beside: Mat<f64>,
    /// The modes of the lower body, then those of the upper one, `[9T, m1 + m2]`.
    pub seen: Mat<f64>,
}

impl JoinedCompliance {
    /// The lower and the upper body.
    pub fn join([lower, upper]: [&Compact; 2]) -> Self {
        // E π = π E, with the signs of the components of the functions.
        let sign = |k: usize| Side::Upper.sign(k);
        let (order, first) = (lower.seen.nrows(), lower.seen.ncols());
        let seen = Mat::from_fn(order, first + upper.seen.ncols(), |k, j| match j.checked_sub(first) {
            None => lower.seen[(k, j)],
            Some(j) => sign(k) * upper.seen[(k, j)],
        });
        let beside = Mat::from_fn(order, order, |i, j| lower.beside[(i, j)] + sign(i) * sign(j) * upper.beside[(i, j)]);
        Self { beside, seen }
    }
}

/// The influence of each grid on itself, stacked, block diagonal, m/N, `[3n, 3n]`.
fn stacked(convolutions: &[Convolution]) -> Mat<f64> {
    if let [one] = convolutions {
        return one.dense();
    }
    let size = convolutions.iter().map(Convolution::rows).sum();
    let mut all = Mat::zeros(size, size);
    let mut first = 0;
    for convolution in convolutions {
        let rows = convolution.rows();
        all.as_mut().submatrix_mut(first, first, rows, rows).copy_from(convolution.dense());
        first += rows;
    }
    all
}
