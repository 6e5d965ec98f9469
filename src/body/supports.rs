//! Contributions of supports to the matrices of a body of finite elements.
//!
//! A component that is clamped alone stays among the degrees of freedom, so that each node has three: its row and
//! column couple with nothing, its stiffness is kept and its mass almost taken away. It is an oscillator of its own
//! far above all that a mesh can show, and no motion has a part in it.

use crate::fem::assembly::{Assembly, Operators};
use crate::fem::dofs::{DofMap, FIXED};
use crate::fem::forms::{AbsorbingMass, Foundation};
use crate::fem::surface::FacetSurface;
use crate::fem::ElasticMaterial;
use crate::job::{Component, Per, Support};
use crate::mesh::distribute::MeshPart;
use crate::mesh::Mesh;
use crate::parallel::World;
use crate::petsc::csr::DistCsr;
use crate::{Error, Result};
use std::rc::Rc;

/// Fraction of its mass that a clamped component keeps: its frequency is a thousand times one of the highest of the
/// mesh.
const MASS_LEFT: f64 = 1e-6;
/// Largest angle of the normals of a surface that counts as plane against their mean, rad.
const PLANE: f64 = 1e-4;

/// A body before its supports.
pub struct Supported<'a> {
    /// Name in messages.
    pub name: &'a str,
    /// The whole mesh, on rank 0.
    pub mesh: Option<&'a Mesh>,
    /// This rank's share.
    pub part: &'a MeshPart,
    /// Its degrees of freedom.
    pub dofs: &'a DofMap,
    /// Material.
    pub material: ElasticMaterial,
}

/// Contributions of supports beside stiffness and mass.
#[derive(Debug, Clone, Default)]
pub struct Effect {
    /// Degrees of freedom that are clamped alone, global, ascending: those of this rank and of its ghosts.
    pub held: Vec<u64>,
    /// Damping matrix of dashpots, springs and absorbing ends, N·s/m.
    pub damping: Option<DistCsr>,
    /// Stiffness of each support with springs, N/m: a static load may rest on them.
    pub springs: Vec<DistCsr>,
    /// Stiffness of the springs which have a loss factor of their own, N/m, if there are any.
    pub lossy: Option<DistCsr>,
    /// Description of the supports, a line each.
    pub lines: Vec<String>,
}

impl Effect {
    /// Sets what is clamped to 0, of a vector of this rank's degrees of freedom.
    pub fn clear(&self, dofs: &DofMap, vector: &mut [f64]) {
        let own = dofs.first()..dofs.first() + dofs.owned() as u64;
        self.held.iter().filter(|d| own.contains(d)).for_each(|d| vector[(d - own.start) as usize] = 0.0);
    }
}

