//! The interface S_c: contact patches, each a rectilinear grid of nodes, with undeformed gap and nodal areas, or points
//! that stand alone.

use crate::{Error, Result};
use std::ops::Range;

/// One contact patch: a rectilinear grid of nodes in the frame of its own contact, whose origin is the contact point.
/// Its nodes are contiguous on the interface: grid node `(ix, iy)` is node `first + ix + nx*iy`.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactPatch {
    /// Longitudinal node positions, m, ascending, `[nx]`. Smaller x is upstream (ahead of the contact). Of points
    /// their numbers.
    pub x: Vec<f64>,
    /// Lateral node positions, m, ascending, `[ny]`.
    pub y: Vec<f64>,
    /// Number of its first node on the interface.
    pub first: usize,
}

impl ContactPatch {
    /// Number of nodes, nx·ny.
    pub fn len(&self) -> usize {
        self.x.len() * self.y.len()
    }

    /// True for a patch without nodes.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Numbers of its nodes on the interface.
    pub fn nodes(&self) -> Range<usize> {
        self.first..self.first + self.len()
    }

    /// Grid indices (ix, iy) of node `i` of the interface, which lies on this patch.
    pub fn indices(&self, i: usize) -> (usize, usize) {
        let k = i - self.first;
        (k % self.x.len(), k / self.x.len())
    }

    /// Number on the interface of the grid node (ix, iy).
    pub fn node(&self, ix: usize, iy: usize) -> usize {
        self.first + ix + self.x.len() * iy
    }

    /// Nodes at most `reach` grid lines from node `i` of the interface, itself among them, ascending.
    pub fn neighbours(&self, i: usize, reach: usize) -> impl Iterator<Item = usize> + '_ {
        let (ix, iy) = self.indices(i);
        let near = move |k: usize, n: usize| k.saturating_sub(reach)..(k + reach + 1).min(n);
        near(iy, self.y.len()).flat_map(move |jy| near(ix, self.x.len()).map(move |jx| self.node(jx, jy)))
    }
}

/// The potential contact area: one or more patches that are rectilinear grids, or points without neighbours. Contact
/// rows of matrices are interleaved `3*i + c` over the nodes with c = (x, y, n), in the frame of the patch of the
/// node.
#[derive(Debug, Clone, PartialEq)]
pub struct Interface {
    /// The patches, in the order of their nodes; one of points.
    pub patches: Vec<ContactPatch>,
    /// Gap of the undeformed bodies at zero approach, m, `[n]`.
    pub gap: Vec<f64>,
    /// Tangential displacement difference (x, y) that does not come from the reactions, m, `[n]`: none between
    /// bodies as they are. As the gap does for the normal direction, it takes up what an approximate influence matrix
    /// leaves out.
    pub shift: Vec<[f64; 2]>,
    /// Nodal areas (integral of the shape function: nodal quadrature), m², `[n]`. Pressure = nodal force / weight.
    pub weight: Vec<f64>,
    /// Rigid creep of each node beside that of the creepages, m/s, `[n]`; empty on a grid. Points have it each for
    /// itself.
    creep: Vec<[f64; 2]>,
    /// Component along z of the axle about which the lower body turns under the upper one, 1, `[n]`; empty where the
    /// material of both bodies passes alike.
    axle: Vec<f64>,
}

/// Contact points on a body that turns under another one, which does not.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TurningPoints {
    /// Areas that the points stand for, m², `[n]`.
    pub area: Vec<f64>,
    /// Rigid creeps, m/s, `[n]`.
    pub creep: Vec<[f64; 2]>,
    /// Component of the axle along z of each point, out of the lower body, 1, `[n]`.
    pub axle: Vec<f64>,
}

