//! The contact rows of a body of finite elements: at nodes of its mesh, as means about the nodes of a grid, or from
//! nine means over a patch at each contact. Rows are stacked over the contacts.

use super::hybrid::{expansions, Lines};
use super::near_contacts::ContactPosition;
use super::statics::Statics;
use super::trace::{axis, Trace};
use crate::grid::{ContactGrid, PatchAverage, PatchShape, Transfer, Weights};
use crate::parallel::World;
use crate::swept::{LoadPatch, LOADS};
use crate::{Error, Result};
use faer::Mat;

/// Contact of a body of finite elements, on rank 0.
#[derive(Debug, Clone, Copy)]
pub enum MeshContact<'g> {
    /// On a grid.
    Grid {
        /// Grid, and how the mesh meets it.
        grid: &'g ContactGrid,
        /// Angle about the axle, along y, from the z axis of the mesh to the normal of the contact, towards x, rad.
        along: f64,
    },
    /// On cells.
    Cells(&'g [SurfaceCell]),
}

/// A cell of a surface, which moves as its mean.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceCell {
    /// Nodes of the mesh with their parts in the mean.
    pub weights: Weights,
    /// Axes x and y of the contact, and z out of the body, in components of the mesh.
    pub axes: [[f64; 3]; 3],
}

/// The means ⟨ω π_m, u_c⟩ over patches as rows 9k + 3m + c of the contact k, π = (1, x, y), c = (x, y, n into the
/// body), and the grids whose rows follow from the first ones.
#[derive(Debug, Clone)]
pub struct AveragedTrace {
    /// Lines of the grid of each contact along x and y, m.
    pub grids: Vec<Lines>,
    /// Sets of patches, one at each contact, and their means; others second, where there is room for them.
    pub patches: Vec<(Vec<LoadPatch>, Trace)>,
    /// Positions of the contacts.
    pub positions: Vec<ContactPosition>,
}

/// Axes (x, y, z) of the frame of a contact, in components of the degrees of freedom: at the angle `along` about y, and
/// turned by `tilt` about x, rad.
fn axes(along: f64, tilt: f64) -> [[f64; 3]; 3] {
    let ((s, c), (sin, cos)) = (along.sin_cos(), tilt.sin_cos());
    [[c, 0.0, -s], [sin * s, cos, sin * c], [cos * s, -sin, cos * c]]
}

/// Rows 3i + c, each the weighted sum of the component c of nodes in the frame of the `axes`.
fn weighted(
    of_nodes: &[Weights],
    axes: &[[f64; 3]; 3],
    first: &dyn Fn(u32) -> Result<u64>,
) -> Result<Vec<Vec<(u64, f64)>>> {
    let mut rows = Vec::with_capacity(3 * of_nodes.len());
    for weights in of_nodes {
        let dofs = weights.iter().map(|&(node, w)| Ok((first(node)?, w))).collect::<Result<Vec<_>>>()?;
        let row = |c: usize| {
            let parts = || (0..3u64).zip(axes[c]).filter(|(_, part)| *part != 0.0);
            let terms = |&(d, w): &(u64, f64)| parts().map(move |(k, part)| (d + k, axis(c) * part * w));
            dofs.iter().flat_map(terms).collect()
        };
        rows.extend([0, 1, 2].map(row));
    }
    Ok(rows)
}

/// Nodes of a mesh as the trace asks for them, on rank 0.
pub(super) struct NodeAccess<'a> {
    /// First degree of freedom of a node.
    pub first: &'a dyn Fn(u32) -> Result<u64>,
    /// Position of a node, m.
    pub place: &'a dyn Fn(u32) -> [f64; 3],
}

