//! A body of revolution swept from a section: modes and statics order by order of Fourier, the orders spread over the
//! ranks; at its contacts the compliance of a half-space and, beside it, motions of the contacts that are constant or
//! go with x and y ("hybrid").

mod cells;
mod contact_places;
mod contact_rows;
mod damping;
mod members;
mod naming;
mod shapes_at;
mod suspended;

use super::clusters;
use super::half_space::HalfSpace;
use super::hybrid::{of_circles, statics, Compact, ContactFunctions, LoadCircles};
use super::mode_cache::{by_ranks, CachedModes};
use super::modes::Extent;
use super::{ContactSpec, ElasticBody, Kind, ProgressFn, TraceModes};
use crate::fem::ElasticMaterial;
use crate::parallel::World;
use crate::swept::modes::{below, by_orders, contact_functions, limit_of, of_order, turned_freely};
use crate::swept::{
    rotate_loads, Attachment, ContactModeData, EdgeSprings, Forms, FourierModes, HalfSections, LineLoad, LoadPatch,
    Prestress, SectionSource, LOADS,
};
use crate::swept::{Bearing, DisplayMesh, Mirror, Outline, OutlineModes, PictureModes, RunningPlace, SectionContact};
use crate::{Error, Result};
pub use contact_places::FaceCell;
use contact_places::{faces, load_section, on_faces, LoadPlace};
use contact_rows::RevolvedRows;
use faer::Mat;
use members::{members, on_outline, rotation, Member};
use naming::names;
use std::f64::consts::PI;
use std::rc::Rc;

/// Modes computed beyond the wanted ones, to see where the last cluster ends.
const BEYOND: usize = 4;

/// Construction parameters of a swept body.
#[derive(Debug, Clone)]
pub struct RevolvedSpec<'a> {
    /// Its section.
    pub section: SectionSource,
    /// Its material.
    pub material: ElasticMaterial,
    /// Groups of the section that are clamped.
    pub fixed: &'a [String],
    /// Springs at its edges.
    pub springs: &'a [EdgeSprings],
    /// Tuned absorbers and ring dampers, with their places as the job gives them.
    pub attachments: &'a [Attachment],
    /// Springs of the bearings of a wheelset, with their y as the job gives it.
    pub suspension: &'a [Bearing],
    /// True if it rotates.
    pub rotates: bool,
    /// Its contacts on the running line.
    pub contacts: &'a [ContactSpec<'a, RunningPlace>],
    /// Cells of its faces, in place of contacts on the running line.
    pub cells: &'a [FaceCell<'a>],
    /// Angle of the frame in which it is shown against that of the axle, about x, rad, as [`rotate_loads`] has it: that
    /// of its contact, where it has one alone.
    pub tilt: f64,
}

/// A body of revolution.
pub struct Swept<'w> {
    world: &'w World,
    name: String,
    making: SectionSource,
    /// Meshed for the modes.
    forms: Rc<Forms>,
    fixed: Vec<String>,
    springs: Vec<EdgeSprings>,
    /// Bearings with their places in the frame of the section.
    bearings: Vec<Bearing>,
    /// Mirror images of the nodes of a wheelset.
    mirror: Option<Mirror>,
    rotates: bool,
    tilt: f64,
    /// Frame and place of each contact, and its grid in `contact`.
    places: Vec<LoadPlace>,
    /// Faces that carry cells.
    faces: Vec<String>,
    contact: RevolvedRows,
    /// Radiating outline, or why that cannot be said; with the modes, once they are known.
    outline: Result<OutlineModes>,
    /// Its modes on a mesh that shows them, once they are known.
    picture: Option<PictureModes>,
    /// Modes that it has found itself, or taken from elsewhere.
    found: Option<Rc<ModeSpectrum>>,
}

/// The modes of a body of revolution, and what they depend on.
pub struct ModeSpectrum {
    forms: Rc<Forms>,
    fixed: Vec<String>,
    springs: Vec<EdgeSprings>,
    rotates: bool,
    extent: Extent,
    all: Vec<ContactModeData>,
    /// How many of them are kept.
    keep: usize,
}

