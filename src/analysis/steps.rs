//! The steps of a run. Every analysis says what it needs; this decides what is made, in which order, and when it is freed.
//! `railsqueal check` prints the same steps.

use super::{reduction, stability, steady, transient};
use crate::case::bodies::needs_elements;
use crate::job::Job;

/// A step of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// The reduced models of earlier runs are read: that of `--reuse`, that of a run that is continued.
    Earlier,
    /// The bodies are meshed, distributed and assembled.
    Bodies,
    /// The mode shapes that an earlier run wrote are read.
    EarlierShapes,
    /// The stiffness of each body is factorised, or multigrid set up for it.
    Solvers,
    /// The free-interface modes are computed, or listed as an earlier run found them.
    Modes,
    /// The meshes alone are written, for want of fields on them.
    Geometry,
    /// The reduced model is made, or taken from an earlier run.
    Model,
    /// An analysis.
    Receptance,
    /// An analysis.
    Stability,
    /// An analysis.
    Steady,
    /// An analysis.
    CreepCurve,
    /// An analysis.
    Transient,
    /// No later step solves with the stiffness: its factors are freed.
    FreeSolvers,
    /// No later step looks at the mode shapes: they are freed.
    FreeModes,
}

/// What a step takes from those before it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Needs {
    /// Static solves of the bodies.
    pub solvers: bool,
    /// Shapes of the free-interface modes on the bodies.
    pub shapes: bool,
}

/// What the steps of a job depend on beside the job.
#[derive(Debug, Clone, Copy, Default)]
pub struct Earlier {
    /// Modes and compliance come from an earlier run (`--reuse`).
    pub reuse: bool,
    /// A transient is continued with the model that it was begun with (`--resume`).
    pub resume: bool,
}

/// The steps of `job`, sweeps apart.
pub fn steps(job: &Job, earlier: Earlier) -> Vec<Step> {
    let wanted = &job.analyses;
    let analyses = [
        (Step::Receptance, wanted.receptance.as_ref().map(|_| Needs::default())),
        (Step::Stability, wanted.stability.as_ref().map(|s| stability::needs(job, s))),
        (Step::Steady, wanted.steady.as_ref().map(|_| steady::needs(job))),
        (Step::CreepCurve, wanted.creep_curve.as_ref().map(|_| Needs::default())),
        (Step::Transient, wanted.transient.as_ref().map(transient::needs)),
    ];
    let analyses: Vec<(Step, Needs)> = analyses.into_iter().filter_map(|(s, n)| n.map(|n| (s, n))).collect();
    let contact = job.contact.is_some() && !analyses.is_empty();
    // A run that is continued has its reduced model: where nothing is wanted on the bodies themselves, that is all.
    let bare = earlier.resume && !job.output.fields && analyses.iter().all(|(_, n)| *n == Needs::default());
    let given = earlier.reuse || bare;

    let mut steps = Vec::new();
    let mut add = |step: Step, needs: Needs| steps.push((step, needs));
    if earlier.reuse || earlier.resume {
        add(Step::Earlier, Needs::default());
    }
    if !given || job.output.fields {
        add(Step::Bodies, Needs::default());
    }
    let from_file = earlier.reuse && stability::writes_shapes(job);
    if from_file {
        add(Step::EarlierShapes, Needs::default());
    }
    add(Step::Solvers, Needs::default());
    if wanted.modes.is_some() {
        add(Step::Modes, Needs { solvers: !given, shapes: false });
    }
    if wanted.steady.is_none() && job.output.fields {
        add(Step::Geometry, Needs::default());
    }
    if contact {
        let made = !earlier.reuse && !earlier.resume;
        let needs = if made { reduction::needs(job) } else { Needs::default() };
        // Shapes computed again are turned to those of the model that was kept.
        add(Step::Model, Needs { shapes: needs.shapes || (earlier.resume && !bare), ..needs });
        for &(step, needs) in &analyses {
            // With `--reuse` there are no shapes but those from the file, which are of stability.
            let shapes = needs.shapes && (!earlier.reuse || (from_file && step == Step::Stability));
            add(step, Needs { solvers: needs.solvers && (shapes || !needs.shapes), shapes });
        }
    }
    freed(steps, needs_elements(job) && (!given || job.output.fields))
}

