use super::*;

/// Modes that one of the models has beside those of the other do not shift the rest.
#[test]
fn shapes_are_compared_body_by_body() {
    let of = |v: &[f64]| v.iter().map(|v| C::from(*v)).collect::<Vec<C>>();
    let (a, b) = (of(&[1.0, 2.0, 3.0, 4.0]), of(&[1.0, 3.0, 4.0, 5.0]));
    assert_eq!(product(&a, 2, &a, 2), C::from(30.0));
    assert_eq!(product(&a, 2, &b, 1), C::from(1.0 + 9.0 + 16.0));
}