/// The forms of a body meshed for its modes, with what it carries.
fn forms(name: &str, making: &RevolvedSpec) -> Result<Forms> {
    let body = |e: Error| e.context(format!("bodies.{name}"));
    let section =
        making.section.for_modes().and_then(|section| on_faces(section, &faces(making.cells))).map_err(body)?;
    let attached = making.section.attached(&section, making.attachments)?;
    let bearings = making.section.bearings(&section, making.suspension).map_err(body)?;
    let forms = Forms::carrying(section, making.material, (making.fixed, making.springs), &attached).map_err(body)?;
    Ok(forms.on_bearings(&bearings))
}

impl<'w> Swept<'w> {
    /// The body `name`, the same on every rank.
    pub fn new(world: &'w World, name: &str, making: RevolvedSpec) -> Result<Self> {
        let forms = forms(name, &making)?;
        let half_space = HalfSpace { young: making.material.young, poisson: making.material.poisson };
        let groups = making.fixed.iter().filter_map(|name| forms.section.groups.get(name));
        let clamped: Vec<usize> = groups.flatten().copied().chain(forms.section.on_axle()).collect();
        let bare = |outline: Outline| OutlineModes { outline, orders: Vec::new(), count: 0 };
        let outline = forms.section.outline(&clamped).map(bare).map_err(|e| e.context(format!("bodies.{name}")));
        let (places, contact) = LoadPlace::all(&making, &forms.section, half_space)?;
        let symmetric = making.section.middle().filter(|_| making.attachments.is_empty());
        let mut body = Self {
            bearings: forms.bearings().copied().collect(),
            mirror: symmetric.and_then(|middle| Mirror::new(&forms.section, middle)),
            outline,
            picture: None,
            found: None,
            world,
            name: name.into(),
            making: making.section,
            forms: Rc::new(forms),
            fixed: making.fixed.to_vec(),
            springs: making.springs.to_vec(),
            rotates: making.rotates,
            tilt: making.tilt,
            places,
            faces: faces(making.cells),
            contact,
        };
        let contacts = body.contacts();
        let tilts = body.against_loads(&contacts);
        let placed = body.contact.place(&contacts, &tilts);
        placed.map_err(|e| e.context(format!("compliance of body \"{name}\"")))?;
        Ok(body)
    }

    /// Free amplitudes of an order.
    pub fn unknowns(&self) -> usize {
        self.forms.order()
    }

    /// Points at which the loads of each contact act.
    fn contacts(&self) -> Vec<SectionContact> {
        self.places.iter().map(|at| at.contact(&self.making)).collect()
    }

    /// Forms of the body on a mesh for loads on patches of the half width `shorter`, m.
    fn load_forms(&self, places: &[LoadPlace], shorter: &[f64]) -> Result<Forms> {
        let section = load_section(&self.making, places, &self.faces, shorter)?;
        Ok(Forms::sprung(section, self.forms.material, &self.fixed, &self.springs)?.on_bearings(&self.bearings))
    }

    /// Loads of an order at each contact.
    fn loads(&self, contacts: &[SectionContact], n: usize) -> Vec<LineLoad> {
        let patches = self.contact.patches().into_iter();
        patches.zip(contacts).map(|(patch, contact)| LineLoad::for_contact(&self.forms, patch, n, contact)).collect()
    }

    /// Angle of the frame of each contact against that of its loads on the section, rad.
    fn against_loads(&self, contacts: &[SectionContact]) -> Vec<f64> {
        self.places.iter().zip(contacts).map(|(at, contact)| at.against_loads(contact)).collect()
    }

