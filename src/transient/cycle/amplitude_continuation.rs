//! How amplitudes grow, and where the amplitude lies that does not.
//!
//! On the slow manifold of one mode the amplitude a obeys d ln a/dt = g(a). What has been seen of g leads to its
//! root: the cycle.

/// Growth at an amplitude.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct GrowthSample {
    /// ln of the amplitude.
    pub(super) level: f64,
    /// d ln a/dt, 1/s.
    pub(super) rate: f64,
    /// True if no more and no fewer nodes were closed and stuck than at rest.
    pub(super) linear: bool,
}

/// Next action.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum NextAmplitude {
    /// The amplitude is to be multiplied by this.
    Scale(f64),
    /// It goes by itself.
    Wait,
    /// It is near to the cycle's, which small deviations approach at this rate, 1/s.
    Near(f64),
}

/// Longest way in ln a at once: where nothing changes with the amplitude but the amplitude, and elsewhere, where a
/// cycle could be missed.
const WAY: [f64; 2] = [1.4, 0.3];
/// The first way from a place of which nothing is known.
const FIRST: f64 = 0.1;
/// A way so short, in ln a, the motion goes by itself: what is changed too often never comes to rest.
const NEAR: f64 = 0.02;
/// So do those of which the way has been turned so often: their growth is no matter of the amplitude alone.
const TURNS: usize = 4;
/// Tolerance, in ln a, within which a repeated amplitude counts as the same.
const STAYS: f64 = 1e-3;
/// Levels that are nearer to each other tell nothing of the slope: their difference is rounding and beats. Those that
/// are farther are of another part of the curve.
const APART: [f64; 2] = [0.01, 0.6];

/// Amplitudes observed so far.
#[derive(Debug, Clone)]
pub(super) struct Trail {
    /// Time from a change of the amplitude to what is seen of it, s.
    span: f64,
    seen: Vec<GrowthSample>,
    /// The last way in ln a.
    way: f64,
    /// The last way wanted had this sign: those down are not gone where the motion is not linear.
    sign: f64,
    /// How often it has been turned.
    turns: usize,
}

impl Trail {
    /// Nothing seen; `span` is the time from a change of the amplitude to what is seen of it, s.
    pub(super) fn new(span: f64) -> Self {
        Self { span, seen: Vec::new(), way: 0.0, sign: 0.0, turns: 0 }
    }

    /// The rate, 1/s, at which the motion came back from where the last change had put it, if it did: a cycle that
    /// sticks is reached within a few periods.
    fn came_back(&self, now: GrowthSample) -> Option<f64> {
        let left = (now.level - self.seen.last()?.level).abs();
        let stays = left <= STAYS && now.rate.abs() * self.span <= STAYS;
        (stays && self.way.abs() >= 0.5 * FIRST).then(|| (self.way.abs() / left.max(1e-2 * STAYS)).ln() / self.span)
    }

    /// d g/d ln a at the last of `seen`, 1/s, from the nearest one that is far enough.
    fn slope(&self, now: GrowthSample) -> Option<f64> {
        let apart = |s: &GrowthSample| (s.level - now.level).abs();
        let near = self.seen.iter().rev().filter(|s| apart(s) > APART[0] && apart(s) < APART[1]);
        let nearest = near.min_by(|a, b| apart(a).total_cmp(&apart(b)))?;
        Some((now.rate - nearest.rate) / (now.level - nearest.level))
    }

