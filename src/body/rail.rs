//! A rail: a section swept along x, on pads, with absorbing ends. Modes and statics come order by order of its
//! period, the orders spread over the ranks; damping couples all modes of a family.

use super::clusters;
use super::discrete_supports::{on_bays, OnBays};
use super::half_space::HalfSpace;
use super::hybrid::{of_circles, Compact, ContactFunctions, Hybrid, Lines, LoadCircles};
use super::mode_cache::{by_ranks, CachedModes};
use super::modes::Extent;
use super::{ContactSpec, ElasticBody, Kind, ModeLabel, ProgressFn, TraceModes};
use crate::fem::ElasticMaterial;
use crate::parallel::World;
use crate::swept::modes::{below, by_orders, contact_functions, limit_of, of_order};
use crate::swept::waves::{self, Member, RailDamping, RailMode};
use crate::swept::{
    family_shares, infinite, rotate_loads, ContactModeData, DiscreteSupports, DisplayMesh, Forms, HeadPoint, Infinite,
    LineLoad, LoadPatch, PictureModes, RailMember, RailOnPads,
};
use crate::swept::{RailTrack, SectionContact, LOADS};
use crate::{Error, Result};
use faer::Mat;
use std::f64::consts::PI;
use std::rc::Rc;

/// Modes computed beyond the wanted ones, to see where the last cluster ends.
const BEYOND: usize = 4;

/// Construction parameters of a rail.
#[derive(Debug, Clone)]
pub struct RailSpec<'a> {
    /// The section, with the contact point on its head.
    pub section: crate::swept::PlacedRailSection,
    /// Its material.
    pub material: ElasticMaterial,
    /// Length after which it repeats itself, m.
    pub period: f64,
    /// Track under the rail, spread evenly.
    pub track: RailTrack,
    /// The whole track, spread evenly, below the rail without ends.
    pub even: RailTrack,
    /// Positions of pads and sleepers, if they stand apart; its `track` is then the pads alone.
    pub bays: Option<DiscreteSupports>,
    /// Its damping beside that of the track.
    pub damping: RailDamping,
    /// Angle of the frame in which it is shown against the upright section, from y to z, rad: that of its contact,
    /// where it has one alone; none: that of the surface at the contact point.
    pub tilt: Option<f64>,
    /// Its contacts.
    pub contacts: Vec<ContactSpec<'a, HeadPoint>>,
}

/// A rail.
pub struct RailOnTrack<'w> {
    world: &'w World,
    name: String,
    section: crate::swept::PlacedRailSection,
    /// Meshed for the modes, in the frame of the surface at the contact point.
    forms: Rc<Forms>,
    track: RailTrack,
    even: RailTrack,
    bays: Option<DiscreteSupports>,
    damping: RailDamping,
    period: f64,
    /// Angle of the frame in which it is shown against that of the surface at the contact point, rad.
    tilt: f64,
    /// Frame and place of each contact, and its grid in `contact`.
    places: Vec<ContactPlace>,
    contact: Hybrid,
    /// Its modes on a mesh that shows them, once they are known; not those of pads that stand apart, which are waves
    /// of many orders each.
    picture: Option<PictureModes>,
    /// Modes that it has found itself, or taken from elsewhere.
    found: Option<Rc<RailSpectrum>>,
}

/// Frame and place of a contact on the running line; the angle of the frame is that against the surface at the contact
/// point of the section, rad.
#[derive(Debug, Clone, Copy)]
struct ContactPlace {
    tilt: f64,
    place: Option<HeadPoint>,
    along: f64,
}

/// The modes of a rail, and what they depend on.
pub struct RailSpectrum {
    forms: Rc<Forms>,
    /// Angle between the frame of their amplitudes and the upright section, rad.
    angle: f64,
    track: RailTrack,
    losses: RailDamping,
    extent: Extent,
    all: Vec<RailMode>,
    /// How many of them are kept.
    keep: usize,
    /// Their damping, 1/s, on rank 0; none with pads that stand apart.
    damping: Option<Mat<f64>>,
}