    /// ψ̂ of modes in the frames of the contacts, 1/√kg and 1/(√kg m), `[9T, m]`.
    fn seen_at(&self, contacts: &[SectionContact], list: &[Member]) -> Mat<f64> {
        let tilts = self.against_loads(contacts);
        let mut all = Mat::zeros(LOADS * contacts.len(), list.len());
        for (k, mode) in list.iter().enumerate() {
            for (c, contact) in contacts.iter().enumerate() {
                let seen = rotate_loads(mode.contact_motion(c, contact.along()), tilts[c]);
                (0..LOADS).for_each(|a| all[(LOADS * c + a, k)] = seen[a]);
            }
        }
        all
    }

    /// Mass, kg.
    pub fn mass(&self) -> f64 {
        let [mass, ..] = self.inertia();
        mass
    }

    /// Mass, kg, y of the centre of mass from the contact, m, and moments of inertia about the axle and about a
    /// diameter through the centre of mass, kg m².
    pub fn inertia(&self) -> [f64; 4] {
        self.forms.section.inertia(self.forms.material)
    }

    /// Collective: number of modes below ω = `limit`, rad/s, by the `halves` of the section where these are symmetric.
    fn below(&self, limit: f64, halves: Option<&HalfSections>) -> Result<usize> {
        let world = self.world;
        let all = by_orders(
            world.size,
            |found: &usize| *found,
            |orders| {
                let n = orders[world.rank];
                let mine = halves
                    .map_or_else(|| below(&self.forms, n, limit), |halves| Ok(halves.below(n, limit)?.iter().sum()));
                let mine = world.agree(mine)?;
                let all = world.all_gather(&[(ContactModeData::families(n) * mine) as u64]);
                Ok(all.into_iter().map(|found| found as usize).collect())
            },
        )?;
        Ok(all.iter().sum())
    }

    /// The modes of an order up to ω = `limit`, rad/s, with the parity of each where the section is symmetric: one by
    /// one half where the supports are symmetric as well.
    fn of_order(
        &self,
        n: usize,
        limit: f64,
        halves: Option<&HalfSections>,
    ) -> Result<(FourierModes, Option<Vec<f64>>)> {
        if let Some(halves) = halves {
            let (modes, parity) = halves.of_order(&self.forms, n, limit)?;
            return Ok((modes, Some(parity)));
        }
        let mut modes = of_order(&self.forms, n, limit)?;
        let parity = self.mirror.as_ref().map(|mirror| mirror.separate(&self.forms, &mut modes));
        Ok((modes, parity))
    }

    /// Collective: what contact and rotation see of all modes up to ω = `limit`, rad/s.
    fn up_to(
        &self,
        limit: f64,
        halves: Option<&HalfSections>,
        prestress: Option<&Prestress>,
        steps: &mut ProgressFn,
    ) -> Result<Vec<ContactModeData>> {
        let (world, forms) = (self.world, &self.forms);
        let contacts = self.contacts();
        let size = |seen: &ContactModeData| seen.omega.len();
        let mut found = 0;
        by_orders(world.size, size, |orders| {
            let n = orders[world.rank];
            steps(found, 0);
            let loads = self.loads(&contacts, n);
            let nodes = self.outline.as_ref().map_or(&[][..], |o| &o.outline.nodes);
            let seen = |(modes, parity)| {
                let seen = ContactModeData::new(forms, &modes, &loads, prestress).with_outline(forms, &modes, nodes);
                match parity {
                    Some(parity) => seen.with_parity(parity),
                    None => seen,
                }
            };
            let mine = self.of_order(n, limit, halves).map(seen);
            let all = ContactModeData::from_numbers(&world.all_gather(&world.agree(mine)?.to_numbers()))?;
            found += all.iter().map(ContactModeData::count).sum::<usize>();
            Ok(all)
        })
    }
}

