//! Bodies on one side of the contacts and the modes that are theirs: the modes of several bodies around one stand in
//! one list.

use crate::body::{ModeLabel, Side};
use crate::job::{self, Job};
use std::collections::BTreeMap;

/// A body with the modes of its side that are its own.
pub(super) struct Owner<'j> {
    /// Its key below `bodies`.
    pub key: String,
    /// The body.
    pub body: &'j job::Body,
    /// Numbers of its modes among those of the side, ascending.
    pub modes: Vec<usize>,
}

/// The bodies on a side of `job` with the modes of each, of as many as there are, whose `names`, where they are known,
/// say to which of several bodies they belong.
pub(super) fn owners<'j>(job: &'j Job, side: Side, names: &[ModeLabel], count: usize) -> Vec<Owner<'j>> {
    let Some(first) = super::given(job)[side.index()] else { return Vec::new() };
    let mut all: BTreeMap<Option<&str>, Vec<usize>> = BTreeMap::new();
    (0..count).for_each(|k| all.entry(names.get(k).and_then(ModeLabel::body)).or_default().push(k));
    let named = |name: Option<&str>| Some((format!("others.{}", name?), job.bodies.others.get(name?)?));
    let owner = |(name, modes): (Option<&str>, Vec<usize>)| {
        let (key, body) = named(name).unwrap_or_else(|| (side.name().into(), first));
        Owner { key, body, modes }
    };
    all.into_iter().map(owner).collect()
}

/// Angular velocities of the bodies on a side of `job` at each of its modes, rad/s.
pub fn speeds(job: &Job, side: Side, names: &[ModeLabel], count: usize) -> Vec<f64> {
    let mut all = vec![0.0; count];
    for Owner { body, modes, .. } in owners(job, side, names, count) {
        modes.iter().for_each(|&k| all[k] = job.angular_velocity_of(body));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{damping_of, IntrinsicDamping};
    use std::path::Path;

    /// Damping and angular velocity are those of the body of each mode, and modes are counted body by body.
    #[test]
    fn each_body_has_its_own_damping_and_speed() {
        let omega = [1000.0, 1100.0, 2000.0, 2100.0];
        let label = |k: usize, body: &str| ModeLabel { order: 2, family: format!("axial {k}") }.on(body);
        let found = |bytes: &[u8], sets: &[&str], second: &str| {
            let sets: Vec<String> = sets.iter().map(|set| set.to_string()).collect();
            let job = Job::from_bytes(bytes, Path::new("job.json"), &sets, None).unwrap();
            let names = [label(0, "body 1"), label(0, second), label(1, "body 1"), label(1, second)];
            let own = IntrinsicDamping::default();
            let damping = damping_of(&job, Side::Upper, (&omega, &names), &own).unwrap();
            ([0, 1, 2, 3].map(|k| damping.get(k, k)), speeds(&job, Side::Upper, &names, 4))
        };
        let first = "bodies.upper.damping.modal={\"by_mode\": [0.25, 0.5]}";
        let idler = "bodies.others.idler.damping.modal={\"by_mode\": [0.125, 1]}";
        let (unlike, speeds) = found(include_bytes!("../../jobs/wheel-and-idler.json"), &[first, idler], "idler");
        assert_eq!(unlike, [250.0, 137.5, 1000.0, 2100.0]);
        assert_eq!(speeds, [5.0 / 0.15, 5.0 / 0.1, 5.0 / 0.15, 5.0 / 0.1]);
        let (alike, speeds) = found(include_bytes!("../../jobs/roller-rig.json"), &[first], "body 2");
        assert_eq!(alike, [250.0, 275.0, 1000.0, 1050.0]);
        assert_eq!(speeds, [5.0 / 0.15; 4]);
    }
}