impl RailSpectrum {
    /// The modes order by order, the contact this far `ahead` of that of the first rail along +x, m.
    pub(super) fn on_pads(&self, ahead: f64) -> RailOnPads<'_> {
        RailOnPads { forms: &self.forms, tilt: self.angle, waves: &self.all, ahead }
    }

    /// The modes that are kept, ascending.
    pub(super) fn members(&self) -> Vec<Member> {
        let mut list = members(&self.all);
        list.truncate(self.keep);
        list
    }
}

impl<'w> RailOnTrack<'w> {
    /// The rail `name`, the same on every rank.
    pub fn new(world: &'w World, name: &str, making: RailSpec) -> Result<Self> {
        let RailSpec { section, material, period, track, even, bays, damping, tilt, contacts } = making;
        let angle = section.contact().angle;
        let forms = Forms::along(section.for_modes()?, material, period, Some(&track), angle)
            .map_err(|e| e.context(format!("bodies.{name}")))?;
        let half_space = HalfSpace { young: material.young, poisson: material.poisson };
        let grids = contacts.iter().map(|c| c.lines.map(<[f64]>::to_vec)).collect();
        let place = |c: &ContactSpec<HeadPoint>| ContactPlace { tilt: c.tilt - angle, place: c.place, along: c.along };
        let mut rail = Self {
            world,
            name: name.into(),
            places: contacts.iter().map(place).collect(),
            section,
            forms: Rc::new(forms),
            track,
            even,
            bays,
            damping,
            period,
            tilt: tilt.map_or(0.0, |t| t - angle),
            contact: Hybrid::new(half_space, grids),
            picture: None,
            found: None,
        };
        let contacts = rail.contacts();
        let tilts = rail.against_loads(&contacts);
        let placed = rail.contact.place(rail.forms.path, &contacts, &tilts);
        placed.map_err(|e| e.context(format!("compliance of body \"{name}\"")))?;
        Ok(rail)
    }

    /// The modes, once they are known.
    pub(super) fn spectrum(&self) -> Option<&RailSpectrum> {
        self.found.as_deref()
    }

    /// Lines of the grid of each contact along x and y, m.
    pub(super) fn grids(&self) -> &[Lines] {
        self.contact.grids()
    }

    /// ψ̂ of the modes at the contacts, 1/√kg and 1/(√kg m), `[9T, m]`, once they are known.
    pub(super) fn contact_modes(&self) -> &Mat<f64> {
        self.contact.contact_modes()
    }

    /// Amplitudes of an order.
    pub fn unknowns(&self) -> usize {
        self.forms.order()
    }

    /// Mass of each metre, kg/m.
    pub fn mass(&self) -> f64 {
        self.forms.section.area() * self.forms.material.density
    }

    /// Equivalent of the rolling radius of a body of revolution: order n has the wavenumber n over it.
    fn radius(&self) -> f64 {
        self.period / (2.0 * PI)
    }

    /// Points at which the loads of each contact act.
    fn contacts(&self) -> Vec<SectionContact> {
        let radius = self.radius();
        let of = |at: &ContactPlace| {
            let level = || SectionContact::level(radius);
            at.place.map_or_else(level, |place| self.section.contact_at(place, radius)).at_place(at.along)
        };
        self.places.iter().map(of).collect()
    }

    /// Angle of the frame of each contact against that of its loads on the section, rad.
    fn against_loads(&self, contacts: &[SectionContact]) -> Vec<f64> {
        self.places.iter().zip(contacts).map(|(at, contact)| at.tilt - contact.angle()).collect()
    }

    /// Forms of the rail meshed for loads on patches of the half width `shorter`, m, the first one at its own contact.
    fn load_forms(&self, others: &[HeadPoint], shorter: &[f64]) -> Result<Forms> {
        let section = self.section.for_loads_at(others, shorter)?;
        let angle = self.section.contact().angle;
        Forms::along(section, self.forms.material, self.period, Some(&self.track), angle)
    }