impl Interface {
    /// An interface of one patch with the areas of bilinear shape functions on the grid. `gap` is `[nx*ny]` in m.
    pub fn new(x: Vec<f64>, y: Vec<f64>, gap: Vec<f64>) -> Result<Self> {
        let wx = nodal_lengths(&x, "x")?;
        let wy = nodal_lengths(&y, "y")?;
        if gap.len() != x.len() * y.len() {
            return Err(Error::Defect(format!(
                "interface: {} gaps for a grid of {} x {} nodes",
                gap.len(),
                x.len(),
                y.len()
            )));
        }
        if let Some(i) = gap.iter().position(|g| !g.is_finite()) {
            return Err(Error::Defect(format!("interface: the gap at node {i} is {}", gap[i])));
        }
        let weight = wy.iter().flat_map(|b| wx.iter().map(move |a| a * b)).collect();
        let shift = vec![[0.0; 2]; gap.len()];
        Ok(Self {
            patches: vec![ContactPatch { x, y, first: 0 }],
            gap,
            shift,
            weight,
            creep: Vec::new(),
            axle: Vec::new(),
        })
    }

    /// Contact points with their gaps (m, `[n]`) and rigid creeps (m/s, `[n]`), each of the area 1, so that pressures
    /// are forces. Nothing flows from one to the next, and they have no place.
    pub fn points(gap: Vec<f64>, creep: Vec<[f64; 2]>) -> Result<Self> {
        if gap.is_empty() || gap.len() != creep.len() || gap.iter().chain(creep.as_flattened()).any(|v| !v.is_finite())
        {
            return Err(Error::Defect(format!("interface: gaps {gap:?} m and creeps {creep:?} m/s of points")));
        }
        let n = gap.len();
        let x = (0..n).map(|i| i as f64).collect();
        let patches = vec![ContactPatch { x, y: vec![0.0], first: 0 }];
        Ok(Self { patches, gap, shift: vec![[0.0; 2]; n], weight: vec![1.0; n], creep, axle: Vec::new() })
    }

    /// One patch of contact points without gaps on a body that turns under the other one.
    pub fn turning(points: TurningPoints) -> Result<Self> {
        let TurningPoints { area, creep, axle } = points;
        let n = area.len();
        let within = area.iter().all(|a| *a > 0.0 && a.is_finite()) && axle.iter().all(|e| e.abs() <= 1.0);
        if axle.len() != n || !within {
            return Err(Error::Defect(format!("interface: areas {area:?} m² and axles {axle:?} of points")));
        }
        Ok(Self { weight: area, axle, ..Self::points(vec![0.0; n], creep)? })
    }

    /// The patches of all `parts` on one interface, in this order. Contact points that stand alone cannot be joined,
    /// nor points with a grid.
    pub fn joined(parts: Vec<Interface>) -> Result<Self> {
        let turning = parts.iter().all(|part| !part.axle.is_empty());
        if parts.is_empty() || (parts.len() > 1 && !turning && parts.iter().any(Self::are_points)) {
            return Err(Error::Defect(format!(
                "interface: {} parts to join, or contact points among them",
                parts.len()
            )));
        }
        let mut parts = parts.into_iter();
        let first = parts.next().ok_or_else(|| Error::Defect("interface: no parts to join".into()))?;
        Ok(parts.fold(first, |mut all, part| {
            let offset = all.len();
            all.patches.extend(part.patches.into_iter().map(|p| ContactPatch { first: offset + p.first, ..p }));
            all.gap.extend(part.gap);
            all.shift.extend(part.shift);
            all.weight.extend(part.weight);
            all.creep.extend(part.creep);
            all.axle.extend(part.axle);
            all
        }))
    }

    /// The patch, where there is one alone; `what` names in the error what cannot be done with several.
    pub fn single(&self, what: &str) -> Result<&ContactPatch> {
        self.only().ok_or_else(|| {
            Error::Job(format!(
                "{what} takes one contact patch so far, and there are {}; leave it out, or examine each patch alone",
                self.patches.len()
            ))
        })
    }

    /// The patch, where there is one alone.
    pub fn only(&self) -> Option<&ContactPatch> {
        match &self.patches[..] {
            [patch] => Some(patch),
            _ => None,
        }
    }

    /// Number of the patch of node `i`.
    pub fn patch_of(&self, i: usize) -> usize {
        self.patches.partition_point(|p| p.first <= i).saturating_sub(1)
    }

    /// The patch of node `i` with the grid indices (ix, iy) of the node there.
    pub fn place(&self, i: usize) -> (&ContactPatch, usize, usize) {
        let patch = &self.patches[self.patch_of(i)];
        let (ix, iy) = patch.indices(i);
        (patch, ix, iy)
    }

