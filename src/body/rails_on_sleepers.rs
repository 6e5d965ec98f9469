//! Two rails on sleepers that both lie on.
//!
//! On even pads on the ground the rails 1 and 2 have the compliances C_i and the modes Ψ_i at their contacts, with the
//! angular frequencies Ω. What pads that stand apart have beyond these, and the sleepers, couple the modes of both
//! ([`DiscreteSupports`]). With the shares Q that the modes of the whole have in these, and their angular frequencies
//! ω,
//!
//! ```text
//! Ψ = diag(Ψ_1, Ψ_2) Q,   C = diag(C_1, C_2) + Ψ ω⁻² Ψᵀ − diag(Ψ_1, Ψ_2) Ω⁻² diag(Ψ_1, Ψ_2)ᵀ
//! ```

use super::discrete_supports::{on_bays, OnBays};
use super::hybrid::{add_functions, expansions, Compact, ContactFunctions};
use super::mode_cache::CachedModes;
use super::modes::Extent;
use super::rail::RailOnTrack;
use super::separate_bodies::SeparateBodies;
use super::{ElasticBody, Kind, ProgressFn, TraceModes};
use crate::parallel::World;
use crate::swept::{DiscreteSupports, Infinite, RailMember, RailOnPads};
use crate::{Error, Result};
use faer::Mat;

/// Two rails on sleepers that both lie on.
pub struct RailsOnSleepers<'w> {
    world: &'w World,
    /// The rails on even pads.
    rails: SeparateBodies<'w, RailOnTrack<'w>>,
    supports: DiscreteSupports,
    /// Distance of the first contact of each rail from that of the first one, along +x, m.
    ahead: [f64; 2],
    /// The modes at the contacts, `[9T, m]`, once they are known, and what the compliance has beside that of the rails
    /// on even pads, `[9T, 9T]`.
    seen: Mat<f64>,
    beside: Mat<f64>,
}

impl<'w> RailsOnSleepers<'w> {
    /// The `rails` on even pads, which lie on `supports`; the first contact of the second rail is `ahead` of that of
    /// the first one along +x, m.
    pub fn new(
        world: &'w World,
        rails: SeparateBodies<'w, RailOnTrack<'w>>,
        supports: DiscreteSupports,
        ahead: f64,
    ) -> Self {
        Self { world, rails, supports, ahead: [0.0, ahead], seen: Mat::new(), beside: Mat::new() }
    }

    /// π of the contact rows, `[3n, 9T]`.
    fn expansion(&self) -> Mat<f64> {
        let grids: Vec<_> = self.rails.each().flat_map(|rail| rail.grids().iter().cloned()).collect();
        expansions(&grids)
    }
}

impl ElasticBody for RailsOnSleepers<'_> {
    fn name(&self) -> &str {
        self.rails.name()
    }

    fn kind(&self) -> Kind {
        Kind::Rail
    }

    fn rows(&self) -> usize {
        self.rails.rows()
    }

    fn factorise(&mut self) -> Result<Option<String>> {
        self.rails.factorise()
    }

    fn release(&mut self) -> Result<()> {
        self.rails.release()
    }

    fn compliance(&self, steps: &mut ProgressFn) -> Result<Option<Mat<f64>>> {
        let Some(mut all) = self.rails.compliance(steps)? else { return Ok(None) };
        add_functions(&mut all, &self.expansion(), self.beside.as_ref());
        Ok(Some(all))
    }

    fn compact(&self) -> Result<Option<Compact>> {
        // Compliance without the modes is that of the rails on even pads without theirs.
        Ok(self.rails.compact()?.map(|even| Compact { seen: self.seen.clone(), ..even }))
    }

    fn contact_functions(&self) -> Result<Option<ContactFunctions>> {
        let whole = |even: ContactFunctions| ContactFunctions {
            constant: &even.constant + &self.beside,
            seen: self.seen.clone(),
            ..even
        };
        Ok(self.rails.contact_functions()?.map(whole))
    }

    fn modes(&mut self, extent: Extent, steps: &mut ProgressFn) -> Result<TraceModes> {
        let even = self.rails.modes(extent, steps)?;
        let missing = || Error::Defect("the modes of a rail on even pads are missing".into());
        let found = self.rails.each().map(RailOnTrack::spectrum).collect::<Option<Vec<_>>>().ok_or_else(missing)?;
        let members: Vec<_> = found.iter().map(|spectrum| spectrum.members()).collect();
        let list: Vec<RailMember> = self.rails.order().iter().map(|&(rail, k)| (rail, members[rail][k])).collect();
        let rails: Vec<RailOnPads> = found.iter().zip(self.ahead).map(|(of, ahead)| of.on_pads(ahead)).collect();
        let seen = self.rails.joined_modes(&self.rails.each().map(RailOnTrack::contact_modes).collect::<Vec<_>>());
        let damping = || even.damping.clone().ok_or_else(missing);
        let laid = on_bays(self.world, &self.supports, (&rails, &list), &seen, damping);
        let OnBays { omega, seen, damping, beside } =
            laid.map_err(|e| e.context(format!("modes of body \"{}\"", self.name())))?;
        (self.seen, self.beside) = (seen, beside);
        let rows = self.world.is_root().then(|| self.expansion() * &self.seen);
        Ok(TraceModes { rows, damping, reach: even.reach, omega, ..TraceModes::default() })
    }

    fn cached_modes(&self) -> Option<CachedModes> {
        self.rails.cached_modes()
    }

    fn reuse_modes(&mut self, found: &CachedModes) {
        self.rails.reuse_modes(found);
    }

    fn infinite_rails(&self, reach: f64) -> Result<Vec<Infinite>> {
        self.rails.infinite_rails(reach)
    }

    fn response(&self, forces: &[f64]) -> Result<Vec<f64>> {
        let mut all = self.rails.response(forces)?;
        if self.world.is_root() {
            let pi = self.expansion();
            let beside = &pi * (&self.beside * (pi.transpose() * faer::ColRef::from_slice(forces)));
            all.iter_mut().zip(beside.iter()).for_each(|(u, v)| *u += v);
        }
        Ok(all)
    }
}
