//! Built-in profiles: the wheel S1002 and the heads of rails.

use super::profile::{ProfilePiece, RunningProfile};
use crate::rails::{Rail, R60E1};
use crate::Result;

/// The wheel profile S1002 of EN 13715 (UIC 510-2), from the flange to the field side. The coefficients are those of
/// the standard, for lengths in mm, y from the running circle and positive to the field side, z down; the standard
/// ends the flange at y = −70 mm, where the line is vertical: it is cut 0.25 mm before.
///
/// ```
/// let profile = railsqueal::placement::builtin::s1002()?;
/// // z is down; the flange, at negative y, reaches below the running circle.
/// assert!(profile.contains(0.0) && profile.local(0.0).z.abs() < 1e-6);
/// # Ok::<(), railsqueal::Error>(())
/// ```
pub fn s1002() -> Result<RunningProfile> {
    // Section H, G, F, D are arcs of circles: centre and radius, positive below the centre; E, C, B, A polynomials.
    let arc = |y: f64, z: f64, radius: f64| ProfilePiece::Arc { centre: [1e-3 * y, 1e-3 * z], radius: 1e-3 * radius };
    let polynomial = |c: &[f64]| {
        let coefficients = c.iter().enumerate().map(|(k, c)| c * 1e-3 * 1e3_f64.powi(k as i32)).collect();
        ProfilePiece::Polynomial { at: 0.0, coefficients }
    };
    let breaks = [-69.75, -62.764705882, -49.662510381, -39.764473993, -38.426669071, -35.0, -26.0, 32.15796, 60.0];
    let pieces = vec![
        arc(-49.5, 9.519259302, 20.5),
        arc(-55.0, 16.0, 12.0),
        arc(-58.558326413, 8.834924130, 20.0),
        polynomial(&[-93.576667419, -2.747477419]),
        arc(-26.210665, 16.446, -13.0),
        polynomial(&[
            -4.320221063e+03,
            -1.038384026e+03,
            -1.065501873e+02,
            -6.051367875,
            -2.054332446e-01,
            -4.169739389e-03,
            -4.687195829e-05,
            -2.252755540e-07,
        ]),
        polynomial(&[
            0.0,
            -3.358537058e-02,
            1.565681624e-03,
            -2.810427944e-05,
            5.844240864e-08,
            -1.562379023e-08,
            5.309217349e-15,
            -5.957839843e-12,
            2.646656573e-13,
        ]),
        polynomial(&[1.364323640, -0.066666667]),
    ];
    RunningProfile::new("S1002", breaks.map(|b| 1e-3 * b).to_vec(), pieces)
}

/// The head of the rail 60E1 of EN 13674-1, upright: arcs of 300, 80 and 13 mm that meet tangentially 20.456 mm and
/// 52.053 mm apart, sides of 1:20 (72 mm apart where they begin, 14.3 mm down); origin on the crown.
/// [`RunningProfile::turned`] cants it.
pub fn rail_60e1() -> Result<RunningProfile> {
    rail(&R60E1)
}

/// The head of a built-in rail, upright, with the origin on the crown.
pub fn rail(rail: &Rail) -> Result<RunningProfile> {
    let widths: Vec<f64> = rail.head.ends.iter().map(|end| 2.0 * end).collect();
    rail_head(rail.name, rail.head.radii, &widths, rail.head.side)
}

/// The head of the rail UIC 60 of the Manchester benchmark, upright: as [`rail_60e1`], but for the places at which
/// its arcs meet.
pub fn uic60() -> Result<RunningProfile> {
    rail_head("UIC60", &[300e-3, 80e-3, 13e-3], &[21e-3, 51.976e-3], 20.0)
}

