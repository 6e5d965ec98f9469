//! The group `/track_decay`.

use super::super::Table;

/// Decay rates of one direction.
#[derive(Debug, Clone, PartialEq)]
pub struct DirectionalDecay {
    /// `vertical` or `lateral`.
    pub name: &'static str,
    /// Decay rate of each band, dB/m, `[bands]`.
    pub rate: Vec<f64>,
    /// |A(x_n)|/|A(x_0)|, `[bands, positions]`.
    pub response: Vec<f64>,
}

/// Decay rates in third octaves with the nominal centres `frequency`, Hz, for a hammer at `positions`, m, which cannot
/// tell rates below twice `least`, dB/m.
pub fn tables(frequency: &[f64], positions: &[f64], least: f64, directions: &[DirectionalDecay]) -> Vec<Table> {
    let mut tables = vec![
        Table::list("/track_decay/frequency", "Hz", "Nominal centres of the third octaves.", frequency.to_vec()),
        Table::list(
            "/track_decay/position",
            "m",
            "Distances of the hammer from the accelerometer (EN 15461, Figure 2).",
            positions.to_vec(),
        ),
        Table::scalar(
            "/track_decay/least",
            "dB/m",
            "Lowest rate that the positions can tell (EN 15461, Formula 2); rates below twice that are upper bounds.",
            least,
        ),
    ];
    for DirectionalDecay { name, rate, response } in directions {
        let text = format!("Decay rate, {name} response to a {name} force (EN 15461, Formula 1).");
        tables.push(Table::list(&format!("/track_decay/{name}"), "dB/m", &text, rate.clone()));
        tables.push(Table::new(
            &format!("/track_decay/response/{name}"),
            "1",
            "Amplitude in each band at each position over that of the direct response.",
            &[frequency.len(), positions.len()],
            response.clone(),
        ));
    }
    tables
}
