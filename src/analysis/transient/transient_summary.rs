//! Summary of a transient: forces, stick, frequencies, growth, motion of the named points.

use crate::sound::spectrum::Welch;
use crate::summary::Summary;
use crate::transient::StepReport;
use crate::Result;
use std::collections::VecDeque;

/// Steps at the end of the run that are looked at, at most.
const LAST: usize = 1 << 16;
/// Parts of the run whose kinetic energy is averaged.
const PARTS: u64 = 64;
/// Lines of the spectrum below this share of the largest are not named.
const FAINT: f64 = 0.05;
/// Lines that are named.
const LINES: usize = 3;

/// Values that are kept of a step.
struct Kept {
    /// Force on the lower body at each contact, N.
    force: Vec<[f64; 3]>,
    /// Closed nodes that stick, of those that are closed.
    stick: f64,
    /// Velocities (x, y, z) of the points, m/s, `[3p]`.
    points: Vec<f64>,
}

/// Values that are kept of the steps of a run.
pub(super) struct StepHistory {
    /// s.
    step: f64,
    first: u64,
    /// Steps of a part.
    part: u64,
    last: VecDeque<Kept>,
    /// Sum of the kinetic energies of the steps of each part, J, and their number.
    kinetic: Vec<(f64, u64)>,
}

/// An exponential law fitted to a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Growth {
    /// 1/s.
    rate: f64,
    /// Root mean square of what ln(amplitude) differs from the law.
    apart: f64,
    /// Begin and end of what it was fitted to, s.
    span: [f64; 2],
}

impl StepHistory {
    /// Account of steps of length `step`, s, from `first` to `total`.
    pub(super) fn new(step: f64, first: u64, total: u64) -> Self {
        let part = (total - first).div_ceil(PARTS).max(1);
        Self { step, first, part, last: VecDeque::new(), kinetic: Vec::new() }
    }

    /// Takes a step: its number, what it found, the kinetic energy after it (J), and the velocities of the points,
    /// m/s, `[3p]`.
    pub(super) fn record_step(&mut self, number: u64, report: &StepReport, kinetic: f64, points: &[f64]) {
        if self.last.len() == LAST {
            self.last.pop_front();
        }
        let stick = report.stick() as f64 / report.closed().max(1) as f64;
        let force = report.patches.iter().map(|p| p.force).collect();
        self.last.push_back(Kept { force, stick, points: points.to_vec() });
        let part = ((number - 1 - self.first) / self.part) as usize;
        if self.kinetic.len() <= part {
            self.kinetic.resize(part + 1, (0.0, 0));
        }
        self.kinetic[part].0 += kinetic;
        self.kinetic[part].1 += 1;
    }

    /// Says it; `names` are those of the points.
    pub(super) fn report(&self, names: &[String], summary: &mut Summary) -> Result<()> {
        let Some(all) = self.last.len().checked_sub(self.last.len() / 2).filter(|n| *n > 0) else { return Ok(()) };
        // The first half of what is kept may belong to the start.
        let late = || self.late();
        summary.value("statistics over", format!("the last {:.4} s", all as f64 * self.step));
        let patches = self.patches();
        for patch in 0..patches {
            let contact = if patches > 1 { format!("contact {}, ", patch + 1) } else { String::new() };
            for (c, name) in ["x, longitudinal", "y, lateral", "z, normal"].into_iter().enumerate() {
                let (mean, sway) = spread(late().map(|k| k.force[patch][c]));
                let name = format!("force on the lower body, {contact}{name}");
                summary.value(&name, format!("{mean:.1} N, {sway:.1} N rms about it"));
            }
        }
        let (stick, _) = spread(late().map(|k| k.stick));
        let most = late().map(|k| k.stick).fold(0.0, f64::max);
        let share = format!("{:.1} % of the closed nodes on the mean, {:.1} % at most", 100.0 * stick, 100.0 * most);
        summary.value("stick", share);
        let (patch, along) = self.strongest();
        let lines = self.lines(patch, along)?;
        if !lines.is_empty() {
            let text: Vec<String> = lines.iter().map(|(f, share)| format!("{f:.2} Hz ({share:.2})")).collect();
            let contact = if patches > 1 { format!(" of contact {}", patch + 1) } else { String::new() };
            let name = format!("frequencies of the {} force{contact}", ["longitudinal", "lateral"][along]);
            summary.value(&name, format!("{} (share of the largest)", text.join(", ")));
        }
        if let Some(g) = self.growth() {
            let [from, to] = g.span;
            let text = format!(
                "{:+.4} 1/s fitted to the kinetic energy from {from:.4} to {to:.4} s, ln of the amplitude apart \
                 by {:.1e} rms",
                g.rate, g.apart
            );
            summary.value("growth rate", text);
        }
        for (p, name) in names.iter().enumerate() {
            let rms = [0, 1, 2].map(|c| spread(late().map(|k| k.points[3 * p + c])).1);
            summary.value(
                &format!("velocity of {name}"),
                format!("{:.4e}, {:.4e}, {:.4e} m/s rms", rms[0], rms[1], rms[2]),
            );
        }
        Ok(())
    }