    /// Loads of an order at each contact.
    fn loads(&self, contacts: &[SectionContact], n: usize) -> Vec<LineLoad> {
        let patches = self.contact.patches().into_iter();
        patches.zip(contacts).map(|(patch, contact)| LineLoad::for_contact(&self.forms, patch, n, contact)).collect()
    }

    /// Modes of an order that are motions of the track alone: sleepers that are spread evenly have their three at
    /// every order, however short its waves. Orders without others end the list.
    fn idle(&self) -> usize {
        self.track.motions()
    }

    /// Collective: number of modes below ω = `limit`, rad/s.
    fn below(&self, limit: f64) -> Result<usize> {
        let world = self.world;
        let size = |found: &usize| *found;
        let all = by_orders(world.size, size, |orders| {
            let n = orders[world.rank];
            let mine = world.agree(below(&self.forms, n, limit))?;
            let mine = if mine > self.idle() { mine } else { 0 };
            let all = world.all_gather(&[(ContactModeData::families(n) * mine) as u64]);
            Ok(all.into_iter().map(|found| found as usize).collect())
        })?;
        Ok(all.iter().sum())
    }

    /// Collective: what contact and damping see of all modes up to ω = `limit`, rad/s.
    fn up_to(&self, limit: f64, steps: &mut ProgressFn) -> Result<Vec<RailMode>> {
        let (world, forms) = (self.world, &self.forms);
        let contacts = self.contacts();
        let size = |wave: &RailMode| wave.omega.len().saturating_sub(self.idle());
        let mut found = 0;
        by_orders(world.size, size, |orders| {
            let n = orders[world.rank];
            steps(found, 0);
            let loads = self.loads(&contacts, n);
            let mine = of_order(forms, n, limit).map(|modes| RailMode::new(forms, modes, &loads));
            let all = RailMode::from_numbers(&world.all_gather(&world.agree(mine)?.to_numbers()))?;
            found += all.iter().map(size).sum::<usize>();
            Ok(all)
        })
    }

    /// Collective: the modes up to `extent` found by another rail, where these are those of this one.
    fn found_elsewhere(&self, extent: Extent) -> Option<(Rc<RailSpectrum>, Vec<RailMode>)> {
        let found = self.found.clone()?;
        let angle = self.section.contact().angle - found.angle;
        let same = (found.extent, found.track, found.losses) == (extent, self.track, self.damping);
        if !same || !found.forms.is_elsewhere(&self.forms, angle) {
            return None;
        }
        let rotated: Vec<RailMode> = found.all.iter().map(|wave| wave.rotated(angle)).collect();
        let counts: Vec<usize> = rotated.iter().map(|wave| wave.omega.len()).collect();
        let contacts = self.contacts();
        let contact = by_ranks(self.world, &counts, LOADS * contacts.len(), |k| {
            let RailMode { order, vectors, .. } = &rotated[k];
            contact_functions(vectors.as_ref(), &self.loads(&contacts, *order))
        });
        let all = rotated.into_iter().zip(contact).map(|(wave, contact)| RailMode { contact, ..wave }).collect();
        Some((found, all))
    }

    /// Collective: the modes up to `extent`, and how many of them are kept.
    fn anew(&self, extent: Extent, steps: &mut ProgressFn) -> Result<(Vec<RailMode>, usize)> {
        match extent {
            Extent::MaxFrequency(f) => {
                let all = self.up_to(2.0 * PI * f, steps)?;
                let keep = members(&all).len();
                Ok((all, keep))
            }
            Extent::Count(count) => {
                let mut wanted = count + BEYOND;
                loop {
                    let limit = limit_of(&self.forms, wanted, |limit| self.below(limit))?;
                    let all = self.up_to(limit, steps)?;
                    if let Some(keep) = clusters::cut(&frequencies(&all, &members(&all)), count) {
                        return Ok((all, keep));
                    }
                    wanted += wanted / 4 + BEYOND;
                }
            }
        }
    }

