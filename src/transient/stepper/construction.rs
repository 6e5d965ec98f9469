//! Construction of steppers, and the checks of what they are given.

use super::remembered::at_rest;
use super::roughness_gap::RoughnessGap;
use super::step_result::{NodeState, StepReport};
use super::working_set::{InactiveNodes, WorkingSet};
use super::{all_feet, Settings, State, Stepper};
use crate::transient::aligned::AlignedVec;
use crate::transient::delassus::DelassusOperator;
use crate::transient::dynamics::Dynamics;
use crate::transient::energy::Energy;
use crate::transient::low_rank_modes::LowRankModes;
use crate::transient::model::{Impact, Model};
use crate::transient::newton::NewtonMemory;
use crate::transient::scheme::Modal;
use crate::{Error, Result};

impl<'a> Stepper<'a> {
    /// A stepper at the given state.
    pub fn new(model: Model<'a>, settings: Settings, state: State) -> Result<Self> {
        let impact = model.impact()?;
        settings.scheme.check(model.omega)?;
        let motion = Box::new(Modal::new(&model, settings.scheme, impact)?);
        let shapes = LowRankModes::new(model.modes);
        Self::construct((model, shapes), settings, state, (motion, false))
    }

    /// A stepper of bodies that `motion` moves. Ψ of the `model` picks the contact rows from its coordinates. What
    /// the future depends on is not all in the [`State`], so that the stepper cannot be [put](Self::put) elsewhere or
    /// [settled](Self::settle).
    pub fn over(model: Model<'a>, settings: Settings, state: State, motion: Box<dyn Dynamics + 'a>) -> Result<Self> {
        let shapes = LowRankModes::from_modes(model.modes);
        Self::construct((model, shapes), settings, state, (motion, true))
    }

    /// A stepper of a contact without mass, behind which `motion` moves as it is told: reactions change nothing of it.
    /// Ψ of the `model` has a column for each of its coordinates.
    pub fn driven(model: Model<'a>, settings: Settings, state: State, motion: Box<dyn Dynamics + 'a>) -> Result<Self> {
        let shapes = LowRankModes::from_modes(model.modes);
        Self::construct((model, shapes), settings, state, (motion, false))
    }

    fn construct(
        (model, shapes): (Model<'a>, LowRankModes),
        settings: Settings,
        mut state: State,
        (motion, massive): (Box<dyn Dynamics + 'a>, bool),
    ) -> Result<Self> {
        let impact = model.impact()?;
        settings.scheme.check(&[])?;
        let n = model.interface.len();
        if !settings.friction.fits(model.interface.patches.len()) {
            return Err(Error::Defect("transient: the laws of friction are not those of the patches".into()));
        }
        if state.q.len() != model.omega.len() || state.v.len() != model.omega.len() || state.reaction.len() != 3 * n {
            return Err(Error::Defect("transient: the state does not belong to the model".into()));
        }
        if settings.friction.memory().is_none() {
            state.friction.clear();
        } else if state.friction.is_empty() {
            state.friction = at_rest(&settings.friction, model.interface);
        } else if state.friction.len() != n {
            return Err(Error::Defect(format!(
                "transient: {} coefficients of friction for {n} contact nodes",
                state.friction.len()
            )));
        }
        if impact == Impact::Rigid && settings.drive.is_loaded() {
            return Err(Error::Job(
                "analyses.transient: bodies without residual compliance need a given approach, not a normal load"
                    .into(),
            ));
        }
        let w = motion.operator(&model);
        let s = model.interface;
        settings.drive.check(s.patches.len())?;
        if state.motions.len() != settings.drive.motions.len() {
            return Err(Error::Defect(format!(
                "transient: {} rigid motions in the state, {} in the loading",
                state.motions.len(),
                settings.drive.motions.len()
            )));
        }
        let slope = (0..n)
            .map(|i| {
                let (patch, ix, iy) = s.place(i);
                let (a, b) = (ix.saturating_sub(1), (ix + 1).min(patch.x.len() - 1));
                if s.are_points() {
                    return 0.0;
                }
                (s.gap[patch.node(b, iy)] - s.gap[patch.node(a, iy)]) / (patch.x[b] - patch.x[a])
            })
            .collect();
        let mut new = Self {
            feet: all_feet(s, &settings.drive, settings.scheme.step),
            passing: RoughnessGap::smooth(s),
            model,
            settings,
            impact,
            motion,
            massive,
            w,
            slope,
            widest: s.gap.iter().fold(0.0, |m, g| m.max(g.abs())),
            state,
            working: WorkingSet {
                nodes: Vec::new(),
                patch: Vec::new(),
                core: 0,
                full: 0,
                place: Vec::new(),
                w: DelassusOperator::default(),
                around: AlignedVec::default(),
                psi: AlignedVec::default(),
                feet: Vec::new(),
                ways: Vec::new(),
                at: Vec::new(),
                u: Vec::new(),
            },
            outside: InactiveNodes::default(),
            memory: NewtonMemory::default(),
            integrated: None,
            past: Vec::new(),
            shapes,
            modal_now: None,
            met: NodeState::default(),
            posed: Vec::new(),
            before: Vec::new(),
            report: StepReport::default(),
            open: Vec::new(),
            settled: false,
        };
        new.reset()?;
        let (kinetic, elastic) = new.stored();
        let e = &mut new.state.energy;
        if *e == Energy::default() {
            *e = Energy { kinetic, elastic, start: kinetic + elastic, ..Energy::default() };
        }
        Ok(new)
    }
}
