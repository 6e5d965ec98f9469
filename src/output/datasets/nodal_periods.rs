//! The contact nodes over the periods of limit cycles, in the group `/cycles/period`.

use crate::cycles::NodalPeriod;
use crate::output::Table;
use std::collections::BTreeSet;

/// Forces and states of the nodes that close in one of the `periods`; of one that could not be marched again there are
/// neither.
pub fn nodal_tables(periods: &[NodalPeriod]) -> Vec<Table> {
    let nodes: BTreeSet<usize> = periods.iter().flat_map(|p| p.nodes.iter().copied()).collect();
    let steps = periods.iter().map(|p| p.state.len()).max().unwrap_or(0);
    let (mut reaction, mut state) = (Vec::<f64>::new(), Vec::<i8>::new());
    for (period, n) in periods.iter().flat_map(|p| (0..steps).map(move |n| (p, n))) {
        for node in &nodes {
            let (force, status) = match (period.state.get(n), period.nodes.binary_search(node)) {
                (None, _) => ([f64::NAN; 3], -1),
                (Some(states), Ok(k)) => ([0, 1, 2].map(|c| period.reaction[n][3 * k + c]), states[k] as i8),
                (Some(_), Err(_)) => ([0.0; 3], 0),
            };
            reaction.extend(force);
            state.push(status);
        }
    }
    vec![
        Table::list(
            "/cycles/period/node",
            "1",
            "Contact nodes that close in one of these periods, from 0, in the order of /cycles/motion/position.",
            nodes.iter().map(|&i| i as i64).collect::<Vec<i64>>(),
        ),
        Table::new(
            "/cycles/period/reaction",
            "N",
            "Contact forces (x, y, n) at these nodes over a period of each of these cycles; NaN where it could not be \
             marched again.",
            &[periods.len(), steps, nodes.len(), 3],
            reaction,
        ),
        Table::new(
            "/cycles/period/state",
            "-",
            "States of these nodes then: 0 open, 1 stick, 2 slip; -1 where they are not known.",
            &[periods.len(), steps, nodes.len()],
            state,
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::Values;

    /// Periods have the nodes of all, open where they do not close; one that was lost has neither forces nor states.
    #[test]
    fn periods_have_the_nodes_of_all() {
        let period = |nodes: &[usize], states: [&[u8]; 2]| NodalPeriod {
            nodes: nodes.to_vec(),
            reaction: states
                .map(|s| s.iter().flat_map(|&s| [1.0, 2.0, 3.0].map(|f| f * f64::from(s))).collect())
                .into(),
            state: states.map(<[u8]>::to_vec).into(),
        };
        let all = [period(&[4, 7], [&[1, 2], &[0, 1]]), NodalPeriod::default(), period(&[2], [&[2], &[1]])];
        let tables = nodal_tables(&all);
        assert!(matches!(&tables[0].values, Values::I64(nodes) if nodes[..] == [2, 4, 7]));
        let Values::I8(state) = &tables[2].values else { panic!("states") };
        assert_eq!(state[..], [0, 1, 2, 0, 0, 1, -1, -1, -1, -1, -1, -1, 2, 0, 0, 1, 0, 0]);
        let Values::F64(reaction) = &tables[1].values else { panic!("forces") };
        for (force, state) in reaction.chunks_exact(3).zip(state) {
            match *state {
                -1 => assert!(force.iter().all(|f| f.is_nan())),
                s => assert_eq!(force, [1.0, 2.0, 3.0].map(|f| f * f64::from(s))),
            }
        }
    }
}