    /// Returns whether the nodes are points without neighbours.
    pub(crate) fn are_points(&self) -> bool {
        !self.creep.is_empty()
    }

    /// Rigid creep of node `i` beside that of the creepages, m/s.
    pub fn creep(&self, i: usize) -> [f64; 2] {
        self.creep.get(i).copied().unwrap_or_default()
    }

    /// Component along z of node `i` of the axle about which the lower body turns under the upper one, 1; none where
    /// the material of both bodies passes alike.
    pub fn axle(&self, i: usize) -> Option<f64> {
        self.axle.get(i).copied()
    }

    /// The interface of points with other rigid creeps, m/s, `[n]`.
    pub fn with_creep(&self, creep: Vec<[f64; 2]>) -> Self {
        Self { creep, ..self.clone() }
    }

    /// The interface with other gaps, m, `[n]`.
    pub fn with_gap(&self, gap: Vec<f64>) -> Self {
        Self { gap, ..self.clone() }
    }

    /// A uniform grid of `nx` × `ny` nodes over [−half_length, half_length] × [−half_width, half_width] (m) whose gap
    /// is that of two bodies with relative curvatures `curvature_x`, `curvature_y` (1/m): g0 = (κx x² + κy y²)/2.
    ///
    /// ```
    /// use railsqueal::grid::Interface;
    ///
    /// // Two bodies with radii of 0.5 m both ways: relative curvatures of 4 1/m.
    /// let interface = Interface::paraboloid(15, 15, [7e-3, 7e-3], [4.0, 4.0])?;
    /// assert_eq!(interface.len(), 225);
    /// // The gap at the corner of the patch.
    /// assert!((interface.gap[0] - 1.96e-4).abs() < 1e-9);
    /// # Ok::<(), railsqueal::Error>(())
    /// ```
    pub fn paraboloid(nx: usize, ny: usize, half: [f64; 2], curvature: [f64; 2]) -> Result<Self> {
        let line = |n: usize, h: f64| -> Vec<f64> {
            (0..n).map(|i| h * (2.0 * i as f64 / (n.max(2) - 1) as f64 - 1.0)).collect()
        };
        let (x, y) = (line(nx, half[0]), line(ny, half[1]));
        let gap =
            y.iter().flat_map(|b| x.iter().map(move |a| 0.5 * (curvature[0] * a * a + curvature[1] * b * b))).collect();
        Self::new(x, y, gap)
    }

    /// Number of nodes of all patches.
    pub fn len(&self) -> usize {
        self.patches.last().map_or(0, |p| p.first + p.len())
    }

    /// True for an interface without nodes.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Position (x, y) of node `i` in the frame of its patch, m; the origin for points.
    pub fn point(&self, i: usize) -> [f64; 2] {
        if self.are_points() {
            return [0.0; 2];
        }
        let (patch, ix, iy) = self.place(i);
        [patch.x[ix], patch.y[iy]]
    }

    /// True when node `i` lies on the border of its patch; points have none.
    pub(crate) fn on_border(&self, i: usize) -> bool {
        if self.are_points() {
            return false;
        }
        let (patch, ix, iy) = self.place(i);
        ix == 0 || iy == 0 || ix + 1 == patch.x.len() || iy + 1 == patch.y.len()
    }
}

