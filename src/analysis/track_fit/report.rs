//! A fit in words.

use super::{FittedDirection, TrackFit};

/// Correlation from which two keys are told to be hardly distinguished.
const ALIKE: f64 = 0.95;
/// Standard deviation of a logarithm from which a key is told not to be determined.
const UNCERTAIN: f64 = 0.5;
/// Difference from which a fit is told to be poor, dB.
const POOR: f64 = 2.0;

/// Lines that say the fitted values, what is left of the rates, and what is not determined.
pub fn lines(fit: &TrackFit) -> Vec<String> {
    let mut lines =
        vec![format!("{:<28}{:>12}{:>14}{:>12}", format!("bodies.{}.track", fit.body), "job", "fitted", "deviation")];
    for key in &fit.keys {
        let name = format!("{} {}", key.key.path(), key.key.unit());
        let percent = 100.0 * key.deviation.exp_m1();
        let percent = if percent < 100.0 { format!("{percent:.1}") } else { "> 100".to_owned() };
        lines.push(format!("  {name:<28}{:>10}{:>14}{percent:>10} %", value(key.before), value(key.fitted)));
    }
    lines.push(format!(
        "difference of the rates, root mean square: {:.2} dB with the values of the job, {:.2} dB fitted",
        fit.residual[0], fit.residual[1]
    ));
    fit.directions.iter().for_each(|direction| lines.extend(table(direction, &fit.bands)));
    lines.extend(remarks(fit).into_iter().map(|text| format!("remark: {text}")));
    lines
}

/// A value with four digits.
fn value(value: f64) -> String {
    if value >= 1e4 {
        format!("{value:.3e}")
    } else {
        format!("{value:.4}")
    }
}

/// Measured and fitted rates of a direction by band.
fn table(direction: &FittedDirection, bands: &[f64]) -> Vec<String> {
    let mut lines =
        vec![format!("{:<12}{:>16}{:>14}{:>16}", direction.name, "measured, dB/m", "fitted, dB/m", "difference, dB")];
    for ((band, measured), fitted) in bands.iter().zip(&direction.measured).zip(&direction.fitted) {
        let difference = 10.0 * (fitted / measured).log10();
        lines.push(format!("{:>9} Hz{measured:>16.3}{fitted:>14.3}{difference:>+16.2}", band));
    }
    lines
}

/// Remarks: keys and bands that say nothing, and poor fits.
fn remarks(fit: &TrackFit) -> Vec<String> {
    let mut remarks = Vec::new();
    for key in &fit.held {
        remarks.push(format!("{} has no effect on these bands and keeps its value in the job", key.path()));
    }
    for key in &fit.keys {
        if key.bound {
            remarks.push(format!(
                "{} ended at the limit of its search, {}: not determined; leave it out by --key, or begin elsewhere by \
                 --set",
                key.key.path(),
                value(key.fitted)
            ));
        } else if !(key.deviation < UNCERTAIN) {
            remarks.push(format!("{} is not determined by these bands: its deviation is large", key.key.path()));
        }
    }
    for (values, residual) in &fit.others {
        let all: Vec<String> =
            fit.keys.iter().zip(values).map(|(key, v)| format!("{} {}", key.key.path(), value(*v))).collect();
        remarks.push(format!("another minimum, {residual:.2} dB off the rates: {}", all.join(", ")));
    }
    for (i, row) in fit.correlation.iter().enumerate() {
        for (j, correlation) in row.iter().enumerate().take(i).filter(|(_, c)| c.abs() > ALIKE) {
            remarks.push(format!(
                "{} and {} are hardly told apart: correlation {correlation:.2}",
                fit.keys[j].key.path(),
                fit.keys[i].key.path()
            ));
        }
    }
    let names = |bands: &mut dyn Iterator<Item = f64>| bands.map(|f| f.to_string()).collect::<Vec<_>>().join(", ");
    for direction in &fit.directions {
        if !direction.without_effect.is_empty() {
            remarks.push(format!(
                "no key has an effect on the {} rates at {} Hz",
                direction.name,
                names(&mut direction.without_effect.iter().copied())
            ));
        }
        let low = fit.bands.iter().zip(&direction.measured).filter(|(_, rate)| **rate < 2.0 * fit.least);
        let low = names(&mut low.map(|(band, _)| *band));
        if !low.is_empty() {
            remarks.push(format!(
                "{} rates below {:.2} dB/m, which the positions of the standard cannot tell: {low} Hz",
                direction.name,
                2.0 * fit.least
            ));
        }
    }
    if fit.residual[1] > POOR {
        remarks.push(format!(
            "the fitted track is {:.1} dB off the measured rates: see that rail, sleepers and spacing are those of the \
             track; begin elsewhere by --set, or leave out bands by --band",
            fit.residual[1]
        ));
    }
    remarks
}

