//! A rail: a section swept along x, on pads, with absorbing ends. Modes and statics come order by order of its period, the orders spread over the
//! ranks; damping couples all modes of a family.

use super::clusters;
use super::half_space::HalfSpace;
use super::hybrid::Hybrid;
use super::modes::Extent;
use super::{Body, Kind, Steps, TraceModes};
use crate::fem::Material;
use crate::parallel::World;
use crate::swept::compliance::sum;
use crate::swept::modes::{below, by_orders, limit_of, of_order};
use crate::swept::waves::{self, Damping, Member, Wave};
use crate::swept::{Constant, Forms, LineLoad, Patch, Seen, Square, Track, FAMILY, LOADS};
use crate::{Error, Result};
use faer::Mat;
use std::f64::consts::PI;

/// A second, wider circle shows how little the constant depends on it.
const WIDER: f64 = 1.5;
/// A difference between both circles of more than this part of the contact's own compliance is called large.
const LARGE: f64 = 0.01;
/// Modes computed beyond the wanted ones, to see where the last cluster ends.
const BEYOND: usize = 4;

/// What a rail is made of.
#[derive(Debug, Clone, Copy)]
pub struct Making<'a> {
    /// The section, with the contact point on its head.
    pub section: crate::swept::Rail,
    /// Its material.
    pub material: Material,
    /// Length after which it repeats itself, m.
    pub period: f64,
    /// What it lies on.
    pub track: Track,
    /// Its damping beside that of the track.
    pub damping: Damping,
    /// Angle of the contact's frame against the upright section, from y to z, rad; none: that of the surface at the contact point.
    pub tilt: Option<f64>,
    /// Lines of the contact grid along x and y, m, where there is a contact.
    pub grid: Option<[&'a [f64]; 2]>,
}

/// A rail.
pub struct Rail<'w> {
    world: &'w World,
    name: String,
    section: crate::swept::Rail,
    /// Meshed for the modes, in the frame of the surface at the contact point.
    forms: Forms,
    track: Track,
    damping: Damping,
    period: f64,
    /// Angle of the contact's frame against that of the surface, rad.
    tilt: f64,
    contact: Hybrid,
}

/// What is seen along (x, y, n) of one frame in another that is turned by `angle`, rad, from y to z, where n is −z: u_y′ = cos u_y − sin u_n,
/// u_n′ = sin u_y + cos u_n. Of the nine components 3m + c.
fn turned(seen: &[f64; LOADS], angle: f64) -> [f64; LOADS] {
    let (s, c) = angle.sin_cos();
    std::array::from_fn(|k| {
        let [y, n] = [seen[k - k % 3 + 1], seen[k - k % 3 + 2]];
        match k % 3 {
            0 => seen[k],
            1 => c * y - s * n,
            _ => s * y + c * n,
        }
    })
}

/// Both sides of a matrix of the nine components.
fn turned_twice(a: &Square, angle: f64) -> Square {
    let rows = a.map(|row| turned(&row, angle));
    let columns: Square = std::array::from_fn(|j| turned(&std::array::from_fn(|i| rows[i][j]), angle));
    std::array::from_fn(|i| std::array::from_fn(|j| columns[j][i]))
}

impl<'w> Rail<'w> {
    /// The rail `name`, the same on every rank.
    pub fn new(world: &'w World, name: &str, making: Making) -> Result<Self> {
        let Making { section, material, period, track, damping, tilt, grid } = making;
        let angle = section.contact().angle;
        let forms = Forms::along(section.for_modes()?, material, period, Some(&track), angle)
            .map_err(|e| e.context(format!("bodies.{name}")))?;
        let half_space = HalfSpace { young: material.young, poisson: material.poisson };
        Ok(Self {
            world,
            name: name.into(),
            section,
            forms,
            track,
            damping,
            period,
            tilt: tilt.map_or(0.0, |t| t - angle),
            contact: Hybrid::new(half_space, grid),
        })
    }

    /// Amplitudes of an order.
    pub fn unknowns(&self) -> usize {
        self.forms.order()
    }

    /// Mass of each metre, kg/m.
    pub fn mass(&self) -> f64 {
        self.forms.section.area() * self.forms.material.density
    }

    /// What takes the place of the rolling radius of a body of revolution: order n has the wavenumber n over it.
    fn radius(&self) -> f64 {
        self.period / (2.0 * PI)
    }

