//! The steps of a run. Every analysis says what it needs; this decides what is made, in which order, and when it is
//! freed. `railsqueal check` prints the same steps.

use super::{cycles, reduction, stability, steady, transient};
use crate::case::bodies::needs_elements;
use crate::job::Job;

/// A step of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// The reduced models of earlier runs are read: that of `--reuse`, that of a run that is continued.
    PriorRun,
    /// The bodies are meshed, distributed and assembled.
    Bodies,
    /// The mode shapes that an earlier run wrote are read.
    EarlierShapes,
    /// The stiffness of each body is factorised, or multigrid set up for it.
    Solvers,
    /// The free-interface modes are computed.
    Modes,
    /// The free-interface modes are listed as an earlier run found them.
    EarlierModes,
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
    /// An analysis.
    Cycles,
    /// No later step solves with the stiffness: its factors are freed.
    FreeSolvers,
    /// No later step looks at the mode shapes: they are freed.
    FreeModes,
}

/// Requirements of a step on earlier steps.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Requirements {
    /// Static solves of the bodies.
    pub solvers: bool,
    /// Shapes of the free-interface modes on the bodies.
    pub shapes: bool,
}

/// State that the steps of a job depend on, beside the job itself.
#[derive(Debug, Clone, Copy, Default)]
pub struct PriorRun {
    /// Modes and compliance come from an earlier run (`--reuse`).
    pub reuse: bool,
    /// A transient is continued with the model that it was begun with (`--resume`).
    pub resume: bool,
    /// The file of `--reuse` has the modes alone.
    pub alone: bool,
    /// The mode shapes are there as they were computed, of a run that did not come to its end.
    pub shapes: bool,
    /// The file of `--reuse` is what an earlier run to the same output has left.
    pub own: bool,
    /// The file of `--reuse` is what an earlier run has left that did not come to its end.
    pub left: bool,
}

impl PriorRun {
    /// Returns whether an earlier run gives the compliance.
    pub fn compliance(self) -> bool {
        self.resume || (self.reuse && !self.alone)
    }
}

/// Returns whether mode shapes of the job can be shown on meshes.
fn on_meshes(job: &Job) -> bool {
    needs_elements(job) && job.bodies().iter().all(|(_, b)| b.is_meshed())
}

/// True if the sound of limit cycles is wanted, of a sweep, of samples or of branches: how the modes radiate is
/// computed where something squeals.
pub fn is_heard(job: &Job) -> bool {
    job.analyses.limit_cycle_sounds().iter().any(|(_, sound)| sound.is_some())
}

/// True if the modes of bodies swept from a section are found again, which takes seconds, for a run that takes up one
/// that did not come to its end: their shapes are written or sound and were not kept; or the compliance is made beside
/// them.
fn finds_again(job: &Job, earlier: PriorRun) -> bool {
    let bodies = job.bodies();
    let swept = job.is_swept() && !bodies.iter().any(|(_, b)| b.is_meshed());
    let sounds = job.analyses.transient.as_ref().is_some_and(|t| t.sound_power.is_some());
    let seen = job.output.swept_modes == Some(true) || is_heard(job) || (earlier.reuse && sounds);
    let unfinished = earlier.resume || earlier.left;
    swept && job.analyses.modes.is_some() && unfinished && (seen || (earlier.reuse && earlier.alone))
}

/// Requirements of the analyses of the job on the bodies.
fn analyses(job: &Job, resume: bool) -> Vec<(Step, Requirements)> {
    let wanted = &job.analyses;
    let all = [
        (Step::Receptance, wanted.receptance.as_ref().map(|_| Requirements::default())),
        (Step::Stability, wanted.stability.as_ref().map(|s| stability::needs(job, s))),
        (Step::Steady, wanted.steady.as_ref().map(|_| steady::needs(job))),
        (Step::CreepCurve, wanted.creep_curve.as_ref().map(|_| Requirements::default())),
        (Step::Transient, wanted.transient.as_ref().map(|t| transient::needs(t, resume))),
        (Step::Cycles, {
            let shown = Requirements { shapes: cycles::animation::is_shown(job), ..Requirements::default() };
            wanted.cycles.as_ref().map(|_| shown)
        }),
    ];
    all.into_iter().filter_map(|(s, n)| n.map(|n| (s, n))).collect()
}

/// Returns whether the shapes of the modes are written, or an analysis looks at them.
pub fn seeks_shapes(job: &Job, resume: bool) -> bool {
    let shown = job.output.fields || is_heard(job) || analyses(job, resume).iter().any(|(_, n)| n.shapes);
    job.analyses.modes.is_some() && on_meshes(job) && shown
}