    /// Takes what was seen.
    pub(super) fn next(&mut self, now: GrowthSample) -> NextAmplitude {
        if let Some(back) = self.came_back(now) {
            return NextAmplitude::Near(back);
        }
        let slope = self.slope(now);
        self.seen.push(now);
        let most = match (now.linear, slope) {
            (true, _) => WAY[0],
            (false, Some(_)) => WAY[1],
            (false, None) => FIRST,
        };
        let way = match slope {
            Some(slope) if slope < 0.0 => {
                let way = -now.rate / slope;
                if way.abs() <= NEAR {
                    return NextAmplitude::Near(-slope);
                }
                way
            }
            // Away from an amplitude that is left on both sides, or nothing known.
            // What neither grows nor decays may be a cycle that sticks: it comes back from above.
            None if now.rate.abs() * self.span <= STAYS => FIRST,
            _ => most.copysign(now.rate),
        };
        let way = way.clamp(-most, most);
        // A beat turns it again and again, and would be fed by the steps up.
        self.turns += usize::from(way * self.sign < 0.0);
        self.sign = way.signum();
        if self.turns >= TURNS {
            return NextAmplitude::Near(f64::NAN);
        }
        if way < 0.0 && !now.linear {
            // A step down could lead beyond a cycle and the threshold below it, which lie close to each other near a
            // fold.
            self.way = 0.0;
            return NextAmplitude::Wait;
        }
        self.way = way;
        NextAmplitude::Scale(self.way.exp())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Follows d ln a/dt = g(ln a) from `level`, with looks of 0.05 s; returns where it ends and after how many looks.
    fn end(g: impl Fn(f64) -> f64, mut level: f64, linear: impl Fn(f64) -> bool) -> Option<(f64, f64, usize)> {
        let mut trail = Trail::new(0.05);
        for look in 1..1000 {
            match trail.next(GrowthSample { level, rate: g(level), linear: linear(level) }) {
                NextAmplitude::Near(back) => return Some((level, back, look)),
                NextAmplitude::Scale(f) => level += f.ln(),
                NextAmplitude::Wait => {}
            }
            (0..50).for_each(|_| level += 1e-3 * g(level));
            if level < -20.0 {
                return None;
            }
        }
        panic!("no end at {level}");
    }

    /// Van der Pol: g = σ (1 − a²/4), a cycle at a = 2 to which deviations return at the rate 2σ.
    #[test]
    fn a_cycle_is_found_from_below_and_from_above() {
        let g = |x: f64| 3.0 * (1.0 - (2.0 * x).exp() / 4.0);
        for start in [-12.0, 0.6, 0.7, 2.0] {
            let (level, back, looks) = end(g, start, |x| x < -3.0).unwrap();
            assert!(
                (level - 2f64.ln()).abs() < 0.02 && (back - 6.0).abs() < 0.7 && looks < 22,
                "{start}: {level}, {back}, {looks}"
            );
        }
    }

    /// Whatever is done to it, it is back at once.
    #[test]
    fn a_cycle_that_sticks_is_one() {
        let mut trail = Trail::new(0.05);
        let seen = GrowthSample { level: 0.3, rate: 1e-5, linear: false };
        assert!(matches!(trail.next(seen), NextAmplitude::Scale(f) if f > 1.05));
        assert!(matches!(trail.next(GrowthSample { level: 0.3002, ..seen }), NextAmplitude::Near(back) if back > 60.0));
        // What only looks as if it did not change, as nothing was changed, is not.
        let mut still = Trail::new(0.05);
        still.seen.push(seen);
        assert!(matches!(still.next(seen), NextAmplitude::Scale(_)));
    }

    /// A stable rest, an unstable cycle at a = 1 and a stable one at a = 2: each start ends on its own side.
    #[test]
    fn what_lies_below_a_threshold_dies_out() {
        let g = |x: f64| {
            let a = x.exp();
            -(a - 1.0) * (a - 2.0) / (1.0 + a * a)
        };
        assert_eq!(end(g, 0.9f64.ln(), |_| false), None);
        for start in [1.1f64, 1.9, 3.0, 6.0] {
            let (level, ..) = end(g, start.ln(), |_| false).unwrap();
            assert!((level.exp() - 2.0).abs() < 0.05, "{start}: {level}");
        }
    }

    /// Beyond a fold nothing is left to stay at, however slowly the bottleneck is passed.
    #[test]
    fn a_cycle_that_is_gone_is_not_found() {
        assert_eq!(end(|x| -0.02 - (x - 0.7).powi(2), 1.5, |_| false), None);
    }

    /// Just before a fold the threshold lies close below the cycle: what comes from above stays.
    #[test]
    fn a_threshold_close_below_a_cycle_is_not_jumped_over() {
        let g = |x: f64| -40.0 * (x - 0.7) * (x - 0.67);
        for start in [0.69, 0.72, 1.0, 1.5] {
            let (level, ..) = end(g, start, |x| x < 0.0).unwrap_or_else(|| panic!("nothing from {start}"));
            assert!(level > 0.67 && level < 0.75, "{start}: {level}");
        }
        // Well below the threshold: what hardly decays, close to it, is tried from above as well.
        assert_eq!(end(g, 0.6, |x| x < 0.0), None);
    }
}
