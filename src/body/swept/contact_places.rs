//! Places of the contacts of a body of revolution: on its running line, or cells of its faces.

use super::cells::CellCompliance;
use super::contact_rows::RevolvedRows;
use super::RevolvedSpec;
use crate::body::half_space::HalfSpace;
use crate::body::hybrid::Hybrid;
use crate::body::ContactSpec;
use crate::swept::{CrossSection, RunningPlace, SectionContact, SectionFace, SectionSource};
use crate::Result;

/// Cell of a face that carries an even load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FaceCell<'a> {
    /// Group of the section that is the face.
    pub face: &'a str,
    /// Radius of its middle, m.
    pub radius: f64,
    /// Angle of its middle about the axle, rad.
    pub angle: f64,
    /// Half its sides along the circle and along the radius, m.
    pub half: [f64; 2],
}

/// A contact on a section.
#[derive(Debug, Clone)]
pub(super) enum LoadPlace {
    /// On the running line, with its frame.
    Running { tilt: f64, place: Option<RunningPlace>, along: f64 },
    /// On a face, in its own frame.
    Face(SectionContact),
}

impl LoadPlace {
    /// The contacts that `making` names on a `section`, with their rows.
    pub(super) fn all(
        making: &RevolvedSpec,
        section: &CrossSection,
        half_space: HalfSpace,
    ) -> Result<(Vec<Self>, RevolvedRows)> {
        if making.cells.is_empty() {
            let running =
                |c: &ContactSpec<RunningPlace>| Self::Running { tilt: c.tilt, place: c.place, along: c.along };
            let grids = making.contacts.iter().map(|c| c.lines.map(<[f64]>::to_vec)).collect();
            let rows = RevolvedRows::Grids(Hybrid::new(half_space, grids));
            return Ok((making.contacts.iter().map(running).collect(), rows));
        }
        let on_face = |cell: &FaceCell| {
            let face = SectionFace::new(section, cell.face)?;
            Ok(Self::Face(face.contact(cell.radius, cell.angle)))
        };
        let places = making.cells.iter().map(on_face).collect::<Result<Vec<_>>>()?;
        let halves = making.cells.iter().map(|cell| cell.half);
        Ok((places, RevolvedRows::Cells(CellCompliance::new(half_space, halves))))
    }

    /// Points of the section at which the loads act.
    pub(super) fn contact(&self, making: &SectionSource) -> SectionContact {
        match self {
            Self::Running { place, along, .. } => {
                let contact = place.map_or_else(|| making.contact(), |place| making.contact_at(place));
                contact.at_place(*along)
            }
            Self::Face(contact) => contact.clone(),
        }
    }

    /// Angle of the frame against that of the loads of `contact` on the section, rad.
    pub(super) fn against_loads(&self, contact: &SectionContact) -> f64 {
        match self {
            Self::Running { tilt, .. } => tilt - contact.angle(),
            Self::Face(_) => 0.0,
        }
    }

    /// Place on the running line, where that is not the contact point of the section itself.
    fn place(&self) -> Option<RunningPlace> {
        match self {
            Self::Running { place, .. } => *place,
            Self::Face(_) => None,
        }
    }
}

/// The mesh of a section for loads at `places` on patches of the half widths `shorter`, m.
pub(super) fn load_section(
    making: &SectionSource,
    places: &[LoadPlace],
    faces: &[String],
    shorter: &[f64],
) -> Result<CrossSection> {
    if !faces.is_empty() {
        let spots: Vec<_> = places.iter().map(|at| at.contact(making).origin()).zip(shorter.iter().copied()).collect();
        return on_faces(making.for_loads_on_faces(&spots)?, faces);
    }
    let placed = places.iter().zip(shorter).filter_map(|(at, &half)| Some((at.place()?, half)));
    let (others, mut all): (Vec<RunningPlace>, Vec<f64>) = placed.unzip();
    let own = places.iter().zip(shorter).filter(|(at, _)| at.place().is_none()).map(|(_, &half)| half);
    all.insert(0, own.fold(f64::INFINITY, f64::min));
    making.for_loads_at(&others, &all)
}

/// The faces of `cells`, each once.
pub(super) fn faces(cells: &[FaceCell]) -> Vec<String> {
    let mut all: Vec<String> = cells.iter().map(|cell| cell.face.to_owned()).collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// The section with loads on `faces`, where there are some, in place of those on its running line.
pub(super) fn on_faces(section: CrossSection, faces: &[String]) -> Result<CrossSection> {
    match faces {
        [] => Ok(section),
        _ => section.with_faces(faces.iter().map(String::as_str)),
    }
}