impl Swept<'_> {
    /// Collective: the modes up to `extent` found by another body, where these are those of this one.
    fn found_elsewhere(&self, extent: Extent) -> Option<(Rc<ModeSpectrum>, Vec<ContactModeData>)> {
        let found = self.found.clone()?;
        let same = found.extent == extent && found.rotates == self.rotates;
        let held = found.fixed == self.fixed && found.springs == self.springs;
        if !same || !held || !found.forms.is_elsewhere(&self.forms, 0.0) {
            return None;
        }
        let counts: Vec<usize> = found.all.iter().map(|of| of.omega.len()).collect();
        let contacts = self.contacts();
        let contact = by_ranks(self.world, &counts, LOADS * contacts.len(), |k| {
            let ContactModeData { order, omega, vectors, .. } = &found.all[k];
            turned_freely((*order, omega), contact_functions(vectors.as_ref(), &self.loads(&contacts, *order)))
        });
        let all =
            found.all.iter().zip(contact).map(|(of, contact)| ContactModeData { contact, ..of.clone() }).collect();
        Some((found, all))
    }

    /// Collective: the modes up to `extent`, and how many of them are kept.
    fn anew(&self, extent: Extent, steps: &mut ProgressFn) -> Result<(Vec<ContactModeData>, usize)> {
        let prestress = if self.rotates { Some(self.forms.centrifugal()?) } else { None };
        let halves = self.mirror.as_ref().and_then(|mirror| HalfSections::new(&self.forms, mirror));
        let halves = halves.as_ref();
        let mut up_to = |limit: f64| self.up_to(limit, halves, prestress.as_ref(), steps);
        match extent {
            Extent::MaxFrequency(f) => {
                let all = up_to(2.0 * PI * f)?;
                let keep = all.iter().map(ContactModeData::count).sum();
                Ok((all, keep))
            }
            Extent::Count(count) => {
                let mut wanted = count + BEYOND;
                loop {
                    let limit = limit_of(&self.forms, wanted, |limit| self.below(limit, halves))?;
                    let all = up_to(limit)?;
                    let omega: Vec<f64> = members(&all).iter().map(Member::omega).collect();
                    if let Some(keep) = clusters::cut(&omega, count) {
                        return Ok((all, keep));
                    }
                    wanted += wanted / 4 + BEYOND;
                }
            }
        }
    }
}

