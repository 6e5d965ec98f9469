//! Products of a [`Convolution`] with forces by fast Fourier transforms, in double and in single precision.

use std::sync::Arc;

use fourier::{ComplexToReal, Fft, RealToComplex};
use num_complex::Complex;

use super::{Block, Convolution, LOADS};

/// Numbers that products are made in.
pub trait ProductNumber: fourier::Number {
    /// Value nearest to `v`.
    fn from_double(v: f64) -> Self;
    /// As a double.
    fn double(self) -> f64;
}

impl ProductNumber for f64 {
    fn from_double(v: f64) -> Self {
        v
    }
    fn double(self) -> f64 {
        self
    }
}

impl ProductNumber for f32 {
    fn from_double(v: f64) -> Self {
        v as f32
    }
    fn double(self) -> f64 {
        f64::from(self)
    }
}

/// The kernel's spectrum, and the transforms of its grid: lines of `size[0]` real numbers, of which the spectrum has
/// `half`, and columns of `size[1]` of these.
pub(super) struct KernelSpectrum<T> {
    size: [usize; 2],
    half: usize,
    forward: Arc<dyn RealToComplex<T>>,
    backward: Arc<dyn ComplexToReal<T>>,
    down: Arc<dyn Fft<T>>,
    up: Arc<dyn Fft<T>>,
    /// Spectrum of each entry (row, column) of the block, divided by the number of points of the grid, `[9][half ·
    /// size[1]]`, column after column; empty where the entry is zero.
    kernel: [Vec<Complex<T>>; 9],
}

/// The next number from `n` on without prime factors beyond 5, even.
pub(super) fn good_size(n: usize) -> usize {
    let smooth = |mut n: usize| {
        for p in [2, 3, 5] {
            while n.is_multiple_of(p) {
                n /= p;
            }
        }
        n == 1
    };
    (n..).find(|&n| n.is_multiple_of(2) && smooth(n)).unwrap_or(n)
}

impl<T: ProductNumber> KernelSpectrum<T> {
    /// Spectra of the kernel k.
    pub(super) fn new(c: &Convolution) -> Self {
        let [nx, ny] = c.shape();
        let size = [good_size(2 * nx - 1), good_size(2 * ny - 1)];
        let mut new = Self {
            size,
            half: size[0] / 2 + 1,
            forward: T::real_forward(size[0]),
            backward: T::real_inverse(size[0]),
            down: T::forward(size[1]),
            up: T::inverse(size[1]),
            kernel: Default::default(),
        };
        let largest = c.kernel.iter().flat_map(|b| b.as_flattened()).fold(0.0, |m: f64, v| m.max(v.abs()));
        let scale = 1.0 / (size[0] * size[1]) as f64;
        let mut buffers = Buffers::new(&new);
        for e in 0..9 {
            let entry = |block: &Block| block[e / 3][e % 3];
            if c.kernel.iter().all(|b| entry(b).abs() <= 1e-3 * f64::EPSILON * largest) {
                continue;
            }
            // Offsets below zero are at the end of the line.
            buffers.spectrum.fill(Complex::new(T::zero(), T::zero()));
            for (iy, row) in c.kernel.chunks_exact(2 * nx - 1).enumerate() {
                buffers.line.fill(T::zero());
                for (ix, block) in row.iter().enumerate() {
                    buffers.line[(ix + size[0] - (nx - 1)) % size[0]] = T::from_double(scale * entry(block));
                }
                new.line_forward(&mut buffers, (iy + size[1] - (ny - 1)) % size[1], 0);
            }
            new.down.process_with_scratch(&mut buffers.spectrum[..new.half * size[1]], &mut buffers.scratch);
            new.kernel[e] = buffers.spectrum[..new.half * size[1]].to_vec();
        }
        new
    }

    /// The transforms with the inverse of the spectrum of the normal entry, where that is sound, and of nothing else.
    pub(super) fn inverse_normal(&self) -> Self {
        let points = T::from_double(1.0 / (self.size[0] * self.size[1]) as f64);
        // What is left of a spectrum of a kernel that ends at the border of the grid may be below that of the
        // shortest wave, or below zero.
        let shortest = self.kernel[8].get((self.half - 1) * self.size[1] + self.size[1] / 2).map_or(T::one(), |v| v.re);
        let least = shortest.abs() * T::from_double(0.5);
        let inverse = |v: &Complex<T>| Complex::new(points * points / v.re.max(least), T::zero());
        let mut kernel: [Vec<Complex<T>>; 9] = Default::default();
        kernel[8] = self.kernel[8].iter().map(inverse).collect();
        let (forward, backward) = (self.forward.clone(), self.backward.clone());
        Self {
            size: self.size,
            half: self.half,
            forward,
            backward,
            down: self.down.clone(),
            up: self.up.clone(),
            kernel,
        }
    }

    /// Transforms the line in `b` and puts it into row `y` of the spectrum `component`.
    fn line_forward(&self, b: &mut Buffers<T>, y: usize, component: usize) {
        // Lengths are those of the plan.
        let _ = self.forward.process_with_scratch(&mut b.line, &mut b.line_spectrum, &mut b.scratch);
        let spectrum = &mut b.spectrum[component * self.half * self.size[1]..][..self.half * self.size[1]];
        for (v, column) in b.line_spectrum.iter().zip(spectrum.chunks_exact_mut(self.size[1])) {
            column[y] = *v;
        }
    }
}

