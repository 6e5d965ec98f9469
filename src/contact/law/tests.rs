use super::*;
use crate::friction::{
    DoubleExponential, Exponential, FrictionLaw, FrictionTable, Kraft, Linear, Rational, Relaxation, Remembered,
};

#[test]
fn natural_map_vanishes_exactly_where_the_laws_hold() {
    let at = |pressure, traction, gap, creep| {
        let node = Node { pressure, traction, gap, creep };
        let found = node.project(Augmentation { normal: 2.0, tangential: 3.0 }, 0.5);
        (found.map(&node), found.status)
    };
    // Open, sticking, sliding against the traction.
    assert_eq!(at(0.0, [0.0, 0.0], 1.0, [1.0, 0.0]), ([0.0; 3], Status::Open));
    assert_eq!(at(4.0, [1.0, -1.0], 0.0, [0.0, 0.0]), ([0.0; 3], Status::Stick));
    assert_eq!(at(4.0, [0.0, -2.0], 0.0, [0.0, 5.0]), ([0.0; 3], Status::Slip));
    // Pressure across a gap, sliding along the traction, sliding below the bound: none may pass.
    assert!(at(4.0, [0.0, 0.0], 0.1, [0.0, 0.0]).0[2] != 0.0);
    assert!(at(4.0, [0.0, 2.0], 0.0, [0.0, 5.0]).0[1] != 0.0);
    assert!(at(4.0, [0.0, -1.0], 0.0, [0.0, 0.1]).0[1] != 0.0);
    // Adhesion and penetration neither.
    assert!(at(-1.0, [0.0, 0.0], 0.0, [0.0, 0.0]).0[2] != 0.0);
    assert!(at(0.0, [0.0, 0.0], -0.1, [0.0, 0.0]).0[2] != 0.0);
}

const RHO: Augmentation = Augmentation { normal: 2.0, tangential: 3.0 };

/// A law with what a node remembers of it, if it does.
#[derive(Debug)]
struct Felt(FrictionLaw, Option<Remembered>);

impl Felt {
    fn coefficient(&self, v: f64) -> f64 {
        self.1.map_or_else(|| self.0.coefficient(v), |before| self.0.renewed(&before, v))
    }

    fn slope(&self, v: f64) -> f64 {
        self.1.map_or_else(|| self.0.slope(v), |before| self.0.renewed_slope(&before, v))
    }
}

/// Laws without memory, and with that of a node at the edge, inside, in a long step, and of one that does not roll.
fn felt() -> Vec<Felt> {
    let before = |own, upstream, step, passage| Remembered { own, upstream, step, passage };
    let remembered = [
        None,
        Some(before(0.38, 0.4, 2e-5, 1e-4)),
        Some(before(0.3, 0.33, 1e-5, 3e-5)),
        Some(before(0.36, 0.36, 1e-4, 1e-4)),
        Some(before(0.28, 0.28, 2e-5, f64::INFINITY)),
    ];
    remembered.into_iter().flat_map(|before| laws().into_iter().map(move |law| Felt(law, before))).collect()
}

fn laws() -> Vec<FrictionLaw> {
    let exponential = Exponential::new(0.4, 0.25, 0.3);
    let rational = Rational::new(0.4, 0.25, 0.3);
    let mut laws = vec![FrictionLaw::Constant(0.0), FrictionLaw::Constant(0.35), exponential.into(), rational.into()];
    laws.push(DoubleExponential::new(0.4, 0.25, 0.6, 0.2, 2.0).into());
    laws.push(Linear::new(0.4, 0.25, 0.8).into());
    laws.push(Kraft::new(0.4).into());
    laws.push(FrictionTable::new(vec![[0.0, 0.35], [0.1, 0.4], [0.9, 0.25]]).into());
    laws
}

/// Nodes that the laws do not hold at, open, in stick and in slip, for all `laws`.
fn nodes() -> [(Status, Node); 4] {
    let node = |pressure, traction, gap, creep| Node { pressure, traction, gap, creep };
    [
        (Status::Open, node(1.0, [0.3, -0.2], 0.8, [0.1, 0.4])),
        (Status::Stick, node(4.0, [0.3, 0.4], -0.1, [-0.01, 0.02])),
        (Status::Slip, node(3.0, [-0.9, 1.1], 0.05, [0.5, 0.2])),
        (Status::Slip, node(3.0, [1.4, 0.2], -0.05, [-0.03, 0.002])),
    ]
}