/// The steps of `job`, sweeps apart.
pub fn steps(job: &Job, earlier: PriorRun) -> Vec<Step> {
    let wanted = &job.analyses;
    let analyses = analyses(job, earlier.resume);
    let contact = job.contact.is_some() && !analyses.is_empty();
    // Bodies of matrices are reduced anew in each run. One that is continued has its reduced model; shapes that are
    // wanted and were not kept are made again.
    let sought = seeks_shapes(job, earlier.resume);
    let kept = earlier.reuse || (earlier.resume && !job.is_reduced_anew());
    let swept = kept && finds_again(job, earlier);
    let again = swept || (kept && !earlier.reuse && sought && !earlier.shapes);
    let given = kept && !again;
    // The shapes that a finished run wrote for ParaView are those of stability alone.
    let shown = earlier.reuse && stability::writes_shapes(job);
    let from_file = given && ((earlier.shapes && sought) || shown);
    let met = |step: Step, needs: Requirements| {
        let shapes = needs.shapes && (!given || (from_file && (earlier.shapes || step == Step::Stability)));
        // What prestress rotation makes is found again.
        let turning = given && shapes && step == Step::Stability && stability::turns_in_full(job);
        Requirements { solvers: turning || (needs.solvers && (shapes || !needs.shapes)), shapes }
    };
    let met: Vec<(Step, Requirements)> = analyses.iter().map(|&(step, needs)| (step, met(step, needs))).collect();
    let alone = earlier.reuse && !earlier.compliance();
    let heard = is_heard(job);
    let bodies =
        !given || alone || job.output.fields || heard || met.iter().any(|(_, n)| *n != Requirements::default());

    let mut steps = Vec::new();
    let mut add = |step: Step, needs: Requirements| steps.push((step, needs));
    if earlier.reuse || earlier.resume {
        add(Step::PriorRun, Requirements::default());
    }
    if bodies {
        add(Step::Bodies, Requirements::default());
    }
    if from_file {
        add(Step::EarlierShapes, Requirements::default());
    }
    add(Step::Solvers, Requirements::default());
    match wanted.modes {
        Some(_) if given => {
            add(Step::EarlierModes, Requirements { solvers: false, shapes: from_file && earlier.shapes })
        }
        // Orders of Fourier have their modes without static solves.
        Some(_) => add(Step::Modes, Requirements { solvers: !swept, shapes: false }),
        None => {}
    }
    if wanted.steady.is_none() && job.output.fields {
        add(Step::Geometry, Requirements::default());
    }
    if contact {
        let needs = if kept && !alone { Requirements::default() } else { reduction::needs(job) };
        // Shapes computed again are turned to those of the model that was kept.
        add(Step::Model, Requirements { shapes: again || (needs.shapes && !given), ..needs });
        met.into_iter().for_each(|(step, needs)| add(step, needs));
    }
    let elements = needs_elements(job) && bodies;
    freed(steps, [elements, elements && !heard])
}