impl ElasticBody for Swept<'_> {
    fn name(&self) -> &str {
        &self.name
    }

    fn kind(&self) -> Kind {
        Kind::Swept
    }

    fn outlines(&self) -> Result<Vec<OutlineModes>> {
        self.outline.clone().map(|outline| vec![outline])
    }

    fn picture(&self) -> Option<&PictureModes> {
        self.picture.as_ref()
    }

    fn rows(&self) -> usize {
        self.contact.rows()
    }

    fn factorise(&mut self) -> Result<Option<String>> {
        let shorter: Vec<f64> = self.contact.patches().iter().map(LoadPatch::shorter).collect();
        if shorter.is_empty() {
            return Ok(None);
        }
        let forms = self.load_forms(&self.places, &shorter)?;
        let contacts = self.contacts();
        let tilts = self.against_loads(&contacts);
        let made = self.contact.make(self.world, &forms, &contacts, &tilts);
        made.map_err(|e| e.context(format!("compliance of body \"{}\"", self.name)))
    }

    fn compliance(&self, _: &mut ProgressFn) -> Result<Option<Mat<f64>>> {
        self.contact.compliance(self.world, &self.name)
    }

    fn compact(&self) -> Result<Option<Compact>> {
        self.contact.compact(&self.name)
    }

    fn contact_functions(&self) -> Result<Option<ContactFunctions>> {
        self.contact.functions(&self.name)
    }

    fn contact_compliances(&self, circles: LoadCircles) -> Result<Option<Vec<Mat<f64>>>> {
        let contacts = self.contacts();
        let ([contact], [tilt], []) = (&contacts[..], &self.against_loads(&contacts)[..], &self.faces[..]) else {
            return Ok(None);
        };
        let forms = self.load_forms(&self.places, &[circles.mesh])?;
        of_circles(self.world, &forms, (contact, *tilt), circles.radii).map(Some)
    }

    fn adopt_compliance(&mut self, constant: Mat<f64>) {
        self.contact.adopt(constant);
    }

    fn modes(&mut self, extent: Extent, steps: &mut ProgressFn) -> Result<TraceModes> {
        let named = |e: Error| e.context(format!("modes of body \"{}\"", self.name));
        let (known, (all, keep)) = match self.found_elsewhere(extent) {
            Some((found, all)) => {
                let keep = found.keep;
                (Some(found), (all, keep))
            }
            None => (None, self.anew(extent, steps).map_err(named)?),
        };
        let mut list = members(&all);
        list.truncate(keep);
        damping::refuse_coupled(&self.forms, &list)?;
        // The modes with equal springs along x and z, and those of the body.
        let even = list.clone();
        let recombined = suspended::recombined(&self.forms, &even)?;
        if let Some(found) = &recombined {
            list = found.order.iter().map(|&k| even[k]).collect();
        }
        if let Ok(outline) = &mut self.outline {
            (outline.orders, outline.count) = (on_outline(&list), list.len());
        }
        let highest = all.iter().map(|seen| seen.order).max().unwrap_or(0);
        let place = |m: &Member| all.iter().position(|seen| seen.order == m.of.order).unwrap_or(0);
        self.picture = Some(PictureModes {
            picture: DisplayMesh::new(&self.forms, self.making.radius(), highest, self.tilt),
            orders: all.iter().map(|seen| (seen.order, seen.vectors.clone())).collect(),
            list: list.iter().map(|m| (place(m), m.index, m.family)).collect(),
        });
        let in_bearings = suspended::energies(&self.forms, &even, recombined.as_ref());
        let mut omega: Vec<f64> = list.iter().map(Member::omega).collect();
        let mut seen = self.seen_at(&self.contacts(), &even);
        let mut rotation = self.rotates.then(|| rotation(&even));
        let mut damping = damping::matrix(self.world, &self.forms, &even);
        if let Some(found) = &recombined {
            let with_even: Vec<f64> = even.iter().map(Member::omega).collect();
            let moved = &seen * &found.components;
            self.contact.add(statics(&found.omega, moved.as_ref()) - statics(&with_even, seen.as_ref()));
            (omega, seen) = (found.omega.clone(), moved);
            rotation = rotation.map(|r| found.rotation(&r));
            damping = damping.map(|c| found.between(&c));
        }
        let rows = self.contact.of_modes(&omega, &seen);
        let found = TraceModes {
            residual: list.iter().map(|m| m.of.residual[m.index]).collect(),
            rows: self.world.is_root().then_some(rows),
            damping,
            springs: damping::stored(&self.forms, &list, &in_bearings),
            reach: match extent {
                Extent::MaxFrequency(f) => 2.0 * PI * f,
                Extent::Count(_) => omega.last().copied().unwrap_or(0.0),
            },
            rotation,
            names: names(&all, &list),
            omega,
            computed: Vec::new(),
            matched: Vec::new(),
        };
        // Those from elsewhere go on as they were found.
        self.found = Some(known.unwrap_or_else(|| {
            let (forms, rotates) = (self.forms.clone(), self.rotates);
            let (fixed, springs) = (self.fixed.clone(), self.springs.clone());
            Rc::new(ModeSpectrum { forms, fixed, springs, rotates, extent, all, keep })
        }));
        Ok(found)
    }

    fn modes_at(&self, points: &[[f64; 3]]) -> Result<Option<Mat<f64>>> {
        let missing = || Error::Defect(format!("body \"{}\" has no mode shapes", self.name));
        let shapes = self.picture.as_ref().ok_or_else(missing)?;
        shapes_at::modes_at(&self.forms, (&self.making, &self.name), shapes, points).map(Some)
    }

    fn cached_modes(&self) -> Option<CachedModes> {
        self.found.clone().map(CachedModes::Swept)
    }

    fn reuse_modes(&mut self, found: &CachedModes) {
        if let CachedModes::Swept(found) = found {
            self.found = Some(found.clone());
        }
    }

    fn response(&self, forces: &[f64]) -> Result<Vec<f64>> {
        self.contact.response(self.world, &self.name, forces)
    }
}

#[cfg(test)]
mod tests;
