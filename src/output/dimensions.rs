//! Names of the dimensions of datasets: the attribute `DIMENSION_LABELS` of HDF5's dimension scales, which `h5py` gives
//! as `dataset.dims[0].label`. A dimension that has the name of a dataset beside it has its coordinates there.

/// Paths, `*` for any one part, and the names of their dimensions; the first rule that fits counts.
const RULES: &[(&str, &[&str])] = &[
    ("/contact/shape", &["axis"]),
    ("/contact/force", &["direction"]),
    ("/contact/centre", &["direction"]),
    ("/contact/deflection", &["direction"]),
    ("/contact/area", &["body"]),
    ("/contact/*", &["node", "direction"]),
    ("/contacts/*", &["contact", "component"]),
    ("/contact_*/shape", &["axis"]),
    ("/contact_*/force", &["direction"]),
    ("/contact_*/centre", &["direction"]),
    ("/contact_*/*", &["node", "direction"]),
    ("/placement/rail_line", &["line_point", "coordinate"]),
    ("/placement/wheel_line", &["line_point", "coordinate"]),
    ("/placement_*/rail_line", &["line_point", "coordinate"]),
    ("/placement_*/wheel_line", &["line_point", "coordinate"]),
    ("/curving/frame", &["motion"]),
    ("/curving/axles/*", &["axle", "component"]),
    ("/curving/contacts/*", &["place", "component"]),
    ("/curving/radii/*", &["radius", "wheel", "component"]),
    ("/modes/*/*", &["mode"]),
    ("/stability/participation", &["eigenvalue", "mode"]),
    ("/stability/diameters", &["eigenvalue", "body"]),
    ("/stability/mode_body", &["mode"]),
    ("/stability/mode_frequency", &["mode"]),
    ("/stability/force", &["direction"]),
    ("/stability/pressure", &["node"]),
    ("/stability/friction", &["node"]),
    ("/stability/state", &["node"]),
    ("/stability/shape", &["motion"]),
    ("/stability/body_energy", &["motion", "body"]),
    ("/stability/contact_motion", &["motion", "body", "direction"]),
    ("/stability/growth_parts", &["motion", "part"]),
    ("/stability/shift", &["shift"]),
    ("/stability/shift_radius", &["shift"]),
    ("/stability/criterion/*", &["place"]),
    ("/stability/confirmation/*", &["place", "side"]),
    ("/stability/sensitivity/*", &["eigenvalue", "mode"]),
    ("/stability/*", &["eigenvalue"]),
    ("/creep_curve/*", &["point", "direction"]),
    ("/creep_curve_*/*", &["point", "direction"]),
    ("/receptance/share", &["node"]),
    ("/receptance/*", &["frequency", "direction", "force_direction"]),
    ("/receptance_*/share", &["node"]),
    ("/receptance_*/*", &["frequency", "direction", "force_direction"]),
    ("/track_decay/response/*", &["frequency", "position"]),
    ("/track_decay/position", &["position"]),
    ("/track_decay/*", &["frequency"]),
    ("/transient/point_displacement", &["time", "point", "direction"]),
    ("/transient/point_velocity", &["time", "point", "direction"]),
    ("/transient/contact_*", &["contact_time", "node", "direction"]),
    ("/transient/modal_*", &["modal_time", "mode"]),
    ("/transient/points/*", &["point", "direction"]),
    ("/transient/grid/mode_frequency", &["mode"]),
    ("/transient/grid/*", &["node"]),
    ("/transient/sound_power/frequency", &["frequency"]),
    ("/transient/sound_power/*/density", &["frequency"]),
    ("/transient/sound_power/*/mode_resistance", &["mode"]),
    ("/transient/sound_power/*", &["band"]),
    ("/transient/sound_power/*/*", &["band"]),
    ("/transient/*", &["time", "direction"]),
    ("/transient_*/contact_*", &["contact_time", "node", "direction"]),
    ("/transient_*/grid/*", &["node"]),
    ("/transient_*/*", &["time", "direction"]),
    ("/sweep/keys", &["key"]),
    ("/sweep/shape", &["key"]),
    ("/sweep/eigenvalue", &["eigenvalue"]),
    ("/sweep/offset", &["edge"]),
    ("/sweep/values/*", &["point"]),
    ("/sweep/*", &["point", "direction"]),
];

/// The same of datasets that have a row for each of several contacts.
const OF_CONTACTS: &[(&str, &[&str])] =
    &[("/stability/force", &["contact", "direction"]), ("/stability/approach", &["contact"])];

/// Names of the `rank` dimensions of the dataset at `path`; none where nothing is known of it, and empty ones where
/// only the first dimensions are named.
pub(super) fn labels(path: &str, rank: usize) -> Vec<&'static str> {
    let of_contacts = OF_CONTACTS.iter().find(|(name, names)| *name == path && names.len() == rank);
    let rule = of_contacts.or_else(|| RULES.iter().find(|(pattern, _)| fits(pattern, path)));
    let Some((_, names)) = rule else { return Vec::new() };
    let named = names.iter().copied().chain(std::iter::repeat(""));
    named.take(rank).collect()
}

/// True if the path has the parts of the pattern; a part that ends in `*` stands for all that begin so.
fn fits(pattern: &str, path: &str) -> bool {
    let (mut wanted, mut given) = (pattern.split('/'), path.split('/'));
    loop {
        match (wanted.next(), given.next()) {
            (None, None) => return true,
            (Some(w), Some(g)) if w == g || w.strip_suffix('*').is_some_and(|begin| g.starts_with(begin)) => {}
            _ => return false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dimensions_have_the_names_of_the_page() {
        assert_eq!(labels("/stability/participation", 2), ["eigenvalue", "mode"]);
        assert_eq!(labels("/stability/growth_rate", 1), ["eigenvalue"]);
        assert_eq!(labels("/transient/contact_traction", 3), ["contact_time", "node", "direction"]);
        assert_eq!(labels("/transient/force", 2), ["time", "direction"]);
        assert_eq!(labels("/transient/sound_power/upper/level", 1), ["band"]);
        assert_eq!(labels("/stability/approach", 0), [""; 0]);
        assert_eq!(labels("/stability/approach", 1), ["contact"]);
        assert_eq!(labels("/stability/force", 1), ["direction"]);
        assert_eq!(labels("/stability/force", 2), ["contact", "direction"]);
        assert_eq!(labels("/contact_2/traction", 2), ["node", "direction"]);
        assert_eq!(labels("/curving/radii/position", 3), ["radius", "wheel", "component"]);
        assert!(labels("/provenance/job", 0).is_empty() && labels("/reduced/lower/order", 1).is_empty());
        // Dimensions beyond those that are named.
        assert_eq!(labels("/modes/upper/frequency", 2), ["mode", ""]);
    }

    /// A dataset that is the coordinate of a dimension has this one dimension.
    #[test]
    fn coordinates_lie_along_their_own_dimension() {
        let coordinates = [
            "/stability/eigenvalue",
            "/receptance/frequency",
            "/transient/time",
            "/transient/contact_time",
            "/transient/modal_time",
            "/transient/sound_power/frequency",
            "/curving/radii/radius",
            "/stability/shift",
            "/track_decay/frequency",
            "/track_decay/position",
        ];
        for path in coordinates {
            let name = path.rsplit('/').next().unwrap_or_default();
            assert_eq!(labels(path, 1), [name], "{path}");
        }
    }
}