/// Collective: the contact rows of the `contacts` that rank 0 has, none without one, and the means that they are made
/// of. `ranges` are the first degrees of freedom of the ranks.
pub(super) fn trace(
    world: &World,
    ranges: &[u64],
    contacts: &[MeshContact],
    nodes: &NodeAccess,
) -> Result<(Trace, Option<AveragedTrace>)> {
    let discs_of = |contact: &MeshContact| -> usize {
        match contact {
            MeshContact::Grid {
                grid: ContactGrid { transfer: Some(Transfer::PatchAverage { patches, .. }), .. },
                ..
            } => patches.len(),
            _ => 0,
        }
    };
    let sets: Vec<u64> = world.broadcast(contacts.iter().map(|c| discs_of(c) as u64).collect());
    let count = sets.iter().copied().min().unwrap_or(0) as usize;
    if sets.iter().any(|&n| (n == 0) != (count == 0)) {
        return Err(Error::Job(
            "found contacts of one body by means over patches and by nodes of the mesh, expected one of both for all: \
             take contact.compliance \"hybrid\" or \"fe\" for every contact of the body"
                .into(),
        ));
    }
    if count == 0 {
        let rows = world.on_root(|| {
            let mut rows = Vec::new();
            for contact in contacts {
                let (grid, along) = match contact {
                    MeshContact::Grid { grid, along } => (grid, *along),
                    MeshContact::Cells(cells) => {
                        for SurfaceCell { weights, axes } in *cells {
                            rows.extend(weighted(std::slice::from_ref(weights), axes, nodes.first)?);
                        }
                        continue;
                    }
                };
                let axes = |tilt: f64| axes(along, tilt);
                rows.extend(match &grid.transfer {
                    Some(Transfer::Nodes(nodes_of)) => {
                        let alone: Vec<Weights> = nodes_of.iter().map(|&node| vec![(node, 1.0)]).collect();
                        weighted(&alone, &axes(0.0), nodes.first)?
                    }
                    Some(Transfer::Averages { rows, tilt }) => weighted(rows, &axes(*tilt), nodes.first)?,
                    _ => Vec::new(),
                });
            }
            Ok(rows)
        })?;
        return Ok((Trace::new(world, ranges, rows.as_deref())?, None));
    }
    let discs: Vec<(&[PatchAverage], [[f64; 3]; 3])> = contacts
        .iter()
        .filter_map(|contact| match contact {
            MeshContact::Grid {
                grid: ContactGrid { transfer: Some(Transfer::PatchAverage { patches, tilt }), .. },
                along,
            } => Some((&patches[..], axes(*along, *tilt))),
            _ => None,
        })
        .collect();
    let lines = |k: usize, of: fn(&ContactGrid) -> &Vec<f64>| {
        world.broadcast(match contacts.get(k) {
            Some(MeshContact::Grid { grid, .. }) => of(grid).clone(),
            _ => Vec::new(),
        })
    };
    let grids: Vec<Lines> = (0..sets.len()).map(|k| [lines(k, |g| &g.x), lines(k, |g| &g.y)]).collect();
    let mut all = Vec::new();
    for set in 0..count {
        // Of each patch the half sides and the middle; no half side along x of a disc.
        let numbers = |(patches, _): &(&[PatchAverage], _)| match patches[set].shape {
            PatchShape::Disc { radius } => [0.0, radius, 0.0],
            PatchShape::Rectangle { half: [a, b], middle } => [a, b, middle],
        };
        let shapes = world.broadcast(discs.iter().flat_map(numbers).collect::<Vec<f64>>());
        let rows = world.on_root(|| {
            let of =
                |(discs, axes): &(&[PatchAverage], [[f64; 3]; 3])| weighted(&discs[set].weights, axes, nodes.first);
            Ok(discs.iter().map(of).collect::<Result<Vec<_>>>()?.concat())
        })?;
        let patch = |of: &[f64]| match (of[0], of[1], of[2]) {
            (0.0, radius, _) => LoadPatch::Circle { radius },
            (a, b, middle) => LoadPatch::Rectangle { half: [a, b], middle },
        };
        let patches: Vec<LoadPatch> = shapes.chunks_exact(3).map(patch).collect();
        all.push((patches, Trace::new(world, ranges, rows.as_deref())?));
    }
    let position = |(discs, [_, _, normal]): &(&[PatchAverage], [[f64; 3]; 3])| {
        let weights = &discs[0].weights[0];
        let sum = |c: usize| weights.iter().map(|&(node, w)| w * (nodes.place)(node)[c]).sum::<f64>();
        [[0, 1, 2].map(sum), *normal].concat()
    };
    let numbers = world.broadcast(discs.iter().flat_map(position).collect::<Vec<f64>>());
    let three = |of: &[f64]| [of[0], of[1], of[2]];
    let positions =
        numbers.chunks_exact(6).map(|v| ContactPosition { point: three(&v[..3]), normal: three(&v[3..]) }).collect();
    let pi = expansions(&grids);
    let factors = pi * functions(&all[0].0);
    Ok((all[0].1.clone().times(factors), Some(AveragedTrace { grids, patches: all, positions })))
}

/// The functions that have means on `patches`, from these: Γ⁻¹ of each, `[9T, 9T]`.
fn functions(patches: &[LoadPatch]) -> Mat<f64> {
    let mut all = Mat::zeros(LOADS * patches.len(), LOADS * patches.len());
    for (c, patch) in patches.iter().enumerate() {
        for k in 0..LOADS {
            let found = patch.functions(&std::array::from_fn(|l| if l == k { 1.0 } else { 0.0 }));
            (0..LOADS).for_each(|l| all[(LOADS * c + l, LOADS * c + k)] = found[l]);
        }
    }
    all
}

impl AveragedTrace {
    /// Collective: Γ⁻¹BΓ⁻¹ of each set of patches, B the means under unit loads of them, m/N and so on, `[9T, 9T]`;
    /// `owned` degrees of freedom are this rank's.
    pub fn yielding(&self, world: &World, statics: &mut Statics, owned: usize) -> Result<Vec<Mat<f64>>> {
        let mut all = Vec::new();
        for (patches, trace) in &self.patches {
            let count = LOADS * patches.len();
            let mut loads = vec![0.0; count * owned];
            for k in 0..count {
                let mut unit = vec![0.0; count];
                unit[k] = 1.0;
                trace.spread(world, &unit, &mut loads[k * owned..(k + 1) * owned]);
            }
            statics.solve(&mut loads, count)?;
            let means = trace.gather(world, count, |k| &loads[k * owned..(k + 1) * owned]);
            let found = means.map(|m| {
                let even = Mat::from_fn(count, count, |c, d| 0.5 * (m[(c, d)] + m[(d, c)]));
                let of_means = functions(patches);
                &of_means * even * of_means.transpose()
            });
            let of = |c: usize, d: usize| found.as_ref().map_or(0.0, |m| m[(c, d)]);
            let own = world.broadcast((0..count * count).map(|k| of(k / count, k % count)).collect::<Vec<f64>>());
            all.push(Mat::from_fn(count, count, |c, d| own[count * c + d]));
        }
        Ok(all)
    }

    /// Collective: ψ̂ = Γ⁻¹⟨ωπ, φ⟩ of `count` modes, `[9T, count]` on rank 0; `mode(k)` are this rank's degrees of
    /// freedom.
    pub(crate) fn averaged_modes<'v>(
        &self,
        world: &World,
        count: usize,
        mode: impl Fn(usize) -> &'v [f64],
    ) -> Option<Mat<f64>> {
        let (patches, trace) = self.patches.first()?;
        Some(functions(patches) * trace.gather(world, count, mode)?)
    }
}