#[cfg(test)]
mod tests {
    use super::super::FittedKey;
    use super::*;
    use crate::case::endless_rail::TrackKey;

    fn key(key: TrackKey, fitted: f64, deviation: f64) -> FittedKey {
        FittedKey { key, before: 1e8, fitted, deviation, bound: false }
    }

    fn good() -> TrackFit {
        let rates = vec![2.0, 1.0];
        TrackFit {
            body: "lower",
            keys: vec![key(TrackKey::PadVertical, 2e8, 0.05), key(TrackKey::PadLoss, 0.25, 0.1)],
            held: Vec::new(),
            correlation: vec![vec![1.0, 0.3], vec![0.3, 1.0]],
            bands: vec![250.0, 315.0],
            directions: vec![FittedDirection {
                name: "vertical",
                measured: rates.clone(),
                fitted: vec![2.2, 1.0],
                without_effect: Vec::new(),
            }],
            residual: [3.0, 0.3],
            others: Vec::new(),
            least: 0.1,
        }
    }

    #[test]
    fn a_good_fit_has_its_numbers_and_no_remarks() {
        let text = lines(&good()).join("\n");
        for part in ["pad.vertical N/m", "2.000e8", "5.1 %", "3.00 dB with", "0.30 dB fitted", "250 Hz", "+0.41"] {
            assert!(text.contains(part), "no {part:?} in: {text}");
        }
        assert!(!text.contains("remark"), "{text}");
    }

    #[test]
    fn each_lack_has_its_remark() {
        type Change = fn(&mut TrackFit);
        let changes: [(Change, &str); 8] = [
            (|fit| fit.held = vec![TrackKey::BallastLoss], "sleeper.ballast.loss_factor has no effect"),
            (|fit| fit.keys[0].bound = true, "pad.vertical ended at the limit"),
            (|fit| fit.keys[1].deviation = 0.8, "pad.loss_factor is not determined"),
            (|fit| fit.keys[1].deviation = f64::NAN, "pad.loss_factor is not determined"),
            (|fit| fit.others = vec![(vec![3e7, 0.4], 0.9)], "0.90 dB off the rates: pad.vertical 3.000e7"),
            (|fit| fit.correlation[1][0] = -0.97, "pad.vertical and pad.loss_factor are hardly told apart"),
            (
                |fit| fit.directions[0].without_effect = vec![315.0],
                "no key has an effect on the vertical rates at 315 Hz",
            ),
            (|fit| fit.directions[0].measured[1] = 0.15, "below 0.20 dB/m, which the positions of the standard"),
        ];
        for (change, wanted) in changes {
            let mut fit = good();
            change(&mut fit);
            let told = remarks(&fit);
            assert!(told.len() == 1 && told[0].contains(wanted), "{told:?}, expected {wanted}");
        }
        let poor = TrackFit { residual: [5.0, 2.5], ..good() };
        assert!(remarks(&poor)[0].contains("2.5 dB off"), "{:?}", remarks(&poor));
    }
}
