//! Requirements of contact laws at points of quadrature.

use super::super::model::*;
use super::super::transient::{StartState, TransientSolver};
use crate::friction::FrictionLaw;

/// Adds the faults of `contact.quadrature`.
pub fn check(job: &Job, faults: &mut Vec<String>) {
    let Some(contact) = job.contact.as_ref().filter(|c| c.quadrature == Quadrature::Consistent) else { return };
    let key = "contact.quadrature: found \"consistent\"";
    if contact.points.is_some() || job.by_matrices() {
        return faults.push(format!("{key}, but contact points stand alone; expected \"nodal\", or leave it out"));
    }
    let own = contact.around.iter().filter_map(|one| one.friction.as_ref());
    let laws = contact.friction_zones.iter().map(|zone| &zone.friction).chain(own);
    if !laws.chain([&contact.friction]).all(FrictionLaw::is_constant) {
        faults.push(format!(
            "{key} with friction that changes with the velocity; expected \"nodal\", or a number as contact.friction"
        ));
    }
    for name in job.analyses.names() {
        if ["stability", "creep_curve", "receptance", "sweep", "uncertainty"].contains(&name) {
            faults.push(format!(
                "{key}, which analyses.{name} does not know; expected \"nodal\", or leave analyses.{name} out"
            ));
        }
    }
    if job.solver.linear == LinearSolver::Gamg {
        faults.push(format!(
            "{key}, which needs the compliance that \"mumps\" makes, but solver.linear is \"gamg\"; leave out \
             one of the two"
        ));
    }
    let Some(transient) = &job.analyses.transient else { return };
    if transient.start.state != Some(StartState::Steady) {
        faults.push(
            "analyses.transient.start.state: expected \"steady\" with the contact.quadrature \"consistent\", of \
             which no sliding of the whole contact is \
             computed"
                .into(),
        );
    }
    if transient.solver == TransientSolver::FixedPoint {
        faults.push(
            "analyses.transient.solver: found \"fixed_point\" with the contact.quadrature \
         \"consistent\"; expected \"newton\", or leave it out"
                .into(),
        );
    }
}