/// The steps, without solvers that nothing asks for, and with the moments when solvers and shapes are freed.
fn freed(steps: Vec<(Step, Needs)>, elements: bool) -> Vec<Step> {
    let last = |of: fn(&Needs) -> bool| steps.iter().rposition(|(_, n)| of(n));
    let solvers = last(|n| n.solvers).filter(|_| elements);
    let shapes = last(|n| n.shapes).filter(|_| elements);
    let mut all = Vec::new();
    for (i, (step, _)) in steps.iter().enumerate() {
        if *step != Step::Solvers || solvers.is_some() {
            all.push(*step);
        }
        if solvers == Some(i) {
            all.push(Step::FreeSolvers);
        }
        if shapes == Some(i) {
            all.push(Step::FreeModes);
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::Earlier as Before;
    use super::*;
    use crate::job::example::two_cylinders as job;
    use Step::*;

    fn of(sets: &[&str], earlier: Before) -> Vec<Step> {
        steps(&job(sets), earlier)
    }

    /// The job computes 40 modes, steady rolling and stability, with fields.
    #[test]
    fn factors_and_shapes_are_freed_after_their_last_use() {
        let all = of(&[], Before::default());
        assert_eq!(all, [Bodies, Solvers, Modes, Model, Stability, FreeModes, Steady, FreeSolvers]);
        let bare = of(&["output.fields=false"], Before::default());
        assert_eq!(bare, [Bodies, Solvers, Modes, Model, FreeSolvers, FreeModes, Stability, Steady]);
        let full = ["output.fields=false", "analyses.stability.full={\"max_frequency\": 500}"];
        let full = of(&full, Before::default());
        assert_eq!(full, [Bodies, Solvers, Modes, Model, FreeSolvers, Stability, FreeModes, Steady]);
    }

    #[test]
    fn nothing_is_made_that_nothing_needs() {
        let none = ["analyses.modes=null", "analyses.stability=null", "contact.compliance=half_space"];
        assert_eq!(of(&none, Before::default()), [Bodies, Model, Steady]);
        let reuse = Before { reuse: true, resume: false };
        assert_eq!(of(&["output.fields=false"], reuse), [Earlier, Modes, Model, Stability, Steady]);
        let shapes = of(&["analyses.steady=null"], reuse);
        assert_eq!(
            shapes,
            [Earlier, Bodies, EarlierShapes, Solvers, Modes, Geometry, Model, Stability, FreeSolvers, FreeModes]
        );
    }

    #[test]
    fn a_transient_without_points_or_fields_needs_the_reduced_model_alone() {
        let transient = |more: &str| {
            let set = format!("analyses.transient={{\"duration\": 0.01{more}}}");
            of(&["analyses.steady=null", "analyses.stability=null", "output.fields=false", &set], Before::default())
        };
        assert_eq!(transient(""), [Bodies, Solvers, Modes, Model, FreeSolvers, FreeModes, Transient]);
        let resumed = |more: &str| {
            let set = format!("analyses.transient={{\"duration\": 0.01{more}}}");
            let sets = ["analyses.steady=null", "analyses.stability=null", "output.fields=false", &set];
            of(&sets, Before { reuse: false, resume: true })
        };
        assert_eq!(resumed(""), [Earlier, Modes, Model, Transient]);
        let moving = [Earlier, Bodies, Solvers, Modes, Model, Transient, FreeSolvers, FreeModes];
        assert_eq!(resumed(", \"body_stride\": 10"), moving);
        let moving = transient(", \"body_stride\": 10");
        assert_eq!(moving, [Bodies, Solvers, Modes, Model, Transient, FreeSolvers, FreeModes]);
        let sound = transient(", \"sound_power\": {}");
        assert_eq!(sound, [Bodies, Solvers, Modes, Model, FreeSolvers, Transient, FreeModes]);
    }
}
