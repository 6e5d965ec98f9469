//! Sound of the cycles of branches: third octaves and levels.

use crate::analysis::radiation::ModalSound;
use crate::output::datasets::branches::OneBranch;
use crate::output::Table;
use crate::sound::power::ThirdOctaves;
use crate::sound::{pressure_level, Air, Bands};
use crate::Result;

/// The sound of all cycles, branch after branch.
pub(super) struct Sounds {
    bodies: Vec<&'static str>,
    bands: Bands,
    air: Air,
    /// Power of each body in each third octave, W, `[cycles][bodies × bands]`.
    powers: Vec<Vec<f64>>,
}

impl Sounds {
    /// The sound of all cycles of `branches`.
    pub(super) fn new(sounding: &ModalSound, branches: &[OneBranch]) -> Result<Self> {
        let points = branches.iter().flat_map(|b| &b.points);
        let powers = points.map(|p| sounding.powers_of_lines(p.cycle.frequency, &p.cycle.lines())).collect();
        Ok(Self { bodies: sounding.names(), bands: sounding.bands(), air: sounding.air(), powers })
    }

    fn power(&self, b: usize, place: usize) -> &[f64] {
        let each = self.bands.centres().len();
        self.powers.get(place).and_then(|p| p.get(b * each..(b + 1) * each)).unwrap_or_default()
    }

    /// Levels of all third octaves, dB re 1 pW: linear and A-weighted.
    fn levels(&self, b: usize, place: usize) -> [f64; 2] {
        let power = self.power(b, place).to_vec();
        ThirdOctaves { centre: self.bands.centres(), power, efficiency: Vec::new() }.total()
    }

    /// The loudest cycle, and its levels in words.
    pub(super) fn loudest(&self) -> Option<(usize, String)> {
        let all = (0..self.powers.len()).flat_map(|p| (0..self.bodies.len()).map(move |b| (p, b)));
        let level = |&(p, b): &(usize, usize)| self.levels(b, p)[1];
        let (place, b) = all.max_by(|x, y| level(x).total_cmp(&level(y)))?;
        let [linear, weighted] = self.levels(b, place);
        let far = pressure_level(self.air, weighted);
        let name = self.bodies[b];
        let text = format!(
            "{weighted:.1} dB(A), {linear:.1} dB re 1 pW from the {name} body; at 7.5 m {far:.1} dB(A) of sound \
             pressure"
        );
        Some((place, text))
    }

    /// The group `/cycles/sound_power`.
    pub(super) fn tables(&self) -> Vec<Table> {
        let path = |name: &str| format!("/cycles/sound_power/{name}");
        let (count, cycles) = (self.bands.centres().len(), self.powers.len());
        let mut tables = vec![
            Table::list(&path("band_frequency"), "Hz", "Exact centres of the third octaves.", self.bands.centres()),
            Table::list(&path("band_name"), "Hz", "Nominal centres of the third octaves.", self.bands.nominal()),
        ];
        for (b, body) in self.bodies.iter().enumerate() {
            let power: Vec<f64> = (0..cycles).flat_map(|p| self.power(b, p).to_vec()).collect();
            let name = path(&format!("{body}/power"));
            tables.push(Table::new(&name, "W", "Sound power in each third octave.", &[cycles, count], power));
            let of = |k: usize| (0..cycles).map(|p| self.levels(b, p)[k]).collect::<Vec<f64>>();
            let name = |name: &str| path(&format!("{body}/{name}"));
            let text = "Sound power level of all third octaves, re 1 pW.";
            tables.push(Table::list(&name("total_level"), "dB", text, of(0)));
            tables.push(Table::list(&name("total_level_a"), "dB", "The same, A-weighted.", of(1)));
            let far = of(1).into_iter().map(|l| pressure_level(self.air, l)).collect::<Vec<f64>>();
            let text =
                "A-weighted sound pressure level at 7.5 m over hard ground, re 20 µPa, if all directions were alike.";
            tables.push(Table::list(&name("pressure_level_a"), "dB", text, far));
        }
        tables
    }
}
