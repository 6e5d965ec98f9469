//! Results of bodies of every kind, by every method of their trait: the same on any number of ranks, and the same
//! whether a body is of finite elements or given by its matrices.

use crate::dense::dense;
use crate::stability::body as block_on_a_foot;
use faer::{Mat, MatRef};
use railsqueal::body::collective_order::{CollectiveOrderCheck, CHECK};
use railsqueal::body::elements::{Elements, StaticMethod};
use railsqueal::body::half_space::{HalfSpace, HalfSpaceBody};
use railsqueal::body::matrices::BodyMatrices;
use railsqueal::body::matrix_body::MatrixBody;
use railsqueal::body::matrix_market::Csr;
use railsqueal::body::modes::Extent;
use railsqueal::body::rigid::Rigid;
use railsqueal::body::{Capability, ElasticBody};
use railsqueal::eigen::sparse;
use railsqueal::parallel::World;
use railsqueal::petsc::Petsc;
use railsqueal::Error;

const YOUNG: f64 = 205e9;
const COUNT: usize = 6;

/// A matrix without its zeros.
fn csr(full: &Mat<f64>) -> Csr {
    let n = full.nrows();
    let entries = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
    Csr::from_entries(n, entries.map(|(i, j)| (i, j, full[(i, j)])).filter(|e| e.2 != 0.0).collect())
}

/// The body of finite elements, and the same one by its matrices.
fn both<'p>(world: &World, petsc: &'p Petsc<'p>, layers: usize) -> (Elements<'p>, MatrixBody<'p>) {
    let fe = block_on_a_foot(world, "block", layers, YOUNG);
    let (stiffness, mass) = (dense(world, &fe.operators.stiffness), dense(world, &fe.operators.mass));
    let dofs = fe.trace.dofs();
    let given = world.is_root().then(|| {
        // Rows of the block are single degrees of freedom, none of them held.
        let contacts = dofs.chunks_exact(3).map(|d| [0, 1, 2].map(|c| vec![(d[c] as usize, fe_sign(c))])).collect();
        BodyMatrices { mass: csr(&mass), damping: Some(csr(&(0.5 * &mass))), stiffness: csr(&stiffness), contacts }
    });
    let matrices = MatrixBody::new(petsc, "matrices", given).unwrap();
    (Elements::new(petsc, fe, StaticMethod::Direct), matrices)
}

/// Contact rows are x, y and n into the body, which is −z.
fn fe_sign(c: usize) -> f64 {
    if c == 2 {
        -1.0
    } else {
        1.0
    }
}

fn largest(m: MatRef<'_, f64>) -> f64 {
    m.col_iter().flat_map(|c| c.iter()).fold(0.0, |a: f64, v| a.max(v.abs()))
}

#[track_caller]
fn near(what: &str, a: MatRef<'_, f64>, b: MatRef<'_, f64>, tolerance: f64) {
    assert_eq!(a.shape(), b.shape(), "{what}");
    let error = largest((a - b).as_ref());
    assert!(error <= tolerance * largest(b), "{what}: {error:e} of {:e}", largest(b));
}

/// Results of a body, whatever it is made of.
struct Given {
    omega: Vec<f64>,
    compliance: Option<Mat<f64>>,
    rows: Option<Mat<f64>>,
}

/// Asks all that the trait has, and compares it with each other.
fn ask(world: &World, body: &mut dyn ElasticBody, modes: bool) -> Given {
    let name = body.name().to_owned();
    body.factorise().unwrap();
    let mut told = (0, 0);
    let compliance = body.compliance(&mut |done, of| told = (done, of)).unwrap();
    assert!(told.0 == told.1, "{name}: the last step told is {told:?}");
    assert_eq!(compliance.is_some(), world.is_root(), "{name}: the compliance is on rank 0");
    let n = body.rows();
    let forces: Vec<f64> = (0..n).map(|i| 1e3 * (1.0 + (1.3 * i as f64).sin())).collect();
    let moved = body.response(if world.is_root() { &forces } else { &[] }).unwrap();
    if let Some(c) = &compliance {
        assert_eq!(c.shape(), (n, n), "{name}");
        near(&format!("symmetry of {name}"), c.as_ref(), c.transpose(), 1e-9);
        let wanted = c * Mat::from_fn(n, 1, |i, _| forces[i]);
        near(&format!("response of {name}"), Mat::from_fn(n, 1, |i, _| moved[i]).as_ref(), wanted.as_ref(), 1e-9);
    }
    let kind = body.kind();
    assert_eq!(kind.can(Capability::Fields), body.fields().is_some(), "{name}: fields");
    assert_eq!(kind.can(Capability::Fields), body.fields_mut().is_some(), "{name}: fields");
    let surface = body.fields().is_some() || matches!(body.outlines(), Ok(all) if !all.is_empty());
    assert_eq!(kind.can(Capability::Surface), surface, "{name}: surface");
    assert_eq!(kind.can(Capability::FullSystem), body.full_system().is_some(), "{name}: matrices");
    assert_eq!(kind.can(Capability::Modes), modes, "{name}: modes");
    let found = body.modes(Extent::Count(COUNT), &mut |_, _| {});
    body.release().unwrap();
    let Ok(found) = found else {
        assert!(!modes, "{name}: {:?}", found.err());
        return Given { omega: Vec::new(), compliance, rows: None };
    };
    assert!(found.omega.windows(2).all(|w| w[0] <= w[1]) && found.reach >= found.omega.last().copied().unwrap_or(0.0));
    assert_eq!(found.rows.is_some(), world.is_root(), "{name}: modes at the contact are on rank 0");
    if let (Some(rows), Some(c)) = (&found.rows, &compliance) {
        assert_eq!(rows.shape(), (n, found.omega.len()), "{name}");
        // Every mode has its part of the compliance: what is left is positive.
        let rest = (0..n).map(|i| {
            let part: f64 = (0..rows.ncols()).map(|k| (rows[(i, k)] / found.omega[k]).powi(2)).sum();
            c[(i, i)] - part
        });
        assert!(rest.into_iter().all(|r| r >= -1e-9 * largest(c.as_ref())), "{name}");
    }
    if let Some(system) = body.full_system() {
        assert_eq!(system.trace().rows(), n, "{name}");
        assert_eq!(system.stiffness().order(), system.mass().order(), "{name}");
    }
    Given { omega: found.omega, compliance, rows: found.rows }
}

