//! Completeness of a spectrum found shift by shift. Around every shift all eigenvalues are known up to the farthest
//! that was found. What is promised is a wedge about the imaginary axis: frequencies up to a limit, damping ratios up
//! to a limit of either sign. The discs have to cover it without a gap, neighbours have to agree where they overlap,
//! and every eigenvalue of the reduced model has to have its partner and the other way round.

use crate::{Error, Result};
use num_complex::Complex;

type C = Complex<f64>;

/// The eigenvalues around one shift, 1/s.
#[derive(Debug, Clone)]
pub struct Disc {
    /// The shift.
    pub centre: C,
    /// Distance within which every eigenvalue is in `found`.
    pub radius: f64,
    /// Eigenvalues found; those beyond the radius are not used.
    pub found: Vec<C>,
}

/// Region in which completeness is guaranteed.
#[derive(Debug, Clone, Copy)]
pub struct Wedge {
    /// Largest imaginary part, rad/s.
    pub height: f64,
    /// Largest |Re λ| / Im λ.
    pub slope: f64,
}

/// Relative distance up to which eigenvalues of two shifts are one and the same.
const SAME: f64 = 1e-6;

impl Wedge {
    /// The wedge up to a frequency (Hz) and a damping ratio.
    pub fn new(frequency: f64, damping_ratio: f64) -> Self {
        let slope = damping_ratio / (1.0 - damping_ratio * damping_ratio).sqrt();
        Self { height: 2.0 * std::f64::consts::PI * frequency, slope }
    }

    /// True for an eigenvalue inside, the real axis excluded.
    pub fn holds(&self, value: C) -> bool {
        value.im > 0.0 && value.im <= self.height && value.re.abs() <= self.slope * value.im
    }

    /// Distance from `centre` within which the wedge between the heights `low` and `high` lies.
    pub fn reach(&self, centre: C, low: f64, high: f64) -> f64 {
        let corner = |h: f64| (self.slope * h + centre.re.abs()).hypot(h - centre.im);
        corner(low).max(corner(high))
    }

    /// Heights between which the whole width of the wedge lies in the disc; `None` if there are none.
    pub fn covered(&self, disc: &Disc) -> Option<(f64, f64)> {
        // (slope h + |Re σ|)² + (h − Im σ)² ≤ ρ².
        let (re, im) = (disc.centre.re.abs(), disc.centre.im);
        let (a, b) = (1.0 + self.slope * self.slope, self.slope * re - im);
        let root = b * b - a * (disc.centre.norm_sqr() - disc.radius * disc.radius);
        (root > 0.0).then(|| (((-b - root.sqrt()) / a).max(0.0), (-b + root.sqrt()) / a))
    }
}

fn hertz(height: f64) -> f64 {
    height / (2.0 * std::f64::consts::PI)
}

/// An eigenvalue: disc and place in its list.
pub type EigenvalueIndex = (usize, usize);

/// The eigenvalues with Im λ between 0 and the height of the wedge that the discs hold, ascending, each once. An
/// error if the discs leave a gap in the wedge or disagree where they overlap.
pub fn merge(discs: &[Disc], wedge: &Wedge) -> Result<Vec<EigenvalueIndex>> {
    let mut spans: Vec<(usize, f64, f64)> = discs
        .iter()
        .enumerate()
        .filter_map(|(d, disc)| wedge.covered(disc).map(|(low, high)| (d, low, high)))
        .collect();
    spans.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut places = Vec::new();
    let mut from = 0.0;
    let mut last: Option<(usize, f64)> = None;
    for (d, low, high) in spans {
        let (reached, before) = match last {
            Some((_, reached)) if high <= reached => continue,
            Some((before, reached)) => (reached, Some(before)),
            None => (0.0, None),
        };
        if low > reached {
            return Err(gap(reached, low));
        }
        if let Some(before) = before {
            agree(&discs[before], &discs[d])?;
            let cut = boundary(&discs[before], &discs[d], low.max(from), reached);
            take(&discs[before], before, from, cut.min(wedge.height), &mut places);
            from = cut;
        }
        last = Some((d, high));
    }
    match last {
        Some((d, reached)) if reached >= wedge.height => {
            take(&discs[d], d, from, wedge.height, &mut places);
            places.sort_by(|a, b| discs[a.0].found[a.1].im.total_cmp(&discs[b.0].found[b.1].im));
            Ok(places)
        }
        Some((_, reached)) => Err(gap(reached, wedge.height)),
        None => Err(gap(0.0, wedge.height)),
    }
}

