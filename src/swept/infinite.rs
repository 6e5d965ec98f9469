//! A rail without ends under harmonic forces at its contacts: what each wavenumber moves, by a few motions of the
//! section.
//!
//! With the wavenumber ξ the forces F at x = 0 move the section by u(ξ) e^{−iξx}, (K0 + ξK1 + ξ²K2)(1 + iη) u + (S +
//! iωC) u − ω²M u = F, and the rail by the integral of that over ξ/2π. V has a factor i, which makes K1 real. The
//! matrices are projected on the modes of some wavenumbers and on what forces there do at rest.
//!
//! Forces at x = x_c move the section by u(ξ) e^{iξx_c}. Those along x have a factor −i, that of V in the work that
//! they do; the motion under them changes its sign with that of ξ where that under the others does not.

mod along;
mod supports;

pub use supports::TrackSlope;

use super::modes::of_order;
use super::{rotate_loads, CrossSection, Forms, LineLoad, LoadPatch, Outline, Path, RailTrack, SectionContact, LOADS};
use crate::dense::symmetric_eigen;
use crate::fem::ElasticMaterial;
use crate::{Error, Result};
use faer::linalg::solvers::Solve;
use faer::{Mat, MatRef};
use num_complex::Complex64;
use std::f64::consts::PI;
use supports::UnitLayers;

/// Wavenumbers whose motions are taken, 1/m; and the highest one, beyond which no motion has to be known.
const TAKEN: [usize; 10] = [0, 1, 3, 6, 10, 16, 24, 40, 70, 120];
const LAST: usize = TAKEN[TAKEN.len() - 1];
/// Modes are taken up to this multiple of the highest frequency.
const BEYOND: f64 = 1.6;
/// Motions whose part in all, by their mass, is smaller than this are no new ones.
const NEW: f64 = 1e-9;
/// Distance of the wavenumbers at which the waves are known, 1/m.
const STEP: f64 = 0.5;

/// Forces along (x, y, n into the body) at a contact.
pub const FORCES: usize = 3;

/// Place on a rail at which forces act.
#[derive(Debug, Clone)]
pub struct ForcePlace {
    /// Patch over which they are spread.
    pub patch: LoadPatch,
    /// Their place on the section and along the rail.
    pub contact: SectionContact,
    /// Angle of the frame of the forces against that of the loads on the section, rad.
    pub tilt: f64,
}

impl ForcePlace {
    /// The contact point of the section, in a frame at the angle `tilt` against that of the section, rad.
    pub fn at_contact_point(patch: LoadPatch, tilt: f64) -> Self {
        Self { patch, contact: SectionContact::level(1.0), tilt }
    }
}

/// Construction parameters of an infinite rail.
#[derive(Debug, Clone)]
pub struct InfiniteRailSpec {
    /// The section, in the frame of the surface at the contact point.
    pub section: CrossSection,
    /// Its material.
    pub material: ElasticMaterial,
    /// Track, spread evenly.
    pub track: Option<RailTrack>,
    /// Angle of the section's frame against the upright one, from y to z, rad.
    pub angle: f64,
    /// Loss factor of the rail.
    pub loss: f64,
    /// Places at which forces act.
    pub places: Vec<ForcePlace>,
}

/// A rail without ends, on q motions of its section.
#[derive(Debug, Clone)]
pub struct Infinite {
    outline: Outline,
    /// (U, W) of the motions at the nodes of the outline, interleaved, `[2 · nodes, q]`.
    motion: Mat<f64>,
    /// K0, K1, K2 of the rail alone, N/m² for motions of 1/√(kg/m) and so on, `[q, q]`; the mass is the identity.
    elastic: [Mat<f64>; 3],
    /// Springs and dashpots of the track, `[q, q]`.
    springs: Mat<f64>,
    dashpots: Mat<f64>,
    /// Springs of each layer for a stiffness of 1 N/m².
    units: UnitLayers,
    /// Coupling of the forces at C places to the motions, `[q, 3C]`.
    loads: Mat<f64>,
    /// Place of the forces along the rail, m, `[C]`.
    along: Vec<f64>,
    loss: f64,
    /// Angular frequencies of the waves at the multiples of [`STEP`], rad/s, ascending, without damping.
    waves: Vec<Vec<f64>>,
}

