//! Harwell–Boeing files.

use super::*;

#[test]
fn harwell_boeing_by_hand() {
    let head = |kind: &str, cards: &str, entries: usize| {
        format!(
            "{:72}{:8}\n{cards}\n{kind:14}{:14}{:14}{entries:14}{:14}\n{:16}{:16}{:20}{:20}\n",
            "by hand", "HAND", 3, 3, 0, "(4I4)", "(3I4)", "(2E12.4)", ""
        )
    };
    let cards = |p: usize, i: usize, v: usize| format!("{:14}{p:14}{i:14}{v:14}{:14}", p + i + v, 0);
    let pointers = "   1   4   5   6\n";
    let symmetric = head("RSA", &cards(1, 2, 3), 5)
        + pointers
        + "   1   2   3\n   2   3\n  4.0000E+00 -1.0000E+00\n  5.0000D-01  3.0000E+00\n  2.5000E+05\n";
    is_hand(&good(&symmetric, Format::HarwellBoeing, None), false);
    is_hand(&good(&symmetric.replace('\n', "\r\n"), Format::HarwellBoeing, None), false);
    let general = head("rua", &cards(1, 3, 4), 7)
        + "   1   4   6   8\n   1   2   3\n   1   2   1\n   3\n"
        + "  4.0000E+00 -1.0000E+00\n  5.0000D-01 -1.0000E+00\n  3.0000E+00  5.0000E-01\n  2.5000E+05\n";
    is_hand(&good(&general, Format::HarwellBoeing, None), false);
    let refused = |text: &str, line, says: &[&str]| refused(text, Format::HarwellBoeing, line, says);
    for kind in ["PSA", "CSA", "RSE", "RRA", "XYZ"] {
        refused(&symmetric.replace("RSA", kind), 3, &[kind, "expected RUA, RSA or RZA"]);
    }
    refused(&general.replace("rua", "RSA"), 7, &["lower triangle only"]);
    refused(&symmetric.replace("(2E12.4)", "(2A12)  "), 4, &["(2A12)"]);
    refused(&symmetric.replace(pointers, "   1   4   3   6\n"), 5, &["do not rise"]);
    refused(&symmetric.replace("   2   3\n  4", "   2   9\n  4"), 7, &["row 9"]);
    refused(&symmetric.replace("   1   2   3\n", "   1   2   2\n"), 6, &["again"]);
    refused(&symmetric[..symmetric.len() - 14], 9, &["truncated"]);
    refused(&symmetric.replace("2.5000E+05", "       NaN"), 10, &["finite"]);
    refused(&symmetric.replace("2.5000E+05\n", "2.5000E+05  1.\n"), 10, &["expected 1 numbers"]);
    refused("title\n", 1, &["truncated"]);
    refused("", 0, &["truncated"]);
    let skew = head("RZA", &cards(1, 1, 1), 1) + "   1   2   2   2\n   2\n  4.0000E+00\n";
    assert_eq!(dense(&good(&skew, Format::HarwellBoeing, None).matrix)[0], [0.0, -4.0, 0.0]);
}
