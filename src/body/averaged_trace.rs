//! The contact rows of a body of finite elements: at nodes of its mesh, as means about the nodes of a grid, or from
//! nine means over a disc.

use super::hybrid::expansion;
use super::statics::Statics;
use super::trace::{axis, Trace};
use crate::grid::{ContactGrid, DiscAverage, Transfer, Weights};
use crate::parallel::World;
use crate::swept::{Patch, Square, LOADS};
use crate::Result;
use faer::Mat;

/// The means ⟨ω π_m, u_c⟩ over discs as rows 3m + c, π = (1, x, y), c = (x, y, n into the body), and the grid whose
/// rows follow from the first ones.
#[derive(Debug, Clone)]
pub struct AveragedTrace {
    /// Lines of the grid along x and y, m.
    pub grid: [Vec<f64>; 2],
    /// The discs and their means; a wider one second, where there is room for it.
    pub discs: Vec<(Patch, Trace)>,
}

/// Rows 3i + c, each the weighted sum of the component c of nodes in a frame that is turned against that of the
/// degrees of freedom by `tilt`, rad.
fn weighted(of_nodes: &[Weights], tilt: f64, first: &dyn Fn(u32) -> Result<u64>) -> Result<Vec<Vec<(u64, f64)>>> {
    let (sin, cos) = tilt.sin_cos();
    // x, y and z of the frame, in components of the degrees of freedom.
    let seen: [&[(u64, f64)]; 3] = match tilt == 0.0 {
        true => [&[(0, 1.0)], &[(1, 1.0)], &[(2, 1.0)]],
        false => [&[(0, 1.0)], &[(1, cos), (2, sin)], &[(1, -sin), (2, cos)]],
    };
    let mut rows = Vec::with_capacity(3 * of_nodes.len());
    for weights in of_nodes {
        let dofs = weights.iter().map(|&(node, w)| Ok((first(node)?, w))).collect::<Result<Vec<_>>>()?;
        let row = |c: usize| {
            let terms = |&(d, w): &(u64, f64)| seen[c].iter().map(move |&(k, part)| (d + k, axis(c) * part * w));
            dofs.iter().flat_map(terms).collect()
        };
        rows.extend([0, 1, 2].map(row));
    }
    Ok(rows)
}

/// Collective: the contact rows on the `grid` that rank 0 has, none without one, and the means that they are made of.
/// `ranges` are the first degrees of freedom of the ranks, `first` is on rank 0 the first degree of freedom of a
/// node.
pub(super) fn trace(
    world: &World,
    ranges: &[u64],
    grid: Option<&ContactGrid>,
    first: &dyn Fn(u32) -> Result<u64>,
) -> Result<(Trace, Option<AveragedTrace>)> {
    let transfer = grid.and_then(|g| g.transfer.as_ref());
    let (means, tilt): (&[DiscAverage], f64) = match transfer {
        Some(Transfer::DiscAverage { discs, tilt }) => (discs, *tilt),
        _ => (&[], 0.0),
    };
    let radii = world.broadcast(means.iter().map(|m| m.radius).collect::<Vec<_>>());
    if radii.is_empty() {
        let rows = world.on_root(|| match transfer {
            Some(Transfer::Nodes(nodes)) => {
                let alone: Vec<Weights> = nodes.iter().map(|&node| vec![(node, 1.0)]).collect();
                weighted(&alone, 0.0, first)
            }
            Some(Transfer::Averages { rows, tilt }) => weighted(rows, *tilt, first),
            _ => Ok(Vec::new()),
        })?;
        return Ok((Trace::new(world, ranges, rows.as_deref())?, None));
    }
    let lines = |of: fn(&ContactGrid) -> &Vec<f64>| world.broadcast(grid.map_or(Vec::new(), |g| of(g).clone()));
    let grid = [lines(|g| &g.x), lines(|g| &g.y)];
    let mut discs = Vec::new();
    for (k, radius) in radii.into_iter().enumerate() {
        let rows = world.on_root(|| means.get(k).map_or(Ok(Vec::new()), |m| weighted(&m.weights, tilt, first)))?;
        discs.push((Patch { radius }, Trace::new(world, ranges, rows.as_deref())?));
    }
    let moments = discs[0].0.moments();
    let pi = expansion(&grid);
    let factors = Mat::from_fn(pi.nrows(), LOADS, |i, k| pi[(i, k)] / moments[k]);
    Ok((discs[0].1.clone().times(factors), Some(AveragedTrace { grid, discs })))
}

impl AveragedTrace {
    /// Collective: Γ⁻¹BΓ⁻¹ of each disc, B the means under unit loads of them, m/N and so on; `owned` degrees of
    /// freedom are this rank's.
    pub fn yielding(&self, world: &World, statics: &mut Statics, owned: usize) -> Result<Vec<Square>> {
        let mut all = Vec::new();
        for (patch, trace) in &self.discs {
            let mut loads = vec![0.0; LOADS * owned];
            for k in 0..LOADS {
                let mut unit = [0.0; LOADS];
                unit[k] = 1.0;
                trace.spread(world, &unit, &mut loads[k * owned..(k + 1) * owned]);
            }
            statics.solve(&mut loads, LOADS)?;
            let means = trace.gather(world, LOADS, |k| &loads[k * owned..(k + 1) * owned]);
            let moments = patch.moments();
            let of = |m: &Mat<f64>, c: usize, d: usize| 0.5 * (m[(c, d)] + m[(d, c)]) / (moments[c] * moments[d]);
            let of = |c: usize, d: usize| means.as_ref().map_or(0.0, |m| of(m, c, d));
            let own: Vec<f64> = (0..LOADS * LOADS).map(|k| of(k / LOADS, k % LOADS)).collect();
            let own = world.broadcast(own);
            all.push(std::array::from_fn(|c| std::array::from_fn(|d| own[LOADS * c + d])));
        }
        Ok(all)
    }

    /// Collective: ψ̂ = Γ⁻¹⟨ωπ, φ⟩ of `count` modes, `mode(k)` this rank's degrees of freedom; on rank 0.
    pub fn seen<'v>(
        &self,
        world: &World,
        count: usize,
        mode: impl Fn(usize) -> &'v [f64],
    ) -> Option<Vec<[f64; LOADS]>> {
        let (patch, trace) = self.discs.first()?;
        let (moments, rows) = (patch.moments(), trace.gather(world, count, mode)?);
        Some((0..count).map(|k| std::array::from_fn(|c| rows[(c, k)] / moments[c])).collect())
    }
}