/// Rows of the tangent, with the normal row, against central differences of the map, for changes of everything.
#[test]
fn tangent_is_the_derivative_of_the_map() {
    let mut seen = [0; 3];
    for law in felt() {
        let map = |n: &Node| {
            let found = n.project(RHO, law.coefficient(size(n.creep)));
            (found.map(n), found)
        };
        for (want, node) in nodes() {
            let (_, found) = map(&node);
            let want = if want == Status::Stick && law.coefficient(0.0) == 0.0 { Status::Slip } else { want };
            assert_eq!(found.status, want, "{law:?}, {node:?}");
            seen[found.status as usize] += 1;
            let tangent = found.tangent(&node, law.slope(size(node.creep)));
            let axes = match tangent {
                Tangent::Slip(s) => [s.direction, across(s.direction)],
                _ => [[1.0, 0.0], [0.0, 1.0]],
            };
            let (traction, pressure, creep) = tangent.plane();
            for k in 0..6 {
                let unit = |j: usize| f64::from(u8::from(j == k));
                let h = 1e-6;
                let moved = |h: f64| Node {
                    pressure: node.pressure + h * unit(0),
                    traction: [node.traction[0] + h * unit(1), node.traction[1] + h * unit(2)],
                    gap: node.gap + h * unit(3),
                    creep: [node.creep[0] + h * unit(4), node.creep[1] + h * unit(5)],
                };
                let (ahead, behind) = (map(&moved(h)).0, map(&moved(-h)).0);
                let d = [0, 1, 2].map(|c| (ahead[c] - behind[c]) / (2.0 * h));
                let closed = want != Status::Open;
                let normal = if closed { RHO.normal * unit(3) } else { unit(0) };
                assert!((d[2] - normal).abs() < 1e-6, "{law:?}, {node:?}, unknown {k}: {d:?}");
                // The bound goes with the projected pressure, δp − ρ δg.
                let (t, q, s) = ([unit(1), unit(2)], unit(0) - RHO.normal * unit(3), [unit(4), unit(5)]);
                let rows = tangent.rows(t, q, s);
                for (axis, row) in axes.iter().zip(rows) {
                    let want = axis[0] * d[0] + axis[1] * d[1];
                    assert!((row - want).abs() < 1e-6, "{law:?}, {node:?}, unknown {k}: {row}, by difference {want}");
                }
                for c in 0..2 {
                    let row = product(traction[c], t) + pressure[c] * q + product(creep[c], s);
                    assert!((row - d[c]).abs() < 1e-6, "{law:?}, {node:?}, unknown {k}: {row}, {d:?}");
                }
            }
        }
    }
    assert!(seen.iter().all(|&s| s >= 2), "{seen:?}");
}

/// Rows at states that satisfy the laws are those of steady sliding, and they have a limit as the sliding ends:
/// that of stick across it.
#[test]
fn rows_of_steady_sliding_end_in_stick() {
    let (p, mu, direction) = (3.0, 0.3, [0.6, -0.8]);
    for velocity in [0.7, 1e-3, 0.0] {
        let steady = Slip::steady(p, direction, velocity, mu, -0.1);
        let node = Node {
            pressure: p,
            traction: direction.map(|t| -mu * p * t),
            gap: 0.0,
            creep: direction.map(|t| velocity * t),
        };
        if velocity > 0.0 {
            let Tangent::Slip(found) = node.project(RHO, mu).tangent(&node, -0.1) else { panic!("{velocity}") };
            let [t, s] = steady.across.map(|c| c * RHO.tangential / (mu * p + RHO.tangential * velocity));
            assert!((found.across[0] - t).abs() < 1e-12 && (found.across[1] - s).abs() < 1e-12, "{found:?}");
            for (a, b) in
                found.direction.iter().chain(&found.falling).zip(steady.direction.iter().chain(&steady.falling))
            {
                assert!((a - b).abs() < 1e-12, "{found:?}, {steady:?}");
            }
        }
        let yielding: Vec<_> = Tangent::Slip(steady).yielding().collect();
        assert_eq!(yielding[0].0, [0.8, 0.6]);
        assert!((yielding[0].1 - velocity / (mu * p)).abs() < 1e-15 && (yielding[1].1 + 1.0 / (0.1 * p)).abs() < 1e-12);
    }
    assert_eq!(Tangent::Stick { creep: 1.0 }.yielding().map(|y| y.1).collect::<Vec<_>>(), [0.0; 2]);
    let frictionless = Tangent::Slip(Slip::steady(p, direction, 0.5, 0.0, 0.0));
    assert_eq!((frictionless.yielding().count(), frictionless.friction()), (0, [-0.0, 0.0]));
}

#[test]
fn numbers_keep_all_of_a_linear_contact() {
    let slip = Tangent::Slip(Slip::steady(3.0, [0.6, -0.8], 0.2, 0.3, -0.1));
    let node =
        |node, tangent, convection: &[(usize, f64)]| LinearNode { node, tangent, convection: convection.to_vec() };
    let contact = LinearContact {
        nodes: vec![
            node(4, slip, &[(4, 2.0), (3, -2.0)]),
            node(7, Tangent::Stick { creep: 1.5 }, &[]),
            node(9, Tangent::Open, &[(1, 0.5)]),
        ],
        edges: vec![LinearEdge { at: 0, gaps: [(3, [0.5, -2.0]), (2, [7.0, 0.25])] }],
        memory: vec![
            LinearMemory {
                at: 0,
                direction: [0.6, -0.8],
                force: 3.0,
                relaxation: Relaxation { decay: 2.0, upstream: 0.5, gain: -7.0 },
                upstream: None,
            },
            LinearMemory {
                at: 1,
                direction: [0.0, 0.0],
                force: 0.0,
                relaxation: Relaxation { decay: 1.0, upstream: 0.25, gain: 0.0 },
                upstream: Some(0),
            },
        ],
    };
    assert_eq!(LinearContact::from_numbers(&contact.numbers()), contact);
    assert_eq!(contact.sticking(), 1);
}