/// Half the distances to the neighbours: lengths of the dual cells of `x`, `[x.len()]`.
fn nodal_lengths(x: &[f64], name: &str) -> Result<Vec<f64>> {
    if x.len() < 3 {
        return Err(Error::Job(format!(
            "contact.patch: the contact grid has {} nodes along {name}, at least 3 are needed; \
             make the patch larger or the elements at the contact smaller",
            x.len()
        )));
    }
    if x.iter().any(|v| !v.is_finite()) || x.windows(2).any(|w| w[1] <= w[0]) {
        return Err(Error::Defect(format!("interface: grid positions along {name} do not ascend")));
    }
    let n = x.len();
    Ok((0..n).map(|i| 0.5 * (x[(i + 1).min(n - 1)] - x[i.saturating_sub(1)])).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn graded() -> Interface {
        let x = vec![-2.0, -1.2, -0.5, 0.0, 0.3, 1.0];
        let y = vec![-1.0, 0.1, 0.7];
        Interface::new(x, y, vec![0.0; 18]).unwrap()
    }

    #[test]
    fn weights_add_up_to_the_area() {
        let s = graded();
        let area: f64 = s.weight.iter().sum();
        assert!((area - 3.0 * 1.7).abs() < 1e-12, "{area}");
    }

    #[test]
    fn points_stand_alone() {
        let s = Interface::points(vec![0.0, 1e-6], vec![[1.0, 0.0], [0.0, -2.0]]).unwrap();
        assert!((s.len(), s.are_points(), s.point(1), s.creep(1)) == (2, true, [0.0; 2], [0.0, -2.0]));
        assert!((0..2).all(|i| !s.on_border(i) && s.weight[i] == 1.0));
        assert!(!graded().are_points() && graded().creep(3) == [0.0; 2]);
        assert!(Interface::points(vec![0.0], Vec::new()).is_err());
    }

    #[test]
    fn patches_of_joined_interfaces_follow_each_other() {
        let small = Interface::paraboloid(3, 4, [1.0, 2.0], [1.0, 1.0]).unwrap();
        let both = Interface::joined(vec![graded(), small.clone()]).unwrap();
        assert_eq!((both.len(), both.patches[1].first, both.patches[1].nodes()), (30, 18, 18..30));
        for i in 0..30 {
            let (patch, part, own) = if i < 18 { (0, graded(), i) } else { (1, small.clone(), i - 18) };
            assert_eq!((both.patch_of(i), both.point(i)), (patch, part.point(own)));
            assert_eq!(
                (both.on_border(i), both.gap[i], both.weight[i]),
                (part.on_border(own), part.gap[own], part.weight[own])
            );
            let (p, ix, iy) = both.place(i);
            assert_eq!((p.node(ix, iy), p), (i, &both.patches[patch]));
        }
        assert_eq!(both.patches[1].neighbours(22, 1).collect::<Vec<_>>(), [18, 19, 20, 21, 22, 23, 24, 25, 26]);
        assert_eq!(both.patches[1].neighbours(18, 1).collect::<Vec<_>>(), [18, 19, 21, 22]);
        assert_eq!(small.only(), Some(&small.patches[0]));
        let error = both.single("analyses.creep_curve").unwrap_err();
        assert!(
            error.message().contains("analyses.creep_curve takes one contact patch so far, and there are 2"),
            "{error}"
        );
        let points = Interface::points(vec![0.0], vec![[1.0, 0.0]]).unwrap();
        assert!(Interface::joined(vec![points, small]).is_err() && Interface::joined(Vec::new()).is_err());
    }

    #[test]
    fn turning_points_make_patches_of_their_own() {
        let points = |n: usize, speed: f64, axle: f64| {
            Interface::turning(TurningPoints { area: vec![2e-4; n], creep: vec![[speed, 0.0]; n], axle: vec![axle; n] })
        };
        let both = Interface::joined(vec![points(3, 2.0, 1.0).unwrap(), points(2, 2.5, -1.0).unwrap()]).unwrap();
        assert_eq!((both.len(), both.patches[1].nodes(), both.are_points()), (5, 3..5, true));
        let of = |i: usize| (both.patch_of(i), both.creep(i), both.axle(i), both.weight[i]);
        assert_eq!(of(2), (0, [2.0, 0.0], Some(1.0), 2e-4));
        assert_eq!(of(3), (1, [2.5, 0.0], Some(-1.0), 2e-4));
        assert_eq!((graded().axle(0), both.point(4)), (None, [0.0; 2]));
        let alone = Interface::points(vec![0.0], vec![[1.0, 0.0]]).unwrap();
        assert!(Interface::joined(vec![points(1, 1.0, 1.0).unwrap(), alone]).is_err());
        assert!(Interface::turning(TurningPoints { axle: vec![1.0], ..TurningPoints::default() }).is_err());
        assert!(points(2, 1.0, 1.5).is_err());
    }

    #[test]
    fn a_grid_that_does_not_ascend_is_refused() {
        assert!(Interface::new(vec![0.0, 1.0, 1.0], vec![0.0, 1.0, 2.0], vec![0.0; 9]).is_err());
        assert!(Interface::new(vec![0.0, 1.0], vec![0.0, 1.0, 2.0], vec![0.0; 6]).is_err());
    }
}