/// Work space of a product.
struct Buffers<T> {
    line: Vec<T>,
    line_spectrum: Vec<Complex<T>>,
    /// Spectra of what goes in and what comes out, `[2 · 3][half · size[1]]`.
    spectrum: Vec<Complex<T>>,
    scratch: Vec<Complex<T>>,
}

impl<T: ProductNumber> Buffers<T> {
    fn new(of: &KernelSpectrum<T>) -> Self {
        let zero = Complex::new(T::zero(), T::zero());
        let scratch = [
            of.forward.get_scratch_len(),
            of.backward.get_scratch_len(),
            of.down.get_inplace_scratch_len(),
            of.up.get_inplace_scratch_len(),
        ];
        Self {
            line: vec![T::zero(); of.size[0]],
            line_spectrum: vec![zero; of.half],
            spectrum: vec![zero; 6 * of.half * of.size[1]],
            scratch: vec![zero; scratch.into_iter().max().unwrap_or(0)],
        }
    }
}

/// Products with a convolution, and the memory that they take.
pub struct Product<'a, T> {
    of: &'a Convolution,
    transformed: &'a KernelSpectrum<T>,
    whole: Option<&'a [[f64; LOADS]; LOADS]>,
    buffers: Buffers<T>,
}

impl<'a, T: ProductNumber> Product<'a, T> {
    /// Products with k, and with what there is beside it as a `whole`.
    pub(super) fn new(
        of: &'a Convolution,
        transformed: &'a KernelSpectrum<T>,
        whole: Option<&'a [[f64; LOADS]; LOADS]>,
    ) -> Self {
        Self { of, transformed, whole, buffers: Buffers::new(transformed) }
    }

    /// Displacements of all nodes under `forces` on them into `out`, both `[3n]`.
    pub fn times(&mut self, forces: &[T], out: &mut [T]) {
        self.components(forces, out, [0, 1, 2].as_slice());
    }

    /// As [`times`](Self::times) of forces along the `components` (0, 1, 2 for x, y, n) alone, whose displacements
    /// alone are wanted; `forces` and `out` hold these of each node.
    pub fn components(&mut self, forces: &[T], out: &mut [T], components: &[usize]) {
        let Self { of, transformed: t, whole, buffers: b } = self;
        let ([nx, ny], count) = (of.shape(), components.len());
        let part = t.half * t.size[1];
        let zero = Complex::new(T::zero(), T::zero());
        b.spectrum[..count * part].fill(zero);
        for k in 0..count {
            for iy in 0..ny {
                let given = &forces[count * nx * iy..][..count * nx];
                if given.iter().skip(k).step_by(count).all(|f| *f == T::zero()) {
                    continue;
                }
                b.line[nx..].fill(T::zero());
                b.line.iter_mut().zip(given.iter().skip(k).step_by(count)).for_each(|(l, f)| *l = *f);
                t.line_forward(b, iy, k);
            }
        }
        t.down.process_with_scratch(&mut b.spectrum[..count * part], &mut b.scratch);
        let (given, found) = b.spectrum.split_at_mut(3 * part);
        for (r, found) in components.iter().zip(found.chunks_exact_mut(part)) {
            let mut first = true;
            for (c, given) in components.iter().zip(given.chunks_exact(part)) {
                let kernel = &t.kernel[3 * r + c];
                match (kernel.is_empty(), first) {
                    (true, _) => continue,
                    (_, true) => found.iter_mut().zip(kernel).zip(given).for_each(|((o, k), v)| *o = *k * *v),
                    (_, false) => found.iter_mut().zip(kernel).zip(given).for_each(|((o, k), v)| *o += *k * *v),
                }
                first = false;
            }
            if first {
                found.fill(zero);
            }
        }
        t.up.process_with_scratch(&mut found[..count * part], &mut b.scratch);
        for k in 0..count {
            for iy in 0..ny {
                for (v, column) in b.line_spectrum.iter_mut().zip(found[k * part..][..part].chunks_exact(t.size[1])) {
                    *v = column[iy];
                }
                // The spectrum of real numbers has real ends; rounding makes them complex.
                b.line_spectrum[0].im = T::zero();
                b.line_spectrum[t.half - 1].im = T::zero();
                let _ = t.backward.process_with_scratch(&mut b.line_spectrum, &mut b.line, &mut b.scratch);
                let out = &mut out[count * nx * iy..][..count * nx];
                out.iter_mut().skip(k).step_by(count).zip(&b.line).for_each(|(o, v)| *o = *v);
            }
        }
        if let Some(a) = whole {
            let mut moments = [0.0; LOADS];
            for (j, f) in forces.chunks_exact(count).enumerate().filter(|(_, f)| f.iter().any(|f| *f != T::zero())) {
                let q = of.factors(j);
                for (c, f) in components.iter().zip(f) {
                    (0..3).for_each(|n| moments[3 * n + c] += q[n] * f.double());
                }
            }
            let moved = a.map(|row| row.iter().zip(&moments).map(|(a, m)| a * m).sum::<f64>());
            for (i, o) in out.chunks_exact_mut(count).enumerate() {
                let p = of.factors(i);
                for (r, o) in components.iter().zip(o) {
                    *o += T::from_double((0..3).map(|m| p[m] * moved[3 * m + r]).sum());
                }
            }
        }
    }
}
