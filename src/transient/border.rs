//! Unknown rigid shifts of the contact, each with a prescribed resultant of the reactions: the borders of the problem
//! of a step.
//!
//! A shift s moves (d_x, d_y, g) of the nodes of patch c by its column times s, and Σ_c Σ_i row_c · R_i is given. The
//! total normal force of one patch has column and row (0, 0, 1), its approach is −s. A vertical motion of several
//! patches has the columns (0, 0, cos δ_c) and the rows (0, sin δ_c, cos δ_c).

/// A border: a shift and the resultant that determines it.
#[derive(Debug, Clone, PartialEq)]
pub struct Border {
    /// Change of (d_x, d_y, g) per unit of the shift, `[patches]`.
    pub column: Vec<[f64; 3]>,
    /// Parts of (t_x, t_y, p) in the resultant, `[patches]`.
    pub row: Vec<[f64; 3]>,
    /// The resultant, N.
    pub total: f64,
    /// True for patches whose load it is, `[patches]`; beside it a further resultant balances forces.
    pub loads: Vec<bool>,
}

impl Border {
    /// The total of component `c` of the reactions (t_x, t_y, p) of one patch.
    pub(crate) fn of_component(c: usize, total: f64) -> Self {
        let unit = [0, 1, 2].map(|k| if k == c { 1.0 } else { 0.0 });
        Self { column: vec![unit], row: vec![unit], total, loads: vec![c == 2] }
    }

    /// Returns whether the shift moves along the normals alone.
    pub(crate) fn is_normal(&self) -> bool {
        self.column.iter().all(|c| c[..2] == [0.0; 2])
    }

    /// Returns whether tractions have a part in the resultant.
    pub(crate) fn has_traction(&self) -> bool {
        self.row.iter().any(|r| r[..2] != [0.0; 2])
    }

    /// Returns whether the shift moves patch `c`.
    pub fn moves(&self, c: usize) -> bool {
        self.column[c] != [0.0; 3]
    }

    /// The direction along the surface in which the shift of one patch moves; none of a normal shift.
    pub fn tangential(&self) -> Option<usize> {
        (0..2).find(|&c| self.column.iter().any(|column| column[c] != 0.0))
    }

    /// Part of the reaction `r` of a node of patch `c` in the resultant, N.
    #[inline(always)]
    pub(crate) fn contribution(&self, c: usize, r: &[f64]) -> f64 {
        let row = &self.row[c];
        row[0] * r[0] + row[1] * r[1] + row[2] * r[2]
    }
}
