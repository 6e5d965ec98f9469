//! Fields on the nodes of the bodies: what is drawn, and how contact values get from the contact grid to the nodes.

use crate::mesh::distribute::MeshPart;
use crate::parallel::World;
use std::collections::HashMap;

/// One body to be written: this rank's part of its mesh, in lower form.
#[derive(Debug, Clone, Copy)]
pub struct BodyPart<'a> {
    /// Nodes and cells.
    pub part: &'a MeshPart,
    /// True for body 2: coordinates and vectors are reflected in z when written.
    pub upper: bool,
}

/// Kind of the values of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FieldKind {
    /// One number a node.
    Scalar,
    /// Three components a node, x, y, z in the body's own (lower) form; reflected with the body.
    Vector,
    /// A small whole number a node, stored as int8.
    Label,
}

impl FieldKind {
    /// Numbers a node.
    pub fn components(self) -> usize {
        match self {
            FieldKind::Vector => 3,
            FieldKind::Scalar | FieldKind::Label => 1,
        }
    }
}

/// Name and meaning of a field.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FieldSpec {
    /// Name in `/VTKHDF/PointData`.
    pub name: String,
    /// SI unit, "1" or "-".
    pub units: String,
    /// Description.
    pub description: String,
    /// Scalar, vector or label.
    pub kind: FieldKind,
}

impl FieldSpec {
    /// See the fields.
    pub fn new(name: &str, units: &str, description: &str, kind: FieldKind) -> Self {
        Self { name: name.to_owned(), units: units.to_owned(), description: description.to_owned(), kind }
    }
}

/// A field with this rank's values.
#[derive(Debug, Clone)]
pub struct PointField<'a> {
    /// Name and meaning.
    pub spec: FieldSpec,
    /// For each body its values at this rank's local nodes (owned and ghosts, as in [`MeshPart::node_ids`]), node by
    /// node, `[node_ids.len() * components]`.
    pub values: Vec<&'a [f64]>,
}

impl<'a> PointField<'a> {
    /// See the fields.
    pub fn new(spec: FieldSpec, values: Vec<&'a [f64]>) -> Self {
        Self { spec, values }
    }

    /// Displacement, m, `[3 * nodes]` for each body.
    pub fn displacement(values: Vec<&'a [f64]>) -> Self {
        let text = "Displacement of the body in the frame of the contact point.";
        Self::new(FieldSpec::new("displacement", "m", text, FieldKind::Vector), values)
    }

    /// Von Mises stress, Pa, `[nodes]` for each body.
    pub fn von_mises(values: Vec<&'a [f64]>) -> Self {
        let text = "Von Mises equivalent stress, averaged at the nodes.";
        Self::new(FieldSpec::new("von_mises", "Pa", text, FieldKind::Scalar), values)
    }
}

/// Collective: nodal values on the contact grid, which rank 0 has, as local nodal values of a part.
/// `nodes`: node of the whole mesh of each grid node (as in `ContactGrid::nodes`), `[n]`, on rank 0; `values`:
/// `[n * components]`, on rank 0; other ranks pass empty slices. Nodes that are not on the grid get `elsewhere`.
/// Returns `[node_ids.len() * components]`.
pub(crate) fn on_points(
    world: &World,
    part: &MeshPart,
    nodes: &[u32],
    values: &[f64],
    components: usize,
    elsewhere: f64,
) -> Vec<f64> {
    let ids: Vec<u64> =
        nodes.iter().map(|&n| part.renumbered.get(n as usize).copied().unwrap_or(u64::from(n))).collect();
    let ids = world.broadcast(ids);
    let values = world.broadcast(values.to_vec());
    let local: HashMap<u64, usize> = part.node_ids.iter().enumerate().map(|(i, &id)| (id, i)).collect();
    let mut out = vec![elsewhere; part.node_ids.len() * components];
    for (id, row) in ids.iter().zip(values.chunks_exact(components)) {
        if let Some(&i) = local.get(id) {
            out[i * components..(i + 1) * components].copy_from_slice(row);
        }
    }
    out
}

/// Collective: the three contact fields of one body at this rank's nodes: pressure (Pa), traction (Pa, `[3 * nodes]`, z
/// component zero) and state. Away from the contact grid pressure and traction are 0, as the surface is free there,
/// and the state is −1. On rank 0 `nodes` `[n]` are the grid's nodes in the whole mesh, `pressure` is `[n]`,
/// `traction` `[2n]` (on body 1) and `state` `[n]` (0 open, 1 stick, 2 slip); other ranks pass empty slices.
pub fn contact_fields(
    world: &World,
    part: &MeshPart,
    nodes: &[u32],
    pressure: &[f64],
    traction: &[f64],
    state: &[i8],
) -> [Vec<f64>; 3] {
    let traction: Vec<f64> = traction.chunks_exact(2).flat_map(|t| [t[0], t[1], 0.0]).collect();
    let state: Vec<f64> = state.iter().map(|&s| f64::from(s)).collect();
    [
        on_points(world, part, nodes, pressure, 1, 0.0),
        on_points(world, part, nodes, &traction, 3, 0.0),
        on_points(world, part, nodes, &state, 1, -1.0),
    ]
}

impl<'a> PointField<'a> {
    /// The three point fields for `bodies` values of [`contact_fields`], in the order of the bodies.
    pub fn contact(bodies: &'a [[Vec<f64>; 3]]) -> [PointField<'a>; 3] {
        let pick = |k: usize| bodies.iter().map(|b| &b[k][..]).collect();
        let pressure = "Contact pressure; 0 where the surface is free.";
        let traction = "Tangential contact traction on body 1 (the lower one), the same at the points of both bodies.";
        let state = "Contact state: 0 open, 1 stick, 2 slip, -1 not on the contact grid.";
        [
            Self::new(FieldSpec::new("pressure", "Pa", pressure, FieldKind::Scalar), pick(0)),
            Self::new(FieldSpec::new("traction", "Pa", traction, FieldKind::Vector), pick(1)),
            Self::new(FieldSpec::new("state", "-", state, FieldKind::Label), pick(2)),
        ]
    }
}