pub fn every_body_gives_what_it_says(world: &World) {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let (mut elements, mut matrices) = both(world, &petsc, 3);
    let of_elements = ask(world, &mut elements, true);
    assert_eq!(of_elements.omega.len(), COUNT);
    assert!(ask(world, &mut matrices, true).omega[0] > 0.0);
    let mut iterative = Elements::new(&petsc, block_on_a_foot(world, "iterative", 3, YOUNG), StaticMethod::Iterative);
    iterative.factorise().unwrap();
    let forces: Vec<f64> = (0..iterative.rows()).map(|i| 1e3 * (1.0 + (1.3 * i as f64).sin())).collect();
    let moved = iterative.response(if world.is_root() { &forces } else { &[] }).unwrap();
    if let Some(c) = &of_elements.compliance {
        let wanted = c * Mat::from_fn(forces.len(), 1, |i, _| forces[i]);
        near("multigrid", Mat::from_fn(forces.len(), 1, |i, _| moved[i]).as_ref(), wanted.as_ref(), 1e-7);
    }
    let lines = [&[-0.1, 0.0, 0.1][..], &[-0.1, 0.0, 0.05, 0.1][..]];
    let material = HalfSpace { young: YOUNG, poisson: 0.3 };
    let mut half = HalfSpaceBody::new(world, "half-space", material, world.is_root().then_some(lines));
    let given = ask(world, &mut half, true);
    assert!(given.omega.is_empty());
    if let Some(c) = &given.compliance {
        near("half-space", c.as_ref(), material.compliance(lines[0], lines[1]).unwrap().as_ref(), 1e-15);
    }
    let mut rigid = Rigid::new(world, "rigid", 12);
    let given = ask(world, &mut rigid, true);
    assert!(given.omega.is_empty() && given.compliance.is_none_or(|c| largest(c.as_ref()) == 0.0));
}

/// A body of finite elements and the same one by its matrices: small ones, treated densely, and large ones; by either
/// eigensolver.
pub fn elements_are_their_matrices(world: &World) {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    for layers in [3, 14] {
        let (mut elements, matrices) = both(world, &petsc, layers);
        let order = matrices.dofs();
        assert_eq!(order > railsqueal::body::matrices::DENSE as u64, layers > 3, "{order} degrees of freedom");
        let mut matrices = matrices.with_modes_by(sparse::Method::Slepc);
        let (a, b) = (ask(world, &mut elements, true), ask(world, &mut matrices, true));
        for (x, y) in a.omega.iter().zip(&b.omega) {
            assert!((x / y - 1.0).abs() < 1e-9, "{layers} layers: {x} and {y} rad/s");
        }
        assert_eq!(a.omega.len(), b.omega.len());
        if let (Some(c), Some(d)) = (&a.compliance, &b.compliance) {
            near(&format!("compliance, {layers} layers"), d.as_ref(), c.as_ref(), 1e-8);
        }
        if let (Some(p), Some(q)) = (&a.rows, &b.rows) {
            // Shares of the compliance, which have no sign.
            for k in 0..COUNT {
                let square = |m: &Mat<f64>| Mat::from_fn(m.nrows(), m.nrows(), |i, j| m[(i, k)] * m[(j, k)]);
                near(&format!("mode {k}, {layers} layers"), square(q).as_ref(), square(p).as_ref(), 1e-6);
            }
        }
        let damped = matrices.modes(Extent::Count(COUNT), &mut |_, _| {}).unwrap().damping;
        if let Some(c) = damped {
            let wanted = Mat::from_fn(COUNT, COUNT, |i, j| if i == j { 0.5 } else { 0.0 });
            near("modal damping of C = M/2", c.as_ref(), wanted.as_ref(), 1e-8);
        }
    }
}

/// Ranks that ask a body for different things are told on every rank, instead of waiting for each other.
pub fn calls_out_of_step_are_told(world: &World) {
    assert!(std::env::var_os(CHECK).is_some(), "the tests run with the check");
    let order = CollectiveOrderCheck::new("block");
    order.enter(world, "compliance").unwrap();
    let call = if world.is_root() { "modes" } else { "response" };
    let found = order.enter(world, call);
    if world.size == 1 {
        return found.unwrap();
    }
    for found in [found, order.enter(world, "compliance")] {
        match found {
            Err(Error::Defect(text)) => assert!(text.contains("out of step") && text.contains("\"block\""), "{text}"),
            other => panic!("rank {}: {other:?}", world.rank),
        }
    }
    // The same through a body: nobody waits, and nobody computes.
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let mut body = Elements::new(&petsc, block_on_a_foot(world, "block", 2, YOUNG), StaticMethod::Direct);
    let message = match world.is_root() {
        true => body.compliance(&mut |_, _| {}).map(|_| ()),
        false => body.modes(Extent::Count(1), &mut |_, _| {}).map(|_| ()),
    };
    let text = message.unwrap_err().to_string();
    assert!(text.contains(if world.is_root() { "`compliance`" } else { "`modes`" }), "{text}");
    assert_eq!(body.full_system().map(|s| s.name().to_owned()), Some("block".into()));
}