    /// Growth rate of the motion while it is small, 1/s, and the strongest frequency of the tangential force in the
    /// end, Hz, where there are any.
    pub(super) fn motion(&self) -> Result<(Option<f64>, Option<f64>)> {
        let (patch, along) = self.strongest();
        let lines = self.lines(patch, along)?;
        Ok((self.growth().map(|g| g.rate), lines.first().map(|line| line.0)))
    }

    /// The strongest frequency of the tangential forces in the end, Hz, where it is above `limit`, Hz, and the force
    /// sways by more than a part [`FAINT`] of the normal one.
    pub(super) fn beyond(&self, limit: f64) -> Result<Option<f64>> {
        let ((patch, along), (_, line)) = (self.strongest(), self.motion()?);
        if self.patches() == 0 {
            return Ok(None);
        }
        let (_, sway) = spread(self.late().map(|k| k.force[patch][along]));
        let (normal, _) = spread(self.late().map(|k| k.force[patch][2]));
        Ok(line.filter(|&line| line > limit && sway > FAINT * normal.abs()))
    }

    /// The later half of the steps that are kept.
    fn late(&self) -> impl Iterator<Item = &Kept> + Clone + '_ {
        self.last.iter().skip(self.last.len() / 2)
    }

    /// Number of contacts; 0 before the first step.
    fn patches(&self) -> usize {
        self.last.back().map_or(0, |k| k.force.len())
    }

    /// The contact and the component whose tangential force sways most; the lateral one of several that are alike.
    fn strongest(&self) -> (usize, usize) {
        let sway = |&(patch, c): &(usize, usize)| spread(self.late().map(|k| k.force[patch][c])).1;
        let all = (0..self.patches()).rev().flat_map(|patch| [(patch, 0), (patch, 1)]);
        all.max_by(|a, b| sway(a).total_cmp(&sway(b))).unwrap_or((0, 1))
    }

    /// The strongest lines of a component of the force of a contact in the end.
    fn lines(&self, patch: usize, component: usize) -> Result<Vec<(f64, f64)>> {
        let record: Vec<f64> = self.late().map(|k| k.force[patch][component]).collect();
        lines(&record, self.step)
    }

    /// The law of the motion while it is small: until the kinetic energy is a tenth of its largest, or, where it
    /// falls from the start, until it is a thousandth. None where that is too little to say.
    fn growth(&self) -> Option<Growth> {
        let whole = self.kinetic.iter().filter(|(_, n)| *n == self.part);
        let mean: Vec<f64> = whole.map(|(sum, n)| sum / *n as f64).collect();
        let largest = mean.iter().copied().fold(0.0, f64::max);
        let falls = mean.first().is_some_and(|first| *first > 0.5 * largest);
        let inside = |e: &&f64| if falls { **e > 1e-3 * largest } else { **e < 0.1 * largest };
        let count = mean.iter().take_while(inside).count();
        if count < 4 || mean[..count].iter().any(|e| !(*e > 0.0)) {
            return None;
        }
        // Amplitudes go with the root of the energy.
        let logs: Vec<f64> = mean[..count].iter().map(|e| 0.5 * e.ln()).collect();
        let width = self.part as f64 * self.step;
        let (centre, level) = (0.5 * (count - 1) as f64, logs.iter().sum::<f64>() / count as f64);
        let moment: f64 = logs.iter().enumerate().map(|(i, l)| (i as f64 - centre) * (l - level)).sum();
        let square: f64 = (0..count).map(|i| (i as f64 - centre).powi(2)).sum();
        let slope = moment / square;
        let apart = |(i, l): (usize, &f64)| (l - level - slope * (i as f64 - centre)).powi(2);
        let apart = (logs.iter().enumerate().map(apart).sum::<f64>() / count as f64).sqrt();
        // What is no exponential has no rate.
        if apart > 0.1 * (slope * count as f64).abs() {
            return None;
        }
        let begin = self.first as f64 * self.step;
        Some(Growth { rate: slope / width, apart, span: [begin, begin + count as f64 * width] })
    }
}

/// Mean and root mean square about it.
fn spread(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let count = values.clone().count().max(1) as f64;
    let mean = values.clone().sum::<f64>() / count;
    (mean, (values.map(|v| (v - mean).powi(2)).sum::<f64>() / count).sqrt())
}

