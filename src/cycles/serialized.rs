//! Cycles and branches as numbers: so they travel between ranks and are kept without loss.

use super::balance::{ContactMemory, ContactPeriod, PeriodicSolution};
use super::branch::{BranchEnd, BranchPoint, BranchState, Special, SpecialKind};
use super::contact_jacobian::ContactJacobian;
use super::floquet::Multipliers;
use faer::Mat;

type C = num_complex::Complex<f64>;

/// Numbers one after the other; lists begin with their length.
#[derive(Debug, Default)]
struct Writer(Vec<f64>);

impl Writer {
    fn one(&mut self, value: f64) {
        self.0.push(value);
    }

    fn many(&mut self, values: &[f64]) {
        self.0.extend(values);
    }

    fn list(&mut self, values: &[f64]) {
        self.one(values.len() as f64);
        self.many(values);
    }

    fn rows<const N: usize>(&mut self, rows: &[[f64; N]]) {
        self.list(rows.as_flattened());
    }

    fn text(&mut self, text: &str) {
        let bytes: Vec<f64> = text.bytes().map(f64::from).collect();
        self.list(&bytes);
    }

    fn complex(&mut self, values: &[C]) {
        let all: Vec<[f64; 2]> = values.iter().map(|z| [z.re, z.im]).collect();
        self.rows(&all);
    }

    fn memory(&mut self, memory: &ContactMemory) {
        self.list(&memory.reaction);
        self.list(&memory.friction);
        self.list(&memory.motions);
    }
}

/// The way back; none where numbers are missing.
struct Numbers<'a>(&'a [f64]);

impl Numbers<'_> {
    fn one(&mut self) -> Option<f64> {
        let (first, rest) = self.0.split_first()?;
        self.0 = rest;
        Some(*first)
    }

    fn count(&mut self) -> Option<usize> {
        let count = self.one()?;
        ((0.0..=1e15).contains(&count) && count.fract() == 0.0).then_some(count as usize)
    }

    fn list(&mut self) -> Option<Vec<f64>> {
        let count = self.count()?;
        let (list, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(list.to_vec())
    }

    fn rows<const N: usize>(&mut self) -> Option<Vec<[f64; N]>> {
        let all = self.list()?;
        (all.len() % N == 0).then(|| all.chunks_exact(N).map(|c| std::array::from_fn(|k| c[k])).collect())
    }

    fn text(&mut self) -> Option<String> {
        String::from_utf8(self.list()?.into_iter().map(|b| b as u8).collect()).ok()
    }

    fn complex(&mut self) -> Option<Vec<C>> {
        Some(self.rows::<2>()?.into_iter().map(|[re, im]| C::new(re, im)).collect())
    }

    fn memory(&mut self) -> Option<ContactMemory> {
        Some(ContactMemory { reaction: self.list()?, friction: self.list()?, motions: self.list()? })
    }

    fn contact(&mut self) -> Option<ContactPeriod> {
        let force = self.rows()?;
        let nodes = self.rows::<2>()?.into_iter().map(|n| n.map(|n| n as usize)).collect();
        Some(ContactPeriod { force, nodes })
    }

    fn cycle(&mut self) -> Option<PeriodicSolution> {
        let [omega, frequency, kinetic, drift] = [self.one()?, self.one()?, self.one()?, self.one()?];
        let contacts = self.count()?;
        let contacts = (0..contacts).map(|_| self.contact()).collect::<Option<_>>()?;
        let count = self.count()?;
        let modal = (0..count).map(|_| self.complex()).collect::<Option<_>>()?;
        let state = [self.list()?, self.list()?];
        let (contact, begin) = (self.memory()?, self.memory()?);
        Some(PeriodicSolution { omega, frequency, kinetic, contacts, modal, drift, state, contact, begin })
    }

    fn point(&mut self) -> Option<BranchPoint> {
        let (key, u, cycle) = (self.one()?, self.list()?, self.cycle()?);
        let multipliers = match self.one()? {
            0.0 => None,
            _ => {
                let values = self.complex()?;
                Some(Multipliers { values, phase: C::new(self.one()?, self.one()?) })
            }
        };
        let [kind, second, error] = [self.one()?, self.one()?, self.one()?];
        let special = SpecialKind::ALL.get(kind as usize).map(|&kind| Special { kind, second, error });
        let special = if kind < 0.0 { None } else { Some(special?) };
        Some(BranchPoint { key, u, cycle, multipliers, special })
    }
}

