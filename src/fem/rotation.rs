//! Rigid rotation of the material through a mesh that stands still: the reference motion of a rolling body.

/// The axis of a rotation. Velocities are those at 1 rad/s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// A point on it, m.
    pub centre: [f64; 3],
    /// Its direction, a unit vector; the material turns about it by the right-hand rule.
    pub direction: [f64; 3],
}

impl Axis {
    /// The axle of a body in lower form that rolls at `distance` (m) under the contact point: the material passes the
    /// contact towards +x.
    pub fn below(distance: f64) -> Self {
        Self { centre: [0.0, 0.0, -distance], direction: [0.0, 1.0, 0.0] }
    }

    /// W(x) = ê × (x − c), m: velocity of the material at 1 rad/s.
    pub fn velocity(&self, x: [f64; 3]) -> [f64; 3] {
        self.turned(std::array::from_fn(|c| x[c] - self.centre[c]))
    }

    /// Distance vector r from the axis, m: the centrifugal acceleration at 1 rad/s.
    pub fn outward(&self, x: [f64; 3]) -> [f64; 3] {
        let r: [f64; 3] = std::array::from_fn(|c| x[c] - self.centre[c]);
        let along: f64 = (0..3).map(|c| r[c] * self.direction[c]).sum();
        std::array::from_fn(|c| r[c] - along * self.direction[c])
    }

    /// ê × v.
    pub fn turned(&self, v: [f64; 3]) -> [f64; 3] {
        let e = self.direction;
        std::array::from_fn(|c| e[(c + 1) % 3] * v[(c + 2) % 3] - e[(c + 2) % 3] * v[(c + 1) % 3])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_contact_point_of_a_rolling_body_moves_along_x() {
        let axis = Axis::below(0.5);
        assert_eq!(axis.velocity([0.0; 3]), [0.5, 0.0, 0.0]);
        assert_eq!(axis.velocity([0.2, 7.0, -0.5]), [0.0, 0.0, -0.2]);
        assert_eq!(axis.outward([0.2, 7.0, -0.4]), [0.2, 0.0, 0.09999999999999998]);
    }
}
