//! Stability of the full finite-element system of `jobs/curve.json` on some 100 thousand degrees of freedom: 20
//! eigenvalues about 2 kHz, one shift. Prints wall and CPU time of the inverse and of the eigensolver, the largest
//! memory, and the eigenvalues.
//!
//! `cargo bench --bench full_stability -- [--size ELEMENT_SIZE] [--speed Ω] [--slepc] [--export FILE]`; `--speed`
//! turns the wheels, rad/s; `--slepc` takes SLEPc's method of single vectors; with `--export` the matrices K, C and M
//! of the same problem, multipliers in units of the largest stiffness, are written one after the other in PETSc's
//! binary format (complex scalars, 32-bit indices) for `benches/peers/slepc4py_pep.py`. Runs on one rank.

use std::io::Write;
use std::rc::Rc;
use std::time::Instant;

use num_complex::Complex;
use railsqueal::body::fe::{BodyModes, FeBody};
use railsqueal::body::modes::{self, Extent};
use railsqueal::body::rotation::{centrifugal, ModalRotation, RotationForms};
use railsqueal::body::statics::Statics;
use railsqueal::body::FullSystem;
use railsqueal::contact::{
    ContactCreepage, LinearContact, NormalLoad, PatchKinematics, SlidingDirection, SlidingProblem, Stencil,
};
use railsqueal::eigen::sparse::Method;
use railsqueal::fem::rotation::Axis;
use railsqueal::fem::ElasticMaterial;
use railsqueal::friction::FrictionLaw;
use railsqueal::grid::{ContactGrid, Interface};
use railsqueal::mesh::cylinder::{self, CylinderSpec};
use railsqueal::model::combined_compliance;
use railsqueal::parallel::World;
use railsqueal::petsc::Petsc;
use railsqueal::stability::full::system::System;
use railsqueal::stability::full::{Coupling, DampedBody, RayleighDamping, Spin};

const STEEL: ElasticMaterial = ElasticMaterial { young: 205e9, poisson: 0.3, density: 7800.0 };
const DAMPING: RayleighDamping = RayleighDamping { alpha: 1.0, beta: 1e-6 };
const HEIGHT: f64 = 2.0 * std::f64::consts::PI * 2000.0;
const COUNT: usize = 20;
/// Largest element, m.
const LARGEST: f64 = 0.03;

/// CPU time of this process so far, s, where the system tells (Linux).
fn cpu() -> f64 {
    let text = std::fs::read_to_string("/proc/self/schedstat").unwrap_or_default();
    text.split(' ').next().and_then(|v| v.parse::<f64>().ok()).unwrap_or(f64::NAN) * 1e-9
}

/// Largest resident set so far, kB.
fn memory() -> String {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    text.lines().find(|l| l.starts_with("VmHWM")).unwrap_or_default().to_owned()
}

fn argument(name: &str) -> Option<String> {
    let all: Vec<String> = std::env::args().collect();
    all.iter().position(|a| a == name).and_then(|i| all.get(i + 1).cloned())
}