impl Infinite {
    /// For angular frequencies up to `reach`, rad/s. Errors: not converged.
    pub fn new(making: &InfiniteRailSpec, reach: f64) -> Result<Self> {
        let InfiniteRailSpec { section, material, track, angle, loss, places } = making.clone();
        let outline = section.outline(&[])?;
        let bare = section.clone();
        // Orders of this period are wavenumbers.
        let forms = Forms::along(section, material, 2.0 * PI, track.as_ref(), angle)?;
        let line = |place: &ForcePlace| LineLoad::for_contact(&forms, place.patch, 0, &place.contact);
        let lines: Vec<LineLoad> = places.iter().map(line).collect();
        let mut forces = Mat::zeros(forms.order(), FORCES * lines.len());
        for (c, line) in lines.iter().enumerate() {
            let columns = line.columns(forms.order());
            forces.as_mut().subcols_mut(FORCES * c, FORCES).copy_from(columns.as_ref().subcols(0, FORCES));
        }
        let mut taken: Vec<Mat<f64>> = Vec::new();
        for n in TAKEN {
            taken.push(of_order(&forms, n, BEYOND * reach)?.vectors);
            let rest = forms.factor(n, forms.shift())?.positive("K − σM of a section")?;
            taken.push(rest.solve(forces.as_ref()));
        }
        let basis = independent(&forms, &taken)?;
        let projected =
            |image: Mat<f64>, n: usize| scaled(&(basis.transpose() * image), 1.0 / forms.path.length_integral(n));
        let stiffness = |n: usize| projected(forms.dynamic(n, 0.0, basis.as_ref()), n);
        // A parabola through three of its points, which is what the stiffness is.
        let half = LAST / 2;
        let at = [0, half, 2 * half].map(stiffness);
        let h = half as f64;
        let q = basis.ncols();
        let entry = |of: &dyn Fn([f64; 3]) -> f64| Mat::from_fn(q, q, |i, j| of([0, 1, 2].map(|k| at[k][(i, j)])));
        let second = entry(&|[a, b, c]| (a - 2.0 * b + c) / (2.0 * h * h));
        let first = entry(&|[a, b, c]| (4.0 * b - 3.0 * a - c) / (2.0 * h));
        let [springs, dashpots] = match forms.track(0, basis.as_ref()) {
            Some(both) => both.map(|image| projected(image, 0)),
            None => [Mat::zeros(q, q), Mat::zeros(q, q)],
        };
        let units = match &track {
            Some(track) => UnitLayers::new(&bare, &forms, (track, angle), basis.as_ref())?,
            None => UnitLayers::default(),
        };
        let zero = &at[0] - &springs;
        let means = |k: usize, c: usize| -> [f64; LOADS] { rotate_loads(lines[c].means(basis.col(k)), places[c].tilt) };
        let seen = Mat::from_fn(q, FORCES * lines.len(), |k, j| means(k, j / FORCES)[j % FORCES]);
        let motion = Mat::from_fn(2 * outline.nodes.len(), q, |i, j| {
            forms.amplitude(outline.nodes[i / 2]).map_or(0.0, |first| basis[(first + 2 * (i % 2), j)])
        });
        let mut rail = Self {
            outline,
            motion,
            elastic: [zero, first, second],
            springs,
            dashpots,
            units,
            loads: seen,
            along: places.iter().map(|place| place.contact.along()).collect(),
            loss,
            waves: Vec::new(),
        };
        let count = (LAST as f64 / STEP) as usize;
        rail.waves = (0..=count).map(|k| rail.frequencies(STEP * k as f64)).collect::<Result<_>>()?;
        Ok(rail)
    }

    /// The outline of the section.
    pub fn outline(&self) -> &Outline {
        &self.outline
    }