fn gap(low: f64, high: f64) -> Error {
    Error::NotConverged(format!(
        "stability, full system: the spectrum is incomplete, nothing is known between {:.2} and {:.2} Hz; \
         give more eigenvalues per shift by analyses.stability.full.count",
        hertz(low),
        hertz(high)
    ))
}

fn take(disc: &Disc, index: usize, from: f64, to: f64, places: &mut Vec<EigenvalueIndex>) {
    for (at, v) in disc.found.iter().enumerate() {
        // Real eigenvalues come with an imaginary part of rounding.
        let inside = v.im > from.max(SAME * v.norm()) && v.im <= to;
        if inside && (v - disc.centre).norm() < disc.radius {
            places.push((index, at));
        }
    }
}

/// The height in an overlap that is farthest from any eigenvalue.
fn boundary(a: &Disc, b: &Disc, low: f64, high: f64) -> f64 {
    let distance = |h: f64| a.found.iter().chain(&b.found).map(|v| (v.im - h).abs()).fold(f64::INFINITY, f64::min);
    let heights = (0..=200).map(|i| low + (high - low) * f64::from(i) / 200.0);
    heights.max_by(|x, y| distance(*x).total_cmp(&distance(*y))).unwrap_or(low)
}

/// An error unless two discs know the same eigenvalues where both know them all.
fn agree(a: &Disc, b: &Disc) -> Result<()> {
    for (one, other) in [(a, b), (b, a)] {
        let mut free: Vec<C> = other.found.clone();
        for v in &one.found {
            let inside = |d: &Disc| (v - d.centre).norm() < d.radius * (1.0 - SAME) - SAME * v.norm();
            if !(inside(one) && inside(other)) {
                continue;
            }
            match nearest(&free, *v) {
                Some((at, distance)) if distance <= SAME * v.norm() => {
                    free.swap_remove(at);
                }
                _ => {
                    return Err(Error::NotConverged(format!(
                        "stability, full system: the spectrum is incomplete, the eigenvalue at {:.4} Hz, growth \
                         rate {:.4} 1/s, was found from the \
                         shift at {:.2} Hz but not from the one at {:.2} Hz",
                        hertz(v.im),
                        v.re,
                        hertz(one.centre.im),
                        hertz(other.centre.im)
                    )));
                }
            }
        }
    }
    Ok(())
}

