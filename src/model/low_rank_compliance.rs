//! The model of a sweep on bodies that the contact sees by few numbers: every rank makes it by itself.

use super::{adapt, CoupledModel, IntrinsicDamping, SharedModel};
use crate::body::hybrid::{add_functions, expansion, Compact, Square, LOADS};
use crate::body::{Convolution, ModalMatrix, Side, TraceModes};
use crate::grid::{ContactPatch, Interface};
use crate::job::Job;
use crate::parallel::World;
use crate::{Error, Result};
use faer::Mat;
use std::f64::consts::PI;

impl SharedModel {
    /// Collective: the model of the lower and the upper body of `job` on the grid of `interface`, from their modes
    /// and what their contact rows need, both in lower form and the same on every rank but for damping, which is on
    /// rank 0. A state of rest sees the half-spaces alone.
    pub fn of_compact(
        world: &World,
        job: &Job,
        interface: Interface,
        parts: [(&TraceModes, &Compact); 2],
    ) -> Result<Self> {
        let own = parts.map(|(modes, _)| {
            let matrix = modes.damping.clone().map(ModalMatrix::from);
            IntrinsicDamping::broadcast(world, Some(&IntrinsicDamping { matrix, springs: modes.springs.clone() }))
        });
        let rotation = parts.map(|(modes, _)| modes.rotation.clone());
        let [(lower, of_lower), (upper, of_upper)] = parts;
        let ContactPatch { x, y, .. } = interface.single("a model of few numbers")?.clone();
        let missing = || Error::Defect("a model of few numbers on a grid that is not uniform".into());
        let convolution = |of: &Compact| Convolution::of_half_space(&of.half_space, &x, &y)?.ok_or_else(missing);
        let convolution = Convolution::combined(&convolution(of_lower)?, &convolution(of_upper)?)?;
        let pi = expansion(&[x.clone(), y.clone()]);
        // E π = π E, with the signs of the components of the functions.
        let sign = |k: usize| Side::Upper.sign(k);
        let first = of_lower.seen.len();
        let seen = Mat::from_fn(LOADS, first + of_upper.seen.len(), |k, j| match j.checked_sub(first) {
            None => of_lower.seen[j][k],
            Some(j) => sign(k) * of_upper.seen[j][k],
        });
        let beside: Square = std::array::from_fn(|i| {
            std::array::from_fn(|j| of_lower.beside[i][j] + sign(i) * sign(j) * of_upper.beside[i][j])
        });
        let omega: Vec<f64> = lower.omega.iter().chain(&upper.omega).copied().collect();
        let local = convolution.dense();
        let with = |functions: &Square| {
            let mut matrix = local.clone();
            add_functions(&mut matrix, &pi, functions);
            matrix
        };
        let mut pair = CoupledModel {
            compliance: Mat::zeros(0, 0),
            residual: with(&beside),
            local: None,
            convolution: Some(convolution),
            modes: &pi * &seen,
            stiffness: ModalMatrix::squares(&omega),
            damping: vec![0.0; omega.len()].into(),
            turning: None,
            lower_modes: first,
            names: [lower.names.clone(), upper.names.clone()],
            reach: lower.reach.min(upper.reach) / (2.0 * PI),
            omega,
        };
        adapt(&mut pair, job, &own, &rotation)?;
        let modal = &seen * pair.stiffness.statics(seen.transpose());
        // By rows where bodies rotate.
        let turned = pair.turning.is_some();
        let modal = |i: usize, j: usize| if turned { modal[(j, i)] } else { modal[(i, j)] };
        let whole = std::array::from_fn(|i| std::array::from_fn(|j| beside[i][j] + modal(i, j)));
        pair.compliance = with(&whole);
        pair.local = Some(local);
        Ok(Self { interface, pair, own, rotation })
    }
}