impl Supported<'_> {
    /// Collective: adds `supports` to the `operators`, and says what else they do.
    pub fn hold(&self, world: &World, supports: &[Support], operators: &mut Operators) -> Result<Effect> {
        let mut effect = Effect::default();
        let mut damping: Vec<DistCsr> = Vec::new();
        for (i, support) in supports.iter().enumerate() {
            let key = format!("bodies.{}.supports.{i}", self.name);
            world.on_root(|| match self.mesh {
                Some(mesh) => mesh.require_group(&support.group, &format!("{key}.group: the mesh")),
                None => Ok(()),
            })?;
            let surface = FacetSurface::new(world, self.part, self.mesh, &support.group);
            let (area, ..) = surface.measures(world);
            let share = if support.per == Per::Total { 1.0 / area } else { 1.0 };
            let form = |[x, y, z, n]: [f64; 4]| {
                let [axes, normal] = [[x, y, z].map(|v| share * v), [share * n; 3]];
                surface.assemble(self.dofs, &Foundation { axes, normal: normal[0] })
            };
            let any = |of: [f64; 4]| of.iter().any(|v| *v > 0.0);
            if any(support.springs()) {
                let springs = form(support.springs());
                operators.stiffness = Rc::new(operators.stiffness.minus_scaled(-1.0, &springs));
                if support.loss_factor.is_some() {
                    let sum = effect.lossy.as_ref().map(|others| others.minus_scaled(-1.0, &springs));
                    effect.lossy = Some(sum.unwrap_or_else(|| springs.clone()));
                }
                effect.springs.push(springs);
            }
            if any(support.dashpots()) {
                damping.push(form(support.dashpots()));
            }
            if let Some(mass) = support.mass.filter(|m| *m > 0.0) {
                operators.mass = operators.mass.minus_scaled(-1.0, &form([mass, mass, mass, 0.0]));
            }
            let mut held: Vec<Component> = support.clamped.clone();
            if support.symmetry {
                held.push(self.across(world, &surface, &key)?);
            }
            effect.held.extend(self.components(&support.group, &held));
            if let Some(absorbing) = support.absorbing.filter(|a| a.absorbs()) {
                let (place, normal, apart) = surface.plane(world);
                refuse_curved(&key, "absorbing", apart)?;
                let (density, depth, rate) = (self.material.density, absorbing.depth, absorbing.rate);
                let along = absorbing.longitudinal.unwrap_or(0.0);
                let form = AbsorbingMass { density, place, normal, depth, rate, across: along > 0.0 };
                damping.push(Assembly::new(world, self.part, self.dofs)?.assemble(&form));
                if along > 0.0 {
                    // A long wave along a bar meets ρ√(E/ρ) for each square metre of its section.
                    let dashpots = along * (density * self.material.young).sqrt();
                    damping.push(surface.assemble(self.dofs, &Foundation { axes: [0.0; 3], normal: dashpots }));
                }
            }
            effect.lines.push(format!("support on \"{}\", {area:.6e} m²", support.group));
        }
        effect.held.sort_unstable();
        effect.held.dedup();
        Rc::make_mut(&mut operators.stiffness).hold(world.rank, &effect.held, 1.0);
        operators.mass.hold(world.rank, &effect.held, MASS_LEFT);
        effect.lossy.iter_mut().for_each(|springs| springs.hold(world.rank, &effect.held, 0.0));
        let sum = damping.into_iter().reduce(|a, b| a.minus_scaled(-1.0, &b));
        effect.damping = sum.map(|mut c| {
            c.hold(world.rank, &effect.held, 0.0);
            c
        });
        Ok(effect)
    }

    /// Collective: the component across a plane of symmetry.
    fn across(&self, world: &World, surface: &FacetSurface, key: &str) -> Result<Component> {
        let (_, normal, apart) = surface.plane(world);
        refuse_curved(key, "symmetry", apart)?;
        let along = |c: usize| 1.0 - normal[c].abs() <= 0.5 * PLANE * PLANE;
        let axes = [Component::X, Component::Y, Component::Z];
        axes.into_iter().enumerate().find(|(c, _)| along(*c)).map(|(_, axis)| axis).ok_or_else(|| {
            Error::Input(format!(
                "{key}.symmetry: the plane has the normal {normal:?}, expected one along x, y or z; turn the mesh"
            ))
        })
    }

    /// The degrees of freedom of the components `held` of the nodes of `group` that this rank has.
    fn components<'s>(&'s self, group: &str, held: &'s [Component]) -> impl Iterator<Item = u64> + 's {
        let nodes = self.part.groups.get(group).map_or(&[][..], |n| &n[..]).to_vec();
        let first = nodes.into_iter().map(|n| self.dofs.local[n as usize]).filter(|&d| d != FIXED);
        first.flat_map(|d| held.iter().map(move |&c| d + c as u64))
    }
}

fn refuse_curved(key: &str, what: &str, apart: f64) -> Result<()> {
    if apart <= PLANE {
        return Ok(());
    }
    Err(Error::Input(format!(
        "{key}.{what}: the group is not plane: normals are up to {apart:.2e} rad off their mean, expected at \
         most {PLANE:e}; name a plane group"
    )))
}