fn nearest(list: &[C], v: C) -> Option<(usize, f64)> {
    let distances = list.iter().map(|w| (w - v).norm()).enumerate();
    distances.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Partner of each of `full` in `reduced`, or `None`: the nearest pairs are made first, up to the distance
/// `agreement` |λ|. An error if an eigenvalue of either list in the wedge is left without one; near the upper end of
/// the wedge the partner may lie beyond it, so both lists should go farther.
pub fn partners(full: &[C], reduced: &[C], wedge: &Wedge, agreement: f64) -> Result<Vec<Option<usize>>> {
    let mut pairs = Vec::new();
    for (i, v) in full.iter().enumerate() {
        for (j, w) in reduced.iter().enumerate() {
            let distance = (v - w).norm() / v.norm();
            if distance <= agreement {
                pairs.push((distance, i, j));
            }
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut of_full, mut of_reduced) = (vec![None; full.len()], vec![None; reduced.len()]);
    for (_, i, j) in pairs {
        if of_full[i].is_none() && of_reduced[j].is_none() {
            of_full[i] = Some(j);
            of_reduced[j] = Some(i);
        }
    }
    let safe = Wedge { height: wedge.height * (1.0 - agreement), ..*wedge };
    let lists = [(full, &of_full, "full", "reduced"), (reduced, &of_reduced, "reduced", "full")];
    for (values, partner, name, other) in lists {
        if let Some((v, _)) = values.iter().zip(partner.iter()).find(|(v, p)| safe.holds(**v) && p.is_none()) {
            return Err(Error::NotConverged(format!(
                "stability: the eigenvalue of the {name} system at {:.3} Hz, growth rate {:.4} 1/s, has none of \
                 the {other} system within \
                 {:.2} % of it. Either the spectrum of the {other} system is incomplete there, or the modes in \
                 analyses.modes are too few for this \
                 frequency (analyses.stability.full.agreement says how near is near enough)",
                hertz(v.im),
                v.re,
                100.0 * agreement
            )));
        }
    }
    Ok(of_full)
}

/// Next place to search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NextShift {
    /// Imaginary part of the shift, rad/s.
    pub height: f64,
    /// Eigenvalues to ask for.
    pub count: usize,
    /// Distance from the shift within which they are needed, 1/s.
    pub reach: f64,
}

/// Eigenvalues asked for beyond those expected: the farthest only bounds the disc, and the reduced model is not exact.
const BEYOND: usize = 4;

/// The next shift for the wedge from height `from` upwards: the largest part of it whose disc is expected (by the
/// eigenvalues of the reduced model, all of them, conjugates included) to hold no more than `count` eigenvalues, at a
/// distance from the frequencies `poles` (rad/s) at which the factorisations are singular. `shift` is the shift of a
/// given imaginary part.
pub fn next(
    wedge: &Wedge,
    from: f64,
    count: usize,
    reduced: &[C],
    poles: &[f64],
    shift: impl Fn(f64) -> C,
) -> NextShift {
    let expected = |centre: C, radius: f64| reduced.iter().filter(|v| (*v - centre).norm() <= radius).count();
    let left = wedge.height - from;
    let mut best = None;
    for part in (1..=64).rev() {
        let to = from + left * f64::from(part) / 64.0;
        let width = to - from;
        // Heights around the middle, the one farthest from the poles.
        let away = |h: f64| poles.iter().map(|p| (p - h).abs()).fold(f64::INFINITY, f64::min);
        let heights = (-5..=5).map(|i| from + width * (0.5 + 0.02 * f64::from(i)));
        let height = heights.max_by(|a, b| away(*a).total_cmp(&away(*b))).unwrap_or(from + 0.5 * width);
        let centre = shift(height);
        let reach = wedge.reach(centre, from, to);
        let expected = expected(centre, reach) + BEYOND;
        best = Some(NextShift { height, count: expected, reach });
        if expected <= count {
            break;
        }
    }
    best.unwrap_or(NextShift { height: from + 0.5 * left, count, reach: left })
}

#[cfg(test)]
mod tests {
    use super::*;

    const PI: f64 = std::f64::consts::PI;

    fn wedge() -> Wedge {
        Wedge::new(1000.0, 0.05)
    }

    /// A lightly damped spectrum with a close pair, a doublet and an unstable eigenvalue, beyond the wedge as well;
    /// upper half-plane.
    fn spectrum() -> Vec<C> {
        let hertz =
            [110.0, 240.0, 240.01, 400.0, 400.0, 515.0, 640.0, 655.0, 780.0, 905.0, 990.0, 1080.0, 1200.0, 1350.0];
        let growth = |i: usize| if i == 2 { 3.0 } else { -2.0 - i as f64 };
        hertz.iter().enumerate().map(|(i, f)| C::new(growth(i), 2.0 * PI * f)).collect()
    }

    /// Disc that a faultless solver covers around a shift: the `count` nearest.
    fn disc(centre: C, count: usize) -> Disc {
        let mut all: Vec<C> = spectrum().into_iter().flat_map(|v| [v, v.conj()]).collect();
        all.sort_by(|a, b| (a - centre).norm().total_cmp(&(b - centre).norm()));
        all.truncate(count);
        let radius = all.iter().map(|v| (v - centre).norm()).fold(0.0, f64::max) * (1.0 - 1e-9);
        Disc { centre, radius, found: all }
    }

    fn discs() -> Vec<Disc> {
        let mut discs = vec![disc(C::new(-5.0, 2.0 * PI * 200.0), 8), disc(C::new(-5.0, 2.0 * PI * 820.0), 11)];
        // The order in which shifts were worked at does not matter.
        discs.reverse();
        discs
    }

    fn values(discs: &[Disc]) -> Vec<C> {
        merge(discs, &wedge()).unwrap().into_iter().map(|(d, i)| discs[d].found[i]).collect()
    }

    #[test]
    fn every_eigenvalue_is_listed_once() {
        let expected: Vec<C> = spectrum().into_iter().filter(|v| v.im <= 2.0 * PI * 1000.0).collect();
        let found = values(&discs());
        assert_eq!(found.len(), expected.len(), "{found:?}");
        for (a, b) in found.iter().zip(&expected) {
            assert!((a - b).norm() < 1e-6 || (a.im - b.im).abs() < 1e-6, "{a} {b}");
        }
    }

    #[test]
    fn shifts_that_do_not_meet_leave_a_gap_that_is_named() {
        let apart = [disc(C::new(-5.0, 2.0 * PI * 150.0), 5), disc(C::new(-5.0, 2.0 * PI * 900.0), 7)];
        let error = merge(&apart, &wedge()).unwrap_err();
        assert_eq!(error.exit_code(), 4);
        assert!(error.message().contains("nothing is known between"), "{error}");
        let error = merge(&discs()[1..], &wedge()).unwrap_err();
        assert!(error.message().contains("and 1000.00 Hz"), "{error}");
        assert!(merge(&[], &wedge()).is_err());
    }

    #[test]
    fn an_eigenvalue_missed_by_one_of_two_shifts_is_seen() {
        let mut discs = discs();
        let both = |v: &C| discs.iter().all(|d| (v - d.centre).norm() < 0.99 * d.radius);
        let shared = discs[0].found.iter().position(both).expect("the discs overlap");
        let lost = discs[0].found.remove(shared);
        let error = merge(&discs, &wedge()).unwrap_err();
        assert_eq!(error.exit_code(), 4);
        assert!(error.message().contains(&format!("at {:.4} Hz", lost.im / (2.0 * PI))), "{error}");
    }

    #[test]
    fn an_eigenvalue_missed_by_all_shifts_is_seen_by_the_reduced_model() {
        // The reduced model is a little off, and does not see the doublet as quite double.
        let reduced: Vec<C> = spectrum().iter().enumerate().map(|(i, v)| v * (1.0 + 2e-5 * (i as f64 - 5.0))).collect();
        let full = values(&discs());
        let all = partners(&full, &reduced, &wedge(), 0.01).unwrap();
        assert!(all.iter().all(Option::is_some));
        let mut places: Vec<_> = all.into_iter().flatten().collect();
        places.sort_unstable();
        assert_eq!(places, (0..full.len()).collect::<Vec<_>>());
        for missing in 0..full.len() {
            if full[missing].im > 0.99 * wedge().height {
                continue;
            }
            let mut rest = full.clone();
            rest.remove(missing);
            let error = partners(&rest, &reduced, &wedge(), 0.01).unwrap_err();
            assert_eq!(error.exit_code(), 4, "{error}");
            assert!(error.message().contains("of the reduced system"), "{missing}: {error}");
            let mut fewer = reduced.clone();
            fewer.remove(missing);
            let error = partners(&full, &fewer, &wedge(), 0.01).unwrap_err();
            assert!(error.message().contains("of the full system"), "{missing}: {error}");
        }
    }

    #[test]
    fn shifts_keep_off_the_poles_and_the_count() {
        let all: Vec<C> = spectrum().into_iter().flat_map(|v| [v, v.conj()]).collect();
        let w = wedge();
        let next = super::next(&w, 0.0, 9, &all, &[2.0 * PI * 250.0], |h| C::new(0.0, h));
        assert!(next.count <= 9 && next.height > 0.0, "{next:?}");
        assert!(
            w.covered(&Disc { centre: C::new(0.0, next.height), radius: next.reach, found: vec![] })
                .is_some_and(|c| c.0 < 1e-9),
            "{next:?}"
        );
        assert!((next.height - 2.0 * PI * 250.0).abs() > 2.0 * PI * 1.0, "{next:?}");
        // A shift farther from the axis needs a larger disc, so at least as many eigenvalues for the same part.
        let left = super::next(&w, 0.0, 9, &all, &[], |h| C::new(-0.3 * h, h));
        let reach = w.reach(C::new(-0.3 * left.height, left.height), 0.0, 2.0 * left.height);
        let inside = all.iter().filter(|v| (*v - C::new(-0.3 * left.height, left.height)).norm() <= reach).count();
        assert!(left.count >= inside, "{left:?}: {inside}");
        // A count that no part of the wedge meets: the smallest part, with what it takes.
        let crowded: Vec<C> = (0..50).map(|i| C::new(-1.0, 2.0 * PI * (10.0 + 0.01 * f64::from(i)))).collect();
        let next = super::next(&w, 0.0, 6, &crowded, &[], |h| C::new(0.0, h));
        assert!(next.count > 50, "{next:?}");
    }

    #[test]
    fn the_covered_span_touches_the_circle() {
        let disc = Disc { centre: C::new(-30.0, 3000.0), radius: 1500.0, found: vec![] };
        let (low, high) = wedge().covered(&disc).unwrap();
        for h in [low, high] {
            let corner = C::new(wedge().slope * h, h);
            assert!(((corner - disc.centre).norm() - disc.radius).abs() < 1e-6 * disc.radius, "{h}");
        }
        assert!((wedge().reach(disc.centre, low, high) - disc.radius).abs() < 1e-6 * disc.radius);
        assert!(wedge().covered(&Disc { radius: 1.0, ..disc }).is_none());
    }
}
