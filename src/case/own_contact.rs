//! The contacts of a vehicle in a curve by the program's own contact, beside the law of creep forces of the
//! equilibrium.

use super::curving::CurvingVehicle;
use super::wheel_rail_geometry::PlacedContact;
use crate::body::half_space::HalfSpace;
use crate::contact::{ContactCreepage, NormalLoad, PatchKinematics, SteadyProblem, Stencil};
use crate::curving::{BogieWheel, ContactForce, WHEELS};
use crate::friction::PlaceOnRail;
use crate::job::{self, Job};
use crate::model::combined_compliance;
use crate::{Error, Result};

/// Residual and iterations of the steady contact.
const TOLERANCE: f64 = 1e-6;
const MOST_ITERATIONS: usize = 200;

/// Forces of one place of contact on the wheel, forwards and to the right along the rail's tangent, N.
pub struct OwnContact {
    /// The wheel.
    pub wheel: BogieWheel,
    /// The place, with the forces of the creep law.
    pub place: ContactForce,
    /// The forces of the discretised contact between half-spaces, under the same normal force and motion.
    pub force: [f64; 2],
}

/// Steady rolling at every place of contact of `curving`. For one rank.
///
/// # Errors
/// Places on which no grid can be laid; a contact that does not converge.
pub fn own_contacts(job: &Job, curving: &CurvingVehicle) -> Result<Vec<OwnContact>> {
    let mut all = Vec::new();
    for wheel in WHEELS {
        for place in curving.solution.wheel(&curving.problem, wheel) {
            let force = forces(job, curving, wheel, place).map_err(|e| {
                e.context(format!("{} wheel at y = {:.1} mm of its profile", wheel.name(), 1e3 * place.place.wheel))
            })?;
            all.push(OwnContact { wheel, place: *place, force });
        }
    }
    Ok(all)
}

fn forces(job: &Job, curving: &CurvingVehicle, wheel: BogieWheel, place: &ContactForce) -> Result<[f64; 2]> {
    let missing = || Error::Defect("a contact of a curve without a wheel".into());
    let mut here = job.clone();
    let contact = here.contact.as_mut().ok_or_else(missing)?;
    curving.put(contact, wheel, place);
    let placed = PlacedContact::from_job(&here)?;
    let interface = placed.interface()?;
    let half_space = |body: &Option<job::Body>| -> Result<HalfSpace> {
        let m = body.as_ref().ok_or_else(missing)?.elastic()?;
        Ok(HalfSpace { young: m.young, poisson: m.poisson })
    };
    let (lower, upper) = (half_space(&here.bodies.lower)?, half_space(&here.bodies.upper)?);
    let own = |h: &HalfSpace| h.compliance(&interface.patches[0].x, &interface.patches[0].y);
    let (lower, upper) = (own(&lower)?, own(&upper)?);
    let compliance = combined_compliance(lower.as_ref(), upper.as_ref())?;
    let [longitudinal, lateral, spin, speed, ..] = placed.motion();
    let curvature = curving.problem.curve.curvature;
    let right = wheel.inner == (curvature > 0.0);
    let law = curving.problem.friction.law(PlaceOnRail { right, curvature, angle: place.place.angle });
    let problem = SteadyProblem {
        interface: &interface,
        compliance: compliance.as_ref().into(),
        friction: law.clone().into(),
        kinematics: PatchKinematics::one(speed, ContactCreepage { longitudinal, lateral, spin }),
        loads: NormalLoad::Force(place.normal).into(),
        stencil: Stencil::default(),
        tolerance: TOLERANCE,
        max_iterations: MOST_ITERATIONS,
    };
    let solution = problem.solve()?;
    // Forces are those on the rail along x, which points backwards, and along y: those on the wheel are opposite.
    Ok([solution.force[0], -solution.force[1]])
}

/// The table of the forces, one line each.
pub fn lines(all: &[OwnContact]) -> Vec<String> {
    let mut lines = vec![
        "forces by the creep law, and by the discretised contact between half-spaces under the same load and motion"
            .to_string(),
        "  wheel            y, mm    N, kN  Fx, kN: law     own   T, kN: law     own   apart/(mu N)".into(),
    ];
    for c in all {
        let law = [c.place.longitudinal, c.place.tangential];
        let apart = (law[0] - c.force[0]).hypot(law[1] - c.force[1]) / (c.place.friction * c.place.normal);
        lines.push(format!(
            "  {:<15} {:+6.1} {:8.2} {:+12.2} {:+7.2} {:+12.2} {:+7.2} {:14.3}",
            c.wheel.name(),
            1e3 * c.place.place.wheel,
            1e-3 * c.place.normal,
            1e-3 * law[0],
            1e-3 * c.force[0],
            1e-3 * law[1],
            1e-3 * c.force[1],
            apart
        ));
    }
    lines
}
