//! Creep forces in closed form.

use super::EllipticContact;
use crate::contact::interface::ContactCreepage;

/// Kalker's linear theory, without any slip: forces (x, y) on body 1, N, which know no bound.
pub fn linear(e: &EllipticContact, c: &ContactCreepage) -> [f64; 2] {
    e.without_slip(c)
}

/// The linear theory cut at the bound of friction by a cubic: Z. Y. Shen, J. K. Hedrick, J. A. Elkins, *A comparison
/// of alternative creep force models for rail vehicle dynamic analysis*, 8th IAVSD Symposium (1983). Forces (x, y) on
/// body 1, N.
pub fn shen_hedrick_elkins(e: &EllipticContact, c: &ContactCreepage) -> [f64; 2] {
    let force = e.without_slip(c);
    let size = force[0].hypot(force[1]);
    if size == 0.0 || e.bound() == 0.0 {
        return [0.0; 2];
    }
    let u = size / e.bound();
    let cut = if u < 3.0 { u - u * u / 3.0 + u * u * u / 27.0 } else { 1.0 };
    force.map(|f| f / size * e.bound() * cut)
}

/// O. Polach, *A fast wheel-rail forces calculation computer code*, Vehicle System Dynamics 33, supplement (1999).
/// Forces (x, y) on body 1, N.
pub fn polach(e: &EllipticContact, c: &ContactCreepage) -> [f64; 2] {
    use std::f64::consts::PI;
    let bound = e.bound();
    // In the frame of that paper the contact rolls towards +x, so that spin turns the other way.
    let (sx, sy, spin) = (c.longitudinal, c.lateral, -c.spin);
    if bound == 0.0 {
        return [0.0; 2];
    }
    // The lateral creepage that spin adds to.
    let corrected = if (sy + spin * e.a).abs() > sy.abs() { sy + spin * e.a } else { sy };
    let (size, size_corrected) = (sx.hypot(sy), sx.hypot(corrected));
    if size_corrected == 0.0 {
        return [0.0; 2];
    }
    let stiff = match size > 0.0 {
        true => (e.kalker.longitudinal * sx / size).hypot(e.kalker.lateral * sy / size),
        false => e.kalker.lateral,
    };
    let gradient = 0.25 * PI * e.shear * e.a * e.b * stiff * size_corrected / bound;
    let force = 2.0 * bound / PI * (gradient / (1.0 + gradient * gradient) + gradient.atan());
    // What spin makes.
    let longish = 1.0 + 6.3 * (1.0 - (-e.a / e.b).exp());
    let gradient = 8.0 / 3.0 * e.b * (e.a * e.b).sqrt() * e.shear * e.kalker.spin * size_corrected / (bound * longish);
    let d = (gradient * gradient - 1.0) / (gradient * gradient + 1.0);
    let moment = gradient.abs() * (d * d * d / 3.0 - d * d / 2.0 + 1.0 / 6.0) - (1.0 - d * d).powi(3).sqrt() / 3.0;
    let by_spin = -9.0 / 16.0 * e.a * bound * moment * longish * spin / size_corrected;
    [-force * sx / size_corrected, -(force * sy / size_corrected + by_spin)]
}
