//! The group `/receptance`.

use super::super::Table;
use num_complex::Complex;

/// Receptances of the `bodies`, lower first, m/N, `[frequencies][3][3]`, at the frequencies (Hz) for a force spread
/// by `share` (`[n]`).
pub fn tables(frequency: &[f64], share: &[f64], bodies: &[Vec<[[Complex<f64>; 3]; 3]>; 2]) -> Vec<Table> {
    let mut tables = vec![
        Table::list("/receptance/frequency", "Hz", "Frequencies.", frequency.to_vec()),
        Table::list("/receptance/share", "1", "Share of each contact node in the unit force.", share.to_vec()),
    ];
    for (name, values) in ["lower", "upper"].into_iter().zip(bodies) {
        tables.push(Table::new(
            &format!("/receptance/{name}"),
            "m/N",
            "Displacement in direction (x, y, n into the body) by a unit force in direction (x, y, n), in lower form.",
            &[frequency.len(), 3, 3],
            values.iter().flatten().flatten().copied().collect::<Vec<Complex<f64>>>(),
        ));
    }
    tables
}
