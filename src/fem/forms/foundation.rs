//! Surface terms, point by point: springs, dashpots, mass.

/// A bilinear form ∫ v·A(n) u dA over a surface with the unit normal n.
pub trait SurfaceForm {
    /// A(n), of the unit of the form over m², `[3][3]`.
    fn tensor(&self, normal: [f64; 3]) -> [[f64; 3]; 3];
}

/// Springs (N/m³), dashpots (N·s/m³) or mass (kg/m²) along the axes and along the normal: A = diag(axes) + normal n nᵀ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Foundation {
    /// Along x, y and z.
    pub axes: [f64; 3],
    /// Along the normal.
    pub normal: f64,
}

impl SurfaceForm for Foundation {
    fn tensor(&self, n: [f64; 3]) -> [[f64; 3]; 3] {
        std::array::from_fn(|i| {
            std::array::from_fn(|j| self.normal * n[i] * n[j] + if i == j { self.axes[i] } else { 0.0 })
        })
    }
}