    /// Collective: number of modes below ω = `limit`, rad/s.
    fn below(&self, limit: f64) -> Result<usize> {
        let world = self.world;
        let size = |found: &usize| *found;
        let all = by_orders(world.size, size, |orders| {
            let n = orders[world.rank];
            let mine = world.agree(below(&self.forms, n, limit))?;
            let all = world.all_gather(&[(Seen::families(n) * mine) as u64]);
            Ok(all.into_iter().map(|found| found as usize).collect())
        })?;
        Ok(all.iter().sum())
    }

    /// Collective: what contact and damping see of all modes up to ω = `limit`, rad/s.
    fn up_to(&self, limit: f64, steps: &mut Steps) -> Result<Vec<Wave>> {
        let (world, forms) = (self.world, &self.forms);
        let circle = self.contact.circle();
        let size = |wave: &Wave| wave.omega.len();
        by_orders(world.size, size, |orders| {
            let n = orders[world.rank];
            steps(orders[0], orders[0] + world.size);
            let line = circle.map(|patch| (LineLoad::new(forms, patch, n, self.radius()), patch));
            let contact = line.as_ref().map(|(line, patch)| (line, *patch));
            let mine = of_order(forms, n, limit).map(|modes| Wave::of(forms, modes, contact));
            Wave::from_numbers(&world.all_gather(&world.agree(mine)?.to_numbers()))
        })
    }

    /// ψ̂ of a mode in the frame of the contact, 1/√kg and 1/(√kg m).
    fn seen(&self, all: &[Wave], (wave, index, family): Member) -> [f64; LOADS] {
        let wave = &all[wave];
        let seen = wave.contact[index];
        let own = std::array::from_fn(|k| if wave.order == 0 || FAMILY[k] == family { seen[k] } else { 0.0 });
        turned(&own, self.tilt)
    }

    /// What was made, for the summary: A, m/N, and that of the wider circle.
    fn made(&self, forms: &Forms, constant: &Constant, a: &Square, wider: Option<&Square>) -> String {
        let pico = |v: f64| 1e12 * v;
        let mut text = format!(
            "sections of {} unknowns at {} of the orders up to {}; beside a half-space xx {:.1}, yy {:.1}, nn {:.1}, yn {:.1} pm/N",
            forms.order(),
            constant.blocks.len(),
            constant.blocks.iter().map(|b| b.0 + b.1 / 2).max().unwrap_or(0),
            pico(a[0][0]),
            pico(a[1][1]),
            pico(a[2][2]),
            pico(a[1][2])
        );
        if let (Some(wider), Some(circle)) = (wider, self.contact.circle()) {
            let apart = (0..9).map(|k| (wider[k / 3][k % 3] - a[k / 3][k % 3]).abs()).fold(0.0, f64::max);
            let own = self.contact.own(circle);
            text += &format!(
                ", good to {:.1} pm/N or {:.2} % of the contact's own compliance{}",
                pico(apart),
                100.0 * apart / own,
                if apart > LARGE * own { ", which is much: the surface is not that of a half-space" } else { "" }
            );
        }
        text
    }
}

/// Modes of all orders and families, ascending, those of a pair beside each other.
fn members(all: &[Wave]) -> Vec<Member> {
    let mut list: Vec<Member> = Vec::new();
    for (of, wave) in all.iter().enumerate() {
        for index in 0..wave.omega.len() {
            list.extend((0..Seen::families(wave.order)).map(|family| (of, index, family)));
        }
    }
    list.sort_by(|a, b| all[a.0].omega[a.1].total_cmp(&all[b.0].omega[b.1]));
    list
}

fn frequencies(all: &[Wave], list: &[Member]) -> Vec<f64> {
    list.iter().map(|m| all[m.0].omega[m.1]).collect()
}

