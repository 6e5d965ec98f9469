//! Lines of the summary on branches of limit cycles.

use super::follow::FollowedBranches;
use super::sound::Sounds;
use super::starts::FailedStart;
use super::thresholds::{persistence, Persistence};
use super::LOCATED;
use crate::cycles::{BranchPoint, Special, SpecialKind};
use crate::job::Branches;
use crate::output::datasets::branches::{Criticality, OneBranch, Onset};
use crate::summary::Summary;

/// Subject of the lines.
pub(super) struct BranchSummary<'a> {
    pub(super) wanted: &'a Branches,
    pub(super) branches: &'a FollowedBranches,
    pub(super) onsets: &'a [Onset],
    /// Side of each of them on which its small cycles lie.
    pub(super) criticality: &'a [Criticality],
    /// Velocities at the contact over the modal ones, `[6][m]`.
    pub(super) watch: &'a [Vec<f64>],
    pub(super) failed: &'a [FailedStart],
}

impl BranchSummary<'_> {
    /// Writes the lines.
    pub(super) fn write(&self, sounds: Option<&Sounds>, summary: &mut Summary) {
        let key = &self.wanted.along;
        let branches = &self.branches.all;
        let cycles: usize = branches.iter().map(|b| b.points.len()).sum();
        let many = if branches.len() == 1 { String::new() } else { format!(" on {} branches", branches.len()) };
        summary.line(format!(
            "limit cycles over {key}: {cycles} cycles{many}, {} marches of the contact",
            self.branches.marches
        ));
        for (onset, criticality) in self.onsets.iter().zip(self.criticality) {
            let side = if onset.above { "above" } else { "below" };
            let place = format!("{side} {key} = {:.7} ({:.3} Hz)", onset.key, onset.frequency);
            let [kind, meaning] = match criticality {
                Criticality::Subcritical => ["; subcritical", ": squeal jumps to a cycle of finite amplitude"],
                Criticality::Supercritical => ["; supercritical", ": squeal grows from small cycles"],
                Criticality::Unknown => ["", ""],
            };
            match onset.mode {
                0 => summary.value("squeal starts by itself", format!("{place}{kind}{meaning}")),
                n => summary.value("a further mode of rest grows", format!("{place}, beside {n}{kind}")),
            };
        }
        for one in persistence(branches, self.onsets, self.watch) {
            summary.value("threshold", self.threshold(&one));
        }
        for (number, branch) in branches.iter().enumerate() {
            if branches.len() > 1 {
                summary.value("branch", (number + 1).to_string());
            }
            self.branch(branch, summary);
            for (text, _) in self.branches.same.iter().filter(|s| s.1 == number) {
                summary.value("the same branch", format!("is reached from {text}"));
            }
        }
        for failed in self.failed {
            summary.value("no cycle", format!("from {}: {}", failed.origin, failed.why));
        }
        if let Some((place, text)) = sounds.and_then(Sounds::loudest) {
            let point = branches.iter().flat_map(|b| &b.points).nth(place);
            let at = point.map_or(String::new(), |p| format!(", {key} = {:.7}", p.key));
            summary.value("loudest", format!("{text}{at}"));
        }
    }

    /// A threshold in words.
    fn threshold(&self, one: &Persistence) -> String {
        let key = &self.wanted.along;
        let [side, way] = if one.onset.above { ["above", "down"] } else { ["below", "up"] };
        let begins = format!("starts by itself {side} {key} = {:.7}", one.onset.key);
        let of = match self.branches.all.len() {
            1 => String::new(),
            _ => format!("branch {}: ", one.branch + 1),
        };
        if one.to == one.onset.key {
            return format!("{of}{begins}, and ends there on the way back");
        }
        if (one.to > one.onset.key) == one.onset.above {
            return format!("{of}{begins}; cycles were followed {way} to {key} = {:.7} and no further", one.to);
        }
        let bound = match one.bound {
            Some(kind) => format!(" ({})", kind.name()),
            None => " or beyond (followed no further)".into(),
        };
        let push = match one.push {
            Some([at, velocity]) => format!(
                "; in between a push starts it: {:.3} mm/s at the rim at {key} = {at:.5} (amplitude of the unstable \
                 cycle)",
                1e3 * velocity
            ),
            None => "; in between a push starts it (no unstable cycle was found there)".into(),
        };
        format!("{of}{begins}, persists {way} to {key} = {:.7}{bound}{push}", one.to)
    }

    fn branch(&self, branch: &OneBranch, summary: &mut Summary) {
        let key = &self.wanted.along;
        summary.value("begun at", branch.origin.clone());
        let stable = |p: &BranchPoint| p.multipliers.as_ref().is_some_and(|m| m.is_stable());
        // Points where a cycle loses its stability bound them; elsewhere there may be more beyond.
        let bound = |p: &BranchPoint| {
            p.special.filter(|s| !matches!(s.kind, SpecialKind::Stick | SpecialKind::Opening)).map(|s| s.kind.name())
        };
        let range = |of: &dyn Fn(&BranchPoint) -> bool| {
            let all = branch.points.iter().filter(|p| of(p));
            let lowest = all.clone().min_by(|a, b| a.key.total_cmp(&b.key))?;
            Some([lowest, all.max_by(|a, b| a.key.total_cmp(&b.key))?])
        };
        let (name, ends) = if branch.points.iter().any(stable) {
            ("stable cycles", range(&|p| stable(p) || bound(p).is_some()))
        } else {
            ("cycles", range(&|_| true))
        };
        if let Some(ends) = ends {
            let [low, high] = ends.map(|p| match bound(p) {
                Some("fold") => format!("{:.7} (fold: squeal that was started ends there)", p.key),
                Some(kind) => format!("{:.7} ({kind}: this motion is unstable beyond)", p.key),
                None => format!("{:.7} (followed no further)", p.key),
            });
            summary.value(name, format!("from {key} = {low} to {high}"));
        }
        for p in &branch.points {
            if let Some(Special { kind, second, error }) = p.special {
                let beat = if second > 0.0 { format!(", beats with {second:.3} Hz") } else { String::new() };
                let rough = match error > LOCATED * (self.wanted.to - self.wanted.from) {
                    true => format!(", the key known to {error:.1e} only"),
                    false => String::new(),
                };
                let [frequency, energy] = [p.cycle.frequency, p.cycle.kinetic];
                let text = format!("{key} = {:.7}, {frequency:.3} Hz, {energy:.4e} J{beat}{rough}", p.key);
                summary.value(kind.name(), text);
            }
        }
        if let Some(why) = &branch.unknown {
            let count = branch.points.iter().filter(|p| p.multipliers.is_none()).count();
            let text = format!("not found for {count} of {} cycles, whose stability is not known", branch.points.len());
            summary.value("multipliers", format!("{text}; the first {why}"));
        }
        let most = branch.points.iter().max_by(|a, b| a.cycle.kinetic.total_cmp(&b.cycle.kinetic));
        if let Some(p) = most {
            let text = format!("{:.4e} J at {:.3} Hz, {key} = {:.7}", p.cycle.kinetic, p.cycle.frequency, p.key);
            summary.value("most energy", text);
        }
        let at = |p: Option<&BranchPoint>| p.map_or(f64::NAN, |p| p.key);
        summary.value("first end", format!("{key} = {:.7}, {}", at(branch.points.first()), branch.ends[0]));
        summary.value("other end", format!("{key} = {:.7}, {}", at(branch.points.last()), branch.ends[1]));
    }
}
