//! The contact foreseen before the compliance of the bodies is known: frictionless, on elastic half-spaces.

use faer::MatRef;

use super::loads::NormalLoad;
use super::normal::solve_normal;
use super::patch::refuse_border;
use crate::grid::Interface;
use crate::Result;

/// Part of the load under which a contact that reaches the border of the patch does so for certain: the contact of
/// finite bodies is not just that of half-spaces, but its size follows from what is near it, and grows with the cube
/// root of the load.
const CERTAIN: f64 = 0.8;

/// A contact as half-spaces make it.
#[derive(Debug, Clone, PartialEq)]
pub struct PatchEstimate {
    /// Area of the closed nodes, m².
    pub area: f64,
    /// Ends along x and along y, in the middle between closed and open nodes, m.
    pub range: [[f64; 2]; 2],
    /// Largest pressure, Pa.
    pub pressure: f64,
    /// Approach, m: the local part, without the deformation of the bodies as wholes.
    pub approach: f64,
}

impl PatchEstimate {
    /// Under the normal force `load` (N), `w` being the influence matrix of half-spaces on the grid, m/N, `[3n, 3n]`.
    /// A contact that reaches the border of the patch is an error, as it is in the analyses.
    pub fn new(w: MatRef<'_, f64>, s: &Interface, load: f64) -> Result<Self> {
        let patch = s.single("the estimate of the contact by half-spaces")?;
        let certain = solve_normal(w.into(), s, &NormalLoad::Force(CERTAIN * load).into())?;
        refuse_border(w.into(), s, &NormalLoad::Force(load).into(), &certain.closed)?;
        let found = solve_normal(w.into(), s, &NormalLoad::Force(load).into())?;
        let mut range = [[0.0f64; 2]; 2];
        let mut area = 0.0;
        let mut pressure = 0.0f64;
        for (&i, force) in found.closed.iter().zip(&found.force) {
            area += s.weight[i];
            pressure = pressure.max(force / s.weight[i]);
        }
        for (axis, lines) in [&patch.x, &patch.y].into_iter().enumerate() {
            let place = |i: usize| [patch.indices(i).0, patch.indices(i).1][axis];
            let low = found.closed.iter().map(|&i| place(i)).min().unwrap_or(0);
            let high = found.closed.iter().map(|&i| place(i)).max().unwrap_or(0);
            let from = 0.5 * (lines[low] + lines[low.saturating_sub(1)]);
            let to = 0.5 * (lines[high] + lines[(high + 1).min(lines.len() - 1)]);
            range[axis] = [from, to];
        }
        Ok(Self { area, range, pressure, approach: found.motions[0] })
    }

    /// Half lengths along x and y, m.
    pub fn half(&self) -> [f64; 2] {
        self.range.map(|[from, to]| 0.5 * (to - from))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::half_space::HalfSpace;

    /// K. L. Johnson, Contact Mechanics, eqs. 4.22–4.24: a³ = 3NR/(4E*), p₀ = 3N/(2πa²), δ = a²/R.
    #[test]
    fn it_is_the_contact_of_hertz() {
        let steel = HalfSpace { young: 205e9, poisson: 0.3 };
        let s = Interface::paraboloid(41, 41, [7e-3, 7e-3], [4.0, 4.0]).unwrap();
        // Two equal bodies: twice the compliance of one.
        let w = faer::Scale(2.0) * steel.compliance(&s.patches[0].x, &s.patches[0].y).unwrap();
        let modulus = 0.5 * steel.plane();
        let a = (0.75 * 70e3 / (4.0 * modulus)).cbrt();
        let found = PatchEstimate::new(w.as_ref(), &s, 70e3).unwrap();
        for (name, value, hertz) in [
            ("area", found.area, std::f64::consts::PI * a * a),
            ("half length", found.half()[0], a),
            ("half width", found.half()[1], a),
            ("pressure", found.pressure, 1.5 * 70e3 / (std::f64::consts::PI * a * a)),
            ("approach", found.approach, 4.0 * a * a),
        ] {
            assert!((value / hertz - 1.0).abs() < 0.04, "{name}: {value} instead of {hertz}");
        }
        // The patch would have to be larger: 7 mm hold a load (7/4.9)³ times as large.
        let error = PatchEstimate::new(w.as_ref(), &s, 5.0 * 70e3).unwrap_err().to_string();
        assert!(error.contains("contact.patch") && error.contains("half_length"), "{error}");
    }
}
