//! The rail 115RE of AREMA.
//!
//! The head runs on arcs of 8, 1¼ and ⅜ inch that meet tangentially 32.437 and 58.173 mm apart, with sides of 1:40
//! that are 2 23/32 inch apart at their lower ends. Below it: fishing faces of 1:4 that meet the middle 1 11/16 inch
//! below the crown and 1⅛ inch above the underside; fillets of ¾ inch; web sides of 14 inch above and 12 inch below
//! the middle between the fishing faces, where they are ⅝ inch apart; corners of 1/16 inch.
//!
//! Height, widths, thickness of the web and the heights of the fishing faces are those of a manufacturer's table of
//! dimensions; slopes, fillets, the radii of the head and the 14 inch of the web are recalled from AREMA's drawing.
//! The area of the foot below its fishing faces confirms their slope: 4.294 in² against the published 4.2947. Where the
//! arcs of the head meet follows from the published area of the head (3.8861 in²), and the 12 inch from that of the web
//! (3.0362 in²). The outline is drawn to 0.01 mm, with sharp edges at the foot's underside.

use super::{Head, Published, Rail};

/// The rail 115RE.
pub static R115RE: Rail = Rail {
    name: "115RE",
    head: Head {
        radii: &[203.2e-3, 31.75e-3, 9.525e-3],
        ends: &[16.218586e-3, 29.086591e-3],
        side: 40.0,
        height: 168.275e-3,
    },
    underside: &UNDERSIDE,
    web: &WEB,
    foot: &FOOT,
    tip: &TIP,
    side: &SIDE,
    stem: 14.8e-3,
    // AREMA, 115 RE: 11.2171 in², 114.3757 lb/yd, 65.5 and 10.7 in⁴.
    published: Published { area: 72.368e-4, mass: 56.738, inertia: [2.7263e-5, 4.4537e-6], sheared: None },
};

#[rustfmt::skip]
const UNDERSIDE: [[f64; 2]; 15] = [
    [34.19, 134.34], [33.97, 134.09], [33.70, 133.90], [33.40, 133.77], [23.92, 131.39], [22.79, 131.04],
    [21.68, 130.63], [20.61, 130.15], [19.56, 129.60], [18.55, 128.99], [17.58, 128.32], [16.66, 127.58],
    [15.78, 126.80], [14.95, 125.96], [14.68, 125.67],
];

#[rustfmt::skip]
const WEB: [[f64; 2]; 38] = [
    [14.68, 125.67], [13.93, 124.76], [13.23, 123.81], [12.59, 122.82], [12.01, 121.79], [11.50, 120.72],
    [11.06, 119.63], [10.68, 118.51], [10.38, 117.37], [10.14, 116.21], [9.98, 115.04], [9.52, 110.54],
    [9.13, 106.04], [8.78, 101.53], [8.50, 97.01], [8.28, 92.50], [8.11, 87.98], [8.00, 83.46], [7.94, 78.93],
    [7.95, 74.38], [8.02, 69.80], [8.17, 65.22], [8.38, 60.64], [8.66, 56.07], [9.01, 51.50], [9.42, 46.94],
    [9.91, 42.38], [10.38, 38.49], [10.56, 37.34], [10.81, 36.20], [11.13, 35.09], [11.52, 33.99], [11.97, 32.92],
    [12.49, 31.88], [13.07, 30.88], [13.71, 29.91], [14.41, 28.98], [14.91, 28.39],
];

#[rustfmt::skip]
const FOOT: [[f64; 2]; 15] = [
    [14.91, 28.39], [15.69, 27.53], [16.53, 26.73], [17.42, 25.98], [18.35, 25.29], [19.32, 24.65], [20.33, 24.07],
    [21.37, 23.56], [22.44, 23.11], [23.54, 22.73], [24.66, 22.41], [68.80, 11.37], [69.09, 11.23], [69.35, 11.03],
    [69.50, 10.87],
];

#[rustfmt::skip]
const TIP: [[f64; 2]; 5] = [
    [69.85, 0.00], [69.84, 10.03], [69.78, 10.35], [69.65, 10.65], [69.50, 10.87],
];

#[rustfmt::skip]
const SIDE: [[f64; 2]; 5] = [
    [34.19, 134.34], [34.36, 134.62], [34.46, 134.93], [34.50, 135.26], [33.99, 155.65],
];