fn main() {
    let universe = mpi::initialize().expect("MPI starts");
    let world = World::new(mpi::traits::Communicator::duplicate(&universe.world()));
    assert_eq!(world.size, 1, "this benchmark runs on one rank");
    let petsc = Petsc::start(&world, &[], &[]).unwrap();
    let size: f64 = argument("--size").map_or(1.2e-3, |s| s.parse().expect("an element size, m"));
    let (bodies, interface) = bodies(&world, size);
    let contact = sliding(&world, &petsc, &bodies, interface);
    if let Some(path) = argument("--export") {
        export(&world, &path, &bodies, &contact).unwrap();
    }
    let speed: f64 = argument("--speed").map_or(0.0, |s| s.parse().expect("an angular velocity, rad/s"));
    let turned = (speed != 0.0).then(|| bodies.iter().map(|b| turning(&world, &petsc, b)).collect::<Vec<_>>());
    let places = [(0, speed), (1, -speed)].map(|(body, speed)| DampedBody {
        spin: turned.as_ref().map(|all| Spin { speed, forms: Rc::clone(&all[body].1), modal: all[body].2.clone() }),
        ..DampedBody::rayleigh(body, DAMPING)
    });
    let modes: Vec<&BodyModes> = turned.iter().flatten().map(|t| &t.0).collect();
    let systems: Vec<&dyn FullSystem> = bodies.iter().map(|b| b as &dyn FullSystem).collect();
    let mut system = System::new(&petsc, &systems, &modes, &places, Coupling::new(&contact).unwrap(), HEIGHT).unwrap();
    let (start, start_cpu) = (Instant::now(), cpu());
    system.shift_to(HEIGHT).unwrap();
    let (ready, ready_cpu) = (start.elapsed().as_secs_f64(), cpu() - start_cpu);
    let method = if std::env::args().any(|a| a == "--slepc") { Method::Slepc } else { Method::Blocks };
    let found = system.nearest(&petsc, method, (COUNT, f64::INFINITY), &mut |_, _| {}).unwrap();
    let (done, done_cpu) = (start.elapsed().as_secs_f64(), cpu() - start_cpu);
    let solves = found.solves;
    let worst = found.pairs.iter().map(|p| p.residuals.backward_error).fold(0.0, f64::max);
    let changed = found.pairs.iter().map(|p| p.residuals.correction).fold(0.0, f64::max);
    let lines: Vec<String> = found.pairs.iter().map(|p| format!("  {:.6} {:+.6}i", p.value.re, p.value.im)).collect();
    if world.is_root() {
        println!(
            "{} unknowns, {} closed nodes, {} ranks",
            order(&bodies) + contact.nodes.len(),
            contact.nodes.len(),
            world.size
        );
        println!("inverse      {ready:8.2} s wall {ready_cpu:8.2} s cpu");
        println!("eigensolver  {:8.2} s wall {:8.2} s cpu, {} solves", done - ready, done_cpu - ready_cpu, solves);
        println!(
            "in all       {done:8.2} s wall {done_cpu:8.2} s cpu, backward error {worst:.1e}, correction \
         {changed:.1e}, {}",
            memory()
        );
        lines.iter().take(COUNT).for_each(|l| println!("{l}"));
    }
}

fn order(bodies: &[FeBody]) -> usize {
    bodies.iter().map(|b| b.dofs.total() as usize).sum()
}

/// 60 modes of a wheel, what rotation adds, and that in the space of the modes.
fn turning(world: &World, petsc: &Petsc, body: &FeBody) -> (BodyModes, Rc<RotationForms>, ModalRotation) {
    let mut statics = Statics::direct(petsc, body).unwrap();
    let modes = modes::compute(petsc, body, &mut statics, Extent::Count(60), Method::Blocks, &mut |_, _| {}).unwrap();
    let axis = Axis::below(0.5);
    let spread = centrifugal(world, body, &mut statics, axis).unwrap();
    let forms = RotationForms::assemble(world, body, axis, &spread).unwrap();
    let modal = forms.project(world, &body.operators.mass, &modes);
    (modes, forms.into(), modal)
}

fn bodies(world: &World, size: f64) -> (Vec<FeBody>, Option<Interface>) {
    let mut gap = Vec::new();
    let mut axes = None;
    let bodies = [("lower", 0.03), ("upper", 0.02)].map(|(name, offset)| {
        let spec = CylinderSpec {
            inner_radius: 0.1,
            outer_radius: 0.5,
            thickness: 0.1,
            crown_radius: Some(0.5),
            contact_offset: offset,
            element_size: size,
            growth: 1.5,
            max_element_size: Some(LARGEST),
            patch_half_length: 0.007,
            patch_half_width: 0.007,
        };
        let mesh = cylinder::build(&spec).unwrap();
        let grid = ContactGrid::from_mesh(&mesh, "contact").unwrap();
        gap.push(grid.z.iter().map(|z| -z).collect::<Vec<f64>>());
        axes = Some((grid.x.clone(), grid.y.clone()));
        let fixed = ["inner".to_owned()];
        FeBody::new(world, name, world.is_root().then_some(&mesh), world.is_root().then_some(&grid), STEEL, &fixed)
            .unwrap()
    });
    let (x, y) = axes.expect("a contact grid");
    let gap = gap[0].iter().zip(&gap[1]).map(|(a, b)| a + b).collect();
    (bodies.into(), world.is_root().then(|| Interface::new(x, y, gap).unwrap()))
}