/// The steps, without solvers that nothing asks for, and with the moments when solvers and shapes are freed, if they
/// are.
fn freed(steps: Vec<(Step, Requirements)>, [solvers, shapes]: [bool; 2]) -> Vec<Step> {
    let last = |of: fn(&Requirements) -> bool| steps.iter().rposition(|(_, n)| of(n));
    let solvers = last(|n| n.solvers).filter(|_| solvers);
    let shapes = last(|n| n.shapes).filter(|_| shapes);
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
    use super::PriorRun as Before;
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
        let reuse = Before { reuse: true, ..Before::default() };
        assert_eq!(of(&["output.fields=false"], reuse), [PriorRun, EarlierModes, Model, Stability, Steady]);
        let shapes = of(&["analyses.steady=null"], reuse);
        assert_eq!(
            shapes,
            [
                PriorRun,
                Bodies,
                EarlierShapes,
                Solvers,
                EarlierModes,
                Geometry,
                Model,
                Stability,
                FreeSolvers,
                FreeModes
            ]
        );
    }

    /// Modes, shapes and compliance that an unfinished run has left on the disk are not computed again.
    #[test]
    fn nothing_is_made_that_is_on_the_disk() {
        let left = Before { reuse: true, own: true, shapes: true, ..Before::default() };
        let steady = "analyses.steady=null";
        let whole = [PriorRun, Bodies, EarlierShapes, Solvers, EarlierModes, Geometry, Model];
        assert_eq!(of(&[steady], left), [&whole[..], &[Stability, FreeSolvers, FreeModes]].concat());
        // The compliance is made with the modes that were kept.
        let alone = Before { alone: true, ..left };
        assert_eq!(of(&[steady], alone), [&whole[..], &[Stability, FreeSolvers, FreeModes]].concat());
        let dense = Before { shapes: false, ..alone };
        let bare = of(&[steady, "output.fields=false"], dense);
        assert_eq!(bare, [PriorRun, Bodies, Solvers, EarlierModes, Model, FreeSolvers, Stability]);
        // What the full system is reduced with.
        let full = "analyses.stability.full={\"max_frequency\": 500}";
        let full = of(&[steady, "output.fields=false", full], left);
        assert_eq!(full, [PriorRun, Bodies, EarlierShapes, EarlierModes, Model, Stability, FreeModes]);
        let transient = ["analyses.transient={\"duration\": 0.01, \"body_stride\": 10}", "analyses.stability=null"];
        let resumed = Before { resume: true, shapes: true, ..Before::default() };
        let moving = of(&[&transient[..], &[steady, "output.fields=false"]].concat(), resumed);
        assert_eq!(
            moving,
            [PriorRun, Bodies, EarlierShapes, Solvers, EarlierModes, Model, Transient, FreeSolvers, FreeModes]
        );
        let fields = of(&["analyses.transient={\"duration\": 0.01}", "analyses.stability=null", steady], resumed);
        assert_eq!(fields, [PriorRun, Bodies, EarlierShapes, EarlierModes, FreeModes, Geometry, Model, Transient]);
    }

    /// The sound of limit cycles takes the shapes of the modes, which a run that is stopped leaves; those of a
    /// finished run have none.
    #[test]
    fn limit_cycles_that_are_heard_keep_the_shapes() {
        let sweep = "analyses.sweep={\"keys\": {\"contact.friction\": [0.2, 0.3]}, \"cycles\": {\"sound_power\": {}}}";
        let sets = ["analyses.steady=null", "output.fields=false", sweep];
        let all = of(&sets, Before::default());
        assert_eq!(all, [Bodies, Solvers, Modes, Model, FreeSolvers, Stability]);
        let left = Before { reuse: true, own: true, shapes: true, ..Before::default() };
        let again = [PriorRun, Bodies, EarlierShapes, EarlierModes, Model, Stability];
        assert_eq!(of(&sets, left), again);
    }

    /// Modes of swept bodies are found again where they are shown, beside the compliance that was kept.
    #[test]
    fn swept_bodies_find_their_modes_again() {
        let bytes = include_bytes!("../../jobs/swept-curve.json");
        let of = |sets: &[&str], earlier: Before| {
            let sets: Vec<String> = sets.iter().map(|s| s.to_string()).collect();
            let job = Job::from_bytes(bytes, std::path::Path::new("job.json"), &sets, None).expect("a job");
            steps(&job, earlier)
        };
        let left = Before { reuse: true, own: true, left: true, ..Before::default() };
        let again = of(&[], left);
        assert!(again.starts_with(&[PriorRun, Bodies, Modes, Model]), "{again:?}");
        assert!(!again.contains(&Solvers) && !again.contains(&EarlierModes), "{again:?}");
        assert!(of(&[], Before { alone: true, ..left }).starts_with(&[PriorRun, Bodies, Solvers, Modes, Model]));
        // Nothing shows them, and the file of a finished run.
        let hidden = ["output.swept_modes=false"];
        assert!(!of(&hidden, left).contains(&Modes) && of(&hidden, left).contains(&EarlierModes));
        assert!(!of(&[], Before { left: false, own: false, ..left }).contains(&Modes));
        // Modes alone: the compliance is made with them.
        assert!(of(&hidden, Before { alone: true, ..left }).contains(&Modes));
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
            of(&sets, Before { resume: true, ..Before::default() })
        };
        let dense = [PriorRun, EarlierModes, Model, Transient];
        // The first segment has what moves the points, and how the modes radiate.
        let point = "{\"name\": \"rim\", \"body\": \"upper\", \"at\": [0, 0, 0]}";
        for more in ["".into(), ", \"sound_power\": {}".into(), format!(", \"points\": [{point}]")] {
            assert_eq!(resumed(&more), dense);
        }
        let moving = [PriorRun, Bodies, Solvers, Modes, Model, Transient, FreeSolvers, FreeModes];
        assert_eq!(resumed(", \"body_stride\": 10"), moving);
        let moving = transient(", \"body_stride\": 10");
        assert_eq!(moving, [Bodies, Solvers, Modes, Model, Transient, FreeSolvers, FreeModes]);
        let sound = transient(", \"sound_power\": {}");
        assert_eq!(sound, [Bodies, Solvers, Modes, Model, FreeSolvers, Transient, FreeModes]);
    }
}