/// The strongest lines of a record about its mean, Hz, by falling amplitude with their shares of the largest; none of
/// a record without motion.
fn lines(record: &[f64], step: f64) -> Result<Vec<(f64, f64)>> {
    let (mean, sway) = spread(record.iter().copied());
    if record.len() < 16 || !(sway > 1e-9 * mean.abs()) {
        return Ok(Vec::new());
    }
    let welch = Welch::new(1.0 / step, record.len() as f64 * step);
    let take = welch.length().min(record.len());
    let spectrum = welch.transform(record[record.len() - take..].iter().map(|v| v - mean))?;
    let size: Vec<f64> = spectrum.iter().map(|z| z.norm()).collect();
    let mut peaks: Vec<(f64, f64)> = (1..size.len().saturating_sub(1))
        .filter(|&i| size[i] > 0.0 && size[i] >= size[i - 1] && size[i] > size[i + 1])
        .map(|i| {
            // A parabola through the logarithms of three lines.
            let [a, b, c] = [i - 1, i, i + 1].map(|k| size[k].max(f64::MIN_POSITIVE).ln());
            let shift = 0.5 * (a - c) / (a - 2.0 * b + c);
            ((i as f64 + shift) * welch.spacing(), (b - 0.25 * (a - c) * shift).exp())
        })
        .collect();
    peaks.sort_by(|a, b| b.1.total_cmp(&a.1));
    let largest = peaks.first().map_or(0.0, |p| p.1);
    peaks.retain(|p| p.1 > FAINT * largest);
    peaks.truncate(LINES);
    Ok(peaks.into_iter().map(|(f, a)| (f, a / largest)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transient::PatchReport;
    use std::f64::consts::PI;

    fn report(force: [f64; 3], stick: usize) -> StepReport {
        let patch = PatchReport { force, closed: 10, stick, ..PatchReport::default() };
        StepReport { patches: vec![patch], ..StepReport::default() }
    }

    /// A motion that grows until it is bounded: its law is found from the part where it grows, its forces and lines
    /// from the end.
    #[test]
    fn a_motion_that_grows_is_told() {
        let (step, total, rate, frequency) = (1e-4, 20_000u64, 5.0, 400.0);
        let mut account = StepHistory::new(step, 0, total);
        for n in 1..=total {
            let t = n as f64 * step;
            let amplitude = (1e-3 * (rate * t).exp()).min(1.0);
            let phase = 2.0 * PI * frequency * t;
            let force = [1.0, -100.0 + amplitude * (phase.sin() + 0.3 * (2.0 * phase).cos()), -500.0];
            account.record_step(
                n,
                &report(force, 4),
                (amplitude * phase.cos()).powi(2),
                &[0.0, amplitude * phase.sin(), 0.0],
            );
        }
        let growth = account.growth().unwrap();
        assert!((growth.rate - rate).abs() < 0.01 * rate && growth.apart < 0.01, "{growth:?}");
        assert!(growth.span[1] < (1e3f64).ln() / rate, "{growth:?}");
        let record: Vec<f64> = account.last.iter().skip(10_000).map(|k| k.force[0][1]).collect();
        let found = lines(&record, step).unwrap();
        assert_eq!(found.len(), 2, "{found:?}");
        assert!((found[0].0 - frequency).abs() < 0.05 && (found[1].0 - 2.0 * frequency).abs() < 0.05, "{found:?}");
        assert!((found[1].1 - 0.3).abs() < 0.01, "{found:?}");
        let (rate, frequency) = account.motion().unwrap();
        assert!(rate == Some(growth.rate) && frequency == Some(found[0].0), "{rate:?}, {frequency:?}");
        let mut summary = Summary::default();
        account.report(&["rim".to_owned()], &mut summary).unwrap();
        let text = summary.to_string();
        for part in ["-500.0 N", "40.0 % of the closed nodes", "400.00 Hz (1.00)", "velocity of rim", "growth rate"] {
            assert!(text.contains(part), "{part:?} is not in\n{text}");
        }
    }

    #[test]
    fn what_decays_decays_and_what_rests_has_no_lines() {
        let mut account = StepHistory::new(1e-4, 100, 5100);
        for n in 101..=5100u64 {
            let t = n as f64 * 1e-4;
            account.record_step(n, &report([0.0, 7.0, -1.0], 10), (-2.0 * 3.0 * t).exp(), &[]);
        }
        let growth = account.growth().unwrap();
        assert!((growth.rate + 3.0).abs() < 1e-9 && (growth.span[0] - 0.01).abs() < 1e-12, "{growth:?}");
        assert!(lines(&[7.0; 100], 1e-4).unwrap().is_empty());
        // A cycle that has been reached does not grow.
        let mut cycle = StepHistory::new(1e-4, 0, 5000);
        (1..=5000u64)
            .for_each(|n| cycle.record_step(n, &report([0.0; 3], 0), 1.0 + 0.5 * (-0.01 * n as f64).exp(), &[]));
        assert_eq!(cycle.growth(), None);
        // Too short to say anything of growth; and nothing at all.
        let mut short = StepHistory::new(1e-4, 0, 3);
        short.record_step(1, &report([0.0; 3], 0), 1.0, &[]);
        assert_eq!(short.growth(), None);
        let mut summary = Summary::default();
        StepHistory::new(1e-4, 0, 0).report(&[], &mut summary).unwrap();
        assert_eq!(summary.to_string(), "");
    }
}
