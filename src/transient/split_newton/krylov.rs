//! Conjugate gradients in single precision.

use pulp::{Arch, Simd, WithSimd};

use crate::dense::{dot, wide_dot};
use crate::transient::aligned::AlignedVec;
use crate::transient::problem::Effort;

/// Conjugate gradients scaled by the diagonal, whose inverse is `scale`: 0 where there is no unknown. `apply` adds A
/// v to zeros; what it leaves where there is no unknown does not matter. The scaled residual falls by `forcing`.
pub(super) fn conjugate_gradients(
    rhs: &[f32],
    scale: &[f32],
    forcing: f32,
    apply: impl Fn(&[f32], &mut [f32]),
    effort: &mut Effort,
) -> AlignedVec<f32> {
    let mut r = AlignedVec::from(rhs.iter().copied());
    let mut direction = AlignedVec::from(rhs.iter().zip(scale).map(|(r, s)| r * s));
    let mut rz = wide_dot(&r, &direction);
    let enough = forcing * forcing * rz;
    let (mut found, mut image) = (AlignedVec::zeros(r.len()), AlignedVec::zeros(r.len()));
    for _ in 0..r.len() {
        if !(rz > enough) {
            break;
        }
        effort.inner += 1;
        image.fill(0.0);
        apply(&direction, &mut image);
        let update =
            Update { rz, scale, image: &image, found: &mut found, residual: &mut r, direction: &mut direction };
        let Some(next) = Arch::new().dispatch(update) else { break };
        rz = next;
    }
    found
}

/// Update of the vectors by an iteration.
struct Update<'a> {
    rz: f32,
    scale: &'a [f32],
    image: &'a [f32],
    found: &'a mut [f32],
    residual: &'a mut [f32],
    direction: &'a mut [f32],
}

impl WithSimd for Update<'_> {
    /// The new product of the residual and the scaled one; none where the operator is not positive along the direction.
    type Output = Option<f32>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Option<f32> {
        // The direction is 0 where there is no unknown.
        let curvature = dot(self.image, self.direction);
        if !(curvature > 0.0) {
            return None;
        }
        let step = self.rz / curvature;
        self.found.iter_mut().zip(&*self.direction).for_each(|(f, d)| *f += step * d);
        self.residual.iter_mut().zip(self.image).for_each(|(r, i)| *r -= step * i);
        // The image is done with: the scaled residual again.
        let next = weighted(self.residual, self.scale);
        let beta = next / self.rz;
        for ((d, r), s) in self.direction.iter_mut().zip(&*self.residual).zip(self.scale) {
            *d = r * s + beta * *d;
        }
        Some(next)
    }
}

/// Σ s r².
#[inline(always)]
fn weighted(r: &[f32], s: &[f32]) -> f32 {
    const PARTS: usize = 16;
    let (rc, sc) = (r.chunks_exact(PARTS), s.chunks_exact(PARTS));
    let tail: f32 = rc.remainder().iter().zip(sc.remainder()).map(|(r, s)| s * r * r).sum();
    let mut sums = [0.0; PARTS];
    for (r, s) in rc.zip(sc) {
        for k in 0..PARTS {
            sums[k] += s[k] * r[k] * r[k];
        }
    }
    sums.iter().sum::<f32>() + tail
}