    /// Keeps modes for others: those that are `known` from elsewhere as they were found, or these.
    fn keep(
        &mut self,
        known: Option<Rc<RailSpectrum>>,
        (extent, all, keep): (Extent, Vec<RailMode>, usize),
        damping: Option<Mat<f64>>,
    ) {
        let (forms, angle) = (self.forms.clone(), self.section.contact().angle);
        let (track, losses) = (self.track, self.damping);
        let new = || Rc::new(RailSpectrum { forms, angle, track, losses, extent, all, keep, damping });
        self.found = Some(known.unwrap_or_else(new));
    }

    /// ψ̂ of modes in the frames of the contacts, 1/√kg and 1/(√kg m), `[9T, m]`.
    fn seen_at(&self, all: &[RailMode], list: &[Member]) -> Mat<f64> {
        let contacts = self.contacts();
        let mut found = Mat::zeros(LOADS * contacts.len(), list.len());
        for (k, &(wave, index, family)) in list.iter().enumerate() {
            let wave = &all[wave];
            for (c, contact) in contacts.iter().enumerate() {
                let phase = self.forms.path.wavenumber(wave.order) * contact.along();
                let shares = family_shares(wave.order, phase, family);
                let own = std::array::from_fn(|a| shares[a] * wave.contact[(LOADS * c + a, index)]);
                let seen = rotate_loads(own, self.places[c].tilt - contact.angle());
                (0..LOADS).for_each(|a| found[(LOADS * c + a, k)] = seen[a]);
            }
        }
        found
    }
}

/// Modes of all orders and families, ascending, those of a pair beside each other.
fn members(all: &[RailMode]) -> Vec<Member> {
    let mut list: Vec<Member> = Vec::new();
    for (of, wave) in all.iter().enumerate() {
        for index in 0..wave.omega.len() {
            list.extend((0..ContactModeData::families(wave.order)).map(|family| (of, index, family)));
        }
    }
    list.sort_by(|a, b| all[a.0].omega[a.1].total_cmp(&all[b.0].omega[b.1]));
    list
}

fn frequencies(all: &[RailMode], list: &[Member]) -> Vec<f64> {
    list.iter().map(|m| all[m.0].omega[m.1]).collect()
}

