//! Numbers in sentences: few digits, true minus signs.

/// Mantissa and exponent of `value` with `digits` significant digits.
fn scientific(value: f64, digits: usize) -> (String, i32) {
    let text = format!("{value:.*e}", digits.max(1) - 1);
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    (mantissa.to_owned(), exponent.parse().unwrap_or(0))
}

/// `text` without zeros at the end of its decimals.
fn trimmed(text: &str) -> &str {
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.'),
        false => text,
    }
}

/// `value` with at most `digits` significant digits, without trailing zeros, as `%g` of C.
pub(super) fn general(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return "none".into();
    }
    let (mantissa, exponent) = scientific(value, digits);
    let text = match exponent {
        e if e < -4 || e >= digits as i32 => {
            format!("{}e{}{:02}", trimmed(&mantissa), if e < 0 { '-' } else { '+' }, e.abs())
        }
        e => trimmed(&format!("{value:.*}", (digits as i32 - 1 - e).max(0) as usize)).to_owned(),
    };
    text.replace('-', "−")
}

/// `value` to two digits, the last one shown if it is 0.
pub(super) fn rounded(value: f64) -> String {
    let size = value.abs();
    if (1e-4..10.0).contains(&size) {
        let (_, exponent) = scientific(value, 2);
        return format!("{value:.*}", (1 - exponent).max(0) as usize).replace('-', "−");
    }
    let short: f64 = format!("{value:.1e}").parse().unwrap_or(value);
    general(short, 6)
}

/// A damping ratio in per cent.
pub(super) fn percent(ratio: f64) -> String {
    format!("{} %", rounded(100.0 * ratio))
}

/// A frequency without digits that do not matter.
pub(super) fn hertz(value: f64) -> String {
    match value >= 100.0 {
        true => format!("{value:.0} Hz"),
        false => format!("{} Hz", general(value, 3)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Texts of Python's `f"{v:.6g}"`, and of the rule with two digits.
    #[test]
    fn numbers_have_the_digits_of_the_report() {
        let six = [(60000.0, "60000"), (1234567.0, "1.23457e+06"), (0.4, "0.4"), (-0.01, "−0.01"), (2e-5, "2e−05")];
        six.into_iter().for_each(|(v, text)| assert_eq!(general(v, 6), text));
        let two = [
            (4.05, "4.0"),
            (0.0014, "0.0014"),
            (0.002, "0.0020"),
            (9.96, "10"),
            (1588.0, "1600"),
            (2.2e6, "2.2e+06"),
            (-0.0668, "−0.067"),
            (5.04e-5, "5e−05"),
            (0.0, "0"),
            (12.0, "12"),
        ];
        two.into_iter().for_each(|(v, text)| assert_eq!(rounded(v), text, "{v}"));
        assert_eq!([965.4, 99.96, 0.1234].map(hertz), ["965 Hz", "100 Hz", "0.123 Hz"]);
        assert_eq!(percent(-0.000668), "−0.067 %");
    }
}