/// Full lateral sliding of 1 % at 70 kN.
fn sliding(world: &World, petsc: &Petsc, bodies: &[FeBody], interface: Option<Interface>) -> LinearContact {
    let compliance: Vec<_> = bodies
        .iter()
        .map(|b| {
            let mut statics = Statics::direct(petsc, b).unwrap();
            b.compliance(world, &mut statics, &mut |_, _| {}).unwrap()
        })
        .collect();
    let interface = interface.expect("one rank");
    let [a, b] = [0, 1].map(|i| compliance[i].as_ref().expect("one rank"));
    let w = combined_compliance(a.as_ref(), b.as_ref()).unwrap();
    let problem = SlidingProblem {
        interface: &interface,
        compliance: w.as_ref(),
        friction: FrictionLaw::Constant(0.3).into(),
        kinematics: PatchKinematics::one(10.0, ContactCreepage { longitudinal: 0.0, lateral: 0.01, spin: 0.0 }),
        loads: NormalLoad::Force(70e3).into(),
        stencil: Stencil::default(),
        direction: SlidingDirection::Rigid,
    };
    problem.contact(&problem.solve().unwrap())
}

/// How PETSc marks a matrix in its binary files.
const MATRIX: i32 = 1211216;

/// One row of a sparse matrix: columns and values.
type Row = Vec<(u32, f64)>;

fn export(world: &World, path: &str, bodies: &[FeBody], s: &LinearContact) -> std::io::Result<()> {
    let rows = [0, 1].map(|b| bodies[b].trace.dofs());
    let sizes = [0, 1].map(|b: usize| bodies[b].dofs.total() as u32);
    let (n, k) = ((sizes[0] + sizes[1]) as usize, s.nodes.len());
    let first = [0, sizes[0]];
    let unit = bodies.iter().map(|b| b.operators.stiffness.max_abs(world)).fold(0.0, f64::max);
    let mut matrices: [Vec<Row>; 3] = [0, 1, 2].map(|_| vec![Row::new(); n + k]);
    for b in 0..2 {
        let (stiffness, mass) = (&*bodies[b].stiffness().full(), &*bodies[b].mass().full());
        for i in 0..sizes[b] as usize {
            let row = first[b] as usize + i;
            for (p, matrix, factor) in
                [(0, stiffness, 1.0), (1, stiffness, DAMPING.beta), (1, mass, DAMPING.alpha), (2, mass, 1.0)]
            {
                let (cols, values) = matrix.row(i);
                matrices[p][row].extend(cols.iter().zip(values).map(|(&c, v)| (first[b] + c, factor * v)));
            }
        }
    }
    let motion = |node: usize, c: usize| {
        let sign = if c == 2 { [-1.0, -1.0] } else { [1.0, -1.0] };
        [0, 1].map(|b| (first[b] + rows[b][3 * node + c] as u32, sign[b]))
    };
    for (i, at) in s.nodes.iter().enumerate() {
        let (node, multiplier) = (at.node, (n + i) as u32);
        let (friction, resistance) = (at.tangent.friction(), at.tangent.resistance().expect("sliding"));
        for p in 0..2 {
            for q in 0..2 {
                let d = resistance[p][q];
                for (row, a) in motion(node, p) {
                    let row = row as usize;
                    matrices[1][row].extend(motion(node, q).map(|(c, b)| (c, a * d * b)));
                    for &(other, v) in &at.convection {
                        matrices[0][row].extend(motion(other, q).map(|(c, b)| (c, a * d * v * b)));
                    }
                }
            }
            for (row, a) in motion(node, p) {
                matrices[0][row as usize].push((multiplier, -a * friction[p] * unit));
            }
        }
        for (row, a) in motion(node, 2) {
            matrices[0][row as usize].push((multiplier, -a * unit));
            matrices[0][n + i].push((row, a * unit));
        }
    }
    let mut file = std::io::BufWriter::new(std::fs::File::create(path)?);
    for rows in &mut matrices {
        for row in rows.iter_mut() {
            row.sort_by_key(|e| e.0);
            row.dedup_by(|b, a| {
                a.0 == b.0 && {
                    a.1 += b.1;
                    true
                }
            });
        }
        let entries: usize = rows.iter().map(Vec::len).sum();
        let counts = rows.iter().map(|r| r.len() as i32);
        let head = [MATRIX, rows.len() as i32, rows.len() as i32, entries as i32];
        for v in head.into_iter().chain(counts).chain(rows.iter().flatten().map(|e| e.0 as i32)) {
            file.write_all(&v.to_be_bytes())?;
        }
        for (_, v) in rows.iter().flatten() {
            for part in [Complex::from(*v).re, 0.0] {
                file.write_all(&part.to_be_bytes())?;
            }
        }
    }
    file.flush()
}