/// A symmetric rail head of arcs that meet tangentially: radii from the crown outwards, m; the widths at which they
/// meet, m; and straight sides that fall by `side` for each unit of width, down to 30 mm below the crown.
pub(crate) fn rail_head(name: &str, radii: &[f64], widths: &[f64], side: f64) -> Result<RunningProfile> {
    let mut centre = [0.0, radii[0]];
    let mut half = Vec::new();
    for (pair, width) in radii.windows(2).zip(widths) {
        half.push((centre, pair[0]));
        let angle = ((0.5 * width - centre[0]) / pair[0]).asin();
        let inwards = pair[0] - pair[1];
        centre = [centre[0] + inwards * angle.sin(), centre[1] - inwards * angle.cos()];
    }
    let last = radii[radii.len() - 1];
    half.push((centre, last));
    let steep = side.atan();
    let end = [centre[0] + last * steep.sin(), centre[1] - last * steep.cos()];
    let foot = [end[0] + (30e-3 - end[1]) / side, 30e-3];
    let outer: Vec<f64> = widths.iter().map(|width| 0.5 * width).chain([end[0], foot[0]]).collect();
    let breaks = outer.iter().rev().map(|y| -y).chain(outer.iter().copied()).collect();
    let arc =
        |sign: f64| move |&(c, r): &([f64; 2], f64)| ProfilePiece::Arc { centre: [sign * c[0], c[1]], radius: -r };
    let mirror = |p: [f64; 2]| [-p[0], p[1]];
    let mut pieces = vec![ProfilePiece::line(mirror(foot), mirror(end))];
    pieces.extend(half[1..].iter().rev().map(arc(-1.0)));
    pieces.extend(half.iter().map(arc(1.0)));
    pieces.push(ProfilePiece::line(end, foot));
    RunningProfile::new(name, breaks, pieces)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest jumps of height and slope at the breaks.
    fn jumps(profile: &RunningProfile) -> [f64; 2] {
        let breaks = profile.breaks();
        breaks[1..breaks.len() - 1].iter().fold([0.0_f64; 2], |worst, &y| {
            let (a, b) = (profile.local(y - 1e-12), profile.local(y + 1e-12));
            [worst[0].max((a.z - b.z).abs()), worst[1].max((a.slope.atan() - b.slope.atan()).abs())]
        })
    }

    #[test]
    fn the_sections_of_s1002_meet() {
        let profile = s1002().unwrap();
        // The standard's own digits: 0.12 µm between C and D, 0.3 mrad.
        let [z, slope] = jumps(&profile);
        assert!(z < 0.13e-6 && slope < 3e-4, "{z} {slope}");
        assert!(profile.local(0.0).z.abs() < 1e-18);
        // Flange 28 mm high, 70 degrees, cone of 1:15 on the field side.
        assert!((profile.local(-0.055).z - 28e-3).abs() < 1e-9);
        assert!((profile.local(-0.039).slope.atan().to_degrees() + 70.0).abs() < 1e-3);
        assert!((profile.local(0.05).slope + 1.0 / 15.0).abs() < 1e-8);
    }

    /// The running profile of each built-in rail and the head of its section are the same surface.
    #[test]
    fn profiles_and_sections_agree() {
        for given in crate::rails::ALL {
            let (profile, head) = (rail(given).unwrap(), given.head);
            let [z, slope] = jumps(&profile);
            assert!(z < 1e-9 && slope < 1e-7, "{}: {z} {slope}", given.name);
            let end = head.to_angle(1.5);
            for k in -30..=30 {
                let at = head.point(end * f64::from(k) / 30.0);
                let found = profile.local(at.y);
                assert!((head.height - at.z - found.z).abs() < 1e-12, "{}: {at:?} {}", given.name, found.z);
                assert!((at.angle + found.slope.atan()).abs() < 1e-9, "{}: {at:?} {}", given.name, found.slope);
            }
        }
    }

    #[test]
    fn the_head_of_60e1_has_the_measures_of_its_drawing() {
        let rail = rail_60e1().unwrap();
        let [z, slope] = jumps(&rail);
        // The places left and right of a break are 2e-12 m apart, where the side turns by 1.5 rad/mm and falls by 20.
        assert!(z < 1e-10 && slope < 1e-8, "{z} {slope}");
        // 72 mm wide 14.3 mm down: both follow from the tangency of the arcs and confirm the widths at which they meet.
        let side = rail.breaks()[rail.breaks().len() - 2];
        assert!(
            (side - 36e-3).abs() < 1e-6 && (rail.local(side).z - 14.3e-3).abs() < 1e-6,
            "{side} {}",
            rail.local(side).z
        );
        for (y, radius) in [(3e-3, 0.3), (-18e-3, 0.08), (33e-3, 0.013)] {
            assert!((rail.local(y).curvature() * radius - 1.0).abs() < 1e-12);
        }
        for y in [2e-3, 15e-3, 30e-3, 36.3e-3] {
            assert!((rail.local(y).z - rail.local(-y).z).abs() < 1e-16);
        }
    }
}
