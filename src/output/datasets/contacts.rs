//! The group `/contacts`: what each of several contacts is.

use super::super::Table;

/// A contact of several.
pub struct NamedContact {
    /// Its name.
    pub name: String,
    /// Contact angle, rad.
    pub angle: f64,
    /// Coefficient of friction at rest.
    pub friction: f64,
    /// Rolling speed, m/s.
    pub speed: f64,
    /// ξ, η (1) and φ (1/m).
    pub creepage: [f64; 3],
}

/// The tables of `all` contacts, in the order of their groups.
pub fn tables(all: &[NamedContact]) -> Vec<Table> {
    let list = |name: &str, units: &str, text: &str, of: fn(&NamedContact) -> f64| {
        Table::list(&format!("/contacts/{name}"), units, text, all.iter().map(of).collect::<Vec<f64>>())
    };
    let names: Vec<String> = all.iter().map(|one| one.name.clone()).collect();
    let creepage: Vec<f64> = all.iter().flat_map(|one| one.creepage).collect();
    vec![
        Table::list("/contacts/name", "-", "Name of each contact, in the order of /contact, /contact_2, ...", names),
        list("contact_angle", "rad", "Contact angle, positive where the rail falls to the right.", |one| one.angle),
        list("friction", "1", "Coefficient of friction at rest.", |one| one.friction),
        list("speed", "m/s", "Rolling speed.", |one| one.speed),
        Table::new(
            "/contacts/creepage",
            "1, 1, 1/m",
            "Longitudinal creepage, lateral creepage and spin.",
            &[all.len(), 3],
            creepage,
        ),
    ]
}
