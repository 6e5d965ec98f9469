//! The contact of two bodies as every contact analysis takes it: the interface and its compliance, dense, on rank 0.

use super::bodies::Bodies;
use crate::body::statics::Statics;
use crate::contact::half_space::HalfSpace;
use crate::contact::{combined_compliance, Creepage, Interface, NormalLoad};
use crate::fem::Material;
use crate::job::{self, Compliance, Load};
use crate::mesh::grid::ContactGrid;
use crate::parallel::World;
use crate::progress::Progress;
use crate::{Error, Result};
use faer::Mat;

/// Interface and compliance on rank 0, nothing elsewhere.
pub struct ContactModel {
    /// What rank 0 holds.
    pub root: Option<RootModel>,
}

/// Interface and compliance.
pub struct RootModel {
    /// The grid both bodies share, with the gap.
    pub interface: Interface,
    /// Influence matrix W of the interface, m/N, `[3n, 3n]`.
    pub compliance: Mat<f64>,
    /// Compliance of each of [`Bodies::unique`], m/N, `[3n, 3n]`; empty with half-spaces.
    pub bodies: Vec<Mat<f64>>,
}

impl ContactModel {
    /// Collective: the interface and its compliance from the source the job names.
    pub fn build(
        world: &World,
        contact: &job::Contact,
        bodies: &Bodies,
        solvers: &mut [Statics],
        progress: &mut Progress,
    ) -> Result<Self> {
        let interface = world.on_root(|| interface_of(bodies))?;
        progress.stage("compliance of the contact");
        let mut unique = Vec::new();
        if contact.compliance == Compliance::Fe {
            for (body, solver) in bodies.unique.iter().zip(solvers) {
                let step = &mut |done, of| progress.step("contact rows", done, of);
                unique.extend(body.compliance(world, solver, step)?);
            }
        }
        let root = world.on_root(|| {
            let interface = interface.ok_or_else(|| Error::Defect("no interface on rank 0".into()))?;
            let compliance = match contact.compliance {
                Compliance::Fe => {
                    let of = |place: usize| {
                        let found = bodies.places.get(place).and_then(|p| unique.get(p.body));
                        found.ok_or_else(|| Error::Defect("compliance is not on rank 0".into()))
                    };
                    combined_compliance(of(0)?.as_ref(), of(1)?.as_ref())?
                }
                Compliance::HalfSpace => half_spaces(bodies, &interface)?,
            };
            Ok(RootModel { interface, compliance, bodies: unique })
        })?;
        Ok(Self { root })
    }

    /// What rank 0 holds; to be asked for on rank 0 only.
    pub fn root(&self) -> Result<&RootModel> {
        self.root.as_ref().ok_or_else(|| Error::Defect("the contact model is on rank 0".into()))
    }
}

/// Creepages of the job.
pub fn creepage(contact: &job::Contact) -> Creepage {
    let c = contact.creepage;
    Creepage { longitudinal: c.longitudinal, lateral: c.lateral, spin: c.spin }
}

/// Load or approach of the job.
pub fn normal_load(contact: &job::Contact) -> NormalLoad {
    match contact.load() {
        Load::Normal(n) => NormalLoad::Force(n),
        Load::Approach(d) => NormalLoad::Approach(d),
    }
}

/// On rank 0: the grid both bodies share and the gap between them.
fn interface_of(bodies: &Bodies) -> Result<Interface> {
    let grids: Vec<&ContactGrid> = bodies.places.iter().filter_map(|p| p.grid.as_ref()).collect();
    let [lower, upper] = grids[..] else {
        return Err(Error::Defect("contact needs the contact grids of two bodies".into()));
    };
    // A thousandth of an element: much less than the grid error, much more than rounding in a mesh file.
    let spacing = lower.x.windows(2).chain(lower.y.windows(2)).map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min);
    ContactGrid::matched(lower, upper, 1e-3 * spacing)?;
    let gap = lower.z.iter().zip(&upper.z).map(|(l, u)| -l - u).collect();
    Interface::new(lower.x.clone(), lower.y.clone(), gap)
}

/// On rank 0: influence matrix of two half-spaces of the bodies' materials.
fn half_spaces(bodies: &Bodies, s: &Interface) -> Result<Mat<f64>> {
    let of = |m: &Material| HalfSpace { young: m.young, poisson: m.poisson }.compliance(&s.x, &s.y);
    let lower = of(&bodies.places[0].material)?;
    let upper = of(&bodies.places[1].material)?;
    combined_compliance(lower.as_ref(), upper.as_ref())
}
