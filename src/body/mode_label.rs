//! Names of free modes.

use crate::parallel::World;

/// Name of a free mode: its waves along the body, and what moves most.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ModeLabel {
    /// Nodal diameters of a body of revolution; waves on the length of a rail.
    pub order: u32,
    /// Component with the largest motion, and how many modes of its kind lie below, such as "axial 0"; empty where only
    /// the order is known. Of a mode of one of several bodies around one the name of its body follows behind a comma.
    pub family: String,
}

impl std::fmt::Display for ModeLabel {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.family.as_str() {
            "" => write!(f, "({})", self.order),
            family => write!(f, "({}, {family})", self.order),
        }
    }
}

/// Between the family of a mode and the name of its body.
const ON: &str = ", ";

impl ModeLabel {
    /// The same name on one of several bodies, the `body`.
    pub(crate) fn on(&self, body: &str) -> Self {
        Self { order: self.order, family: format!("{}{ON}{body}", self.family) }
    }

    /// Name of the body, of a mode of one of several.
    pub(crate) fn body(&self) -> Option<&str> {
        self.family.rsplit_once(ON).map(|(_, body)| body)
    }

    /// Names of modes of which only the number of waves is known.
    pub(crate) fn of_orders(orders: &[f64]) -> Vec<Self> {
        orders.iter().map(|n| Self { order: n.round() as u32, family: String::new() }).collect()
    }

    /// Collective: the names of rank 0 on every rank.
    pub fn broadcast(world: &World, names: Option<&[Self]>) -> Vec<Self> {
        let names = names.unwrap_or_default();
        let orders = world.broadcast(names.iter().map(|n| u64::from(n.order)).collect::<Vec<u64>>());
        let lengths = world.broadcast(names.iter().map(|n| n.family.len() as u64).collect::<Vec<u64>>());
        let text = world.broadcast(names.iter().flat_map(|n| n.family.bytes()).collect::<Vec<u8>>());
        let mut rest = &text[..];
        let name = |(order, length): (&u64, &u64)| {
            let (own, after) = rest.split_at((*length as usize).min(rest.len()));
            rest = after;
            Self { order: *order as u32, family: String::from_utf8_lossy(own).into_owned() }
        };
        orders.iter().zip(&lengths).map(name).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_say_what_is_known() {
        assert_eq!(ModeLabel { order: 3, family: "axial 0".into() }.to_string(), "(3, axial 0)");
        assert_eq!(ModeLabel::of_orders(&[1.9999])[0].to_string(), "(2)");
        let axial = ModeLabel { order: 3, family: "axial 0".into() };
        assert_eq!((axial.body(), axial.on("idler").body()), (None, Some("idler")));
        assert_eq!(axial.on("idler").to_string(), "(3, axial 0, idler)");
    }
}