impl ElasticBody for RailOnTrack<'_> {
    fn name(&self) -> &str {
        &self.name
    }

    fn kind(&self) -> Kind {
        Kind::Rail
    }

    fn rows(&self) -> usize {
        self.contact.rows()
    }

    fn factorise(&mut self) -> Result<Option<String>> {
        let shorter: Vec<f64> = self.contact.patches().iter().map(LoadPatch::shorter).collect();
        if shorter.is_empty() {
            return Ok(None);
        }
        let placed = self.places.iter().zip(&shorter).filter_map(|(at, &half)| Some((at.place?, half)));
        let (others, mut all): (Vec<HeadPoint>, Vec<f64>) = placed.unzip();
        let own = self.places.iter().zip(&shorter).filter(|(at, _)| at.place.is_none()).map(|(_, &half)| half);
        all.insert(0, own.fold(f64::INFINITY, f64::min));
        let forms = self.load_forms(&others, &all)?;
        let contacts = self.contacts();
        let tilts = self.against_loads(&contacts);
        let made = self.contact.make(self.world, &forms, &contacts, &tilts);
        made.map_err(|e| e.context(format!("compliance of body \"{}\"", self.name)))
    }

    fn compliance(&self, _: &mut ProgressFn) -> Result<Option<Mat<f64>>> {
        self.contact.compliance(self.world, &self.name)
    }

    fn compact(&self) -> Result<Option<Compact>> {
        self.contact.compact(&self.name).map(Some)
    }

    fn contact_functions(&self) -> Result<Option<ContactFunctions>> {
        self.contact.functions(&self.name).map(Some)
    }

    fn contact_compliances(&self, circles: LoadCircles) -> Result<Option<Vec<Mat<f64>>>> {
        let ([contact], [at]) = (&self.contacts()[..], &self.places[..]) else { return Ok(None) };
        let forms = self.load_forms(&[], &[circles.mesh])?;
        of_circles(self.world, &forms, (contact, at.tilt - contact.angle()), circles.radii).map(Some)
    }

    fn adopt_compliance(&mut self, constant: Mat<f64>) {
        self.contact.adopt(constant);
    }

    fn modes(&mut self, extent: Extent, steps: &mut ProgressFn) -> Result<TraceModes> {
        let named = |e: Error| e.context(format!("modes of body \"{}\"", self.name));
        let known = self.found_elsewhere(extent);
        let (known, (all, keep)) = match known {
            Some((found, all)) => {
                let keep = found.keep;
                (Some(found), (all, keep))
            }
            None => (None, self.anew(extent, steps).map_err(named)?),
        };
        let mut list = members(&all);
        list.truncate(keep);
        let omega = frequencies(&all, &list);
        let seen = self.seen_at(&all, &list);
        let root = self.world.is_root();
        let reach = match extent {
            Extent::MaxFrequency(f) => 2.0 * PI * f,
            Extent::Count(_) => omega.last().copied().unwrap_or(0.0),
        };
        if let Some(bays) = self.bays {
            let rail = RailOnPads { forms: &self.forms, tilt: self.section.contact().angle, waves: &all, ahead: 0.0 };
            let members: Vec<RailMember> = list.iter().map(|&member| (0, member)).collect();
            let damping = || Ok(waves::damping(&self.forms, &all, &list, &self.damping));
            let laid = on_bays(self.world, &bays, (&[rail], &members), &seen, damping).map_err(named)?;
            let OnBays { omega, seen, damping, beside } = laid;
            self.contact.add(beside);
            let rows = root.then_some(self.contact.of_modes(&omega, &seen));
            self.keep(known, (extent, all, keep), None);
            // They are waves of many orders each, and solved densely.
            return Ok(TraceModes { rows, damping, reach, omega, ..TraceModes::default() });
        }
        let highest = all.iter().map(|wave| wave.order).max().unwrap_or(0);
        self.picture = Some(PictureModes {
            picture: DisplayMesh::new(&self.forms, 0.0, highest, self.tilt),
            orders: all.iter().map(|wave| (wave.order, wave.vectors.clone())).collect(),
            list: list.clone(),
        });
        let rows = self.contact.of_modes(&omega, &seen);
        let damping = match known.as_ref().and_then(|found| found.damping.clone()) {
            Some(damping) => Some(damping),
            None => root.then(|| waves::damping(&self.forms, &all, &list, &self.damping)),
        };
        let residual = list.iter().map(|m| all[m.0].residual[m.1]).collect();
        let names = list.iter().map(|m| ModeLabel { order: all[m.0].order as u32, family: String::new() }).collect();
        self.keep(known, (extent, all, keep), damping.clone());
        let rows = root.then_some(rows);
        Ok(TraceModes { residual, rows, damping, reach, omega, names, ..TraceModes::default() })
    }

    fn cached_modes(&self) -> Option<CachedModes> {
        self.found.clone().map(CachedModes::Rail)
    }

    fn reuse_modes(&mut self, found: &CachedModes) {
        if let CachedModes::Rail(found) = found {
            self.found = Some(found.clone());
        }
    }

    fn picture(&self) -> Option<&PictureModes> {
        self.picture.as_ref()
    }

    fn infinite_rails(&self, reach: f64) -> Result<Vec<Infinite>> {
        let contacts = self.contacts();
        let tilts = self.against_loads(&contacts);
        let patches = self.contact.patches().into_iter();
        let place = |((patch, contact), tilt)| infinite::ForcePlace { patch, contact, tilt };
        let places: Vec<_> = patches.zip(contacts).zip(tilts).map(place).collect();
        if places.is_empty() {
            return Ok(Vec::new());
        }
        let making = infinite::InfiniteRailSpec {
            section: self.section.for_modes()?,
            material: self.forms.material,
            track: Some(self.even),
            angle: self.section.contact().angle,
            loss: self.damping.loss,
            places,
        };
        let made = Infinite::new(&making, reach).map_err(|e| e.context(format!("bodies.{}: its sound", self.name)))?;
        Ok(vec![made])
    }

    fn response(&self, forces: &[f64]) -> Result<Vec<f64>> {
        self.contact.response(self.world, &self.name, forces)
    }
}