    /// (U, W) of the motions at the nodes of the outline, interleaved, `[2 · nodes, q]`.
    pub fn motion(&self) -> MatRef<'_, f64> {
        self.motion.as_ref()
    }

    /// Coupling of the forces to the motions, which is what the contacts see of them, `[q, 3C]`.
    pub fn loads(&self) -> MatRef<'_, f64> {
        self.loads.as_ref()
    }

    /// Place of the forces along the rail, m, `[C]`.
    pub fn along_of_forces(&self) -> &[f64] {
        &self.along
    }

    /// Wavenumber beyond which nothing that radiates or travels has to be known, 1/m.
    pub fn last(&self) -> f64 {
        LAST as f64
    }

    /// Angular frequencies of the waves with the wavenumber `xi`, 1/m, without damping, rad/s, ascending.
    fn frequencies(&self, xi: f64) -> Result<Vec<f64>> {
        let [zero, one, two] = &self.elastic;
        let whole = |i: usize, j: usize| {
            let k = zero[(i, j)] + xi * one[(i, j)] + xi * xi * two[(i, j)] + self.springs[(i, j)];
            if i >= j {
                k
            } else {
                0.0
            }
        };
        let (values, _) = symmetric_eigen(Mat::from_fn(self.loads.nrows(), self.loads.nrows(), whole).as_ref())
            .ok_or_else(|| Error::NotConverged(format!("waves of an infinite rail at the wavenumber {xi} 1/m")))?;
        Ok(values.into_iter().map(|v| v.max(0.0).sqrt()).collect())
    }

    /// Wavenumbers, 1/m, ascending, of the waves that travel along the rail at the angular frequency `omega`, rad/s,
    /// were there no damping; to the second digit or better.
    pub fn travelling(&self, omega: f64) -> Vec<f64> {
        let mut found = Vec::new();
        for (k, pair) in self.waves.windows(2).enumerate() {
            for (a, b) in pair[0].iter().zip(&pair[1]) {
                if (a < &omega) != (b < &omega) {
                    found.push(STEP * (k as f64 + (omega - a) / (b - a)));
                }
            }
        }
        found.sort_by(f64::total_cmp);
        found
    }

    /// Motions under a unit force each at x = 0, along (x, y, n into the body) of each place, at the angular frequency
    /// `omega`, rad/s, of the wavenumber `xi`, 1/m; `[q, 3C]`, so that the integral of what they move over xi/2π is a
    /// displacement, m/N. e^{+iωt}. Those under forces along x are without their factor −i.
    pub fn response(&self, omega: f64, xi: f64) -> Mat<Complex64> {
        let [zero, one, two] = &self.elastic;
        let q = self.loads.nrows();
        let matrix = Mat::from_fn(q, q, |i, j| {
            let rail = zero[(i, j)] + xi * one[(i, j)] + xi * xi * two[(i, j)];
            let inertia = if i == j { omega * omega } else { 0.0 };
            let real = rail + self.springs[(i, j)] - inertia;
            Complex64::new(real, self.loss * rail + omega * self.dashpots[(i, j)])
        });
        let right = Mat::from_fn(q, self.loads.ncols(), |i, c| Complex64::new(self.loads[(i, c)], 0.0));
        matrix.partial_piv_lu().solve(&right)
    }
}

fn scaled(a: &Mat<f64>, factor: f64) -> Mat<f64> {
    Mat::from_fn(a.nrows(), a.ncols(), |i, j| factor * a[(i, j)])
}

/// Motions with ΦᵀMΦ = 1 for each metre that span those of `taken`, `[order, q]`.
fn independent(forms: &Forms, taken: &[Mat<f64>]) -> Result<Mat<f64>> {
    let columns = taken.iter().map(|t| t.ncols()).sum();
    let mut all = Mat::<f64>::zeros(forms.order(), columns);
    let mut next = 0;
    for part in taken {
        all.as_mut().subcols_mut(next, part.ncols()).copy_from(part);
        next += part.ncols();
    }
    let per_metre = |x: &Mat<f64>| scaled(&forms.mass(0, x.as_ref()), 1.0 / Path::length_integral(forms.path, 0));
    // Twice, so that rounding leaves nothing of those that are nearly the same.
    for _ in 0..2 {
        let mass = per_metre(&all);
        let size: Vec<f64> =
            (0..all.ncols()).map(|k| (all.col(k).transpose() * mass.col(k)).max(f64::MIN_POSITIVE).sqrt()).collect();
        let gram = all.transpose() * &mass;
        let gram = Mat::from_fn(all.ncols(), all.ncols(), |i, j| gram[(i, j)] / (size[i] * size[j]));
        let (values, vectors) = symmetric_eigen(gram.as_ref())
            .ok_or_else(|| Error::NotConverged("motions of the section of an infinite rail".into()))?;
        let most = values.last().copied().unwrap_or(0.0);
        let kept: Vec<usize> = (0..values.len()).filter(|&k| values[k] > NEW * most).collect();
        let turn =
            Mat::from_fn(all.ncols(), kept.len(), |i, j| vectors[(i, kept[j])] / (size[i] * values[kept[j]].sqrt()));
        all = &all * turn;
    }
    Ok(all)
}