impl Body for Rail<'_> {
    fn name(&self) -> &str {
        &self.name
    }

    fn kind(&self) -> Kind {
        Kind::Swept
    }

    fn rows(&self) -> usize {
        self.contact.rows()
    }

    fn factorise(&mut self) -> Result<Option<String>> {
        let Some(circle) = self.contact.circle() else { return Ok(None) };
        let named = |e: Error| e.context(format!("compliance of body \"{}\"", self.name));
        let world = self.world;
        let section = self.section.for_loads(circle.radius)?;
        let angle = self.section.contact().angle;
        let forms = Forms::along(section, self.forms.material, self.period, Some(&self.track), angle)?;
        let wider = Patch { radius: WIDER * circle.radius };
        // Beside a corner there is room for the one alone.
        let patches = if wider.radius <= self.section.room() { vec![circle, wider] } else { vec![circle] };
        let constant = Constant::new(&forms, &patches, self.radius()).map_err(named)?;
        let mine = (world.rank..constant.blocks.len()).step_by(world.size);
        let parts = mine.map(|k| constant.block(k)).collect::<Result<Vec<_>>>();
        let parts = world.agree(parts.map_err(named))?;
        let nothing = vec![[[0.0; LOADS]; LOADS]; patches.len()];
        let own = if world.is_root() { constant.singles() } else { nothing };
        let all = world.sum_all(sum(parts.into_iter().chain([own])).as_flattened().as_flattened());
        let square = |index: usize| -> Square {
            std::array::from_fn(|c| std::array::from_fn(|d| all[LOADS * (LOADS * index + c) + d]))
        };
        let [a, wide] = [0, patches.len() - 1].map(|index| turned_twice(&square(index), self.tilt));
        self.contact.constant = Some(a);
        Ok(Some(self.made(&forms, &constant, &a, (patches.len() > 1).then_some(&wide))))
    }

    fn compliance(&self, _: &mut Steps) -> Result<Option<Mat<f64>>> {
        self.contact.compliance(self.world, &self.name)
    }

    fn modes(&mut self, extent: Extent, steps: &mut Steps) -> Result<TraceModes> {
        let named = |e: Error| e.context(format!("modes of body \"{}\"", self.name));
        let (all, keep) = match extent {
            Extent::MaxFrequency(f) => {
                let all = self.up_to(2.0 * PI * f, steps).map_err(named)?;
                let keep = members(&all).len();
                (all, keep)
            }
            Extent::Count(count) => {
                let mut wanted = count + BEYOND;
                loop {
                    let limit = limit_of(&self.forms, wanted, |limit| self.below(limit)).map_err(named)?;
                    let all = self.up_to(limit, steps).map_err(named)?;
                    if let Some(keep) = clusters::cut(&frequencies(&all, &members(&all)), count) {
                        break (all, keep);
                    }
                    wanted += wanted / 4 + BEYOND;
                }
            }
        };
        let mut list = members(&all);
        list.truncate(keep);
        let omega = frequencies(&all, &list);
        let seen: Vec<[f64; LOADS]> = list.iter().map(|&m| self.seen(&all, m)).collect();
        let rows = self.contact.of_modes(&omega, &seen);
        let root = self.world.is_root();
        Ok(TraceModes {
            residual: list.iter().map(|m| all[m.0].residual[m.1]).collect(),
            rows: root.then_some(rows),
            damping: root.then(|| waves::damping(&self.forms, &all, &list, &self.damping)),
            reach: match extent {
                Extent::MaxFrequency(f) => 2.0 * PI * f,
                Extent::Count(_) => omega.last().copied().unwrap_or(0.0),
            },
            omega,
            rotation: None,
        })
    }

    fn response(&self, forces: &[f64]) -> Result<Vec<f64>> {
        self.contact.response(self.world, &self.name, forces)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A force along the vertical of the section moves its point along it, in whatever frame both are given.
    #[test]
    fn vectors_and_matrices_turn_together() {
        let angle = 0.3_f64;
        // Up is z = −n; y′ is (cos, sin) of (y, z), so that up has the part sin along it.
        let up = turned(&[0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], angle);
        assert!((up[1] - angle.sin()).abs() < 1e-15 && (up[2] + angle.cos()).abs() < 1e-15);
        let side = turned(&[0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0], angle);
        assert!((side[1] - angle.cos()).abs() < 1e-15 && (side[2] - angle.sin()).abs() < 1e-15 && side[4] == side[1]);
        let v: [f64; LOADS] = std::array::from_fn(|k| (k as f64 + 1.0).sqrt());
        let a: Square = std::array::from_fn(|i| std::array::from_fn(|j| v[i] * v[j]));
        let (b, w) = (turned_twice(&a, angle), turned(&v, angle));
        for i in 0..LOADS {
            for j in 0..LOADS {
                assert!((b[i][j] - w[i] * w[j]).abs() < 1e-14);
            }
        }
    }
}
