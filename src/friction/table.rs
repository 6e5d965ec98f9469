//! Friction as it was measured: straight lines between the points of a table.

use super::velocity_weakening::remembering;
use super::Law;

remembering! {
    /// mu(v) along straight lines between points, and that of the last one beyond.
    pub struct FrictionTable {
        /// Pairs of the sliding velocity, m/s, and the coefficient there; the velocities ascend from 0.
        pub points: Vec<[f64; 2]>,
    }
}

impl FrictionTable {
    /// The points before and after the velocity `v`.
    fn around(&self, v: f64) -> [Option<&[f64; 2]>; 2] {
        let after = self.points.partition_point(|p| p[0] <= v);
        [after.checked_sub(1).and_then(|i| self.points.get(i)), self.points.get(after)]
    }
}

impl Law for FrictionTable {
    fn coefficient(&self, v: f64) -> f64 {
        match self.around(v) {
            [Some(a), Some(b)] => a[1] + (b[1] - a[1]) * (v - a[0]) / (b[0] - a[0]),
            [Some(a), None] | [None, Some(a)] => a[1],
            [None, None] => 0.0,
        }
    }

    fn slope(&self, v: f64) -> f64 {
        match self.around(v) {
            [Some(a), Some(b)] => (b[1] - a[1]) / (b[0] - a[0]),
            _ => 0.0,
        }
    }

    fn largest(&self) -> f64 {
        self.points.iter().map(|p| p[1]).fold(0.0, f64::max)
    }

    fn scale(&mut self, factor: f64) {
        self.points.iter_mut().for_each(|p| p[1] *= factor);
    }

    fn fault(&self) -> Option<(&'static str, String)> {
        let wrong = |text: String| Some(("points", text));
        let Some(first) = self.points.first() else {
            return wrong("the table is empty; give pairs of a velocity (m/s) and a coefficient, e.g. [[0, 0.4], \
             [1, 0.3]]".into());
        };
        if first[0] != 0.0 {
            let begin = first[0];
            return wrong(format!("the table begins at {begin} m/s, expected 0: the coefficient at rest is needed"));
        }
        if let Some(p) = self.points.iter().find(|p| p[1] < 0.0) {
            return wrong(format!("found the coefficient {} at {} m/s, expected at least 0", p[1], p[0]));
        }
        let falls_back = self.points.windows(2).find(|w| w[1][0] <= w[0][0]);
        falls_back.and_then(|w| wrong(format!("velocity goes from {} m/s to {} m/s; the velocities of a table \
         ascend", w[0][0], w[1][0])))
    }
}

impl std::fmt::Display for FrictionTable {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "from a table of {} points that begins at {}", self.points.len(), self.coefficient(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::friction::{check, FrictionLaw};

    #[test]
    fn is_straight_between_its_points() {
        let law = FrictionLaw::from(FrictionTable::new(vec![[0.0, 0.3], [0.05, 0.4], [0.5, 0.25]]));
        check(&law, 0.3, 0.25);
        assert!((law.coefficient(0.025) - 0.35).abs() < 1e-15 && (law.coefficient(0.275) - 0.325).abs() < 1e-15);
        assert_eq!((law.largest(), law.slope(0.6), law.fault("friction")), (0.4, 0.0, None));
    }

    #[test]
    fn tables_that_cannot_be_are_refused() {
        for (points, part) in [
            (vec![], "the table is empty"),
            (vec![[0.1, 0.3]], "begins at 0.1 m/s, expected 0"),
            (vec![[0.0, 0.3], [1.0, -0.1]], "found the coefficient -0.1 at 1 m/s"),
            (vec![[0.0, 0.3], [1.0, 0.2], [1.0, 0.1]], "goes from 1 m/s to 1 m/s"),
        ] {
            let fault = FrictionLaw::from(FrictionTable::new(points)).fault("friction").unwrap();
            assert!(fault.starts_with("friction.table.points: ") && fault.contains(part), "{fault}");
        }
    }
}
