//! The group `/receptance`.

use super::super::Table;
use faer::Mat;
use num_complex::Complex;

/// Receptances of the `bodies`, lower first, m/N, at the frequencies (Hz): for each a matrix `[3p, 3p]` of p contacts.
/// The force at each is spread over its nodes by `share`. Further contacts have groups of their own, `/receptance_2`
/// and so on.
pub fn tables(frequency: &[f64], share: &[Vec<f64>], bodies: &[Vec<Mat<Complex<f64>>>; 2]) -> Vec<Table> {
    let (mut tables, contacts) = (Vec::new(), share.len());
    for (number, share) in share.iter().enumerate() {
        let group = group(number);
        tables.extend([
            Table::list(&format!("{group}/frequency"), "Hz", "Frequencies.", frequency.to_vec()),
            Table::list(&format!("{group}/share"), "1", "Share of each contact node in the unit force.", share.clone()),
        ]);
        for (name, values) in ["lower", "upper"].into_iter().zip(bodies) {
            tables.push(block(&format!("{group}/{name}"), values, (number, number)));
            let others = (0..contacts).filter(|&by| by != number);
            tables.extend(others.map(|by| block(&format!("{group}/{name}_by_{}", by + 1), values, (number, by))));
        }
    }
    tables
}

fn group(number: usize) -> String {
    if number == 0 {
        "/receptance".to_owned()
    } else {
        format!("/receptance_{}", number + 1)
    }
}

/// The receptance at the contact `at` by forces at the contact `by`, `[frequencies][3][3]`.
fn block(path: &str, values: &[Mat<Complex<f64>>], (at, by): (usize, usize)) -> Table {
    let force = if at == by { String::new() } else { format!(" at contact {}", by + 1) };
    let text = format!(
        "Displacement in direction (x, y, n into the body) by a unit force{force} in direction (x, y, n), in lower \
         form."
    );
    let entry = |h: &Mat<Complex<f64>>, k: usize| h[(3 * at + k / 3, 3 * by + k % 3)];
    let all: Vec<Complex<f64>> = values.iter().flat_map(|h| (0..9).map(move |k| entry(h, k))).collect();
    Table::new(path, "m/N", &text, &[values.len(), 3, 3], all)
}
