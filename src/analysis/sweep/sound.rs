//! The sound of the limit cycles of a sweep.

use super::super::radiation::ModalSound;
use crate::output::datasets::cycles::Cycle;
use crate::output::Table;
use crate::sound::power::ThirdOctaves;
use crate::sound::{pressure_level, Air, Bands};

/// The bodies that are heard, and the third octaves: those of the model whose modes reach furthest.
pub(super) struct SoundSetup {
    bodies: Vec<&'static str>,
    bands: Bands,
    air: Air,
}

impl SoundSetup {
    /// Takes another model.
    pub(super) fn with(before: Option<Self>, sounding: &ModalSound) -> Self {
        match before {
            Some(before) if before.bands.highest() >= sounding.bands().highest() => before,
            _ => Self { bodies: sounding.names(), bands: sounding.bands(), air: sounding.air() },
        }
    }

    /// Powers of all bodies in all third octaves at rest, W.
    pub(super) fn silence(&self) -> Vec<f64> {
        vec![0.0; self.bodies.len() * self.bands.centres().len()]
    }

    /// Power of the body number `b` in the third octaves that its modes reach, W; none where it was not computed.
    fn power<'c>(&self, b: usize, cycle: &'c Cycle) -> &'c [f64] {
        let each = cycle.sound.len() / self.bodies.len().max(1);
        cycle.sound.get(b * each..(b + 1) * each).unwrap_or_default()
    }

    /// Levels of all third octaves, dB re 1 pW: linear and A-weighted; −∞ at rest.
    fn levels(&self, b: usize, cycle: &Cycle) -> [f64; 2] {
        let power = self.power(b, cycle).to_vec();
        match power.is_empty() {
            true => [f64::NAN; 2],
            false => ThirdOctaves { centre: self.bands.centres(), power, efficiency: Vec::new() }.total(),
        }
    }

    /// Returns the number of the loudest of `cycles` and its line of the summary.
    pub(super) fn loudest(&self, cycles: &[Cycle]) -> Option<(usize, String)> {
        let moving = (0..cycles.len()).filter(|&i| cycles[i].fate > 0);
        let all = moving.filter_map(|i| self.level(&cycles[i]).map(|(level, text)| (i, level, text)));
        all.max_by(|x, y| x.1.total_cmp(&y.1)).map(|(i, _, text)| (i, text))
    }

    /// The A-weighted level of the louder body, dB re 1 pW, and what the summary says of it; none where it was not
    /// computed.
    pub(super) fn level(&self, cycle: &Cycle) -> Option<(f64, String)> {
        let levels = (0..self.bodies.len()).map(|b| (b, self.levels(b, cycle))).filter(|l| l.1[1].is_finite());
        let (body, [linear, weighted]) = levels.max_by(|x, y| x.1[1].total_cmp(&y.1[1]))?;
        let (name, far) = (self.bodies[body], pressure_level(self.air, weighted));
        let text = format!(
            "{weighted:.1} dB(A), {linear:.1} dB re 1 pW from the {name} body; at 7.5 m {far:.1} dB(A) of sound \
             pressure"
        );
        Some((weighted, text))
    }

    /// The sound of `all` cycles in the `group` of these, in the order of a `shape`.
    pub(super) fn tables(&self, group: &str, shape: &[usize], all: &[Cycle]) -> Vec<Table> {
        let path = |name: &str| format!("{group}/sound_power/{name}");
        let count = self.bands.centres().len();
        let mut tables = vec![
            Table::list(&path("band_frequency"), "Hz", "Exact centres of the third octaves.", self.bands.centres()),
            Table::list(&path("band_name"), "Hz", "Nominal centres of the third octaves.", self.bands.nominal()),
        ];
        for (b, body) in self.bodies.iter().enumerate() {
            let bands = |cycle: &Cycle| -> Vec<f64> {
                let power = self.power(b, cycle).iter().copied();
                power.chain(std::iter::repeat(f64::NAN)).take(count).collect()
            };
            let text = "Sound power in each third octave; NaN in those that the modes of a point do not reach.";
            let power = all.iter().flat_map(bands).collect::<Vec<f64>>();
            tables.push(Table::new(&path(&format!("{body}/power")), "W", text, &[shape, &[count]].concat(), power));
            let names = ["total_level", "total_level_a"];
            let texts = ["Sound power level of all third octaves, re 1 pW; -inf at rest.", "The same, A-weighted."];
            for (k, (name, text)) in names.into_iter().zip(texts).enumerate() {
                let levels = all.iter().map(|c| self.levels(b, c)[k]).collect::<Vec<f64>>();
                tables.push(Table::new(&path(&format!("{body}/{name}")), "dB", text, shape, levels));
            }
            let text =
                "A-weighted sound pressure level at 7.5 m over hard ground, re 20 µPa, if all directions were alike.";
            let levels = all.iter().map(|c| pressure_level(self.air, self.levels(b, c)[1])).collect::<Vec<f64>>();
            tables.push(Table::new(&path(&format!("{body}/pressure_level_a")), "dB", text, shape, levels));
        }
        tables
    }
}