impl PeriodicSolution {
    fn write(&self, to: &mut Writer) {
        to.many(&[self.omega, self.frequency, self.kinetic, self.drift]);
        to.one(self.contacts.len() as f64);
        for contact in &self.contacts {
            to.rows(&contact.force);
            let nodes: Vec<[f64; 2]> = contact.nodes.iter().map(|n| n.map(|n| n as f64)).collect();
            to.rows(&nodes);
        }
        to.one(self.modal.len() as f64);
        self.modal.iter().for_each(|q| to.complex(q));
        self.state.iter().for_each(|s| to.list(s));
        to.memory(&self.contact);
        to.memory(&self.begin);
    }
}

impl BranchPoint {
    fn write(&self, to: &mut Writer) {
        to.one(self.key);
        to.list(&self.u);
        self.cycle.write(to);
        match &self.multipliers {
            None => to.one(0.0),
            Some(m) => {
                to.one(1.0);
                to.complex(&m.values);
                to.many(&[m.phase.re, m.phase.im]);
            }
        }
        let kind = |s: Special| SpecialKind::ALL.iter().position(|k| *k == s.kind);
        to.one(self.special.and_then(kind).map_or(-1.0, |k| k as f64));
        to.many(&self.special.map_or([0.0; 2], |s| [s.second, s.error]));
    }

    /// All of it in a row.
    pub fn numbers(&self) -> Vec<f64> {
        let mut to = Writer::default();
        self.write(&mut to);
        to.0
    }

    /// From [`numbers`](Self::numbers); none where they are not those of a point.
    pub fn from_numbers(all: &[f64]) -> Option<Self> {
        let mut from = Numbers(all);
        let point = from.point()?;
        from.0.is_empty().then_some(point)
    }
}

impl BranchState {
    /// Everything that the next cycle depends on beside the points, in a row.
    pub fn numbers(&self) -> Vec<f64> {
        let mut to = Writer::default();
        to.one(self.points.len() as f64);
        let (kind, text) = match &self.end {
            None => (0.0, ""),
            Some(BranchEnd::Range) => (1.0, ""),
            Some(BranchEnd::Rest) => (2.0, ""),
            Some(BranchEnd::Count) => (3.0, ""),
            Some(BranchEnd::Model(why)) => (4.0, &why[..]),
            Some(BranchEnd::Lost(why)) => (5.0, &why[..]),
        };
        to.one(kind);
        to.text(text);
        to.one(f64::from(u8::from(self.unknown.is_some())));
        to.text(self.unknown.as_deref().unwrap_or_default());
        to.list(&self.ahead);
        to.many(&[self.length, self.marches as f64]);
        to.memory(&self.memory);
        let near = self.contact.as_ref();
        to.list(near.map_or(&[], |c| &c.u));
        to.list(near.map_or(&[], |c| &c.force));
        let columns = near.iter().flat_map(|c| c.derivative.col_iter());
        let entries: Vec<f64> = columns.flat_map(|c| c.iter().copied().collect::<Vec<_>>()).collect();
        to.list(&entries);
        to.0
    }

    /// From [`numbers`](Self::numbers) and the points; none where they do not belong together. Points beyond those of
    /// the state are left out: the state was not written with them.
    pub fn from_numbers(all: &[f64], mut points: Vec<BranchPoint>) -> Option<Self> {
        let mut from = Numbers(all);
        let count = from.count()?;
        if count == 0 || points.len() < count {
            return None;
        }
        points.truncate(count);
        let (kind, text) = (from.one()?, from.text()?);
        let (known, unknown) = (from.one()? == 0.0, from.text()?);
        let end = match kind {
            0.0 => None,
            1.0 => Some(BranchEnd::Range),
            2.0 => Some(BranchEnd::Rest),
            3.0 => Some(BranchEnd::Count),
            4.0 => Some(BranchEnd::Model(text)),
            5.0 => Some(BranchEnd::Lost(text)),
            _ => return None,
        };
        let ahead = from.list()?;
        let (length, marches) = (from.one()?, from.count()?);
        let memory = from.memory()?;
        let (u, force, entries) = (from.list()?, from.list()?, from.list()?);
        let (rows, columns) = (force.len(), ahead.len());
        let fits = rows > 0 && columns == rows + 2 && u.len() == columns && entries.len() == rows * columns;
        if !fits || !from.0.is_empty() || points.iter().any(|p| p.u.len() != columns) {
            return None;
        }
        let derivative = Mat::from_fn(rows, columns, |i, k| entries[rows * k + i]);
        let contact = Some(ContactJacobian { u, force, derivative });
        let unknown = (!known).then_some(unknown);
        Some(Self { points, end, ahead, length, contact, memory, marches, unknown })
    }
}
